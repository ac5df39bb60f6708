"""A memory over time in files that other programs open: MCAP for Foxglove and Rerun."""
