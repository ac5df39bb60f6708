"""The finder for robots, and training that starts from another network."""
