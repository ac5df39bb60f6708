"""Rooms and furniture of a home."""
