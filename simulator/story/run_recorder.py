"""Runs of robots in simulated and recorded homes, written down step by step."""

from __future__ import annotations

import numpy as np

from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import MemoryEvent
from sgm.schema import RELATIONS
from simulator.drawing.floor_plan import FloorPlan
from simulator.policies import make_policy
from simulator.story.past_memory import PastMemory
from simulator.story.story import PastQuestion, TruePlaces
from simulator.tasks.answer import Answer
from simulator.tasks.registry import find_task
from simulator.tasks.task import Task
from simulator.trace.layout import number_names
from simulator.world.homes import Homes
from simulator.world.sensing import Observation
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


class RunRecorder:
    """Follows a task that is played in one home: the looks, the questions, and the truth."""

    def __init__(self, task: Task) -> None:
        """Follow a task from its start on.

        Raises:
            ValueError: if it is played in several homes.
        """
        self._homes = task.rollout.homes
        if self._homes.num_homes != 1:
            raise ValueError(
                f"a run must be in one home, got {self._homes.num_homes}. Play one of them."
            )
        self._rollout = task.rollout
        self._lines = _describe_start(self._homes)
        self._questions: list[PastQuestion] = []
        self._furniture: list[np.ndarray] = []
        self._code: list[np.ndarray] = []
        self._note_truth()
        task.rollout.on_look = self._note_look
        task.on_answer = self._note_answer

    def end_step(self) -> None:
        """Note that a step of the task was played."""
        self._note_truth()
        self._lines.append(MemoryEvent("step", self._rollout.memory.time, {"num_steps": 1}))

    def finish(self, title: str, plan: FloorPlan | None = None) -> PastMemory:
        """Return the run; title and, if it has one, plan are those of the home."""
        codes, number = np.unique(np.stack(self._code), return_inverse=True)
        text = self._homes.object_descriptions.text
        truth = TruePlaces(
            np.stack(self._furniture),
            number.reshape(len(self._code), -1).astype(np.int32),
            tuple(text(int(code)) for code in codes),  # those that came up
        )
        return PastMemory(
            self._lines,
            title,
            prior=self._homes.prior,
            truth=truth,
            questions=self._questions,
            plan=plan,
        )

    def _note_truth(self) -> None:
        self._furniture.append(self._homes.object_furniture[0].astype(np.int32))
        self._code.append(self._homes.object_code[0].astype(np.int32))

    def _note_look(self, seen: Observation) -> None:
        text = self._homes.object_descriptions.text
        for look in range(len(seen.home)):
            rows = [
                (text(int(code)), RELATIONS[int(relation)], float(confidence))
                for code, relation, confidence in zip(
                    seen.seen_code, seen.seen_relation, seen.seen_confidence, strict=True
                )
            ]
            furniture, coverage = int(seen.furniture[look]), float(seen.coverage[look])
            values = {"furniture": furniture, "coverage": coverage, "seen": rows}
            self._lines.append(MemoryEvent("look", self._rollout.memory.time, values))

    def _note_answer(self, answer: Answer) -> None:
        keys = self._rollout.memory.objects["key"][answer.queries.object]
        for key, choice, is_right in zip(keys, answer.choice, answer.is_correct, strict=True):
            self._questions.append(
                PastQuestion(
                    self._rollout.memory.time,
                    self._homes.object_descriptions.text(int(key)),
                    int(choice),
                    bool(is_right),
                )
            )


def record_run(
    source: HomeSource,
    num_steps: int,
    *,
    home: int = 0,
    seed: int = 0,
    policy: str = "bayesian",
    task: str = "predict_location",
) -> PastMemory:
    """Let a robot live in a home, and return what it saw and what was true.

    Args:
        source: of the home.
        num_steps: how long.
        home: number of the home.
        seed: of everything random.
        policy: who answers, and chooses looks where the rules of the home leave that to it.
        task: what it is asked.

    Raises:
        ValueError: if there is no such home, policy or task, or a number is out of range.
    """
    source.check_homes([home])
    source.check_steps(num_steps)
    (group,) = source.list_groups([home])
    homes = source.make(Streams(seed, "test", group.homes))
    game = find_task(task)(homes, make_policy(policy, homes))
    recorder = RunRecorder(game)
    for _ in game.run(num_steps):
        recorder.end_step()
    about = source.describe()
    return recorder.finish(f"{about.get('source') or about.get('homes')} home {home}")


def _describe_start(homes: Homes) -> list[MemoryEvent]:
    """Return the lines with which a memory of the home begins: its start, rooms and furniture."""
    clock = homes.make_clock()
    content = MemoryContent.empty(homes.prior.checksum, clock)
    start = {"clock": clock, "layout": content.layout, "memory": content}
    lines = [MemoryEvent("start", 0, start)]
    rooms = number_names([label for label in homes.room_labels[0] if label])
    lines += [
        MemoryEvent("room", 0, {"room": number, "label": label})
        for number, label in enumerate(rooms)
    ]
    labels = [label for label in homes.furniture_labels[0] if label]
    for node, (label, name) in enumerate(zip(labels, number_names(labels), strict=True)):
        room = int(homes.furniture_room[0, node])
        values = {"furniture": node, "label": label, "room": room, "description": name}
        lines.append(MemoryEvent("furniture", 0, values))
    return lines
