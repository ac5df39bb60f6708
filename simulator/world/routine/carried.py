"""What residents carry along whenever they leave the home: keys, phones, bags, a lunch box."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from sgm.files import read_table
from simulator.world.routine.life_kernel import Habits
from simulator.world.routine.rules import RoutineRules
from simulator.world.sampled_state import SampledState

_LONG_MINUTES = 240.0  # from here on, an outing is a long one: a job, not an errand
_LEFT = 0.1  # how often what was carried is left where its owner comes in, not put back


@lru_cache(maxsize=1)
def load_carried() -> dict[str, tuple[float, float]]:
    """Read `data/carried.csv`: how often a type goes along on short and long outings, by label.

    All numbers are assumptions, in round figures.
    """
    rows = read_table("simulator.world.routine", "carried.csv")
    return {entry["label"]: (float(entry["short"]), float(entry["long"])) for entry in rows}


def add_carried(
    homes: SampledState,
    rules: Mapping[int, RoutineRules],
    habits: Habits,
    num_residents: np.ndarray,
) -> Habits:
    """Give everything that is carried an owner, who takes it along on every outing.

    Args:
        homes: the group.
        rules: of each home with routines.
        habits: drawn; what is carried comes in columns after the other items.
        num_residents: of each home, (H,).
    """
    carried = {home: _choose(homes, home, rule) for home, rule in rules.items()}
    num_items = habits.item.shape[3]
    size = (*habits.item.shape[:3], num_items + max(len(slots) for slots, _ in carried.values()))
    item, use, left = np.full(size, -1, dtype=np.int32), np.zeros(size), np.zeros(size)
    for longer, shorter in ((item, habits.item), (use, habits.use), (left, habits.left)):
        longer[..., :num_items] = shorter
    for home, (slots, shares) in carried.items():
        rng = homes.streams.generator("routine carried", home)
        owner = rng.integers(num_residents[home], size=len(slots))
        columns = num_items + np.arange(len(slots))
        for n, occasion in enumerate(rules[home].occasions):
            if habits.leads_out[habits.activity[home, n]]:
                is_long = int(occasion.minutes >= _LONG_MINUTES)
                item[home, owner, n, columns] = slots
                use[home, owner, n, columns] = shares[:, is_long]
                left[home, owner, n, columns] = _LEFT
    return habits._replace(item=item, use=use, left=left)


def _choose(homes: SampledState, home: int, rule: RoutineRules) -> tuple[np.ndarray, np.ndarray]:
    """Choose slots of what is carried out of a home, (n,): by the table, or as many at random.

    Beside them how often each goes along on a short outing and on a long one, (n, 2).
    """
    slots = np.flatnonzero(homes.object_place[home] >= 0)[: None if rule.carry_share else 0]
    labels = [homes.object_labels[number] for number in homes.object_type[home, slots]]
    table = load_carried()
    is_named = np.array([label in table for label in labels], dtype=bool)
    shares = np.array([table[label] for label in labels if label in table]).reshape(-1, 2)
    chosen = slots[is_named]
    if rule.carries_anything:
        rng = homes.streams.generator("routine carried anything", home)
        chosen = rng.permutation(slots[~is_named])[: len(chosen)]
        shares = shares[: len(chosen)]
    return chosen, shares * rule.carry_share
