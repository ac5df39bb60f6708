"""What is taken for the labels of one list in a memory of another one."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from sgm.names.aliases import AliasTable
from sgm.names.name import Name
from sgm.names.name_index import NameIndex
from sgm.names.resolution import Resolution
from sgm.prior.prior_graph import load_prior
from tools.names.label_lists import LabelList

OUTCOMES = ("right", "ambiguous", "unknown", "wrong")
JUDGED = Path(__file__).parent / "data" / "judged_pairs.json"


@dataclass(frozen=True)
class Taken:
    """What a name was taken for.

    Attributes:
        memory: list of what was seen.
        asked: name.
        resolution: what it was taken for.
        wrong: matches that are not meant.
    """

    memory: str
    asked: str
    resolution: Resolution
    wrong: tuple[str, ...]

    @property
    def outcome(self) -> str:
        """One of `OUTCOMES`."""
        if self.resolution.is_ambiguous:
            return "ambiguous"
        if not self.resolution.matches:
            return "unknown"
        return "wrong" if self.wrong else "right"


def ask_labels(asked: LabelList, seen: LabelList, half: int | None) -> Iterator[Taken]:
    """Ask for the labels of one list, of a half or all, in a memory of another one."""
    index = NameIndex(
        tuple(object_type.label for object_type in load_prior(None).objects), AliasTable.household()
    )
    index.update(seen.seen)
    for name in asked.list_asked(half):
        found = index.resolve(name)
        wrong = tuple(match for match in found.matches if not is_right(name, match))
        yield Taken(seen.name, name, found, wrong)


def is_right(asked: str, match: str) -> bool:
    """Tell whether a thing is what was asked for.

    It is if the names are one but for spelling, or the pair stands in `data/judged_pairs.json`.
    There stand other pairs that a person has judged to be the same thing or a kind of it. What is
    not listed there is wrong.
    """
    if Name.read(asked).is_same(Name.read(match)):
        return True
    return match in _load_judged().get(asked, ())


def count_outcomes(taken: Sequence[Taken]) -> Counter[str]:
    """Count the outcomes."""
    return Counter(answer.outcome for answer in taken)


@lru_cache(maxsize=1)
def _load_judged() -> dict[str, frozenset[str]]:
    rows: dict[str, list[str]] = json.loads(JUDGED.read_text(encoding="utf-8"))
    return {name: frozenset(matches) for name, matches in rows.items()}
