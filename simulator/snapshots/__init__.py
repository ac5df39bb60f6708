"""Memories at the moment of a query: in memory, recorded, on disk."""
