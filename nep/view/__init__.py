"""A page to look into a memory: `python -m nep.view SOURCE`, or `show(memory)` from a program."""

from nep.view.server import show

__all__ = ["show"]
