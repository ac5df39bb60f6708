"""Follows tasks and keeps what their looks have shown as events, in one home or in many."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sgm.memory.queries import Change
from simulator.events.table import PLACE, THING, EventQuestions, Events, EventTable, Nodes
from simulator.fan_out import check_workers, fan_out
from simulator.policies import make_policy
from simulator.tasks.answer import Answer
from simulator.tasks.registry import find_task
from simulator.tasks.task import Task
from simulator.world.sensing import Observation
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


class EventRecorder:
    """Listens to a task in H homes: every look, and every question before its look."""

    def __init__(self, task: Task, numbers: Sequence[int]) -> None:
        """Follow a task from its start on, in homes of these numbers, (H,)."""
        self._task = task
        self._numbers = np.asarray(numbers)
        self._memory = task.rollout.memory
        self._num_looks = np.zeros(len(numbers), dtype=np.int64)  # of each home
        self._change: Change | None = None
        self._rows = [np.zeros((0, 8), dtype=np.int64)]  # integer columns of events, (n, 8)
        self._shares = [np.zeros((0, 2))]  # coverage and confidence, (n, 2)
        # home, time, look, object row, (q, 4)
        self._asked = [np.zeros((0, 4), dtype=np.int64)]
        self._places: list[tuple[int, ...]] = []
        task.on_answer = self._note_answer
        task.rollout.on_change = self._note_change
        task.rollout.on_look = self._note_look

    def finish(self) -> EventTable:
        """Return the events of all homes so far."""
        memory, tables = self._memory, []
        rows, shares = np.concatenate(self._rows), np.concatenate(self._shares)
        asked = np.concatenate(self._asked)
        labels = np.array([*memory.labels, ""], dtype=object)
        things_of = memory.objects["home"]
        text = self._task.rollout.homes.object_descriptions.text
        clock = memory.clock
        for home, number in enumerate(self._numbers):
            num_places = int(memory.home_num_furniture[home])
            things = np.flatnonzero(things_of == home)
            new_id = np.full(len(things_of), -1)
            new_id[things] = num_places + np.arange(len(things))
            place_label = labels[memory.furniture_label[home, :num_places]]
            rooms = memory.room_label[home, memory.furniture_room[home, :num_places]]
            names = [text(int(code)) for code in memory.objects["key"][things]]
            of_home = rows[:, 0] == home
            _, time, look, order, thing, place, relation, is_seen = rows[of_home].T
            events = Events(
                np.full(len(time), number),
                time,
                look,
                order,
                new_id[thing],
                place,
                relation,
                is_seen.astype(bool),
                *shares[of_home].T,
            )
            nodes = Nodes(
                np.full(num_places + len(things), number),
                np.repeat([PLACE, THING], [num_places, len(things)]),
                np.concatenate([place_label, labels[memory.objects["label"][things]]]),
                np.concatenate([place_label, np.array(names, dtype=object)]),
                np.concatenate([labels[rooms], np.full(len(things), "", dtype=object)]),
            )
            chosen = np.flatnonzero(asked[:, 0] == home)
            _, time, look, thing = asked[chosen].T
            questions = EventQuestions(
                np.full(len(time), number),
                time,
                look,
                new_id[thing],
                tuple(self._places[question] for question in chosen),
            )
            seconds = None
            if clock is not None and not np.isnan(clock[home]).any():
                seconds = float(clock[home, 1])
            tables.append(EventTable(events, nodes, questions, seconds))
        return EventTable.join(tables)

    def _note_answer(self, answer: Answer) -> None:
        if answer.is_repeat:
            return
        home = answer.queries.home
        time = np.full(len(home), self._memory.time)
        self._asked.append(
            np.column_stack([home, time, self._num_looks[home], answer.queries.object])
        )
        self._places += [tuple(np.flatnonzero(is_answer).tolist()) for is_answer in answer.answers]

    def _note_change(self, change: Change) -> None:
        self._change = change

    def _note_look(self, seen: Observation) -> None:
        change, memory = self._change, self._memory
        assert change is not None
        edges = memory.edges
        rows, is_seen = change.edges, change.is_seen
        home, thing = edges["home"][rows], edges["object"][rows]
        relation = edges["relation"][rows]
        # Where the detector listed each edge first; what it did not list comes last.
        listed: dict[tuple[int, int, int], int] = {}
        detected = (seen.seen_home, seen.seen_code, seen.seen_relation)
        for number, key in enumerate(zip(*(column.tolist() for column in detected), strict=True)):
            listed.setdefault(key, number)
        keys = zip(
            home.tolist(), memory.objects["key"][thing].tolist(), relation.tolist(), strict=True
        )
        last = len(seen.seen_home)
        position = np.array([listed.get(key, last) for key in keys], dtype=np.int64)
        position = np.where(is_seen, position, last)
        by_look = np.lexsort((relation, thing, position, home))
        home, thing, relation = home[by_look], thing[by_look], relation[by_look]
        rows, is_seen = rows[by_look], is_seen[by_look]
        first = np.searchsorted(home, home)
        coverage = np.ones(memory.num_homes)
        coverage[change.home] = change.coverage
        confidence = np.where(is_seen, edges["confidence"][rows], 0.0)
        self._rows.append(
            np.column_stack(
                [
                    home,
                    np.full(len(home), memory.time),
                    self._num_looks[home],
                    np.arange(len(home)) - first,
                    thing,
                    edges["furniture"][rows],
                    relation,
                    is_seen,
                ]
            ).astype(np.int64)
        )
        self._shares.append(np.column_stack([coverage[home], confidence]))
        self._num_looks[change.home] += 1


def collect_events(
    source: HomeSource,
    streams: Streams,
    num_steps: int,
    *,
    policy: str = "bayesian",
    task: str = "predict_location",
    workers: int = 1,
    backend: str = "processes",
    on_homes: Callable[[int], None] = lambda count: None,
) -> EventTable:
    """Let a policy play a task in homes, and return what its looks have shown.

    The same arguments give the same table, for any number of workers.

    Args:
        source: where the homes come from.
        streams: names the homes.
        num_steps: time steps of each, or searches of Find Object.
        policy: who answers, and chooses looks where the rules of the homes leave that to it.
        task: name of the task.
        workers: processes that share the homes out.
        backend: where they work, see `fan_out`.
        on_homes: called with the number of homes that are done since the last call.

    Raises:
        ValueError: if there is no such policy, task or backend, or not so many homes or steps.
    """
    check_workers(workers, backend)
    source.check_steps(num_steps)
    jobs = []
    for group in source.list_groups(streams.homes):
        parts = np.array_split(np.array(group.homes), min(workers, len(group.homes)))
        jobs += [(source, streams.select(part.tolist()), num_steps, policy, task) for part in parts]
    tables = []
    for _, table in fan_out(_play, jobs, workers, backend):
        tables.append(table)
        on_homes(len(table.homes))
    return EventTable.join(tables)


def _play(
    source: HomeSource, streams: Streams, num_steps: int, policy: str, task: str
) -> EventTable:
    homes = source.make(streams)
    game = find_task(task)(homes, make_policy(policy, homes))
    recorder = EventRecorder(game, streams.homes)
    for _ in game.run(num_steps):
        pass
    return recorder.finish()
