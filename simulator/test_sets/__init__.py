"""Frozen test homes that a paper can cite, and a check that a machine makes the same ones."""
