"""Kitchens of HD-EPIC as traces: its published annotations of what was moved where.

Source: Perrett et al., "HD-EPIC: A Highly-Detailed Egocentric Video Dataset" (CVPR 2025), the files
`assoc_info.json` and `mask_info.json` of its object movements.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any, NoReturn

from sgm.checks import is_number
from sgm.files import read_json
from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import RELATIONS, USUAL_RELATION
from simulator.trace.events import GONE, Event
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.trace import Trace

ASSOCIATIONS, MASKS = "assoc_info.json", "mask_info.json"
_FRAMES = 30.0  # a second
_VIDEO = re.compile(r"(\w+)-(\d{8}-\d{6})")
_NUMBER = re.compile(r"\s*(\d+)$")
_NONE = ("", "null", "none")  # what else than null says that a mask is at no fixture
_ROOM = "kitchen"
# Fixtures that things are in, beside the furniture of the type table.
_INSIDE = (
    "bin",
    "cupboard",
    "dishwasher",
    "drawer",
    "freezer",
    "fridge",
    "oven",
    "washing machine",
)
# What happens within one instant: it is taken first, put down then.
_TAKEN, _PUT = range(2)


@dataclass(frozen=True, slots=True)
class _Move:
    """A thing is taken and put down, in seconds of the video; a fixture is "" for none."""

    taken_s: float
    put_s: float
    taken_from: str
    put_at: str


@dataclass(frozen=True, slots=True)
class _Video:
    """What moved in a video: by name of the thing, one list of moves for each of that name."""

    name: str
    start: datetime
    things: Mapping[str, Sequence[Sequence[_Move]]]
    length_s: float


@dataclass(frozen=True, slots=True)
class ReadKitchens:
    """Kitchens, and what was left out of them.

    Attributes:
        traces: one of each participant.
        left_out: how many were not read, by reason.
    """

    traces: Sequence[Trace]
    left_out: Mapping[str, int]

    def summarise(self) -> str:
        """Say what is in the traces, a line each, and what is not."""
        lines = [
            f"{trace.name}: {len(trace.layout.furniture)} furniture nodes, "
            f"{len({event.object for event in trace.events})} objects, {len(trace.events)} events, "
            f"{trace.end_s / 3600:.1f} h"
            for trace in self.traces
        ]
        return "\n".join([*lines, *(f"left out, {why}: {n}" for why, n in self.left_out.items())])


def read_hd_epic(
    folder: Path, participants: Sequence[str] = (), gap_minutes: float | None = None
) -> ReadKitchens:
    """Read what people moved in their kitchens, a trace of each of them.

    A thing is where it was taken from since its first video began. While it is carried, it is
    nowhere; what is put down at no fixture is gone: it was used up, cut up or taken away. In later
    videos a thing of the same name is the same, where several have a name in order of appearance;
    a video that finds it elsewhere says so when it begins. Fixtures are furniture of one room.

    Args:
        folder: with `assoc_info.json` and `mask_info.json`.
        participants: whose kitchens, such as "P01"; none for all.
        gap_minutes: lay the videos one after the other with so many minutes between them; None for
            the true times, with the date.

    Raises:
        ValueError: if a file is missing or none of this form, or there is no such participant.
    """
    if gap_minutes is not None and not 0 <= gap_minutes < 1e6:
        raise ValueError(
            f"gap_minutes must be 0 or more, got {gap_minutes}. Leave it out for the true gaps."
        )
    associations, masks = (_read_file(folder / name) for name in (ASSOCIATIONS, MASKS))
    left_out: Counter[str] = Counter()
    videos: dict[str, list[_Video]] = defaultdict(list)
    for name, associated in associations.items():
        participant, start = _read_video_name(name, folder / ASSOCIATIONS)
        known = masks.get(name, {})
        if not isinstance(associated, dict) or not isinstance(known, dict):
            _refuse(
                "a video", "an object of associations or masks", associated, folder / ASSOCIATIONS
            )
        videos[participant].append(_read_video(name, start, associated, known, left_out, folder))
    unknown = sorted(set(participants) - set(videos))
    if unknown or not videos:
        raise ValueError(
            f"participants must be among {', '.join(sorted(videos)) or 'none'}, got "
            f"{shorten(', '.join(unknown)) if unknown else 'no video'} in {folder}. Name others."
        )
    chosen = sorted(participants or videos)
    traces = [
        _make_trace(who, sorted(videos[who], key=lambda video: video.start), gap_minutes)
        for who in chosen
    ]
    empty = [trace.name for trace in traces if not trace.events]
    if empty:
        raise ValueError(
            f"participants must have things at fixtures, got none for {', '.join(empty)} in "
            f"{folder}. Name others."
        )
    return ReadKitchens(traces, dict(left_out))


def _refuse(noun: str, rule: str, found: object, path: Path) -> NoReturn:
    raise ValueError(
        f"{noun} must be {rule}, got {shorten(found)} in {path}. Take the file as it was published."
    )


def _read_file(path: Path) -> dict[str, Any]:
    try:
        data = read_json(path)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path.name} must be a JSON file of HD-EPIC, got {type(error).__name__}: "
            f"{shorten(str(error))} for {path}. Check the folder."
        ) from None
    if not isinstance(data, dict):
        _refuse(path.name, "an object of videos", data, path)
    return data


def _read_video_name(name: str, path: Path) -> tuple[str, datetime]:
    """Return participant, and date and time, of a name such as `P01-20240202-110250`."""
    found = _VIDEO.fullmatch(name)
    try:
        if found:
            return found[1], datetime.strptime(found[2], "%Y%m%d-%H%M%S")
    except ValueError:
        pass
    return _refuse("video", "PARTICIPANT-YYYYMMDD-HHMMSS", name, path)


def _read_video(
    name: str,
    start: datetime,
    associations: Mapping[str, Any],
    masks: Mapping[str, Any],
    left_out: Counter[str],
    folder: Path,
) -> _Video:
    things: dict[str, list[list[_Move]]] = defaultdict(list)
    length = 0.0
    for association in associations.values():
        if not (isinstance(association, dict) and isinstance(association.get("tracks"), list)):
            _refuse(
                "association", "an object with name and tracks", association, folder / ASSOCIATIONS
            )
        if not isinstance(association.get("name"), str):
            _refuse("name", "a text", association.get("name"), folder / ASSOCIATIONS)
        moves = [_read_track(track, masks, left_out, folder) for track in association["tracks"]]
        found = sorted((move for move in moves if move is not None), key=lambda move: move.taken_s)
        length = max([length, *(move.put_s for move in found)])
        if any(move.taken_from or move.put_at for move in found):
            things[_read_thing(association["name"], folder)].append(found)
        else:
            left_out["things at no fixture"] += 1
    return _Video(name, start, dict(things), length)


def _read_thing(name: str, folder: Path) -> str:
    """Return the description of a thing: its name without the number of an annotator."""
    plain = _NUMBER.sub("", name.replace("_", " ").strip()).lower() or name
    try:
        read_words("name", plain)
    except ValueError:
        _refuse("name", "words", name, folder / ASSOCIATIONS)
    return plain


def _read_track(
    track: Any, masks: Mapping[str, Any], left_out: Counter[str], folder: Path
) -> _Move | None:
    """Read a move; None, with the reason noted, where its masks are not known."""
    segment = track.get("time_segment") if isinstance(track, dict) else None
    is_pair = isinstance(segment, list) and len(segment) == 2 and all(map(is_number, segment))
    if not is_pair or segment is None or not 0 <= segment[0] <= segment[1]:
        _refuse("time_segment", "two times in seconds, in order", segment, folder / ASSOCIATIONS)
    taken_s, put_s = map(float, segment)
    names = track.get("masks")
    if not isinstance(names, list):
        _refuse("masks", "a list of names", names, folder / ASSOCIATIONS)
    found = [masks[name] for name in names if isinstance(name, str) and name in masks]
    if not found:
        left_out["moves without masks"] += 1
        return None
    for mask in found:
        if not isinstance(mask, dict) or not is_number(mask.get("frame_number", 0)):
            _refuse("mask", "an object with a frame_number", mask, folder / MASKS)
    ordered = sorted(found, key=lambda mask: float(mask.get("frame_number", 0)))
    first, last = ordered[0], ordered[-1]
    if len(ordered) == 1:  # it was seen taken or put: whichever end is nearer
        seen_s = float(first.get("frame_number", 0)) / _FRAMES
        fixture = _read_fixture(first, folder)
        if abs(seen_s - taken_s) <= abs(seen_s - put_s):
            return _Move(taken_s, put_s, fixture, "")
        return _Move(taken_s, put_s, "", fixture)
    return _Move(taken_s, put_s, _read_fixture(first, folder), _read_fixture(last, folder))


def _read_fixture(mask: Mapping[str, Any], folder: Path) -> str:
    fixture = mask.get("fixture")
    if fixture is None:
        return ""
    if not isinstance(fixture, str):
        _refuse("fixture", "a name or null", fixture, folder / MASKS)
    return "" if fixture.strip().lower() in _NONE else fixture.strip()


def _make_trace(participant: str, videos: Sequence[_Video], gap_minutes: float | None) -> Trace:
    """Return the kitchen of a participant, whose videos are in the order of time."""
    fixtures = sorted(
        {
            fixture
            for video in videos
            for _, _, moves in _name_things(video)
            for _, _, fixture in _list_places(moves)
        }
        - {""}
    )
    layout = _make_layout(participant, fixtures)
    number = {fixture: position for position, fixture in enumerate(fixtures)}
    usual = HomeBuilder()
    relations = [
        RELATIONS.index(
            usual.get_relation(node.label) or ("in" if node.label in _INSIDE else USUAL_RELATION)
        )
        for node in layout.furniture.values()
    ]
    first_day = datetime.combine(videos[0].start, time())
    events: list[tuple[float, int, Event]] = []
    place_of: dict[str, int] = {}
    offset = until = 0.0
    for video in videos:
        if gap_minutes is None:
            offset = (video.start - first_day) / timedelta(seconds=1)
        for name, object_name, thing in _name_things(video):
            for when, order, fixture in _list_places(thing):
                place = number.get(fixture, GONE)
                before = place_of.get(object_name, GONE)
                if place == before:
                    continue
                place_of[object_name] = place
                relation = relations[before if place == GONE else place]
                event = Event(offset + when, object_name, name, place, relation)
                events.append((event.time_s, order, event))
        until = offset + video.length_s
        if gap_minutes is not None:
            offset = until + 60 * gap_minutes
    ordered = tuple(event for *_, event in sorted(events, key=lambda entry: entry[:2]))
    start = first_day if gap_minutes is None else None
    return Trace(participant, layout, ordered, start=start, until_s=until)


def _name_things(video: _Video) -> Iterator[tuple[str, str, Sequence[_Move]]]:
    """Yield description, name and moves of every thing; those of one name are numbered."""
    for name, several in video.things.items():
        for number, moves in enumerate(several, start=1):
            yield name, name if number == 1 else f"{name} {number}", moves


def _list_places(moves: Sequence[_Move]) -> Iterator[tuple[float, int, str]]:
    """Yield when a thing is at which fixture, "" for nowhere: taken, carried, put down."""
    if moves[0].taken_from:
        yield 0.0, _PUT, moves[0].taken_from
    for move in moves:
        yield move.taken_s, _TAKEN, ""
        yield move.put_s, _PUT, move.put_at


def _make_layout(participant: str, fixtures: Sequence[str]) -> Layout:
    """Return one room with a furniture node for each fixture, such as `P01_cupboard.009`."""
    nodes, taken = [], set[str]()
    for fixture in fixtures:
        words = fixture.removeprefix(f"{participant}_").replace("_", " ")
        label, _, number = words.partition(".")
        label = _NUMBER.sub("", label) or label
        name = f"{label} {int(number)}" if number.isdecimal() else words.replace(".", " ")
        while name in taken:
            name = f"{name} again"
        taken.add(name)
        nodes.append(Furniture(read_words("fixture", label), 0, name, name))
    return Layout.of([Room(_ROOM, _ROOM)], nodes)
