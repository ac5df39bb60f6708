"""Collections of snapshots or events: a policy plays a task in many homes, kept on disk."""
