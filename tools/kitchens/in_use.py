"""Fit what `in_use` says of where a thing is, in simulated homes that are in use by the minute.

A robot looks around, and is asked for what was moved within ten minutes. Two numbers make the
answers of the shipped network fit (`sgm.belief.in_use`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from sgm.belief import Belief, Detector, compute_posterior
from sgm.memory.memory_questions import Asked
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.network.network import Network
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from sgm.prior.prior_graph import PriorGraph
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from simulator.story.run_recorder import record_run
from simulator.world.config import HomeConfig
from simulator.world.mixture.lived_in_homes import draw_sessions
from simulator.world.source import SampledSource

_STEP_SECONDS = 60.0
_IN_USE = 10  # steps
_NUM_STEPS = 360
_ASKED = 0.5  # share of the steps in which is asked
_LEAST = 1e-6  # probability


class UseQuestion(NamedTuple):
    """What a finder says of a thing that is in use.

    Attributes:
        before: log odds that it is where it was seen last, by the policy, before looks of the step.
        after: the same with these looks.
        has_moved: whether it is not there.
    """

    before: float
    after: float
    has_moved: bool


def make_source(rng: np.random.Generator) -> SampledSource:
    """Draw the rules of a home in which things are moved in sessions."""
    furniture, objects = int(rng.choice([3, 4, 6])), int(rng.choice([1, 2, 3]))
    config = HomeConfig(
        furniture_per_room=furniture,
        objects_per_furniture=objects,
        detection_error=float(rng.choice([0.05, 0.1, 0.2])),
        looks="random",
        looks_per_step=int(rng.choice([1, 2, 3])),
    )
    start = f"2024-05-06T{rng.integers(7, 20):02}:00:00"
    dynamics = draw_sessions(rng, start, _STEP_SECONDS, sum(config.room_sizes) * objects)
    return SampledSource(PriorGraph.household(), replace(config, dynamics=dynamics))


def ask(number: int, policy: NetworkPolicy) -> Iterator[UseQuestion]:
    """Let a robot live in home `number`, and ask for what was moved within ten minutes."""
    rng = np.random.default_rng([91, number])
    run = record_run(make_source(rng), _NUM_STEPS, home=number, policy="random")
    truth = run.truth
    assert truth is not None
    looks: dict[int, list[tuple[int, tuple[str, ...]]]] = {}
    for look in run.looks:
        looks.setdefault(look.step, []).append((look.furniture, look.seen))
    memory = run.memory_at(0).copy()
    known: set[str] = set()
    for step in range(1, run.num_steps):
        memory.step()
        for place, seen in looks.get(step, []):
            memory.observe(place, [Sighting(name) for name in seen])
            known |= set(seen)
        lately = truth.furniture[max(step - _IN_USE, 0) : step + 1]
        is_moved = (lately[1:] != lately[:-1]).any(axis=0) & (lately[-1] >= 0)
        names = sorted({truth.descriptions[code] for code in truth.code[step, is_moved]} & known)
        if names and rng.random() < _ASKED:
            name = names[int(rng.integers(len(names)))]
            there = {id_ for id_ in memory.furniture_ids if name in truth.list_there(step, id_)}
            asked = _tell_unless_seen(memory, name, there, policy)
            if asked is not None:
                yield asked


def _tell_unless_seen(
    memory: SceneGraphMemory, name: str, there: set[int], policy: NetworkPolicy
) -> UseQuestion | None:
    """Ask a policy; None for what was seen in this step, which is known, or is several."""
    asked: Asked = memory.ask((name,))
    last = int(asked.batch.objects["last_furniture"][asked.queries.object[0]])
    if len(asked.rows) > 1 or last < 0 or asked.looks.num_seen.any():
        return None
    policy.reset(asked.batch)
    belief: Belief = policy.believe(asked.batch, asked.queries)
    detector = Detector.learn(asked.batch.history, Detector())
    after = compute_posterior(belief, asked, detector).places[last]
    has_moved = asked.furniture_ids[last] not in there
    return UseQuestion(
        before=_log_odds(belief.places[0, last]), after=_log_odds(after), has_moved=has_moved
    )


def _log_odds(probability: float) -> float:
    kept = min(max(float(probability), _LEAST), 1 - _LEAST)
    return float(np.log(kept / (1 - kept)))


def compute_loss(questions: Sequence[UseQuestion], bias: float, slope: float) -> float:
    """Return the mean log loss of whether each has moved, in nats, by two numbers."""
    before, after, has_moved = np.array(questions).T
    odds = after + bias + (slope - 1) * before
    return float(np.logaddexp(0.0, np.where(has_moved > 0, odds, -odds)).mean())


def fit(questions: Sequence[UseQuestion]) -> tuple[float, float]:
    """Return the bias and slope with the least loss."""
    found = minimize(lambda pair: compute_loss(questions, *pair), [0.0, 1.0], method="Powell").x
    return float(found[0]), float(found[1])


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser("python -m tools.kitchens.in_use", __doc__)
    parser.add_argument("--homes", type=int, default=60, help="number of homes")
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        if options.homes < 1:
            raise ValueError(f"homes must be at least 1, got {options.homes}. Take 60.")
        policy = NetworkPolicy(Network.load(find_trained("any_home")), 0.0)
        questions = [each for home in range(options.homes) for each in ask(home, policy)]
        bias, slope = fit(questions)
        print(
            f"{len(questions)} questions in {options.homes} homes: bias {bias:.2f}, slope "
            f"{slope:.2f}, {compute_loss(questions, bias, slope):.3f} nats of whether it has "
            f"moved; without {compute_loss(questions, 0.0, 1.0):.3f}"
        )


if __name__ == "__main__":
    run_main(main)
