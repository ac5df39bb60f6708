"""Type tables, and the command for prior graphs: `python -m simulator.priors --help`.

docs/priors.md says what the default is, and how to count homes and data sets of one's own.
"""

from simulator.priors.types import load_types

__all__ = ["load_types"]
