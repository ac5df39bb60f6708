"""Test homes by name and version, and checksums of what homes do."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sgm.checks import check_choice
from sgm.files import read_json
from sgm.messages import shorten
from sgm.policies.heuristics import Bayesian
from sgm.prior.prior_graph import PriorGraph
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams

FILE = Path(__file__).parent / "test_sets.json"
_HOMES_AT_ONCE = 25


@dataclass(frozen=True, slots=True)
class TestSet:
    """Homes of one version, which never change: new ones get a new name.

    Attributes:
        name: what a paper cites.
        title: what the homes are.
        home: their rules, `HomeConfig.describe`.
        prior: checksum of the prior that they were sampled from.
        split, seed, num_homes: of their streams; homes 0 to `num_homes` - 1.
        steps: how long they are played.
        layout: SHA-256 of rooms and furniture.
        life: SHA-256 of the objects at t = 0 and after every step.
        evaluate: the command that plays in them.
    """

    __test__ = False  # no test of pytest's

    name: str
    title: str
    home: dict[str, Any]
    prior: str
    split: str
    seed: int
    num_homes: int
    steps: int
    layout: str
    life: str
    evaluate: str

    def make_source(self) -> SampledSource:
        """Make the source of the homes."""
        return SampledSource(PriorGraph.default(), HomeConfig.from_json(self.home))

    @property
    def checksums(self) -> dict[str, str]:
        """What the set says of its homes, by name."""
        return {"prior": self.prior, "layout": self.layout, "life": self.life}

    def compute_checksums(self) -> dict[str, str]:
        """Make the homes, let them live, and return what `checksums` should be.

        Where objects go does not depend on who looks where, so that no policy plays.
        """
        source = self.make_source()
        layout, life = hashlib.sha256(), hashlib.sha256()
        for first in range(0, self.num_homes, _HOMES_AT_ONCE):
            numbers = range(first, min(first + _HOMES_AT_ONCE, self.num_homes))
            homes = source.make(Streams(self.seed, self.split, numbers))
            layout.update(_describe_layout(homes))
            life.update(_describe_objects(homes))
            for _ in range(self.steps):
                homes.evolve()
                life.update(_describe_objects(homes))
        return {
            "prior": source.prior.checksum,
            "layout": layout.hexdigest(),
            "life": life.hexdigest(),
        }


def load_test_sets(path: Path = FILE) -> dict[str, TestSet]:
    """Return the sets by name.

    Raises:
        ValueError: if the file is no list of sets.
    """
    try:
        sets = [TestSet(**entry) for entry in read_json(path)]
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"test sets must be a list of what `TestSet` says, got {shorten(str(error))} in {path}."
            " Take the file that ships."
        ) from error
    return {test_set.name: test_set for test_set in sets}


def find_test_set(name: str) -> TestSet:
    """Return a set by name; raises ValueError if there is none."""
    sets = load_test_sets()
    check_choice("test set", name, sets)
    return sets[name]


def name_test_set(source: HomeSource, streams: Streams, steps: int) -> str | None:
    """Return the name of the set that homes are, None if they are none that has a name."""
    for test_set in load_test_sets().values():
        named_source = test_set.make_source()
        if (
            named_source.prior.checksum != test_set.prior
            or named_source.describe() != source.describe()
        ):
            continue
        same = (test_set.split, test_set.seed, list(range(test_set.num_homes)), test_set.steps)
        if same == (streams.split, streams.seed, list(streams.homes), steps):
            return test_set.name
    return None


def _describe_layout(homes: SampledHomes) -> bytes:
    """Spell out rooms and furniture, home by home."""
    lines = []
    for home in range(homes.num_homes):
        for place in np.flatnonzero(homes.is_furniture[home]):
            room = homes.room_labels[home, homes.furniture_room[home, place]]
            lines.append(f"{room}|{homes.furniture_labels[home, place]}")
        lines.append("")
    return "\n".join(lines).encode()


def _describe_objects(homes: SampledHomes) -> bytes:
    """Write down description and place of every object, home by home, slot by slot."""
    parts = []
    for home, count in enumerate(homes.home_num_slots):
        place = homes.object_place[home, :count]
        code = np.where(place >= 0, homes.object_code[home, :count], -1)
        parts += [place.astype("<i4").tobytes(), code.astype("<i4").tobytes()]
    return b"".join(parts)


def compute_fingerprint(source: HomeSource, streams: Streams, num_steps: int) -> str:
    """Return the SHA-256 of what the first home is, how it changes and what is asked there.

    Equal settings give equal homes by the same code alone: a source or dynamics of one's own, or
    another version of a package, may mean something else by them. No stream is used up.
    """
    homes = source.make(streams.select(streams.homes[:1]))
    rollout = Rollout(homes, Bayesian())
    digest = hashlib.sha256()
    _add_texts(digest, [*homes.room_labels[0], *homes.furniture_labels[0]])
    for _ in range(num_steps):
        codes, _ = rollout.ask()
        present = np.flatnonzero(homes.is_present[0])
        names = homes.object_descriptions
        _add_texts(digest, [names.text(int(code)) for code in homes.object_code[0, present]])
        digest.update(homes.object_place[0, present].astype("<i8").tobytes())
        _add_texts(digest, [names.text(int(codes[0]))])
    return digest.hexdigest()


def _add_texts(digest: hashlib._Hash, texts: Iterable[str]) -> None:
    digest.update("\0".join(texts).encode() + b"\0\0")
