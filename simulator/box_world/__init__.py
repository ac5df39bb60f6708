"""Homes of boxes, and robots with a camera that live in them: what eyes are tried with."""
