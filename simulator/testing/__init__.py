"""Checks that a part of one's own keeps the contract of its interface; for tests of any kind.

They play in small simulated homes, need nothing but this package, and raise an `AssertionError`
that says what must hold.
"""

from simulator.testing.homes import check_homes
from simulator.testing.parts import check_dynamics, check_sensing
from simulator.testing.policies import SmallHomes, check_policy

__all__ = ["SmallHomes", "check_dynamics", "check_homes", "check_policy", "check_sensing"]
