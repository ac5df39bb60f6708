"""The memory of one home, for use with or without the simulator."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from threading import Lock, RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.layout.box import Box
from sgm.layout.furniture import Furniture, read_position
from sgm.layout.layout import Layout, read_map_id
from sgm.layout.viewpoint import Viewpoint, read_viewpoint
from sgm.memory.asking import Asked, Scorer
from sgm.memory.clock import Clock
from sgm.memory.corrections import MemoryCorrections
from sgm.memory.coverage import read_coverage, read_share
from sgm.memory.frame_watch import FrameWatch
from sgm.memory.home_view import list_home, list_rows
from sgm.memory.identity import read_embedding
from sgm.memory.look_log import LookLog
from sgm.memory.look_weights import SURE
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_state import MemoryState
from sgm.memory.queries import Queries
from sgm.memory.questions import ask
from sgm.memory.save_lock import SaveLock
from sgm.memory.score_calibration import ScoreCalibration, calibrate
from sgm.memory.sighting import SeenAt, Sighting, read_hidden, read_sightings
from sgm.memory.spark_graph import make_spark_graph
from sgm.memory.storage import load_content, save_content
from sgm.memory.thing_changes import (
    ThingChange,
    ThingEvent,
    list_changes,
    list_events,
    read_since,
)
from sgm.memory.time_steps import MAX_TIME, check_jump, count_steps
from sgm.messages import shorten
from sgm.names.aliases import Aliases, AliasTable
from sgm.names.name_encoder import Encode, NameEncoder
from sgm.names.names import NameIndex, Resolution, Similarity
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph, find_shipped

if TYPE_CHECKING:  # pandas is an extra
    from pandas import DataFrame


class SceneGraphMemory(MemoryCorrections):
    """One graph that holds everything ever observed in a home.

    Object nodes are distinguished by the words of their description, and one description may be
    seen at several places at once: one node then has several true edges. Looking at furniture
    updates every remembered edge of it: seen -> true, not seen -> false. Rooms, furniture and
    objects may be added and removed at any time; ids of rooms and furniture never change and are
    never given twice.

    Names are compared as `read_words` says: case, spaces and "_" make no difference. Words that
    the prior does not know are welcome: an object without a prior may be at all furniture.

    Threads may share a memory: every call is made whole, one after the other, and a call that
    raises changes nothing. What a call returns is the caller's own, but for `batch` and `query`.

    Example:
        >>> memory = SceneGraphMemory()
        >>> kitchen = memory.add_room("kitchen")
        >>> fridge = memory.add_furniture("fridge", room=kitchen, description="white fridge")
        >>> memory.observe(fridge, seen=[Sighting("milk", relation="in")])
        >>> memory.step(3)
        >>> memory.last_seen("milk").steps_ago
        3

    Source: paper section 4.2, appendix B; docs/design.md, rulings 12 and 13.
    """

    def __init__(
        self,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        log: str | Path | None = None,
        aliases: Aliases | None = None,
        encoder: Encode | None = None,
        score_calibration: ScoreCalibration | None = None,
        map_id: str = "",
    ) -> None:
        """Start with an empty home.

        Args:
            prior: where things tend to be; None for `PriorGraph.household()`, which knows some 800
                things of homes that people live in (docs/priors.md).
            clock: what time it is now, and how long a step is, for networks that were trained with
                `features.clock`; the shipped one reads none.
            log: file to which every look and every change is appended, such as "looks.jsonl", from
                which `python -m simulator.trace from-log` makes a trace; None for no log. Asking
                writes nothing.
            aliases: what things are called besides, and what they are kinds of, added to the
                shipped table (`AliasTable`): a CSV file with columns name, kind and aliases, or a
                mapping such as {"thermos": ["vacuum flask"], "beagle": {"kind": "dog"}}.
            encoder: a function from a list of names to their vectors, for names that are not in
                the table; None for the text vectors of the policy, where it has some.
            score_calibration: what the confidences of sightings mean as probabilities, where they
                are scores of a detector; it is saved with the memory. None if they are
                probabilities.
            map_id: of the map that positions and boxes of furniture are in, such as its checksum.

        Raises:
            TypeError: if the prior, the clock, the aliases, the encoder or the calibration is
                something else.
            ValueError: if the aliases or the map id are malformed, the log is another file, or
                another process writes it. In one process the latest memory that opened a log has
                it, and changes of earlier ones raise this.
            FileNotFoundError: if there is no file of aliases.
            OSError: if the log cannot be written, here or with any later change; a change that
                could not be written was not made.
        """
        for name, value, kind in (
            ("prior", prior, PriorGraph),
            ("clock", clock, Clock),
            ("score_calibration", score_calibration, ScoreCalibration),
        ):
            if value is not None and not isinstance(value, kind):
                raise TypeError(
                    f"{name} must be a {kind.__name__}, got {shorten(value)}. Leave it out for the "
                    "default."
                )
        self._lock = RLock()  # held by every call while it reads or changes the state
        self._save_lock: SaveLock | None = None  # of the file saved last, as long as this lives
        self._saving = Lock()  # these two are never waited for while the first one is held
        self._naming = Lock()
        self._aliases, self._own_encode = aliases, encoder  # for copies
        self._table = AliasTable.household(aliases)
        self._encoder = None if encoder is None else NameEncoder(encoder, self._table)
        self._frames = FrameWatch()
        self._log: LookLog | None = None
        self._begin(prior if prior is not None else PriorGraph.household(), clock)
        self._state.score_calibration = score_calibration
        self._was_warned = False
        self._state.layout.map_id = read_map_id(map_id)
        self._start_log(log)

    @classmethod
    def load(
        cls,
        path: str | Path,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        log: str | Path | None = None,
        aliases: Aliases | None = None,
        encoder: Encode | None = None,
        score_calibration: ScoreCalibration | None = None,
        map_id: str = "",
    ) -> SceneGraphMemory:
        """Go on with a memory that was saved: every later answer is what it would have been.

        Args:
            path: written by `save`.
            prior: None for the one that the memory was saved with, which must then be one that
                ships. A prior that is given is taken, whether it is the same or not; another one
                changes what is said about places, and nothing of what was observed.
            clock: of step 0, for a memory that was saved without one, or to replace its own; None
                to keep what was saved.
            log: where changes from now on are written, as in the constructor; a file of the same
                home is gone on with.
            aliases: as in the constructor; they are not in the file.
            encoder: as in the constructor.
            score_calibration: of looks from now on; None for what was saved.
            map_id: of the map that the robot has now; a memory of another one is refused. Empty to
                go on with whatever the memory has, for `transform`.

        Raises:
            FileNotFoundError: if there is no such file; it is a `ValueError`, too.
            ValueError: if it was altered or cut short, comes from another version or map, or was
                saved with another prior than those that ship and none is given.
        """
        content = load_content(path)
        prior = prior if prior is not None else find_shipped(content.prior)
        if prior is None:
            raise ValueError(
                f"prior must be the one of the memory, {content.prior[:12]}..., got no shipped one "
                f"of that checksum for {path}. Give its own prior, or PriorGraph.default() to go "
                "on with that one."
            )
        own = content.layout.map_id
        if map_id and own and own != map_id:
            raise ValueError(
                f"memory must be of the map that the robot has, {shorten(map_id)}, got one of "
                f"{shorten(own)} for {path}. Load it without map_id, and say with transform how "
                "the map was moved, or start a new memory."
            )
        content.layout.map_id = read_map_id(map_id) or own
        memory = cls(prior, aliases=aliases, encoder=encoder, score_calibration=score_calibration)
        memory._state.set_content(content if clock is None else replace(content, clock=clock))
        if score_calibration is not None:
            memory._state.score_calibration = score_calibration
        memory._start_log(log, goes_on=True)
        return memory

    def copy(self) -> SceneGraphMemory:
        """Return a memory of the same content that goes its own way; it writes no log."""
        with self._lock:
            content = self._state.get_content_to_save().copy()
        memory = type(self)(self._prior, aliases=self._aliases, encoder=self._own_encode)
        memory._state.set_content(content)
        memory._was_warned = self._was_warned
        return memory

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` goes on; it holds no code.

        Args:
            path: such as "home.sgm".

        Raises:
            ValueError: if a memory of another process saved the file, and still lives.
            OSError: if the folder does not exist, or the disk does not take the file; an older
                file is left as it was.
        """
        # Of two saves the later one lasts; no other call waits for the disk.
        with self._saving, SaveLock.hold(path) as lock:
            with self._lock:
                content = self._state.get_content_to_save().copy()
            save_content(path, content.to_json())
            self._save_lock = lock

    def save_and_rotate(self, path: str | Path, old_log: str | Path) -> None:
        """Write the memory to a file, and begin its log anew from there.

        No call of another thread comes between the two: what the file holds and the lines of the
        new log are the memory. A process that is killed meanwhile leaves the old log whole, and
        perhaps the new one (`sgm.memory.kept_home` reads both).

        Args:
            path: such as "home.sgm".
            old_log: name for the log so far, beside the log.

        Raises:
            ValueError: if the memory has no log, another one has it now, or a memory of another
                process saved the file, and still lives.
            OSError: if the disk does not take the new log or the file. Without the file, the new
                log alone is the memory.
        """
        with self._saving, SaveLock.hold(path) as lock:
            with self._lock:
                if self._log is None:
                    raise ValueError(
                        f"memory must have a log to begin anew, got none for {path}. Give log= "
                        "when it is made or loaded."
                    )
                content = self._state.get_content_to_save().copy()
                self._log.rotate(Path(old_log), content)
            save_content(path, content.to_json())
            self._save_lock = lock

    def sync_log(self) -> None:
        """Have the disk take all that is in the log, so that it survives a loss of power.

        What was changed before this call survives a kill of the process without it.

        Raises:
            OSError: if the disk does not take it.
        """
        if self._log is not None:
            self._log.sync()

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home, which policies read, in the order of `furniture_ids`.

        It takes over rooms and furniture that were added when it is read, all at once. It is the
        memory itself, which changes with it: beside a thread that observes, read `copy().batch`.
        """
        with self._lock:
            return self._state.batch

    @property
    def clock(self) -> Clock | None:
        """What time it is at every time step; None if it was not given."""
        with self._lock:
            return self._state.clock

    @property
    def time(self) -> int:
        """Steps since the start."""
        with self._lock:
            return self._state.time

    @property
    def layout(self) -> Layout:
        """Rooms and furniture by id, as they are now; the methods below change the memory's own."""
        with self._lock:
            return self._state.layout.copy()

    @property
    def map_id(self) -> str:
        """Id of the map that positions and boxes are in; empty if none was given."""
        with self._lock:
            return self._state.layout.map_id

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        with self._lock:
            return len(self._state.layout.furniture)

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of `batch`, (F,)."""
        with self._lock:
            return self._state.furniture_ids

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of all objects seen or asked for, in the order of `batch`, (O,)."""
        with self._lock:
            return self._state.descriptions

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id.

        Raises:
            ValueError: if the label is no name (`read_words`).
        """
        read_words("room label", label)
        with self._lock:
            layout = self._state.layout
            self._write("room", room=layout.num_rooms_ever, label=label)
            room = layout.add_room(label)
            self._state.note_new(label)
        return room

    def add_furniture(
        self,
        label: str,
        room: int,
        description: str | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
        open_cost: float | None = None,
    ) -> int:
        """Add a furniture node and return its id.

        Args:
            label: what it is, such as "fridge".
            room: id from `add_room`.
            description: for people, such as "white fridge"; the label if left out.
            position: where one stands to look at it, in metres; with positions of all furniture,
                searches and plans need no `distance`. With a box it may be left out: it is then
                found in front of the box.
            box: its extents in the map (`sgm.eyes.Box`), from which a camera's frames become looks.
                A floor is furniture, too: label "floor", `Box.of_floor`.
            open_cost: of opening it, in the unit of distances, for searches; None where there is
                nothing to open.

        Raises:
            KeyError: if `room` is not a room of this memory.
            TypeError: if the box is none.
            ValueError: if the label or the description is no name (`read_words`), the position no
                two numbers, or the cost no number, 0 or more.
        """
        with self._lock:
            layout = self._state.layout
            node = layout.make_furniture(label, room, description, position, box, open_cost)
            self._write(
                "furniture", furniture=layout.num_furniture_ever, label=label, room=node.room,
                description=node.description, position=node.position, **_list_extents(node),
            )  # fmt: skip
            furniture = layout.add_furniture(node)
            self._state.note_new(label)
        return furniture

    def move_furniture(
        self,
        furniture: int,
        room: int | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
    ) -> None:
        """Note that a furniture node was moved; what was seen there moves with it.

        Args:
            furniture: id from `add_furniture`.
            room: where it stands now; None for the same room.
            position: as in `add_furniture`; None if it is as it was, or, in another room or box,
                unknown.
            box: where it stands now; None if it is as it was, or, in another room, unknown.

        Raises:
            KeyError: if there is no such furniture node or room.
            TypeError: if the box is none.
            ValueError: if the position is no two numbers.
        """
        with self._lock:
            layout = self._state.layout
            node = layout.make_moved(furniture, room, position, box)
            about: dict[str, Any] = {} if node.box is None else {"box": node.box.to_json()}
            self._write(
                "move", furniture=furniture, room=node.room, position=node.position, **about
            )
            layout.furniture[furniture] = node
            self._state.note_new()

    def transform(
        self,
        angle: float = 0.0,
        shift: tuple[float, float] = (0.0, 0.0),
        map_id: str = "",
    ) -> None:
        """Move all positions and boxes into the frame of another map; nothing else changes.

        Args:
            angle: by which the home is turned around the origin of the old map, counter-clockwise,
                in radians.
            shift: by which it is moved then, x and y in metres.
            map_id: of the new map; empty if it has none.

        Raises:
            ValueError: if an argument is out of range, or a box would lie where no home is.
        """
        turn = float(read_numbers("angle", angle, ()))
        by = read_position(shift)
        if by is None:
            raise ValueError("shift must be two numbers, got None. Give metres, or leave it out.")
        with self._lock:
            layout = self._state.layout.transform(turn, by, read_map_id(map_id))
            self._write("transform", angle=turn, shift=by, map_id=map_id)
            self._state.layout = layout
            self._state.note_new()

    def get_position(self, furniture: int) -> tuple[float, float] | None:
        """Return where one stands to look at a furniture node; None if it is unknown.

        As it was given; where it was not, a point before the front of its box, outside all others.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        with self._lock:
            self._state.layout.check_furniture(furniture)
            position = self._state.layout.furniture[furniture].position
            return position or self._state.layout.compute_positions()[furniture]

    @property
    def boxes(self) -> dict[int, Box]:
        """Boxes of the furniture that has one, by id, for `sgm.eyes.LookBuilder`."""
        with self._lock:
            return self._state.layout.boxes

    def list_furniture(self, room: int) -> tuple[int, ...]:
        """Return the ids of the furniture of a room, to leave out a closed one, for example.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        with self._lock:
            self._state.layout.check_room(room)
            furniture = self._state.layout.furniture.items()
            return tuple(number for number, node in furniture if node.room == room)

    def remove_room(self, room: int) -> None:
        """Remove a room with all its furniture and what is remembered of it; objects stay.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        with self._lock:
            self._state.layout.check_room(room)
            self._write("remove_room", room=room)
            self._state.remove(rooms=[room])

    def remove_furniture(self, furniture: int) -> None:
        """Remove a furniture node and all its edges; the objects that were seen there stay.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._remove_furniture(furniture)

    def remove_object(self, description: str) -> None:
        """Forget an object with all its edges, as if it had never been seen or asked for.

        Raises:
            KeyError: if this memory has no object of that description.
            ValueError: if the description is no name (`read_words`).
        """
        self._remove_object(description)

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node, "white fridge in kitchen".

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        with self._lock:
            return self._state.layout.describe(furniture)

    def observe(
        self,
        furniture: int,
        seen: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
        hidden: Sequence[str] = (),
        viewpoint: Viewpoint | None = None,
    ) -> None:
        """Fold one look at a furniture node into the memory.

        Every remembered edge of `furniture` is updated: seen ones become true, the others false.
        What was not in view is not counted as absent: the parts of looks that do not show an object
        are added up until they make most of a look (`MemoryBatch`).
        A look at another furniture node leaves them alone: an object that was seen at two places
        is believed at both until one of them is looked at again.

        Args:
            furniture: id from `add_furniture`.
            seen: what was detected there; detection may have missed objects. Sightings of the
                same description are several things of a kind.
            coverage: share of the furniture that was in view, above 0 and at most 1; the detector
                may have missed what was in view. Or shares of what is "in" and "onTop" of it, 0
                for one that was not in view: {"in": 0, "onTop": 0.8} of a fridge that is shut.
            hidden: descriptions of things whose own spots were out of view, behind something else:
                that they were not seen is not counted against them.
            viewpoint: from where the camera looked, for the log and the page that shows it; the
                memory does not use it.

        Looks must lie some time apart: a memory that seems to get every frame of a video
        warns once (`LookPerFrameWarning`), and counts ten looks at a place in a time step and those
        that show something new.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            TypeError: if `seen` holds something else than sightings, `hidden` is no list, or the
                viewpoint none.
            ValueError: if the coverage is out of range, or something hidden has no name.

        Source: paper section 4.2, appendix B. Differs: negative evidence is counted (released
        code does not).
        """
        place = self.describe(furniture)
        seen = read_sightings(seen, place)  # may take its time: others go on meanwhile
        share = read_coverage(coverage, place)
        names = read_hidden(hidden, place)
        from_where = read_viewpoint(viewpoint)
        furniture = int(furniture)  # of any kind of number
        rows = [one.to_row() for one in seen]
        with self._lock:
            self._state.layout.check_furniture(furniture)
            num_in_step = self._state.step.count_looks(furniture)
            self._frames.note(furniture, place, seen, num_in_step, self._state.clock)
            if self._state.score_calibration is not None:
                seen = calibrate(seen, self._state.score_calibration)
            else:
                self._warn_of_scores(seen)
            about: dict[str, Any] = {"hidden": names} if names else {}
            if from_where is not None:
                about["viewpoint"] = from_where.to_json()
            self._write("look", furniture=furniture, coverage=share, seen=rows, **about)
            self._state.look(furniture, seen, share, names)

    @property
    def score_calibration(self) -> ScoreCalibration | None:
        """What the confidences of sightings mean; None if they are probabilities."""
        with self._lock:
            return self._state.score_calibration

    def _warn_of_scores(self, seen: Sequence[Sighting]) -> None:
        """Say once that most scores of a look count as not seen."""
        num_doubted = sum(0 < one.confidence < SURE for one in seen)
        if self._was_warned or 2 * num_doubted <= len(seen):
            return
        self._was_warned = True
        warnings.warn(
            f"{num_doubted} of {len(seen)} confidences of a look are below {SURE}, so that these "
            "count as not seen: a confidence is the probability that a sighting is right. If they "
            "are scores of a detector, give SceneGraphMemory(score_calibration="
            "ScoreCalibration.open_vocabulary()), or one that was fitted.",
            stacklevel=3,
        )

    def note_absent(self, furniture: int, description: str, coverage: float = 1.0) -> None:
        """Note that a look for one thing did not find it, and say nothing of all others there.

        Args:
            furniture: id from `add_furniture`.
            description: what was looked for, seen before or not.
            coverage: share of the furniture that was in view.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if the description is no name, or the coverage out of range.
        """
        with self._lock:
            place = self._state.layout.describe(furniture)
            words = read_words("description", description)
            coverage = read_share("coverage", coverage, place)
            furniture = int(furniture)
            self._write("absent", furniture=furniture, description=words, coverage=coverage)
            self._state.note_absent(furniture, words, coverage)

    def step(self, num_steps: int = 1) -> None:
        """Let time pass.

        Args:
            num_steps: time steps, 0 or more. The shipped network was trained on homes where one
                object in twenty moves in a step.

        Raises:
            ValueError: if it is negative, no whole number, or time would exceed `MAX_TIME` or the
                dates that the clock can tell.
        """
        if not isinstance(num_steps, (int, np.integer)) or num_steps < 0:
            raise ValueError(
                f"num_steps must be a whole number, 0 or more, got {shorten(num_steps)}. Time only "
                "goes forward."
            )
        with self._lock:
            now, clock = self._state.time, self._state.clock
            if now + num_steps > MAX_TIME:
                raise ValueError(
                    f"time must be at most {MAX_TIME}, got {num_steps} steps at time {now}. "
                    "Choose a longer time step."
                )
            if clock is not None:
                clock.get_time(now + int(num_steps))
            if num_steps:
                self._write("step", now + int(num_steps), num_steps=int(num_steps))
                self._state.let_pass(int(num_steps))

    def step_to(self, time: datetime, *, accept_jump: bool = False) -> None:
        """Let time pass until a date and time: the last step that has begun by then.

        Time never goes back, so that a date that was wrong once would stay. More than `MAX_JUMP`
        at once is therefore believed only when it is said to be right.

        Args:
            time: local, not before the present step.
            accept_jump: whether the time is right, however far ahead.

        Raises:
            ValueError: if the memory has no clock, the time lies before the present step, or more
                than `MAX_JUMP` after it and is not accepted.
        """
        with self._lock:
            now, clock = self._state.time, self._state.clock
            num_steps = count_steps(time, now, clock)
            if clock is not None and not accept_jump:
                check_jump(num_steps, now, clock)
            self.step(num_steps)

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph.

        A place that is looked at meanwhile, and does not show it, is remembered as one where it
        was not. So this changes the memory, as `rank` and `ask` do not, and is logged.

        Args:
            description: what to look for, whether it was seen before or not.

        Returns:
            One query, for `Policy.scores(memory.batch, query)`, which gives (1, F).

        Raises:
            ValueError: if the description is no name (`read_words`), or there is no furniture yet.
        """
        read_words("description", description)
        with self._lock:
            self._check_furniture()
            self._write("query", description=description)
            return self._state.query(description)

    def rank(self, policy: Scorer, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first.

        Args:
            policy: who judges, for example `sgm.policies.heuristics.Bayesian()`.
            description: what to look for.

        Returns:
            (furniture id, score) for every furniture node; -inf where there is no opinion.
        """
        asked = self.ask([description], before_looks=False)
        scores = policy.scores(asked.batch, asked.queries)[0]
        order = np.argsort(-scores, kind="stable")
        return [(asked.furniture_ids[place], float(scores[place])) for place in order]

    def resolve(
        self,
        description: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which of the things that were seen a name means; `NameIndex` has the rules.

        Args:
            description: such as "the red mug".
            similarity: how alike labels are, where the memory has no encoder; None to go by words
                alone.
            among: names to choose from, such as those of one look; None for all that were seen.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        if among is not None:
            index = NameIndex((), self._table, self._encoder)
            index.update(list(among))
            return index.resolve(description, similarity)
        with self._lock:
            descriptions = self._state.names
            if self._state.has_id(description):
                return Resolution(description, (description,), "exact")
        with self._naming:  # no other call waits for text vectors
            self._names.update(descriptions)
            return self._names.resolve(description, similarity)

    def find_nearest(self, embedding: Sequence[float], k: int = 3) -> list[tuple[str, float]]:
        """Return the things that look most like something, by the embeddings of their sightings.

        Args:
            embedding: of what is seen, (D,), of the same maker as those of the sightings.
            k: most things to return.

        Returns:
            Ids, or descriptions of things without one, and cosines, the nearest first.

        Raises:
            ValueError: if the embedding is no vector, or `k` is below 1.
        """
        vector = np.array(read_embedding(embedding))
        if not len(vector) or not isinstance(k, (int, np.integer)) or k < 1:
            raise ValueError(
                f"embedding and k must be a vector and at least 1, got {shorten(embedding)} and "
                f"{shorten(k)}. Give what the sightings had."
            )
        with self._lock:
            things = [one for one in self._state.things if len(one.embedding) == len(vector)]
        own = np.array([one.embedding for one in things]).reshape(-1, len(vector))
        cosines = own @ vector / (np.linalg.norm(own, axis=1) * np.linalg.norm(vector))
        order = np.argsort(-cosines, kind="stable")[:k]
        return [(things[n].id or things[n].description, float(cosines[n])) for n in order]

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge".

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        furniture = self.layout.furniture
        index = NameIndex((), self._table, self._encoder)
        index.update([node.description for node in furniture.values()])
        matches = set(index.resolve(name).matches)
        return tuple(number for number, node in furniture.items() if node.description in matches)

    def ask(
        self,
        descriptions: Sequence[str],
        before_looks: bool = True,
        at: datetime | int | None = None,
    ) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes.

        Args:
            descriptions: one or more, seen before or not; each means the object of that name.
            before_looks: whether policies are asked of the memory before the looks of this step,
                which then say for themselves what they say.
            at: when: a time step, or a date and time by the clock; not before the present step,
                None for it.

        Raises:
            ValueError: if a description is no name (`read_words`), there is no furniture yet, or
                the time has passed.
        """
        with self._lock:
            self._check_furniture()
            state = self._state
            later = 0 if at is None else count_steps(at, state.time, state.clock, "at")
            return ask(state, descriptions, before_looks, later)

    def places_of(self, description: str) -> list[SeenAt]:
        """Return every place where an object was ever seen, the latest sighting first.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        matches = self.resolve(description).matches
        with self._lock:
            rows = dict.fromkeys(row for match in matches for row in self._state.find_rows(match))
            found = [seen for row in rows for seen in self._state.list_places(row)]
        return sorted(found, key=lambda seen: -seen.time)

    def last_seen(self, description: str) -> SeenAt | None:
        """Return where and when an object was last seen; None if it never was.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return next(iter(self.places_of(description)), None)

    def history(self, thing: str) -> list[ThingEvent]:
        """Return what is kept of a thing over time, the latest first; the log has all.

        That is the last sighting at each place, the look that missed it there first since, and the
        last things that were said of it. Of several things that a name means, all.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        matches = self.resolve(thing).matches
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            rows = state.find_rows(thing) or [r for name in matches for r in state.find_rows(name)]
            found = [
                event
                for row in dict.fromkeys(rows)
                for event in list_events(
                    fused,
                    state.get_statements(row),
                    row,
                    state.list_places(row, fused),
                    state.furniture_ids,
                )
            ]
        return sorted(found, key=lambda event: -event.time)

    def changes(self, since: datetime | int) -> list[ThingChange]:
        """Return what is new, was moved or is gone, as looks have shown and people have said.

        Args:
            since: time step, or date and time by the clock, from which on it was noticed.

        Returns:
            The last changes of each thing, the latest first; a thing that was moved twice since
            stands there once, with its last move.

        Raises:
            ValueError: if `since` is neither, or a date and the memory has no clock.
        """
        with self._lock:
            state = self._state
            first = read_since(since, state.clock)
            things = [state.get_statements(row) for row in range(len(state.things))]
            return list_changes(state.fuse_batch(), things, state.furniture_ids, first)

    def to_dict(self) -> dict[str, Any]:
        """Return rooms > furniture > objects as JSON values.

        Under each furniture node stand the objects that were ever seen there: "is_there" says
        whether the last look at it found them; "by" is who said last that they are there, where no
        look has shown it. "unplaced" lists objects that were last seen at furniture that was
        removed.
        """
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            said_by = {row: state.list_said_by(row, fused) for row in state.list_spoken_of()}
            return list_home(fused, state.layout, state.descriptions, said_by)

    def to_frame(self) -> DataFrame:
        """Return a table of every object at every place where it was ever seen (needs pandas).

        Columns: object, relation, furniture, room, is_there, last_seen, times_seen, times_looked.
        """
        from pandas import DataFrame  # an extra: only this needs it

        return DataFrame(list_rows(self.to_dict()))

    def to_spark_dsg(self) -> Any:
        """Return what is there by the last looks as a graph of spark_dsg, the format of Hydra.

        Example:
            >>> memory.to_spark_dsg().save("home.json")

        Raises:
            ModuleNotFoundError: if spark_dsg is not installed.
        """
        with self._lock:
            batch = self._state.batch
            kinds = [batch.labels[index] for index in batch.objects["label"]]
            labels = dict(zip(self._state.descriptions, kinds, strict=True))
            home, layout = self.to_dict(), self.layout
        return make_spark_graph(home, layout, labels)

    def _check_furniture(self) -> None:
        if not self._state.layout.furniture:
            raise ValueError(
                "memory must have furniture before a query, got none. Call add_furniture first."
            )

    def _begin(self, prior: PriorGraph, clock: Clock | None) -> None:
        """Become an empty memory."""
        self._prior = prior
        labels = (row.label for row in prior.objects)
        self._names = NameIndex(labels, self._table, self._encoder)
        self._state = MemoryState(prior, clock, self._table)

    def _go_on_from(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content, as a log says that one went on."""
        with self._lock:
            self._begin(prior, content.clock)
            self._state.set_content(content.copy())
            self._note_start(goes_on=True)

    def _start_log(self, path: str | Path | None, goes_on: bool = False) -> None:
        if path is not None:
            self._log = LookLog(path)
            self._note_start(goes_on)

    def _note_start(self, goes_on: bool) -> None:
        """Write into the log that a new memory begins, or how the one is that goes on."""
        if self._log is not None:
            self._log.start(self._state.get_content_to_save(), is_new=not goes_on)

    def _write(self, kind: str, time: int | None = None, **values: Any) -> None:
        """Append a change to the log, if there is one, before it is made.

        Args:
            kind: as in `LogLine`.
            time: step after the change; None for the present one.
            values: as in `LogLine`.
        """
        if self._log is not None:
            time = self._state.time if time is None else time
            self._log.write(kind, time, self._state.clock, values)


def _list_extents(node: Furniture) -> dict[str, Any]:
    """Return what a line of a log says of furniture with a box, or that must be opened."""
    about: dict[str, Any] = {}
    if node.box is not None:
        about["box"] = node.box.to_json()
    if node.open_cost is not None:
        about["open_cost"] = node.open_cost
    return about
