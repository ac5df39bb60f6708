"""Where a thing is, as an answer that is short enough for an agent."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

from sgm.finder.answers import MOST_BYTES, LastSeen, Moment, PlaceFound, WhereIs, write_json
from sgm.finder.finder import Finder
from sgm.finder.meanings import MOST_CANDIDATES, doubt
from sgm.finder.ranking import Place, Ranking
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import SeenAt
from sgm.messages import shorten_text

DEFAULT_PLACES = 3
_MOST_WHY = 80  # characters of the evidence of a place


def tell_where(
    memory: SceneGraphMemory,
    finder: Finder,
    thing: str,
    at: datetime | int | None = None,
    k: int | None = None,
) -> WhereIs:
    """Say where a thing may be; `MemoryService.where_is` says what the arguments are."""
    ranking = finder.rank(memory, thing, k or DEFAULT_PLACES, at=at)
    resolution, now, clock = ranking.resolution, memory.time, memory.clock
    unclear = doubt(resolution)
    seen, asked = _choose_last_seen(ranking), now
    if isinstance(at, datetime) and clock is not None:
        asked = int((at - clock.start).total_seconds() // clock.step_seconds)
    elif isinstance(at, int):
        asked = at
    answer = WhereIs(
        status="ok" if unclear is None else unclear.status,
        thing=ranking.description,
        taken_for=resolution.matches[:MOST_CANDIDATES],
        places=tuple(
            PlaceFound(
                place=place.furniture,
                name=place.name,
                relation=place.relation,
                probability=place.probability,
                why=shorten_text(_tell_why(place), _MOST_WHY),
            )
            for place in ranking
        ),
        left_out=0,
        elsewhere=ranking.elsewhere,
        with_robot=ranking.with_robot,
        last_seen=None
        if seen is None
        else LastSeen(
            place=seen.furniture,
            name=tell_name(memory, seen.furniture),
            is_there=seen.is_there,
            by=seen.by,
            at=Moment.tell(seen.time, now, clock),
        ),
        at=Moment.tell(asked, now, clock),
        ask="" if unclear is None else unclear.ask,
        candidates=() if unclear is None else unclear.candidates,
    )
    return answer if k is not None else _fit(answer)


def tell_name(memory: SceneGraphMemory, place: int | None) -> str:
    """Return the name of a place; empty if it was removed."""
    try:
        return "" if place is None else memory.describe(place)
    except KeyError:
        return ""


def _choose_last_seen(ranking: Ranking) -> SeenAt | None:
    """Return the latest sighting; of those of one time step one where the thing still is."""
    last = ranking.last_seen
    if last is None or last.is_there:
        return last
    own = (place.last_seen for place in ranking)
    still = (one for one in own if one is not None and one.is_there and one.time == last.time)
    return next(still, last)


def _tell_why(place: Place) -> str:
    """Say the evidence; where the thing was seen itself, other things and the prior say little."""
    evidence = place.evidence
    if evidence.seen is not None:
        evidence = replace(evidence, similar=(), prior=0.0)
    return str(evidence)


def _fit(answer: WhereIs) -> WhereIs:
    """Leave places out, then shorten names, until an answer is short enough."""
    sizes = [len(write_json(place)) + 1 for place in answer.places]  # with a comma, but for one
    left = MOST_BYTES - len(write_json(replace(answer, places=()))) + 1
    kept = len(sizes)
    while kept > 1 and sum(sizes[:kept]) > left:
        kept -= 1
    num_left_out = answer.left_out + len(sizes) - kept
    whole = answer = replace(answer, places=answer.places[:kept], left_out=num_left_out)
    if sum(sizes[:kept]) <= left:
        return answer
    for most in (60, 40, 20, 10, 5, 1):  # names may have hundreds of letters
        if len(write_json(answer)) <= MOST_BYTES:
            break
        answer = _shorten_names(whole, most)
    return answer


def _shorten_names(answer: WhereIs, most: int) -> WhereIs:
    def cut(text: str) -> str:
        return text if len(text) <= most else f"{text[:most]}..."

    seen = answer.last_seen
    return replace(
        answer,
        thing=cut(answer.thing),
        taken_for=tuple(map(cut, answer.taken_for)),
        places=tuple(
            replace(place, name=cut(place.name), why=cut(place.why)) for place in answer.places
        ),
        last_seen=None if seen is None else replace(seen, name=cut(seen.name)),
        ask=cut(answer.ask),
        candidates=tuple(map(cut, answer.candidates)),
    )
