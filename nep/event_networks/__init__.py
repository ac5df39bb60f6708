"""Temporal graph networks that read the looks of a robot as a stream of events."""
