"""Let policies play the tasks in recorded homes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from simulator.policies import POLICIES, Policy
from simulator.tasks.evaluation import TaskScores, play_games
from simulator.trace.recordings import Recordings
from simulator.world.homes import Homes

# What needs a simulator's knowledge of the true dynamics (docs/traces.md).
_SIMULATED_ONLY = ("ceiling",)


def evaluate_recordings(
    make: Callable[[Homes], Policy],
    recordings: Recordings,
    seed: int,
    split: str,
    num_steps: int,
    on_step: Callable[[], None] = lambda: None,
    task: str = "predict_location",
    workers: int = 1,
    backend: str = "processes",
) -> TaskScores:
    """Let a policy play a task in all recorded homes, in lockstep.

    Args:
        make: gets the homes of a group and returns the policy; only oracles keep them.
        recordings: the homes.
        seed: of queries, detection errors and ties.
        split: "train", "val" or "test", likewise.
        num_steps: T, at most what was recorded.
        on_step: called after each step of each group.
        task: name of the task.
        workers: how many play at a time, see `play_games`.
        backend: where they work, see `fan_out`.

    Raises:
        ValueError: if there is no task of that name, the homes were recorded for fewer steps, or
            there is no worker or no such backend.
    """
    recordings.check_steps(num_steps)
    (scores,) = play_games(
        [(make, task)], recordings.make_homes, recordings.list_groups(), seed, split, num_steps,
        lambda game: on_step(), workers, backend,
    )  # fmt: skip
    return scores


def list_policies(recordings: Recordings) -> tuple[str, ...]:
    """Return the names of the policies that can play in such homes."""
    left_out = () if recordings.has_truth else _SIMULATED_ONLY
    return tuple(name for name in POLICIES if name not in left_out)


def check_policies(names: Sequence[str], recordings: Recordings) -> None:
    """Check that policies can play in such homes.

    Raises:
        ValueError: if one needs what only a simulator knows.
    """
    for name in names:
        if name in POLICIES and name not in list_policies(recordings):
            raise ValueError(
                f"policies must not need the true dynamics of recorded homes, got {name}. "
                "Leave it out."
            )
