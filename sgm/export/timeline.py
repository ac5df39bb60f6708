"""A memory over time as messages: after every change what is where, and what is believed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from sgm.export.home_scene import HomeScene, make_scene
from sgm.export.scene_messages import (
    Message,
    tell_belief,
    tell_frame,
    tell_furniture,
    tell_pose,
    tell_things,
)
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.memory_event import MemoryEvent
from sgm.memory.replayer import Replayer
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Point
from sgm.messages import shorten
from sgm.store.event_kinds import QUESTION, list_kinds

if TYPE_CHECKING:
    from sgm.export.mcap_file import McapFile

NUM_THINGS = 5  # whose belief is shown where none are named
CAMERA_FRAME = "camera"
_EPOCH = datetime(1970, 1, 1)
_LAST = datetime(2262, 1, 1)  # what fits into 63 bits of nanoseconds
_MOST_IN_STEP = 1000  # changes of a time step that have a time of their own


class Timeline:
    """Follows a memory through its events, and writes a file.

    A time step of the memory begins at its time by the clock; its changes follow at a thousandth of
    its length. Without a clock, step 0 is the beginning of 1970, and a step is an hour.

    Attributes:
        memory: as after the last line.
    """

    def __init__(
        self, file: McapFile, make_finder: Callable[[], Finder], things: Sequence[str] | None
    ) -> None:
        """Begin without a memory.

        Args:
            file: to write to.
            make_finder: makes the finder that is asked, once something is.
            things: what is asked for, in words; None for those that were seen last, `NUM_THINGS`.
        """
        self.memory = SceneGraphMemory()
        self._file, self._make_finder, self._things = file, make_finder, things
        self._finder: Finder | None = None
        self._replayer: Replayer[SceneGraphMemory] | None = None
        self._scene: HomeScene | None = None
        self._step, self._num_in_step, self._time = -1, 0, -1
        self._is_believed = True  # whether what is believed now was written
        self._topics: dict[str, str] = {}

    def take(self, lines: Iterable[MemoryEvent]) -> None:
        """Make changes in the memory, and write what each has changed.

        Raises:
            ValueError: if a line names what was never added, or a time is no date of the file.
        """
        for line in lines:
            if self._replayer is None:
                self._replayer = Replayer(SceneGraphMemory(clock=line.values.get("clock")))
                self.memory = self._replayer.memory
            if line.kind == "step":
                self._write_beliefs()
            self._replayer.apply(line)
            if line.kind in list_kinds(QUESTION):
                continue
            self._go_on()
            if line.kind == "step":
                self._num_in_step = -1  # what comes next is the first change of the step
            if line.kind == "look":
                self._write_look(line, self._replayer.furniture)
            self._write_scene()

    def finish_step(self) -> None:
        """Write what is believed now, if something has changed since it was written."""
        self._write_beliefs()

    def _go_on(self) -> None:
        """Let the time of the file pass to that of the next change."""
        step, clock = self.memory.time, self.memory.clock or Clock(_EPOCH)
        is_first = self._num_in_step < 0  # of a step, whose own event changes no scene
        self._num_in_step = self._num_in_step + 1 if step == self._step else 0
        self._step = step
        part = min(self._num_in_step, _MOST_IN_STEP - 1) / _MOST_IN_STEP
        date = clock.get_date(step)
        if date is None or not _EPOCH <= date < _LAST:
            raise ValueError(
                f"time must lie from {_EPOCH.year} to {_LAST.year - 1} in a file of MCAP, got "
                f"{shorten(str(date or clock.start))} at step {step}. Set the clock of the memory."
            )
        date += timedelta(seconds=part * clock.step_seconds)
        # Later than the change before, whatever the clock says: a viewer takes away what it shows
        # from before the time of a scene, and not what has the same time.
        least = self._time if is_first else self._time + 1
        self._time = max(least, (date - _EPOCH) // timedelta(microseconds=1))
        self._is_believed = False

    def _write(self, topic: str, schema: str, message: Message) -> None:
        self._file.write(topic, schema, self._time * 1000, message)

    @property
    def _stamp(self) -> str:
        return f"{(_EPOCH + timedelta(microseconds=self._time)).isoformat()}Z"

    def _write_look(self, line: MemoryEvent, furniture: Mapping[int, int]) -> None:
        """Write from where a look was: the camera, else where one stands to look at the place."""
        point = line.values["viewpoint"]
        if point is not None:
            position, yaw = (point.x, point.y, point.z), point.yaw
        else:
            stand = self._find_stand(furniture[line.values["furniture"]])
            if stand is None:
                return
            position, yaw = stand
        self._write("/look", "PoseInFrame", tell_pose(position, yaw, self._stamp))
        self._write("/tf", "FrameTransform", tell_frame(CAMERA_FRAME, position, yaw, self._stamp))

    def _write_scene(self) -> None:
        """Write furniture and things, each if it has changed."""
        old, scene = self._scene, make_scene(self.memory)
        self._scene = scene
        if old is None or (old.furniture, old.rooms) != (scene.furniture, scene.rooms):
            self._write("/furniture", "SceneUpdate", tell_furniture(scene, self._stamp))
        if old is None or old.things != scene.things:
            self._write("/things", "SceneUpdate", tell_things(scene, self._stamp))

    def _write_beliefs(self) -> None:
        """Write what is believed of each thing, and where to stand to look for it first."""
        if self._is_believed or self._scene is None or not self.memory.num_furniture:
            return
        self._is_believed = True
        for thing in self._choose_things():
            if self._finder is None:
                self._finder = self._make_finder()
            ranking = self._finder.rank(self.memory, thing)
            topic = self._name_topic(thing)
            message = tell_belief(ranking, self._scene, self._stamp)
            self._write(f"/belief/{topic}", "SceneUpdate", message)
            stand = self._find_stand(ranking[0].furniture) if len(ranking) else None
            if stand is not None:
                self._write(f"/next/{topic}", "PoseInFrame", tell_pose(*stand, self._stamp))

    def _find_stand(self, furniture: int) -> tuple[Point, float] | None:
        """Return where to stand to look at furniture, and the yaw, 0 where it is unknown."""
        pose = self.memory.get_pose(furniture)
        if pose is not None:
            return (*pose[:2], 0.0), pose[2]
        position = self.memory.get_position(furniture)
        return None if position is None else ((*position, 0.0), 0.0)

    def _choose_things(self) -> Sequence[str]:
        """Return what is asked for; what was seen first stays, so that topics are few."""
        if self._things is not None:
            return self._things
        for name, _ in self.memory.list_seen(most=NUM_THINGS)[0]:
            if len(self._topics) < NUM_THINGS:
                self._name_topic(name)
        return list(self._topics)

    def _name_topic(self, thing: str) -> str:
        """Return the name of a thing in topics: "large_red_mug"."""
        if thing not in self._topics:
            words = re.sub(r"\W+", "_", thing.casefold()).strip("_") or "thing"
            taken = self._topics.values()
            names = [words, *(f"{words}_{number}" for number in range(2, len(taken) + 3))]
            self._topics[thing] = next(name for name in names if name not in taken)
        return self._topics[thing]
