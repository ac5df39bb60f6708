"""The options by which a command line takes recorded homes instead of sampled ones."""

from __future__ import annotations

import argparse

from simulator.priors.prior_graph import PriorGraph
from simulator.trace.source import RecordedSource
from simulator.world.config import HomeConfig
from simulator.world.source import HomeSource, SampledSource


def add_trace_arguments(parser: argparse.ArgumentParser) -> None:
    """Add --trace, --step-seconds and --by-day."""
    parser.add_argument(
        "--trace",
        nargs="+",
        metavar="DIR",
        help="play in recorded homes: traces, or folders of traces (docs/traces.md)",
    )
    parser.add_argument(
        "--step-seconds",
        type=float,
        help="with --trace: length of a time step; an hour, or what the homes were simulated with",
    )
    parser.add_argument(
        "--by-day",
        action="store_true",
        help="with --trace: each day is a home of its own, with an empty memory at first",
    )


def read_trace_arguments(
    options: argparse.Namespace, prior: PriorGraph, home: HomeConfig
) -> HomeSource:
    """Return the recorded homes that were asked for, or sampled ones.

    Raises:
        ValueError: if a value is out of range, or given without --trace, or a trace is broken.
    """
    if options.trace is not None:
        source = RecordedSource(prior, home, options.trace, options.step_seconds, options.by_day)
        print(*source.left_out, sep="\n", end="\n" if source.left_out else "")
        return source
    if options.step_seconds is not None or options.by_day:
        raise ValueError(
            "--step-seconds and --by-day must come with --trace, got no trace. Name a folder."
        )
    return SampledSource(prior, home)
