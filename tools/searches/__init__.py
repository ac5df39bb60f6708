"""Searches in a robot's home by several orders of looks: how soon they find things."""
