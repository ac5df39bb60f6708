"""What residents carry along whenever they leave the home: keys, phones, bags, a lunch box."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

import numpy as np

from simulator.world.routine.life_kernel import Habits
from simulator.world.routine.rules import RoutineRules
from simulator.world.sampled_state import SampledState

_LONG_MINUTES = 240.0  # from here on, an outing is a long one: a job, not an errand
_LEFT = 0.1  # how often what was carried is left where its owner comes in, not put back


@dataclass(frozen=True, slots=True)
class Carried:
    """Slots of a home's objects that are carried out, n of them.

    Attributes:
        slot: (n,).
        share: how often each goes along on a short outing and on a long one, (n, 2).
    """

    slot: np.ndarray
    share: np.ndarray


@lru_cache(maxsize=1)
def load_carried() -> dict[str, tuple[float, float]]:
    """Read `carried.csv`: how often a type goes along on short and on long outings, by label.

    All numbers are assumptions, in round figures.
    """
    text = resources.files(__package__).joinpath("carried.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    return {row["label"]: (float(row["short"]), float(row["long"])) for row in rows}


def choose_carried(homes: SampledState, home: int, rule: RoutineRules) -> Carried:
    """Choose what is carried out of a home: things of the table, or as many others at random."""
    if rule.carry_share == 0:
        return Carried(np.zeros(0, dtype=np.int64), np.zeros((0, 2)))
    slots = np.flatnonzero(homes.object_place[home] >= 0)
    labels = [homes.object_labels[number] for number in homes.object_type[home, slots]]
    table = load_carried()
    is_named = np.array([label in table for label in labels], dtype=bool)
    share = np.array([table[label] for label in labels if label in table]).reshape(-1, 2)
    chosen = slots[is_named]
    if rule.carries_anything:
        rng = homes.streams.generator("routine carried anything", home)
        others = slots[~is_named]
        chosen = rng.permutation(others)[: len(chosen)]
        share = share[: len(chosen)]
    return Carried(chosen, share * rule.carry_share)


def add_carried(
    homes: SampledState, rules: Mapping[int, RoutineRules], carried: Mapping[int, Carried],
    habits: Habits, num_residents: np.ndarray,
) -> None:  # fmt: skip
    """Give everything that is carried an owner, who takes it along on every outing, in place.

    Args:
        homes: the group.
        rules: of each home with routines.
        carried: of each of them.
        habits: drawn; the last columns of items are free for what is carried.
        num_residents: of each home, (H,).
    """
    for home, own in carried.items():
        if len(own.slot) == 0:
            continue
        rng = homes.streams.generator("routine carried", home)
        owner = rng.integers(num_residents[home], size=len(own.slot))
        first = habits.item.shape[3] - len(own.slot)
        columns = first + np.arange(len(own.slot))
        for n, occasion in enumerate(rules[home].occasions):
            if habits.leads_out[habits.kind[home, n]]:
                is_long = int(occasion.minutes >= _LONG_MINUTES)
                habits.item[home, owner, n, columns] = own.slot
                habits.use[home, owner, n, columns] = own.share[:, is_long]
                habits.left[home, owner, n, columns] = _LEFT
