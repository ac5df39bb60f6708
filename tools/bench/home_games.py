"""The kinds of homes: small and large, with people in them, with another prior, recorded ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from sgm.arrays.week import DAY_SECONDS, HOUR_SECONDS
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.count_prior import count_prior
from simulator.trace.source import RecordedSource
from simulator.trace.trace import find_traces, load_trace
from simulator.world.config import HomeConfig
from simulator.world.mixture.source import Mixture, MixtureSource
from simulator.world.mixture.views import NONE, OTHER_HOME, UNKNOWN_WORDS
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from tools.bench.robot_life import LivedHome
from tools.bench.task_game import TaskGame


def list_simulated(num_homes: int, num_steps: int, num_searches: int) -> Mapping[str, TaskGame]:
    """List the kinds that are simulated, by name."""

    def sample(title: str, prior: PriorGraph | None = None, **rules: object) -> TaskGame:
        source = SampledSource(prior, HomeConfig(**rules))  # type: ignore[arg-type]
        return TaskGame(title, (source,), num_homes, num_steps, num_searches)

    def mix(title: str, view: str | None = None) -> TaskGame:
        mixture = Mixture() if view is None else Mixture(views={view: 1.0})
        source = MixtureSource(None, None, mixture)
        return TaskGame(title, (source,), num_homes, num_steps, num_searches)

    return {
        "paper-32": sample("The paper's homes, 32 places"),
        "paper-16": sample("16 places", furniture_per_room=4),
        "paper-8": sample("8 places", furniture_per_room=2),
        "paper-60": sample("60 places", furniture_per_room=15),
        "paper-24": sample(
            "Homes of the released code's size, 24 places",
            furniture_per_room=6,
            objects_per_furniture=5,
        ),
        "dealt-prior": sample(
            "32 places, another prior graph: object types deal their places anew",
            deal_placements(PriorGraph.default()),
        ),
        "routine": sample(
            "People with routines, 24 places",
            furniture_per_room=6,
            objects_per_furniture=3,
            dynamics=RoutineDynamics(),
        ),
        "mixed": mix("Mixture"),
        "no-prior": mix("Mixture, no prior", NONE),
        "other-prior": mix("Mixture, the prior of another home", OTHER_HOME),
        "unknown-words": mix("Mixture, words that the prior does not know", UNKNOWN_WORDS),
    }


def deal_placements(prior: PriorGraph) -> PriorGraph:
    """Return a world in which mugs may be kept where books are: its homes, and the agents' prior.

    Each object type gets the placements of another, at random; nothing else changes. Who learnt by
    heart what is kept where, or uses what a thing is called, is wrong there.
    """
    labels = [object_type.label for object_type in prior.objects]
    order = np.random.default_rng(0).permutation(len(labels))
    dealt = {label: labels[other] for label, other in zip(labels, order, strict=True)}
    placements = tuple(
        replace(placement, object=dealt[placement.object]) for placement in prior.placements
    )
    return replace(prior, placements=placements)


def list_recorded(
    folders: Sequence[str], num_searches: int, seeds: tuple[int, ...], called: str
) -> Mapping[str, TaskGame]:
    """List the kinds that are recorded, by name: with both shipped priors and with a counted one.

    Raises:
        ValueError: if there is no trace, one is broken, or there is only one.
    """
    paths = _find_several(folders)

    def record(
        title: str, num_steps: int, step_seconds: float, priors: list[PriorGraph]
    ) -> TaskGame:
        sources = [
            RecordedSource(prior, None, [path], step_seconds)
            for path, prior in zip(paths, priors, strict=True)
        ]
        least = min(source.num_steps for source in sources)
        return TaskGame(title, tuple(sources), 1, min(num_steps, least), num_searches, seeds)

    priors = {
        "recorded": ("", [PriorGraph.default()] * len(paths)),
        "household": (", the household prior", [PriorGraph.household()] * len(paths)),
        "counted": (", prior counted in the other homes", _count_in_others(paths)),
    }
    kinds = {}
    for name, (knowing, counted) in priors.items():
        for num_steps in (200, 1000):
            title = f"{called}, {num_steps:,} hourly steps{knowing}"
            kinds[f"{name}-hour-{num_steps}"] = record(title, num_steps, 3600.0, counted)
        for num_steps in (200, 1000) if name != "counted" else ():
            title = f"{called}, {num_steps:,} steps of ten minutes{knowing}"
            kinds[f"{name}-10min-{num_steps}"] = record(title, num_steps, 600.0, counted)
    return kinds


_LOOKS = {"policy": "the policy says where the robot looks", "patrol": "the robot is on patrol"}
_SCORED_SECONDS = 10 * DAY_SECONDS  # the end of a long life


def list_benchmark(
    folders: Sequence[str],
    num_steps: int,
    step_seconds: float,
    replays: int,
    also: Mapping[str, PriorGraph] = MappingProxyType({}),
) -> Mapping[str, TaskGame]:
    """List the kinds of the benchmark of recorded homes, by name.

    Episodes from an empty memory and long lives, of which the last ten days are scored; the policy
    says where the robot looks, or a patrol; the default prior, the household prior, or one counted
    in the other homes.

    Args:
        folders: traces, or folders of traces.
        num_steps: of an episode.
        step_seconds: length of a step.
        replays: how often each home is played in episodes; half as often in long lives.
        also: further priors, by the name that ends those of their kinds.

    Raises:
        ValueError: if a name is taken, there is no trace, one is broken or too short, or there is
            only one.
    """
    paths = _find_several(folders)
    own_others = zip(_count_in_others(paths), [[path] for path in paths], strict=True)
    priors = {
        "shipped": ("the default prior", [(PriorGraph.default(), paths)]),
        "household": ("the household prior", [(PriorGraph.household(), paths)]),
        "counted": ("a prior counted in the other homes", list(own_others)),
    }
    for name, prior in also.items():
        if name in priors:
            raise ValueError(
                f"also_prior must have a name of its own, got {shorten(name)}. Choose another."
            )
        priors[name] = (f"the prior `{name}`", [(prior, paths)])
    num_scored = math.ceil(_SCORED_SECONDS / step_seconds)
    kinds = {}
    for name, (knowing, homes) in priors.items():
        for looks, looking in _LOOKS.items():
            rules = HomeConfig(looks=looks)
            episodes, lives = (
                tuple(
                    RecordedSource(prior, rules, paths, step_seconds, replays=times)
                    for prior, paths in homes
                )
                for times in (replays, max(replays // 2, 1))
            )
            life = min(source.num_steps for source in lives)
            if life <= num_scored:
                raise ValueError(
                    f"recorded homes must be longer than the {num_scored} steps of their last ten "
                    f"days, got one of {life}. Leave it out, or record longer."
                )
            num_steps = min(num_steps, life)
            # On patrol there is no search: Find Object looks where the policy says.
            searches = looks == "policy"
            kinds[f"episodes-{looks}-{name}"] = TaskGame(
                f"Episodes of {num_steps} steps from an empty memory; {looking}, {knowing}",
                episodes,
                1,
                num_steps,
                num_steps * searches,
            )
            kinds[f"lives-{looks}-{name}"] = TaskGame(
                f"The last ten days of lives of {life} steps; {looking}, {knowing}",
                lives,
                1,
                life,
                life * searches,
                num_warm_up=life - num_scored,
            )
    return kinds


def choose_games(
    kinds: Mapping[str, TaskGame], names: Sequence[str] | None
) -> Mapping[str, TaskGame]:
    """Choose some kinds by name, all for None.

    Raises:
        ValueError: if there is no kind of a name.
    """
    for name in names or ():
        if name not in kinds:
            raise ValueError(
                f"kinds must be some of {', '.join(kinds)}, got {shorten(name)}. Choose among "
                "these; recorded ones need folders of recorded homes."
            )
    return kinds if names is None else {name: kinds[name] for name in names}


def _find_several(folders: Sequence[str]) -> list[str]:
    """Find two or more traces."""
    paths = [str(path) for path in find_traces(folders)]
    if len(paths) < 2:
        raise ValueError(
            f"recorded homes must be two or more, so that a prior can be counted in the others, "
            f"got {len(paths)}. Name more folders."
        )
    return paths


def _count_in_others(paths: Sequence[str]) -> list[PriorGraph]:
    """Count a prior for each trace in all the others."""
    traces = [load_trace(path) for path in paths]
    return [
        count_prior([trace for trace in traces if trace is not held_out], HOUR_SECONDS)[0]
        for held_out in traces
    ]


def list_lived_homes(
    sizes: Sequence[int], num_homes: int, folders: Sequence[str], rules: HomeConfig, seed: int
) -> list[LivedHome]:
    """List the homes: people with routines, or recordings.

    Args:
        sizes: furniture nodes of each room, of one simulated home after the other, in turn.
        num_homes: simulated homes, or plays of each recording.
        folders: traces, or folders of traces, where a robot's memory uses the household prior,
            as it does by default; none for simulated homes.
        rules: of looking.
        seed: of the first play, or of all simulated homes.
    """
    if folders:
        prior = PriorGraph.household()
        return [
            LivedHome(
                f"{path.name}-{home_seed}",
                RecordedSource(prior, rules, [str(path)]),
                0,
                home_seed,
                path.name,
            )
            for path in find_traces(folders)
            for home_seed in range(seed, seed + num_homes)
        ]
    homes = []
    for number in range(num_homes):
        size = sizes[number % len(sizes)]
        home_rules = replace(
            rules, furniture_per_room=size, objects_per_furniture=3, dynamics=RoutineDynamics()
        )
        name = f"{size * len(rules.rooms)} places-{number}"
        homes.append(LivedHome(name, SampledSource(None, home_rules), number, seed, name))
    return homes
