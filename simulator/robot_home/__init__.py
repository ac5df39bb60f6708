"""Robots that live in a home of boxes: one with eyes, and one that is given perfect looks."""
