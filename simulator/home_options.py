"""Which homes a command line or a data module asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from sgm.prior.prior_graph import PriorGraph, load_prior
from simulator.world.config import HomeConfig
from simulator.world.parts import import_class
from simulator.world.source import HomeSource, SampledSource

# Sources by the name that command lines use; one of your own is named by its import path.
SOURCES: Mapping[str, str] = {
    "sampled": "simulator.world.source.SampledSource",
    "recorded": "simulator.trace.source.RecordedSource",
    "paper": "simulator.world.source.PaperSource",
    "mixed": "simulator.world.mixture.source.MixtureSource",
    "lived_in": "simulator.world.mixture.lived_in_homes.LivedInSource",
}

# A source's class is one; its further arguments are options of the command line.
MakeSource = Callable[[PriorGraph, HomeConfig], HomeSource]


def import_source(name: str) -> MakeSource:
    """Return the class of a source by its name in `SOURCES`, or by its import path."""
    found: MakeSource = import_class(SOURCES.get(name, name))
    return found


@dataclass(frozen=True, slots=True)
class HomeOptions:
    """Where homes come from.

    Attributes:
        homes: the source: a name, or the import path of a class of your own.
        home: rules of the homes; of recorded ones only the detector and where the robot looks, see
            docs/traces.md.
        prior: "default" or "household", which ship, or a prior file (JSON); the default if left
            out.
        trace: play in recorded homes: traces, or folders of traces (docs/traces.md).
        step_seconds: length of a time step of recorded homes; an hour, or what the homes were
            simulated with, if left out.
        by_day: whether each recorded day is a home of its own, with an empty memory at first.
        replays: how often each recorded home is played, every time with other looks and questions.
    """

    homes: MakeSource = SampledSource
    home: HomeConfig = field(default_factory=HomeConfig)
    prior: str | None = None
    trace: tuple[str, ...] | None = None
    step_seconds: float | None = None
    by_day: bool = False
    replays: int = 1

    def __post_init__(self) -> None:
        """Raise ValueError if options of recorded homes come without a trace, or others with it."""
        is_plain = self.step_seconds is None and not self.by_day and self.replays == 1
        if self.trace is None and not is_plain:
            raise ValueError(
                "step_seconds, by_day and replays must come with trace, got no trace. Name a "
                "folder."
            )
        # A command line hands on what makes a source, with its class as the last argument.
        source = self.homes.args[-1] if isinstance(self.homes, partial) else self.homes
        if self.trace is not None and source is not SampledSource:
            raise ValueError(
                "homes must be left out with trace, got both. Recorded homes are played as they "
                "were recorded; leave one out."
            )

    def make(self) -> HomeSource:
        """Make the source.

        Raises:
            ValueError: if a file cannot be read or is malformed, or an option is out of range.
        """
        prior = load_prior(self.prior)
        if self.trace is not None:
            from simulator.trace.source import RecordedSource  # few trainings read traces

            return RecordedSource(
                prior, self.home, self.trace, self.step_seconds, self.by_day, self.replays
            )
        return self.homes(prior, self.home)
