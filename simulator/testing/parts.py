"""Check that dynamics and sensing keep the contracts of `Dynamics` and `Sensing`."""

from __future__ import annotations

import json
import pickle

import numpy as np

from sgm.schema import PlaceCode
from simulator.testing.homes import check_homes
from simulator.testing.policies import SmallHomes
from simulator.world.dynamics import DYNAMICS, Dynamics
from simulator.world.parts import Part
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import SENSING, Observation, Sensing, observe
from simulator.world.streams import Streams

_SIGMAS = 4.5  # of a sum of independent numbers: exceeded once in 300,000 times


def check_dynamics(dynamics: Dynamics | str, *, num_steps: int = 12, seed: int = 0) -> None:
    """Check dynamics, beside homes of the paper's and in homes of several sizes.

    All that `check_homes` says, and: `num_objects` counts the objects; who has moved is elsewhere
    than before; fields survive JSON and pickling.

    Args:
        dynamics: an instance, or a name for `DYNAMICS.find`.
        num_steps: for how long.
        seed: of the homes.

    Raises:
        AssertionError: if one of this does not hold.
    """
    rules = DYNAMICS.find(dynamics)() if isinstance(dynamics, str) else dynamics
    _check_part(rules)
    make = SmallHomes(dynamics=rules).make
    check_homes(make, num_homes=5, num_steps=num_steps, seed=seed)
    homes = make(Streams(seed, "test", range(5)))
    for step in range(1, num_steps + 1):
        before = homes.object_place.copy()
        homes.evolve()
        moved = homes.object_moved
        if (before[moved] == homes.object_place[moved]).any():
            raise AssertionError(
                f"object_moved must mark who is elsewhere than before, got others in step {step}. "
                "Mark those whose place has changed."
            )
        if not np.array_equal(homes.num_objects, homes.is_present.sum(axis=1)):
            raise AssertionError(
                f"num_objects must count the objects of each home, got {homes.num_objects} in step "
                f"{step}. Use `fill_slots` and `empty_slots`."
            )


def check_sensing(sensing: Sensing | str, *, num_steps: int = 60, seed: int = 0) -> None:
    """Check sensing, beside homes of the paper's and in homes of several sizes.

    All that `check_homes` says, and: looks are reported in order, for those that look; coverage
    and confidences are in range; what is seen in a part of a look is no more than that part of what
    is there, and a detection is right no less often than its confidence says; fields survive JSON
    and pickling.

    Args:
        sensing: an instance, or a name for `SENSING.find`.
        num_steps: looks per home.
        seed: of the homes.

    Raises:
        AssertionError: if one of this does not hold.
    """
    rules = SENSING.find(sensing)() if isinstance(sensing, str) else sensing
    _check_part(rules)
    make = SmallHomes(sensing=rules).make
    check_homes(make, num_homes=5, seed=seed)
    homes = make(Streams(seed, "test", range(24)))
    numbers = np.arange(homes.num_homes)
    sure, seen_more = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for step in range(num_steps):
        homes.evolve()
        furniture = np.where((step + numbers) % 5, (3 * step + numbers) % 4, -1)
        seen = observe(homes, furniture)
        _check_observation(homes, furniture, seen)
        is_right = np.array(
            [
                (
                    (homes.object_place[home] == PlaceCode.of(furniture[home], relation))
                    & (homes.object_code[home] == code)
                ).any()
                for home, code, relation in zip(
                    seen.seen_home, seen.seen_code, seen.seen_relation, strict=True
                )
            ],
            dtype=bool,
        )
        sure.append(np.stack([is_right, seen.seen_confidence], axis=1))
        num_there = (homes.object_furniture[seen.home] == seen.furniture[:, None]).sum(axis=1)
        found = np.bincount(seen.seen_home[is_right], minlength=homes.num_homes)[seen.home]
        seen_more.append(
            np.stack(
                [
                    np.repeat(found / np.maximum(num_there, 1), num_there),
                    np.repeat(seen.coverage, num_there),
                ],
                axis=1,
            )
        )
    right, confidence = np.concatenate(sure).T
    found, coverage = np.concatenate(seen_more).T
    if right.sum() < confidence.sum() - _spread(confidence):
        raise AssertionError(
            f"detections must be right as often as they say, got {right.mean():.3f} for a mean "
            f"confidence of {confidence.mean():.3f}. Lower the confidences."
        )
    if found.sum() > coverage.sum() + _spread(coverage):
        raise AssertionError(
            f"looks must show no more than what is in view, got {found.mean():.3f} of the objects "
            f"for a mean coverage of {coverage.mean():.3f}. Raise the coverage."
        )


def _check_observation(homes: SampledHomes, furniture: np.ndarray, seen: Observation) -> None:
    looking = np.flatnonzero(furniture >= 0)
    for holds, rule in (
        (np.array_equal(seen.home, looking), "be reported in order, for those that look alone"),
        (np.array_equal(seen.furniture, furniture[looking]), "name the furniture looked at"),
        (((seen.coverage > 0) & (seen.coverage <= 1)).all(), "have a coverage above 0, at most 1"),
        (np.isin(seen.seen_home, looking).all(), "see in homes that look"),
        ((np.diff(seen.seen_home) >= 0).all(), "see home after home"),
        (np.isin(seen.seen_relation, (0, 1)).all(), "see relations 0 and 1"),
        (
            ((seen.seen_confidence >= 0) & (seen.seen_confidence <= 1)).all(),
            "have confidences in [0, 1]",
        ),
        (
            (
                (seen.seen_code >= 0)
                & (seen.seen_code < homes.object_descriptions.num_descriptions)
            ).all(),
            "see descriptions that there are",
        ),
        (len(seen.coverage) == len(looking), "have one coverage each"),
        (
            len(
                {
                    len(seen.seen_home),
                    len(seen.seen_code),
                    len(seen.seen_relation),
                    len(seen.seen_confidence),
                }
            )
            == 1,
            "have equally long columns",
        ),
    ):
        if not holds:
            raise AssertionError(f"looks must {rule}, got others. See `Observation`.")


def _check_part(part: Part) -> None:
    """Check that a part can be written down, sent to workers and compared."""
    data = json.loads(json.dumps(part.describe()))
    for way, copy in (
        ("JSON", type(part).from_json(data)),
        ("pickling", pickle.loads(pickle.dumps(part))),
    ):
        if copy != part or hash(copy) != hash(part):
            raise AssertionError(
                f"fields must survive {way}, got {copy} for {part}. Make it a frozen dataclass."
            )


def _spread(prob: np.ndarray) -> float:
    """Return how much a sum of ones with these probabilities may be off."""
    return _SIGMAS * float(np.sqrt((prob * (1 - prob)).sum())) + 1e-6
