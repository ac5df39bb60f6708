"""Kinds of homes that one network is played in, and how it does in each of them."""
