"""Homes that are lived in, but in which nothing follows from what things are called."""
