"""Snapshots to features to batched graphs."""

import os

from simulator.caches import keep_home_clean

# Set before dgl is imported anywhere: else it prints advice and writes a file to the user's home.
os.environ.setdefault("DGLBACKEND", "pytorch")
keep_home_clean()  # torchmetrics imports matplotlib
