"""Type tables, and the command for prior graphs: `python -m simulator.priors --help`.

docs/priors.md says what the default is, and how to count homes and data sets of one's own.
"""

from typing import NoReturn

from sgm.messages import shorten
from simulator.priors.types import load_types

__all__ = ["load_types"]

_MOVED = {
    "BuildOptions": "merge",
    "PlacementCounts": "counts",
    "build_from_sources": "build",
    "build_prior": "merge",
    "load_source": "build",
}


def __getattr__(name: str) -> NoReturn:
    """Refuse names that were here."""
    if name in _MOVED:
        raise ImportError(
            f"{name} must be imported in a checkout, got simulator.priors. Import it from "
            f"tools.priors.{_MOVED[name]}."
        )
    raise AttributeError(f"module {__name__} has no attribute {shorten(name)}")
