"""Prior graphs from data sets of homes: importers, merging, and the shipped default.

`python -m simulator.priors build | show | check | compare` is the command line; docs/priors.md says
what the default is and how to count data sets of one's own.
"""

from simulator.priors.sources.build import build_from_sources, load_source
from simulator.priors.sources.counts import PlacementCounts
from simulator.priors.sources.merge import BuildOptions, build_prior
from simulator.priors.types import load_types

__all__ = [
    "BuildOptions",
    "PlacementCounts",
    "build_from_sources",
    "build_prior",
    "load_source",
    "load_types",
]
