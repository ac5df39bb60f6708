"""A memory at any step of the past, from its events; without any, as it is now."""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from threading import RLock

from sgm.memory.clock import Clock
from sgm.memory.memory_event import MemoryEvent
from sgm.memory.replayer import Replayer
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.thing import ThingName
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import MAX_TIME
from sgm.store.event_kinds import get_by_kind
from simulator.drawing.floor_plan import FloorPlan
from simulator.story.past_things import PastThings
from simulator.story.story import PastLook, PastQuestion, PastStatement, Story, TruePlaces

_KEEP_EVERY = 64  # lines between memories that are kept, to go on from
_EDGES_KEPT = 1_000_000  # of all memories that are kept, a hundred bytes each
_FEWEST_KEPT, _MOST_KEPT = 8, 512  # memories
# What a story makes of an event of a kind: a look, or what it tells of a thing or of furniture.
# The rest is in the memory of a later step alone, or left out.
_LOOK, _TOLD, _TOLD_OF_PLACE, _KNOWN, _LEFT_OUT = "look", "told", "told of a place", "known", ""
PARTS: Mapping[str, str] = {
    **dict.fromkeys(("look", "absent"), _LOOK),
    **dict.fromkeys(("moved", "picked_up", "put_down"), _TOLD),
    **dict.fromkeys(("rename", "merge", "split", "split_off", "remove_object"), _TOLD),
    **dict.fromkeys(("name", "merge_furniture"), _TOLD_OF_PLACE),
    "remove_furniture": _TOLD_OF_PLACE,  # where it is known who said so
    **dict.fromkeys(("start", "configure", "step", "transform"), _KNOWN),
    **dict.fromkeys(("room", "rename_room", "remove_room", "furniture", "move"), _KNOWN),
    "query": _LEFT_OUT,
}


Player = Replayer[SceneGraphMemory]


class PastMemory(Story):
    """What happened to a memory, from the first of its events on."""

    first_step = 0

    def __init__(
        self,
        lines: Sequence[MemoryEvent],
        title: str,
        *,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        truth: TruePlaces | None = None,
        questions: Sequence[PastQuestion] = (),
        plan: FloorPlan | None = None,
    ) -> None:
        """Take over the events of a file.

        Args:
            lines: of `read_events`, or as a memory would write them.
            title: of the home.
            prior: of the memory; None for the household prior.
            clock: of step 0; None for that of the file.
            truth: where everything was.
            questions: what was asked.
            plan: of the home.

        Raises:
            ValueError: if a line names a room or furniture that there is not, or they go on
                for longer than a memory can.
        """
        self.title = title
        self.truth = truth
        self.questions = tuple(questions)
        self.plan = plan
        self._prior = prior
        clocks = [line.values["clock"] for line in lines if "clock" in line.values]
        self.clock = clock or next(filter(None, clocks), None)
        # Every line says when it was: those that only let time pass are needed for the end alone.
        timed = list(_follow_time(lines))
        self.num_steps = timed[-1].time if timed else 0
        self._lines = [line for line in timed if line.kind != "step"]
        self._times = [line.time for line in self._lines]
        if self.num_steps > MAX_TIME:
            raise ValueError(
                f"events must end by time step {MAX_TIME}, got {self.num_steps}. Use a "
                "copy of the file."
            )
        if self.clock is not None:
            self.clock.get_time(self.num_steps)  # raises where it cannot go on for so long
        self._lock = RLock()
        # By the number of lines that were played and the step until which time then passed: the
        # work and what is kept follow the lines, however many steps lie between them.
        self._memories: OrderedDict[tuple[int, int], Player] = OrderedDict()
        self.things = PastThings()
        looks: list[PastLook] = []
        self.statements = tuple(self._follow(looks, self.things))
        self.looks = tuple(looks)

    def memory_at(self, step: int) -> SceneGraphMemory:
        """Return the memory after all looks of a step; it is to be read, not changed.

        Raises:
            ValueError: if there is no such step.
        """
        if not 0 <= step <= self.num_steps:
            raise ValueError(
                f"step must lie in 0 to {self.num_steps}, got {step}. Choose one of these."
            )
        key = bisect_right(self._times, step), step
        with self._lock:
            if key not in self._memories:
                earlier = [
                    kept for kept in self._memories if kept[0] <= key[0] and kept[1] <= key[1]
                ]
                begin = max(earlier, default=(0, 0))
                player = _copy(self._memories[begin]) if earlier else self._make_player()
                first = begin[0]
                for stop in range(first - first % _KEEP_EVERY + _KEEP_EVERY, key[0], _KEEP_EVERY):
                    self._play(player, first, stop)
                    self._keep((stop, player.memory.time), _copy(player))
                    first = stop
                self._play(player, first, key[0])
                _go_to(player.memory, step)
                self._keep(key, player)
            self._memories.move_to_end(key)
            return self._memories[key].memory

    def _make_player(self) -> Player:
        memory = SceneGraphMemory(self._prior, self.clock)
        return Replayer(memory, self._prior, self.clock, gives_new_ids=True)

    def _play(self, player: Player, first: int, end: int) -> None:
        """Apply the lines from number `first` to before `end`, each at its time."""
        for line in self._lines[first:end]:
            _go_to(player.memory, line.time)
            player.apply(line)
            _go_to(player.memory, line.time)  # what was started again may begin earlier

    def _keep(self, key: tuple[int, int], player: Player) -> None:
        self._memories[key] = player
        num_edges = max(player.memory.batch.edges.num_rows, 1)
        most = min(max(_EDGES_KEPT // num_edges, _FEWEST_KEPT), _MOST_KEPT)
        while len(self._memories) > most:
            self._memories.popitem(last=False)

    def _follow(self, looks: list[PastLook], things: PastThings) -> Iterator[PastStatement]:
        """Yield all statements with the ids of the replayed memory; looks and names are noted."""
        player = self._make_player()
        for line in self._lines:
            values, part = line.values, get_by_kind(PARTS, line.kind, __name__)
            if part == _LOOK and values["furniture"] in player.furniture:
                furniture = player.furniture[values["furniture"]]
                is_look = line.kind == "look"
                seen = tuple(sighting[0] for sighting in values["seen"]) if is_look else ()
                missed = None
                if self.truth is not None and line.time <= self.truth.num_steps:
                    unseen = self.truth.list_there(line.time, furniture)
                    for text in seen:
                        if text in unseen:
                            unseen.remove(text)
                    missed = tuple(unseen)
                sought = None if is_look else values["description"]
                things.note_look(line.time, furniture, values["seen"] if is_look else ())
                looks.append(
                    PastLook(
                        line.time,
                        furniture,
                        seen,
                        missed,
                        sought,
                        values["coverage"],
                        values.get("viewpoint"),
                    )
                )
            elif part != _LEFT_OUT:
                said = _read_statement(line, player, len(looks))
                if part != _TOLD:  # a look at no furniture is an error
                    player.apply(line)
                if said is not None:
                    name = ThingName.from_json(values) if said.thing else None
                    things.note_statement(line.time, name)
                    yield said
                things.note_change(line, player.furniture)


def _read_statement(line: MemoryEvent, player: Player, num_looks: int) -> PastStatement | None:
    """Return what a line says that was said or done; None of another line."""
    values = line.values
    has_text = PARTS[line.kind] in (_TOLD, _TOLD_OF_PLACE)
    if not has_text or (line.kind == "remove_furniture" and "by" not in values):
        return None
    furniture = _find_furniture(line, values.get("furniture"), player)
    merged, other = None, values.get("name", "")
    if line.kind == "merge":
        other = values["other"].description
    elif line.kind == "name":
        other = values["description"]
    elif line.kind == "merge_furniture":
        merged = _find_furniture(line, values["other"], player)
        other = "" if merged is None else player.memory.describe(merged)
    return PastStatement(
        step=line.time,
        kind=line.kind,
        thing="" if line.kind == "name" else values.get("description", ""),
        by=values.get("by", ""),
        furniture=furniture,
        place="" if furniture is None else player.memory.describe(furniture),
        other=other,
        num_looks=num_looks,
        merged=merged,
    )


def _find_furniture(line: MemoryEvent, number: int | None, player: Player) -> int | None:
    """Return the id in the replayed memory of furniture that a line names."""
    if number is not None and number not in player.furniture:
        raise ValueError(
            f"every {line.kind} of a memory must be of what was added, got furniture {number} at "
            f"time step {line.time}. Use a copy of the file."
        )
    return None if number is None else player.furniture[number]


def _copy(player: Player) -> Player:
    """Return one that goes on alone."""
    return player.copy_to(player.memory.copy())


def _go_to(memory: SceneGraphMemory, step: int) -> None:
    """Let time pass; an event may be of many steps."""
    memory.step(step - memory.time, accept_jump=True)


def _follow_time(lines: Sequence[MemoryEvent]) -> Iterator[MemoryEvent]:
    """Yield the lines with steps that never go back: a new memory begins where the old one ended.

    With clocks, it begins when its clock says.
    """
    shift, last = 0, 0
    first_clock: Clock | None = None
    for line in lines:
        if line.kind == "start":
            clock = line.values["clock"]
            first_clock = first_clock or clock
            if clock is not None and first_clock is not None:
                seconds = (clock.start - first_clock.start).total_seconds()
                steps = seconds / first_clock.step_seconds
                shift = round(min(max(steps, -MAX_TIME), MAX_TIME + 1))
                shift = max(shift, 0)  # the memory knows what time it is
            if line.time + shift < last:
                shift = last + 1 - line.time
        last = max(last, line.time + shift)
        yield replace(line, time=last)


class StillMemory(Story):
    """One memory as it is; of the past it tells the last sighting of each object at each place."""

    def __init__(self, memory: SceneGraphMemory, title: str) -> None:
        """Take the memory of a home, which is not changed any more."""
        self.title = title
        self.clock = memory.clock
        self.first_step = self.num_steps = memory.time
        self.looks = _list_last_sightings(memory)
        self.things = PastThings()
        for look in self.looks:
            self.things.note_look(look.step, look.furniture, [(name,) for name in look.seen])
        self.statements = tuple(self._list_statements(memory))
        self._memory = memory

    def memory_at(self, step: int) -> SceneGraphMemory:
        """Return the memory.

        Raises:
            ValueError: if another step is asked for than its own.
        """
        if step != self.num_steps:
            raise ValueError(
                f"step must be {self.num_steps}, got {step}: this memory knows no other. Log looks "
                'with SceneGraphMemory(path="home.sgm") to look back.'
            )
        return self._memory

    def _list_statements(self, memory: SceneGraphMemory) -> Iterator[PastStatement]:
        """Yield what was said of things, each after the looks of its time step."""
        times = [look.step for look in self.looks]
        for thing, said in memory.list_statements():
            # Looks of a memory file know things by their words alone.
            self.things.note_statement(said.time, ThingName(thing.description))
            place = "" if said.furniture is None else memory.describe(said.furniture)
            yield PastStatement(
                said.time,
                said.kind,
                thing.description,
                said.by,
                said.furniture,
                place,
                num_looks=bisect_right(times, said.time),
            )


def _list_last_sightings(memory: SceneGraphMemory) -> tuple[PastLook, ...]:
    """List what was last seen at each place, and the last look at it if that was later."""
    found: dict[tuple[int, int], list[str]] = {}
    for room in memory.to_dict()["rooms"]:
        for furniture in room["furniture"]:
            if furniture["last_looked"] is not None:
                found.setdefault((furniture["last_looked"], furniture["id"]), [])
            for thing in furniture["objects"]:
                if "by" in thing:  # it was said, not seen
                    continue
                key = (thing["last_seen"], furniture["id"])
                found.setdefault(key, []).append(thing["description"])
    return tuple(
        PastLook(step, furniture, tuple(seen)) for (step, furniture), seen in sorted(found.items())
    )
