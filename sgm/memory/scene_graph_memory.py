"""The memory of one home, for use with or without the simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from threading import Lock, RLock

from sgm.checks import read_optional
from sgm.layout.layout import read_map_id
from sgm.memory.clock import Clock
from sgm.memory.corrections import MemoryCorrections
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_files import load_content
from sgm.memory.memory_looks import MemoryLooks
from sgm.memory.memory_state import MemoryState
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.step_log import LookWatch
from sgm.messages import shorten
from sgm.names.aliases import Aliases, AliasTable
from sgm.names.name_encoder import Encode, NameEncoder
from sgm.names.name_matching import NameIndex
from sgm.prior.prior_graph import PriorGraph, find_shipped


class SceneGraphMemory(MemoryLooks, MemoryCorrections):
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
        _check_parts(prior, clock, score_calibration)
        prior = prior if prior is not None else PriorGraph.household()
        content = MemoryContent.empty(prior.checksum, clock, read_map_id(map_id))
        content = replace(content, score_calibration=score_calibration)
        self._make(content, prior, aliases, encoder)
        self._start_log(log)

    def _make(
        self,
        content: MemoryContent,
        prior: PriorGraph,
        aliases: Aliases | None,
        encoder: Encode | None,
    ) -> None:
        """Make all parts, of a memory of that content."""
        self._lock, self._saving, self._naming = RLock(), Lock(), Lock()
        self._save_lock = self._kept_lock = self._log = None
        self._aliases, self._own_encode = aliases, encoder  # for copies
        self._table = AliasTable.household(aliases)
        self._encoder = None if encoder is None else NameEncoder(encoder, self._table)
        self._watch = LookWatch()
        self._begin(content, prior)

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
        _check_parts(prior, clock, score_calibration)
        memory = cls.__new__(cls)
        content = content if clock is None else replace(content, clock=clock)
        memory._make(content, prior, aliases, encoder)
        if score_calibration is not None:
            memory._state.score_calibration = score_calibration
        memory._start_log(log, goes_on=True)
        return memory

    def copy(self) -> SceneGraphMemory:
        """Return a memory of the same content that goes its own way; it writes no log."""
        with self._lock:
            content, prior = self._state.get_content_to_save().copy(), self._state.prior
        memory = type(self).__new__(type(self))
        memory._make(content, prior, self._aliases, self._own_encode)
        memory._watch.warns_of_scores = self._watch.warns_of_scores
        return memory

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
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of all objects seen or asked for, in the order of `batch`, (O,)."""
        with self._lock:
            return self._state.things.descriptions

    def _begin(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content."""
        labels = (row.label for row in prior.objects)
        self._names = NameIndex(labels, self._table, self._encoder)
        self._state = MemoryState(content, prior, self._table)

    def _go_on_from(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content, as a log says that one went on."""
        with self._lock:
            self._begin(content.copy(), prior)
            self._start_log(goes_on=True)


def _check_parts(prior: object, clock: object, score_calibration: object) -> None:
    """Raise TypeError for a part of a memory that is something else."""
    for name, value, kind in (
        ("prior", prior, PriorGraph),
        ("clock", clock, Clock),
        ("score_calibration", score_calibration, ScoreCalibration),
    ):
        read_optional(name, value, kind, "Leave it out for the default.")
