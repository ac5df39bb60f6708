"""What an agent remembers of a home: scene graph memories, their prior and snapshots."""
