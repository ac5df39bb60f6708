"""Measures over many homes: computed home by home, kept in files, and written as a table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import read_json, write_whole
from simulator.box_world.robot_body import BodyRules
from simulator.box_world.week import Week, WeekRules
from simulator.box_world.world import BoxWorld
from simulator.world.source import HomeSource
from simulator.world.streams import Streams
from tools.eyes.map_measures import measure_map
from tools.eyes.measures import EyesExam

PARTS = ("looks", "maps")  # what is measured: looks with a map, and maps of robots without one
NOISES = (0.0, 0.02, 0.1)  # standard deviations of the known position, metres
_ABSENCE_NOISE = 0.02  # with which absences are counted
MAP_NOISES = (0.02, 0.1)  # with which maps are drawn
_MAP_ROUNDS = 2  # that both robots are led around before errands with and without a map
# Of the files of each part; raise it when homes, robots, eyes or maps change.
_VERSIONS = {"looks": 7, "maps": 8}


@dataclass(frozen=True, slots=True)
class MeasureRules:
    """How much is measured.

    Attributes:
        num_homes: homes 0 to n - 1.
        rounds: times that all furniture is looked at to count absences, a time step apart.
        steps: time steps of errands.
        errands_per_step: errands in each.
    """

    num_homes: int = 20
    rounds: int = 6
    steps: int = 48
    errands_per_step: int = 2


def measure_homes(
    source: HomeSource, rules: MeasureRules, seed: int, folder: Path, parts: Sequence[str] = PARTS
) -> Iterator[dict[str, Any]]:
    """Measure home by home; what a file in the folder has already is not computed again.

    Args:
        source: of the homes.
        rules: how much.
        seed: of the homes and of all else.
        folder: for a file a home and part.
        parts: what is measured, of `PARTS`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "source": source.describe(),
        "seed": seed,
        "rounds": rules.rounds,
        "steps": rules.steps,
        "errands_per_step": rules.errands_per_step,
    }
    about = json.loads(json.dumps(about))
    for home in range(rules.num_homes):
        scores: dict[str, Any] = {}
        for part in parts:
            path = folder / f"home_{home}_{part}.json"
            known = read_json(path) if path.exists() else None
            of_part = {"version": _VERSIONS[part], **about}
            if not isinstance(known, dict) or known.get("about") != of_part:
                known = {"about": of_part, **_MEASURES[part](source, rules, seed, home)}
                write_whole(path, json.dumps(known).encode())
            scores |= known
        yield scores


def _measure_looks(source: HomeSource, rules: MeasureRules, seed: int, home: int) -> dict[str, Any]:
    """Measure looks at furniture that is on a map."""
    scores: dict[str, Any] = {}
    for noise in NOISES:
        counts_absences = noise == _ABSENCE_NOISE
        exam = EyesExam(
            BoxWorld(source.make(Streams(seed, "test", [home]))),
            make_body(noise),
            measures_coverage=noise < max(NOISES),
        )
        exam.visit_all()
        scores[f"noise {noise}"] = exam.scores.to_json()
        if counts_absences:
            exam.measures_coverage = False
            for _ in range(rules.rounds - 1):
                exam.evolve()
                exam.visit_all()
            scores["absences"] = exam.scores.to_json() | {"coverage_errors": []}
    week_rules = WeekRules(steps=rules.steps, errands_per_step=rules.errands_per_step)
    robots = ("eyes", "all that shows", "perfect looks")
    return scores | {"errands": _live(source, seed, home, week_rules, robots)}


def _measure_maps(source: HomeSource, rules: MeasureRules, seed: int, home: int) -> dict[str, Any]:
    """Measure what a robot without a map draws, and what it finds."""
    scores: dict[str, Any] = {}
    for noise in MAP_NOISES:
        world = BoxWorld(source.make(Streams(seed, "test", [home])))
        body = replace(make_body(noise), names_furniture=True)
        scores[f"map {noise}"] = measure_map(world, body)
    led = WeekRules(steps=rules.steps, errands_per_step=rules.errands_per_step, rounds=_MAP_ROUNDS)
    robots = ("eyes", "own map")
    return scores | {"errands without a map": _live(source, seed, home, led, robots)}


_MEASURES = {"looks": _measure_looks, "maps": _measure_maps}


def _live(
    source: HomeSource, seed: int, home: int, rules: WeekRules, robots: tuple[str, ...]
) -> dict[str, Any]:
    """Return what robots have found in the same hours of a home, by their names."""
    week = Week(source, home, seed, rules, make_body(_ABSENCE_NOISE), names=robots)
    for _ in week.live():
        pass
    return {
        tally.name: {
            "found": tally.found,
            "looks": tally.compute_looks(rules.most_looks),
            "metres": tally.metres,
        }
        for tally in week.tallies
    }


def make_body(position_sd: float) -> BodyRules:
    """Return a robot that knows its position so well, and its yaw to a quarter radian a metre."""
    return replace(BodyRules(), position_sd=position_sd, angle_sd=position_sd / 4)


def format_results(found: Sequence[dict[str, Any]]) -> str:
    """Return the table of all homes, with the bound that each figure is to keep."""
    rows: list[Row] = []
    if "errands" in found[0]:
        for listed in (_list_coverage, _list_assignment, _list_absences, _list_finds):
            rows += listed(found)
    if "errands without a map" in found[0]:
        rows += _list_maps(found)
    return _format_rows(rows)


def format_short(found: Sequence[dict[str, Any]]) -> str:
    """Return the table of robots without a map, at the pose noise of the other robots' errands."""
    noises = [f"pose noise {100 * noise:g} cm" for noise in MAP_NOISES if noise != _ABSENCE_NOISE]
    rows = (row for row in _list_maps(found) if not any(noise in row[0] for noise in noises))
    return _format_rows(rows)


def _format_rows(rows: Iterable[Row]) -> str:
    lines = [
        "| measured | figure | bound |",
        "| --- | --- | --- |",
        *(f"| {measured} | {figure} | {bound} |" for measured, figure, bound in rows),
    ]
    return "\n".join(lines)


Row = tuple[str, str, str]


def _list_coverage(found: Sequence[dict[str, Any]]) -> Iterator[Row]:
    for noise in NOISES[:2]:
        errors = np.concatenate([home[f"noise {noise}"]["coverage_errors"] for home in found])
        yield (
            f"coverage of {len(errors)} volumes in looks, pose noise {100 * noise:g} cm, beside "
            "the true visible share",
            f"within .05 in {(np.abs(errors) <= 0.05).sum()}, mean {errors.mean():+.3f}, "
            f"largest error {np.abs(errors).max():.3f}",
            "within .05" if noise == 0 else "",
        )


def _list_assignment(found: Sequence[dict[str, Any]]) -> Iterator[Row]:
    for noise, bound in zip(NOISES, ("", "98 %", "90 %"), strict=True):
        count = _sum(found, f"noise {noise}")
        yield (
            f"assignment of {count['num_detections']} detections, pose noise {100 * noise:g} cm",
            f"right for {count['num_right'] / count['num_detections']:.1%}, at no place "
            f"{count['num_unassigned'] / count['num_detections']:.1%}",
            bound,
        )


def _list_absences(found: Sequence[dict[str, Any]]) -> Iterator[Row]:
    count = _sum(found, "absences")
    yield (
        f"absence counted for what was occluded, {count['num_frames']} frames",
        f"{count['num_false_absences']} of {count['num_hidden']} occluded things",
        "0",
    )
    in_view = count["num_absences_in_view"], count["num_gone_in_view"]
    partly = count["num_absences"] - in_view[0], count["num_gone"] - in_view[1]
    for (found_out, gone), where in ((in_view, "all in view"), (partly, "in part or not in view")):
        yield (
            f"absence counted for what had left, in looks that had its spot {where}",
            f"{found_out} of {gone} things that had left",
            "",
        )
    yield (
        f"looks of a visit of {count['num_frames'] / max(count['num_visits'], 1):.0f} frames, on "
        "the way and there",
        f"{count['num_looks'] / max(count['num_visits'], 1):.3f}",
        "1",
    )


def _list_finds(found: Sequence[dict[str, Any]]) -> Iterator[Row]:
    for name, other in (
        ("perfect looks", "perfect looks, which show what stands behind and under other things"),
        ("all that shows", "perfect looks of all that the camera shows"),
    ):
        for key, title in (
            ("found", "errands that end with a find"),
            ("looks", "looks of an errand"),
        ):
            eyes, given = (
                np.array([home["errands"][robot][key] for home in found])
                for robot in ("eyes", name)
            )
            more, sd = compute_ratio(eyes, given)
            yield (
                f"{title}, with eyes and with {other}",
                f"{eyes.mean():.3f} and {given.mean():.3f}: {more - 1:+.1%}, standard error "
                f"{sd:.1%}",
                "within 5 %",
            )


def _list_maps(found: Sequence[dict[str, Any]]) -> Iterator[Row]:
    for noise in MAP_NOISES:
        count = _sum(found, f"map {noise}")
        overlaps = np.concatenate([home[f"map {noise}"]["overlaps"] for home in found])
        where = f"without a map, after two rounds, pose noise {100 * noise:g} cm"
        on_map = count["num_on_map"] / count["num_visible"]
        yield (
            f"furniture on the map, of {count['num_visible']} pieces that were in view, {where}",
            f"{on_map:.1%}, {count['num_labelled'] / count['num_on_map']:.1%} of it with its label",
            "90 %",
        )
        yield (
            f"overlap of its footprint with the true one, {where}",
            f"mean {overlaps.mean():.3f}, lowest tenth {np.quantile(overlaps, 0.1):.3f}",
            ".6",
        )
        yield (
            f"furniture that is not there, of {count['num_drawn']} on the map, {where}",
            f"{count['num_nowhere'] / count['num_drawn']:.1%}",
            "3 %",
        )
        away = np.concatenate([home[f"map {noise}"]["positions"] for home in found])
        yield (
            f"positions of {len(away)} rightly named things of the last round, from where they "
            f"lie, {where}",
            f"within 15 cm for {(away <= 0.15).mean():.1%}, median {100 * np.median(away):.1f} cm, "
            f"highest tenth {100 * np.quantile(away, 0.9):.1f} cm",
            "within 15 cm" if noise == MAP_NOISES[0] else "",
        )
        num_positions = len(away) + count["num_misnamed"]
        yield (
            f"positions whose name is that of another thing, of {num_positions}, {where}",
            f"{count['num_misnamed'] / num_positions:.1%}",
            "",
        )
    for key, title, bound in (
        ("found", "errands that end with a find", "within 10 %"),
        ("looks", "looks of an errand", "within 15 %"),
    ):
        mapped, given = (
            np.array([home["errands without a map"][robot][key] for home in found])
            for robot in ("own map", "eyes")
        )
        more, sd = compute_ratio(mapped, given)
        yield (
            f"{title}, without a map and with the true one, after two rounds of both",
            f"{mapped.mean():.3f} and {given.mean():.3f}: {more - 1:+.1%}, standard error {sd:.1%}",
            bound,
        )


def compute_ratio(values: np.ndarray, others: np.ndarray) -> tuple[float, float]:
    """Return the ratio of two means over the same homes (H,), and its standard error.

    The error is that of the linearised ratio over homes, which are drawn independently; nan of one
    home. Errands of one home are not independent of each other.
    """
    ratio = float(values.mean() / others.mean())
    if len(values) < 2:
        return ratio, float("nan")
    residual = (values - ratio * others) / others.mean()
    return ratio, float(residual.std(ddof=1) / np.sqrt(len(residual)))


def _sum(found: Sequence[dict[str, Any]], name: str) -> dict[str, int]:
    """Return the sums of the counts of one measure over homes."""
    keys = [key for key, value in found[0][name].items() if isinstance(value, int)]
    return {key: sum(home[name][key] for home in found) for key in keys}
