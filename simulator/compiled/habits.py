"""What residents usually do: drawn once for each home, before its life begins."""

from typing import Any, NamedTuple

import numpy as np

from simulator.compiled.kernel import kernel
from simulator.compiled.split_mix import draw_index, draw_normal, draw_uniform

# The rules of a home that the kernels read, from the fields of `RoutineDynamics`.
RULES = np.dtype(
    [
        (name, np.float64)
        for name in (
            "person_spread", "habit_spread", "omission_spread", "drift_spread", "drift_kept",
            "jitter", "min_use", "max_use", "static_share", "elsewhere_share", "extra_share",
            "left_share", "second_share", "new_share", "collect_share", "tidy_share", "tidy_time",
            "can_carry_out", "max_things", "own_spot_share", "left_habit",
            "together",
        )
    ]
)  # fmt: skip


class Customs(NamedTuple):
    """What people usually do in H homes, before they have habits of their own.

    Attributes:
        role_share: share of the residents that have each role or one before it, (H, 3).
        num_occasions: occasions of each home, the first of its row, (H,).
        hour: usual start of each, in seconds after midnight on weekdays and at weekends, (H, N, 2).
        share: how often, (H, N, 2).
        role: the role whose people alone do it, or -1, (H, N).
        num_slots: object slots of each home, the first of its row, (H,).
    """

    role_share: np.ndarray
    num_occasions: np.ndarray
    hour: np.ndarray
    share: np.ndarray
    role: np.ndarray
    num_slots: np.ndarray


class Habits(NamedTuple):
    """What the residents of H homes usually do; drawn once.

    Attributes:
        kind: kind of each occasion, int32 (H, N).
        after: the occasion that it follows, or -1, int32 (H, N).
        seconds: its usual length, (H, N).
        hour: seconds after midnight at which a resident begins, on weekdays and at weekends,
            (H, R, N, 2).
        share: how often, (H, R, N, 2).
        shared_spot: the place where residents do a kind of activity, int32 (H, K).
        spot: the same of a resident, who may have another one, int32 (H, R, K).
        item: objects that a resident takes for an occasion, or -1, int32 (H, R, N, S).
        use: how often each of them is taken, (H, R, N, S).
        left: how often each of them is left where it was used, (H, R, N, S).
        own_place: of an object: its usual place, a second one, two others, int32 (H, C, 4).
        object_weight: how readily a kind takes an object, summed up over objects, (H, K, C).
        spot_weight: how readily a kind is done at furniture, summed up over it, (H, K, F).
        spot_place: the place of each furniture node where things are put down, int32 (H, F).
    """

    kind: np.ndarray
    after: np.ndarray
    seconds: np.ndarray
    hour: np.ndarray
    share: np.ndarray
    shared_spot: np.ndarray
    spot: np.ndarray
    item: np.ndarray
    use: np.ndarray
    left: np.ndarray
    own_place: np.ndarray
    object_weight: np.ndarray
    spot_weight: np.ndarray
    spot_place: np.ndarray


@kernel
def draw_own_places(
    weights: np.ndarray, uniform: np.ndarray, gathering: float, second_place_share: float
) -> np.ndarray:
    """Draw the places of a home's objects, one object after the other.

    Args:
        weights: of the places of each object, each row with a positive sum, float32 (n, P).
        uniform: (n, 5).
        gathering: how much more readily an object is kept where others are.
        second_place_share: share of the objects that have a second place.

    Returns:
        Usual place, second place (or again the usual one), two others, int32 (n, 4).
    """
    num_places = weights.shape[1]
    num_kept = np.zeros(num_places)
    own = np.empty((len(weights), 4), dtype=np.int32)
    for i in range(len(weights)):
        for turn in range(4):
            total = 0.0
            for place in range(num_places):
                if turn == 0 or place != own[i, 0]:
                    total += weights[i, place] * (1 + gathering * num_kept[place])
            own[i, turn] = own[i, 0]
            mark = uniform[i, turn] * total
            for place in range(num_places if total > 0 else 0):
                if weights[i, place] > 0 and (turn == 0 or place != own[i, 0]):
                    own[i, turn] = place
                    mark -= weights[i, place] * (1 + gathering * num_kept[place])
                    if mark < 0:
                        break
        if uniform[i, 4] >= second_place_share:
            own[i, 1] = own[i, 0]
        num_kept[own[i, 0]] += 1
    return own


@kernel
def draw_habits(
    rules: np.ndarray,
    customs: Customs,
    habits: Habits,
    num_residents: np.ndarray,
    random: np.ndarray,
) -> None:
    """Draw the residents' habits, in place.

    Args:
        rules: `RULES`, (H,).
        customs: what people usually do.
        habits: `hour`, `share`, `spot`, `item` and `use` are filled; weights of objects are
            summed up for those that are used at all.
        num_residents: int32 (H,).
        random: the generators, changed, uint64 (H,).
    """
    num_kinds = habits.object_weight.shape[1]
    favourite = np.empty(2 * habits.item.shape[3], dtype=np.int64)
    for home in range(len(rules)):
        rule = rules[home]
        set_size = int(rule.max_things)
        _choose_purposes(rule, random, home, customs.num_slots[home], habits.object_weight[home])
        for kind in range(num_kinds):
            habits.shared_spot[home, kind] = draw_spot(habits, random, home, kind)
        for resident in range(num_residents[home]):
            role = np.searchsorted(
                customs.role_share[home], draw_uniform(random, home), side="right"
            )
            shift = draw_normal(random, home) * rule.person_spread
            for kind in range(num_kinds):
                habits.spot[home, resident, kind] = habits.shared_spot[home, kind]
                if draw_uniform(random, home) < rule.own_spot_share:
                    habits.spot[home, resident, kind] = draw_spot(habits, random, home, kind)
                count = 0  # favourites of this resident and kind
                for _ in range(8 * set_size):
                    found = draw_index(random, home, habits.object_weight[home, kind])
                    if found < 0 or count == 2 * set_size or found in favourite[:count]:
                        continue
                    is_apart = count > 0
                    for other in favourite[:count]:
                        is_apart &= (
                            habits.own_place[home, found, 0] != habits.own_place[home, other, 0]
                        )
                    if not is_apart or draw_uniform(random, home) >= rule.together:
                        favourite[count] = found
                        count += 1
                for n in range(customs.num_occasions[home]):
                    if habits.kind[home, n] != kind:
                        continue
                    own_shift = shift + draw_normal(random, home) * rule.habit_spread
                    change = (2 * draw_uniform(random, home) - 1) * rule.omission_spread
                    for w in range(2):
                        habits.hour[home, resident, n, w] = customs.hour[home, n, w] + own_shift
                        share = customs.share[home, n, w]
                        if 0 < share < 1:
                            share = min(max(share + change, 0.0), 1.0)
                        is_mine = customs.role[home, n] in (-1, role)
                        habits.share[home, resident, n, w] = share * is_mine
                    wanted = 1 + int(draw_uniform(random, home) * set_size)
                    for i in range(min(wanted, count)):
                        j = i + int(draw_uniform(random, home) * (count - i))
                        favourite[i], favourite[j] = favourite[j], favourite[i]
                        habits.item[home, resident, n, i] = favourite[i]
                        use = rule.min_use + draw_uniform(random, home) * (
                            rule.max_use - rule.min_use
                        )
                        habits.use[home, resident, n, i] = use
                        is_left = draw_uniform(random, home) < rule.left_share
                        habits.left[home, resident, n, i] = (
                            rule.left_habit if is_left else 1 - rule.left_habit
                        )


@kernel
def draw_spot(habits: Habits, random: np.ndarray, home: int, kind: int) -> int:
    """Draw a place where a kind of activity may be done."""
    return habits.spot_place[home, draw_index(random, home, habits.spot_weight[home, kind])]


@kernel
def _choose_purposes(
    rule: Any, random: np.ndarray, home: int, num_slots: int, weight: np.ndarray
) -> None:
    """Draw what each object of a home is for, and sum up its weights over objects, (K, C)."""
    of_kinds = np.empty(len(weight), dtype=weight.dtype)
    for column in range(weight.shape[1]):
        if column < num_slots:
            of_kinds[:] = weight[:, column]
            for kind in range(1, len(weight)):
                of_kinds[kind] += of_kinds[kind - 1]
            main = draw_index(random, home, of_kinds)
            is_static = draw_uniform(random, home) < rule.static_share
            for kind in range(len(weight)):
                if is_static or kind != main:
                    weight[kind, column] = 0
        if column > 0:
            weight[:, column] += weight[:, column - 1]
