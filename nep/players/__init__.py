"""Trained networks as policies that play."""
