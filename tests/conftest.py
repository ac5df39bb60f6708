import os

from hypothesis import settings

# The variables that our packages set on import, for tests that import the dependency first.
os.environ.setdefault("DGLBACKEND", "pytorch")
os.environ.setdefault("MPLBACKEND", "Agg")

# The same examples on every run, and no time limit per example: a busy machine is not a failure.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
