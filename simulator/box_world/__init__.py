"""Homes of boxes with a camera in them: what a robot's eyes are tried with."""
