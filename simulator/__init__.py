"""Homes that change while nobody looks, and a memory of what was seen of them."""
