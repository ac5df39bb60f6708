"""Where to look next: the finder for robots."""
