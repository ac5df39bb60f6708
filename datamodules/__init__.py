"""Snapshots to features to batched graphs."""

import os

# Set before dgl is imported anywhere: else it prints advice and writes a file to the user's home.
os.environ.setdefault("DGLBACKEND", "pytorch")
