"""The memory of one home, for use with or without the simulator: all that it can do."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sgm.layout.box import Box
from sgm.layout.layout import Layout
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_clock import MemoryClock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import MemoryEvent, read_kept
from sgm.memory.memory_files import MemoryFiles, begin_content, take_given
from sgm.memory.memory_layout import MemoryLayout
from sgm.memory.memory_looks import MemoryLooks
from sgm.memory.memory_questions import Asked, MemoryQuestions, Scorer
from sgm.memory.memory_state import MemoryState
from sgm.memory.memory_statements import MemoryStatements
from sgm.memory.memory_things import MemoryThings
from sgm.memory.noticed_changes import ThingChange, ThingEvent
from sgm.memory.queries import Queries
from sgm.memory.replayer import Replayer
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import SeenAt, Sighting
from sgm.memory.thing import ROBOT, Statement, ThingName
from sgm.names.aliases import Aliases, AliasTable
from sgm.names.name import Name
from sgm.names.name_encoder import Encode, NameEncoder
from sgm.names.name_matching import Similarity
from sgm.names.resolution import Resolution
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import USUAL_RELATION
from sgm.store.home_file import HomeFile
from sgm.store.home_reader import HomeReader

if TYPE_CHECKING:  # pandas is an extra
    from pandas import DataFrame


class MemoryParts(NamedTuple):
    """What a memory hands its calls to, and the state that all its parts share.

    For what replays events, which makes a memory what it was: these calls say more in an event, or
    change which file is written. A robot calls the memory itself.
    """

    state: MemoryState
    layout: MemoryLayout
    looks: MemoryLooks
    clock: MemoryClock
    questions: MemoryQuestions
    statements: MemoryStatements
    files: MemoryFiles


class SceneGraphMemory:
    """One graph that holds everything ever observed in a home.

    Object nodes are distinguished by the words of their description, and one description may be
    seen at several places at once: one node then has several true edges. Looking at furniture
    updates every remembered edge of it: seen -> true, not seen -> false. Rooms, furniture and
    objects may be added and removed at any time; ids of rooms and furniture never change and are
    never given twice.

    Names are compared as `read_words` says: case, spaces and "_" make no difference. Words that
    the prior does not know are welcome: an object without a prior may be at all furniture.

    What it can do stands here; each call is made by the part that it is about, in a file of that
    name: `MemoryLayout`, `MemoryLooks`, `MemoryClock`, `MemoryQuestions`, `MemoryThings`,
    `MemoryStatements` and `MemoryFiles`. The parts share one state (`MemoryState`).

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
        path: str | Path | None = None,
        aliases: Aliases | None = None,
        encoder: Encode | None = None,
        score_calibration: ScoreCalibration | None = None,
        map_id: str = "",
        language: str = ENGLISH,
    ) -> None:
        """Start with an empty home.

        Args:
            prior: where things tend to be; None for `PriorGraph.household()`, which knows some 800
                things of homes that people live in (docs/priors.md).
            clock: what time it is now, and how long a step is, for networks that were trained with
                `features.clock`; the shipped one reads none.
            path: of a new file in which every look and every change is kept from now on, such as
                "home.sgm"; None for a memory that lives in the process alone. Asking writes
                nothing. `open` goes on with a file.
            aliases: what things are called besides, and what they are kinds of, added to the
                shipped table (`AliasTable`): a CSV file with columns name, kind and aliases, or a
                mapping such as {"thermos": ["vacuum flask"], "beagle": {"kind": "dog"}}.
            encoder: a function from a list of names to their vectors, for names that are not in
                the table; None for the text vectors of the policy, where it has some.
            score_calibration: what the confidences of sightings mean as probabilities, where they
                are scores of a detector; it is saved with the memory. None if they are
                probabilities.
            map_id: of the map that positions and boxes of furniture are in, such as its checksum.
            language: in which is asked and answered, "en" or "de"; it is not saved.

        Raises:
            TypeError: if the prior, the clock, the aliases, the encoder or the calibration is
                something else.
            ValueError: if the aliases or the map id are malformed.
            FileNotFoundError: if there is no file of aliases, or no folder for the file.
            FileExistsError: if there is a file of that path.
            OSError: if the file cannot be written, here or with any later change; a change that
                could not be written was not made.
        """
        content, prior = begin_content(prior, clock, score_calibration, map_id)
        self._make(content, prior, aliases, encoder, language)
        if path is not None:
            self._files.begin(path)

    def _make(
        self,
        content: MemoryContent,
        prior: PriorGraph,
        aliases: Aliases | None,
        encoder: Encode | None,
        language: str,
    ) -> None:
        """Make all parts, of a memory of that content."""
        table = AliasTable.household(aliases, language)
        encodes = None if encoder is None else NameEncoder(encoder, table)
        self._make_parts(MemoryState(content, prior, table, encodes))

    def _make_parts(self, state: MemoryState) -> None:
        """Make all parts, of a state that they share."""
        self._state = state
        self._layout = MemoryLayout(state)
        self._looks = MemoryLooks(state)
        self._clock = MemoryClock(state)
        self._questions = MemoryQuestions(state)
        self._things = MemoryThings(state)
        self._statements = MemoryStatements(state)
        self._files = MemoryFiles(state)
        self._files.read_again = _read_again

    @classmethod
    def open(
        cls,
        path: str | Path,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        aliases: Aliases | None = None,
        encoder: Encode | None = None,
        score_calibration: ScoreCalibration | None = None,
        map_id: str = "",
        language: str = ENGLISH,
        *,
        is_new: bool = False,
    ) -> SceneGraphMemory:
        """Go on with a memory in its file, as it was when its last process ended, to the bit.

        Every change is written before it is made. One process at a time writes a file, by whatever
        names and links it came to it; in one process the latest to open it has it.

        Example:
            >>> with SceneGraphMemory.open("home.sgm") as memory:
            ...     memory.observe(fridge, [Sighting("milk")])  # a kill now loses nothing

        Args:
            path: of a file that `save` or a memory with a path has written.
            prior: as in `load`.
            clock: of the present step, for a memory that has none.
            aliases: as in the constructor; they are not in the file.
            encoder: as in the constructor.
            score_calibration: as in `load`.
            map_id: as in `load`.
            language: as in the constructor.
            is_new: whether an empty memory begins, where there is no file.

        Raises:
            FileNotFoundError: if there is no file, and `is_new` does not say so, or no folder; it
                is a `ValueError`, too.
            ValueError: as of `load`, and if another process writes the file.
            OSError: if the file cannot be written, or lies on a network drive.
        """
        path = Path(path)
        if is_new and not path.exists():
            return cls(prior, clock, path, aliases, encoder, score_calibration, map_id, language)
        file = HomeFile(path)  # first of all, so that no process writes while it is read
        try:
            memory = cls._read(path, prior, aliases, encoder, language)
            memory._files.go_on_in(file, clock, prior, score_calibration, map_id)
        except BaseException:
            file.close()
            raise
        return memory

    @classmethod
    def load(
        cls,
        path: str | Path,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        aliases: Aliases | None = None,
        encoder: Encode | None = None,
        score_calibration: ScoreCalibration | None = None,
        map_id: str = "",
        language: str = ENGLISH,
    ) -> SceneGraphMemory:
        """Read a memory from its file, also beside the process that writes it.

        Every later answer is what it would have been. What is changed from then on is in this
        process alone: `open` goes on in the file.

        Args:
            path: of a file that `save` or a memory with a path has written.
            prior: None for the one of the memory, which must then be one that ships. A prior that
                is given is taken, whether it is the same or not; another one changes what is said
                about places, and nothing of what was observed.
            clock: of step 0, for a memory that was saved without one, or to replace its own; None
                to keep what was saved.
            aliases: as in the constructor; they are not in the file.
            encoder: as in the constructor.
            score_calibration: of looks from now on; None for what was saved.
            map_id: of the map that the robot has now; a memory of another one is refused. Empty to
                go on with whatever the memory has, for `transform`.
            language: as in the constructor.

        Raises:
            FileNotFoundError: if there is no such file; it is a `ValueError`, too.
            ValueError: if it was altered or cut short, comes from another version or map, was saved
                with another prior than those that ship and none is given, or its present step is
                no date by the clock that is given.
        """
        memory = cls._read(path, prior, aliases, encoder, language)
        content, _ = memory._files.copy_content()
        content, prior = take_given(content, path, prior, clock, score_calibration, map_id)
        if (clock, score_calibration) != (None, None) or map_id:
            memory._files.go_on_from(content, prior)
        return memory

    @classmethod
    def _read(
        cls,
        path: str | Path,
        prior: PriorGraph | None,
        aliases: Aliases | None,
        encoder: Encode | None,
        language: str,
    ) -> SceneGraphMemory:
        """Make a memory of what a file holds."""
        with HomeReader(path) as reader:
            start, *events = read_kept(reader)
        content: MemoryContent = start.values["memory"]
        content, own_prior = take_given(content, path, prior, None, None, "")
        memory = cls.__new__(cls)
        memory._make(content, own_prior, aliases, encoder, language)
        memory._replay(events, prior)
        return memory

    def _replay(self, events: Sequence[MemoryEvent], prior: PriorGraph | None) -> None:
        """Make events again, which go on from what the memory holds."""
        if not events:
            return
        warns, self._looks.watch.warns_of_scores = self._looks.watch.warns_of_scores, False
        replayer = Replayer(self, prior)
        replayer.start_from(self._state.layout)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the process that looked was warned
            for event in events:
                replayer.apply(event)
        self._looks.watch.warns_of_scores = warns

    def copy(self) -> SceneGraphMemory:
        """Return a memory of the same content that goes its own way; it writes to no file."""
        memory = type(self).__new__(type(self))
        memory._make_parts(self._state.copy())
        memory._looks.watch.warns_of_scores = self._looks.watch.warns_of_scores
        return memory

    @property
    def parts(self) -> MemoryParts:
        """The parts that replays call; see `MemoryParts`."""
        return MemoryParts(
            state=self._state,
            layout=self._layout,
            looks=self._looks,
            clock=self._clock,
            questions=self._questions,
            statements=self._statements,
            files=self._files,
        )

    # Rooms and furniture

    @property
    def layout(self) -> Layout:
        """Rooms and furniture by id, as they are now; the methods below change the memory's own."""
        return self._layout.layout

    @property
    def map_id(self) -> str:
        """Id of the map that positions and boxes are in; empty if none was given."""
        return self._layout.map_id

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        return self._layout.num_furniture

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of `batch`, (F,)."""
        return self._layout.furniture_ids

    @property
    def boxes(self) -> dict[int, Box]:
        """Boxes of the furniture that has one, by id, for `sgm.eyes.LookBuilder`."""
        return self._layout.boxes

    def find_called(self, name: Name) -> list[int]:
        """Return the ids of the furniture that is exactly of a name; see `CalledFurniture`."""
        return self._layout.find_called(name)

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id.

        Raises:
            ValueError: if the label is no name (`read_words`).
        """
        return self._layout.add_room(label)

    def rename_room(self, room: int, label: str) -> None:
        """Note what a room is, where that was not known, or was known wrongly; its id stays.

        Raises:
            KeyError: if there is no room of that id.
            ValueError: if the label is no text.
        """
        self._layout.rename_room(room, label)

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
        return self._layout.add_furniture(label, room, description, position, box, open_cost)

    def move_furniture(
        self,
        furniture: int,
        room: int | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
        open_cost: float | None = None,
    ) -> None:
        """Note that a furniture node was moved; what was seen there moves with it.

        Positions of things that are not at its new place are forgotten.

        Args:
            furniture: id from `add_furniture`.
            room: where it stands now; None for the same room.
            position: as in `add_furniture`; None if it is as it was, or, in another room or box,
                unknown.
            box: where it stands now; None if it is as it was, or, in another room, unknown.
            open_cost: as in `add_furniture`; None if it is as it was.

        Raises:
            KeyError: if there is no such furniture node or room.
            TypeError: if the box is none.
            ValueError: if the position is no two numbers, or the cost is negative or not finite.
        """
        self._layout.move_furniture(furniture, room, position, box, open_cost)

    def name_furniture(self, furniture: int, label: str, description: str | None = None) -> None:
        """Note what a furniture node is, where that was not known, or was known wrongly.

        Args:
            furniture: id from `add_furniture`.
            label: what it is.
            description: for people; the label if left out.

        Raises:
            KeyError: if there is no such furniture node.
            ValueError: if the label or the description is no name (`read_words`).
        """
        self._layout.name_furniture(furniture, label, description)

    def merge_furniture(self, furniture: int, other: int) -> None:
        """Note that two furniture nodes are one: what was seen at the other was seen at the first.

        The other node is removed; what people said about it goes with it.

        Args:
            furniture: id of the node that stays.
            other: id of the one that goes.

        Raises:
            KeyError: if there is no such furniture node.
            ValueError: if they are one.
        """
        self._layout.merge_furniture(furniture, other)

    def transform(
        self,
        angle: float = 0.0,
        shift: Sequence[float] = (0.0, 0.0),
        map_id: str = "",
    ) -> None:
        """Move all positions and boxes into the frame of another map; nothing else changes.

        Those of things, too.

        Args:
            angle: by which the home is turned around the origin of the old map, counter-clockwise,
                in radians.
            shift: by which it is moved then, x and y in metres.
            map_id: of the new map; empty if it has none.

        Raises:
            ValueError: if an argument is out of range, or a box or a thing would lie where no home
                is.
        """
        self._layout.transform(angle, shift, map_id)

    def get_position(self, furniture: int) -> tuple[float, float] | None:
        """Return where one stands to look at a furniture node; None if it is unknown.

        As it was given; where it was not, a point before the front of its box, outside all others.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        return self._layout.get_position(furniture)

    def get_pose(
        self, furniture: int, target: tuple[float, float, float] | None = None
    ) -> tuple[float, float, float] | None:
        """Return where one stands to look at a furniture node, x, y in the map, and the yaw.

        Args:
            furniture: id from `add_furniture`.
            target: what is looked at there, x, y, z in the map, metres, such as `Place.position`;
                None for the middle of the furniture. Where no position of the furniture was given,
                one stands right before that.

        Returns:
            Metres and radians; None where it is not known where the furniture stands.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if `target` is no position.
        """
        return self._layout.get_pose(furniture, target)

    def list_furniture(self, room: int) -> tuple[int, ...]:
        """Return the ids of the furniture of a room, to leave out a closed one, for example.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        return self._layout.list_furniture(room)

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node, "white fridge in kitchen".

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        return self._layout.describe(furniture)

    def remove_room(self, room: int) -> None:
        """Remove a room with all its furniture and what is remembered of it; objects stay.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        self._layout.remove_room(room)

    def remove_furniture(self, furniture: int) -> None:
        """Remove a furniture node and all its edges; the objects that were seen there stay.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._layout.remove_furniture(furniture)

    # Looks

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
        A look at another furniture node leaves them alone. What is seen at a second place was moved
        there, unless one look showed two of its name, or it is seen at the first one again.

        Args:
            furniture: id from `add_furniture`.
            seen: what was detected there; detection may have missed objects. Sightings of the
                same description are several things of a kind.
            coverage: share of the furniture that was in view, above 0 and at most 1; the detector
                may have missed what was in view. Or shares by relation, 0 for one that
                was not in view: {"in": 0, "onTop": 0.8} of a fridge that is shut.
            hidden: descriptions of things whose own spots were out of view, behind something else:
                that they were not seen is not counted against them.
            viewpoint: from where the camera looked, for the file and the page that shows it; the
                memory does not use it.

        Looks must lie some time apart: a memory that seems to get every frame of a video
        warns once (`LookPerFrameWarning`). Of those at a place in a time step that show the same,
        ten in a row update the belief of this step, and one counts for later steps, as looks of one
        moment err alike. What comes or goes between them counts.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            TypeError: if `seen` holds something else than sightings, `hidden` is no list, or the
                viewpoint none.
            ValueError: if the coverage is out of range, or something hidden has no name.

        Source: paper section 4.2, appendix B. Differs: negative evidence is counted (released
        code does not).
        """
        self._looks.observe(furniture, seen, coverage, hidden, viewpoint)

    def note_found(
        self,
        furniture: int,
        thing: str | ThingName,
        relation: str = USUAL_RELATION,
        coverage: float = 0.01,
    ) -> None:
        """Note that a look for one thing has found it, and say nothing of all others there.

        Args:
            furniture: id from `add_furniture`.
            thing: name, as the memory and people call it, or id; another one is a new thing.
            relation: such as "in" or "onTop" the furniture.
            coverage: share of the furniture that was in view; little, as nothing but the thing was.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if the thing has no name, or the relation or the coverage is none.
        """
        self._looks.note_found(furniture, thing, relation, coverage)

    def name_seen(self, furniture: int, seen: Sequence[Sighting]) -> tuple[Sighting, ...]:
        """Return what a detector shows at furniture by the names that `observe` takes it for.

        That is as it is, but for things that people have called otherwise there (`rename`).

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            TypeError: if `seen` holds something else than sightings.
        """
        return self._looks.name_seen(furniture, seen)

    def note_absent(self, furniture: int, description: str, coverage: float = 1.0) -> None:
        """Note that a look for one thing did not find it, and say nothing of all others there.

        For that thing it counts, ages and is kept as a look at the place; of a name that several
        things have, for all of them.

        Args:
            furniture: id from `add_furniture`.
            description: what was looked for, seen before or not.
            coverage: share of the furniture that was in view.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if the description is no name, or the coverage out of range.
        """
        self._looks.note_absent(furniture, description, coverage)

    @property
    def score_calibration(self) -> ScoreCalibration | None:
        """What the confidences of sightings mean; None if they are probabilities."""
        return self._looks.score_calibration

    # Time

    @property
    def clock(self) -> Clock | None:
        """What time it is at every time step; None if it was not given."""
        return self._clock.clock

    @property
    def time(self) -> int:
        """Steps since the start."""
        return self._clock.time

    def step(self, num_steps: int = 1, *, accept_jump: bool = False) -> None:
        """Let time pass.

        Args:
            num_steps: time steps, 0 or more. The shipped network was trained on homes where one
                object in twenty moves in a step.
            accept_jump: whether so many have passed, though it is more than `MOST_AHEAD`.

        Raises:
            ValueError: if it is negative, no whole number, more than `MOST_AHEAD` by the clock and
                not accepted, or time would exceed `MAX_TIME` or the dates that the clock can tell.
        """
        self._clock.step(num_steps, accept_jump=accept_jump)

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
        self._clock.step_to(time, accept_jump=accept_jump)

    def start_clock(self, clock: Clock) -> None:
        """Have a clock from now on: for a memory that began before the time was known.

        Raises:
            TypeError: if it is no clock.
            ValueError: if the memory has one, or the present step is no date by it.
            OSError: if the file cannot be written.
        """
        self._files.start_clock(clock)

    # Questions: what a name means, and where what is asked for may be

    def resolve(
        self,
        description: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which of the things that were seen a question means; `NameIndex` has the rules.

        What acts on a thing asks `resolve_exact`.

        Args:
            description: such as "the red mug".
            similarity: how alike labels are, where the memory has no encoder; None to go by words
                alone.
            among: names to choose from, such as those of one look; None for all that were seen.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return self._questions.resolve(description, similarity, among)

    @property
    def language(self) -> str:
        """Code of the language in which is asked and answered."""
        return self._questions.language

    def read_sentence(self, question: str, speaker: str = "") -> Sentence:
        """Read what a sentence asks for: its kind, the things, the place and the time in it.

        Args:
            question: "where were my keys and the wallet yesterday?".
            speaker: who says "my"; empty if that is not known.

        Raises:
            ValueError: if it is no text of one line (`read_words`).
        """
        return self._questions.read_sentence(question, speaker)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which of the things that were seen is exactly of a name, or has that id.

        Case, articles, plural, accents and spelling aside: `NameIndex.resolve_exact` has the rules,
        and aliases of one's own count. Every call that acts on a thing uses it.

        Args:
            name: such as "the red mug".
            among: names to choose from; None for all that were seen.

        Returns:
            Matches; without any, `doubtful` has what may be meant.

        Raises:
            ValueError: if it is no name (`read_words`).
        """
        return self._questions.resolve_exact(name, among)

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge".

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        return self._questions.find_furniture(name)

    def find_places(
        self, name: str, resolution: Resolution | None = None
    ) -> tuple[str, tuple[int, ...]]:
        """Return the furniture that a question is about, if it is about furniture or a room.

        Args:
            name: such as "the fridge", "kitchen table", "the kitchen".
            resolution: what `resolve` gave for it, where that was asked for.

        Returns:
            "place" and the ids of the furniture of that name, "room" and those of what stands in
            it; else "thing" and none. A thing that was seen under exactly that name comes first,
            and any thing of the name before a place that is less than exactly so called.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        return self._questions.find_places(name, resolution)

    def ask(
        self,
        descriptions: Sequence[str],
        before_looks: bool = True,
        at: datetime | int | None = None,
        question: str | None = None,
        miss_rate: float | None = None,
    ) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes.

        Args:
            descriptions: one or more, seen before or not; each means the object of that name.
            before_looks: whether policies are asked of the memory before the looks of this step,
                which then say for themselves what they say.
            at: when: a time step, or a date and time by the clock; not before the present step,
                nor more than `MOST_AHEAD` after it, None for it.
            question: what they were asked for as: looks for that which did not find it count, too.
            miss_rate: of the detector, which policies then read; None for what the memory counted.

        Raises:
            ValueError: if a description is no name (`read_words`), there is no furniture yet, or
                the time has passed.
        """
        return self._questions.ask(descriptions, before_looks, at, question, miss_rate)

    def rank(self, policy: Scorer, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first.

        Args:
            policy: who judges, for example `sgm.policies.heuristics.Bayesian()`.
            description: what to look for.

        Returns:
            (furniture id, score) for every furniture node; -inf where there is no opinion.
        """
        return self._questions.rank(policy, description)

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph.

        A place that is looked at meanwhile, and does not show it, is remembered as one where it
        was not. So this changes the memory, as `rank` and `ask` do not, and is written.

        Args:
            description: what to look for, whether it was seen before or not.

        Returns:
            One query, for `Policy.scores(memory.batch, query)`, which gives (1, F).

        Raises:
            ValueError: if the description is no name (`read_words`), or there is no furniture yet.
        """
        return self._questions.query(description)

    # Things, and where they were seen

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home, which policies read, in the order of `furniture_ids`.

        It takes over rooms and furniture that were added when it is read, all at once. It is the
        memory itself, which changes with it: beside a thread that observes, read `copy().batch`.
        """
        return self._things.batch

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of all objects seen or asked for, in the order of `batch`, (O,)."""
        return self._things.descriptions

    def list_ids(self, thing: str) -> tuple[str, ...]:
        """Return the ids of the things of a name; none where words alone tell them apart.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        return self._things.list_ids(thing)

    def list_named(self, *names: str, place: int | None = None) -> tuple[ThingName, ...]:
        """Return the things of some names or ids, as files name them; what was merged is one.

        Args:
            names: descriptions or ids, of exactly these things.
            place: furniture id: only what is there by the last looks; None for all.

        Raises:
            KeyError: if there is no such furniture.
            ValueError: if a name is none (`read_words`).
        """
        return self._things.list_named(*names, place=place)

    def find_nearest(
        self, embedding: Sequence[float] | np.ndarray, k: int = 3
    ) -> list[tuple[str, float]]:
        """Return the things that look most like something, by the embeddings of their sightings.

        Args:
            embedding: of what is seen, (D,), of the same maker as those of the sightings.
            k: most things to return.

        Returns:
            Ids, or descriptions of things without one, and cosines, the nearest first.

        Raises:
            ValueError: if the embedding is no vector, or `k` is below 1.
        """
        return self._things.find_nearest(embedding, k)

    def places_of(self, description: str) -> list[SeenAt]:
        """Return every place where an object was ever seen, the latest sighting first.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return self._things.places_of(description)

    def last_seen(self, description: str) -> SeenAt | None:
        """Return where and when an object was last seen; None if it never was.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return self._things.last_seen(description)

    def history(self, thing: str) -> list[ThingEvent]:
        """Return what is kept of a thing over time, the latest first.

        A memory with a file tells all that the file keeps: each stay at a place, by the last
        sighting there, and all that was said. Where a name is that of several things, that is the
        last sighting at each place. A memory without one has the last sighting at each place, and
        the last things that were said. Both tell which look missed it there first since. Of several
        things that a name means, all.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        return self._things.history(thing)

    def list_known(self, thing: str, begin: int, end: int) -> list[ThingEvent]:
        """Return where a thing is known to have been around a time, the earliest first.

        Of a memory with a file that is the last sighting or statement before it, the last one in
        it, and the first one after it; without one, all that is kept.

        Args:
            thing: its exact name or id.
            begin: first time step.
            end: last time step.
        """
        return self._things.list_known(thing, begin, end)

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
        return self._things.changes(since)

    def list_seen(
        self, things: Sequence[str] | None = None, furniture: int | None = None, most: int = 20
    ) -> tuple[list[tuple[str, SeenAt]], int]:
        """List where things are by the last looks, or else were seen last, the latest seen first.

        Args:
            things: names; then every place where one was ever seen is looked at. None for all.
            furniture: id of a place, to list what is there alone; None for all places.
            most: rows to return.

        Returns:
            Descriptions and places, and how many there are in all.
        """
        return self._things.list_seen(things, furniture, most)

    def count_things(self) -> dict[int, tuple[int, int | None]]:
        """Count what the last look showed at each place, by furniture id.

        Returns:
            How many things, and the time step of that look, None without one.
        """
        return self._things.count_things()

    def to_dict(self) -> dict[str, Any]:
        """Return rooms > furniture > objects as JSON values.

        Under each furniture node stand the objects that were ever seen there: "is_there" says
        whether they are there by the last looks, as `SeenAt.is_there`; "by" is who said last that
        they are there, where no look has shown it. "unplaced" lists objects that were last seen at
        furniture that was removed. "position" is x, y, z in the map, metres, of an object where it
        was seen, and of furniture the middle of its "box", or the point on the floor where one
        stands to look at it; both are left out where they are unknown.
        """
        return self._things.to_dict()

    def to_frame(self) -> DataFrame:
        """Return a table of every object at every place where it was ever seen (needs pandas).

        Columns: object, relation, furniture, room, is_there, last_seen, times_seen, times_looked,
        and x, y, z in the map, metres: of the object where that is known, else of the furniture.
        """
        return self._things.to_frame()

    def to_spark_dsg(self) -> Any:
        """Return what is there by the last looks as a graph of spark_dsg, the format of Hydra.

        Example:
            >>> memory.to_spark_dsg().save("home.json")

        Raises:
            ModuleNotFoundError: if spark_dsg is not installed.
        """
        return self._things.to_spark_dsg()

    # What people say, and what the robot did

    def note_moved(
        self,
        thing: str,
        place: int,
        by: str,
        relation: str = "in",
        confidence: float | None = None,
        was_at: int | None = None,
    ) -> None:
        """Note where a thing is now, as a person says: "I put the keys in the drawer".

        Args:
            thing: name or id; a name that no thing has exactly is a new thing.
            place: furniture id.
            by: who says so, such as "anna".
            relation: such as "in" or "onTop" it.
            confidence: probability that it is right, at least 0.5; None for 0.9, since people err.
            was_at: furniture id from which one of several of its kind was taken; the others stay
                where they are. None for the only one of its description, wherever it was.

        Raises:
            KeyError: if a place is no furniture node of this memory.
            ValueError: if several things have the name, or another argument is out of range.
        """
        self._statements.note_moved(thing, place, by, relation, confidence, was_at)

    def picked_up(
        self, thing: str, was_at: int | None = None, confidence: float | None = None
    ) -> None:
        """Note that the robot has taken a thing, and carries it until it is put down.

        Args:
            thing: name or id; a name that is like none that is known is a new thing.
            was_at: furniture id, where there are several of its kind; None for the only one.
            confidence: probability that it has it, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the name is not exactly that of one thing and may be meant for one, or
                another argument is out of range.
        """
        self._statements.picked_up(thing, was_at, confidence)

    def put_down(
        self, thing: str, place: int, relation: str = "onTop", confidence: float | None = None
    ) -> None:
        """Note that the robot has put down what it carried.

        Args:
            thing: name or id, among what it carries; fewer properties will do: "mug" for the only
                one carried, a "red mug".
            place: furniture id.
            relation: such as "in" or "onTop" it.
            confidence: probability that it lies there, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the robot carries no such thing, or another argument is out of range.
        """
        self._statements.put_down(thing, place, relation, confidence)

    @property
    def carried(self) -> tuple[str, ...]:
        """Descriptions of what the robot carries."""
        return self._statements.carried

    def find_carried(self, thing: str) -> str:
        """Return the description of the one thing that the robot carries and a name means.

        Fewer properties will do: "mug" for a "red mug". Empty if it carries none such, or several.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        return self._statements.find_carried(thing)

    def list_statements(self) -> list[tuple[ThingName, Statement]]:
        """Return what was said of things, or done with them, the oldest first.

        Kept are the last eight statements about each; the file has all.
        """
        return self._statements.list_statements()

    def rename(self, thing: str | ThingName, name: str, by: str = ROBOT) -> None:
        """Call a thing otherwise: "that is no cup, it is a bowl".

        What a detector calls so at a place where the thing was seen is called so there, until it is
        renamed again; `rename("bowl", "cup")` undoes it. Of several things of one name, without
        ids, it holds for what was seen so far: who sees one more cannot tell which that is.

        Args:
            thing: name or id.
            name: description from now on.
            by: who says so; it stands in the file.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if the name is not exactly that of one thing, or another thing has the new
                one.
        """
        self._statements.rename(thing, name, by)

    def merge(self, thing: str | ThingName, other: str | ThingName, by: str = ROBOT) -> None:
        """Note that two things are one: "this is the same mug"; `split` undoes it.

        Looks go on to be kept under the name and id that each sighting has. Answers are about one
        thing, which is called as the first one.

        Args:
            thing: name or id.
            other: name or id of the other one.
            by: who says so; it stands in the file.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if a name is not exactly that of one thing, both are one already, or one is
                carried.
        """
        self._statements.merge(thing, other, by)

    def split(
        self, thing: str | ThingName, place: int | None = None, name: str = "", by: str = ROBOT
    ) -> None:
        """Note that what was held to be one thing is two; `merge` undoes it.

        Args:
            thing: name or id, of a thing that was merged: it is one of its own again, or, where it
                is the one that stands for others, all of them are.
            place: furniture id, to tell apart what words did not: what was seen there is another
                thing.
            name: description of that other thing.
            by: who says so; it stands in the file.

        Raises:
            KeyError: if there is no such thing or place.
            ValueError: if a name is not exactly that of one thing, nothing was merged, the thing
                was seen at no other place or not there, or another thing has the new name.
        """
        self._statements.split(thing, place, name, by)

    def forget(self, gone: str | int, by: str = ROBOT) -> None:
        """Forget a thing that is not there at all, "there is no vase", or a place that is gone.

        A thing is forgotten as if it had never been seen; it comes back when it is seen again.

        Args:
            gone: name or id of a thing, or a furniture id.
            by: who says so; it stands in the file.

        Raises:
            KeyError: if there is no such thing or furniture.
            ValueError: if the name is not exactly that of one thing, or `by` is no name.
        """
        if isinstance(gone, str):
            self._statements.forget(gone, by)
        else:
            self._layout.forget_furniture(gone, by)

    def remove_object(self, description: str) -> None:
        """Forget an object with all its edges, as if it had never been seen or asked for.

        Raises:
            KeyError: if this memory has no object of that description.
            ValueError: if the description is no name (`read_words`).
        """
        self._statements.remove_object(description)

    # The file

    @property
    def path(self) -> Path | None:
        """Of the file in which every change is kept, without links; None without one."""
        return self._files.path

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` and `open` go on; it holds no code.

        Of a memory that is kept in a file, that is a copy of it with all events; to its own file it
        is a snapshot, after which the next start has no event to make again.

        Args:
            path: such as "home.sgm".

        Raises:
            ValueError: if another memory, in this process or another one, is kept in that file.
            OSError: if the folder does not exist, or the disk does not take the file; an older
                file is left as it was.
        """
        self._files.save(path)

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Write all changes that are made meanwhile at once; other threads wait.

        A change that raises an error ends it: those before it stay.

        Raises:
            OSError: if the disk does not take them; then none was made.
        """
        with self._files.transaction():
            yield

    def sync(self) -> None:
        """Have the disk take all changes, to survive a loss of power; raises OSError if not.

        What was changed before this call survives a kill of the process without it.
        """
        self._files.sync()

    def close(self) -> None:
        """Write a snapshot, and let go of the file; the memory lives on in the process alone.

        A file that was moved or removed is left as it is, with every change so far.

        Raises:
            OSError: if the disk does not take the snapshot; the next start makes all events again.
        """
        self._files.close()

    def __enter__(self) -> SceneGraphMemory:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let go of the file."""
        self.close()


def _read_again(path: Path) -> tuple[MemoryContent, PriorGraph]:
    """Return what a file holds."""
    return SceneGraphMemory.load(path)._files.copy_content()
