"""The model card of an exported network: what it is, how well it does, where it ends."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nep.report.tables import join_table

# Who is scored in the same homes, worst first as a rule.
REFERENCES = ("priors", "last_seen_prior", "bayesian", "prior_filter", "ceiling")

SCORED_TASKS = ("predict_location", "find_object")

TEMPLATE = Path(__file__).parents[1] / "pretrained" / "card_template.md"

# What is true of networks that were trained in simulated homes, and of those in recorded ones.
_SIMULATED = {
    "data": """\
Simulated homes alone, sampled from a prior over rooms, furniture and objects (docs/priors.md):
{memories}. Homes have 4 rooms with 8 pieces of furniture each and about 190 objects. In each
time step one object in twenty moves; a look misses each object there with probability 0.25. No
recorded home and no person's data went into it.""",
    "step_limit": """\
In its training homes one object in twenty moves per time step. Let your steps be as long as it
  takes for that.""",
    "size_limit": """\
All training homes had 32 places, one of which was looked at in a time step. In homes of 8 and 16 it
  is better than Bayesian (results/experiments.md), but it makes too little of looks in vain at one
  place in several time steps, which such homes hardly teach.""",
}
_MIXED = {
    "data": """\
Simulated homes alone, drawn from a mixture (`simulator.world.mixture`): {memories}.
Homes have 1 to 8 rooms and 4 to 60 places; objects move as in the paper's homes or with people who
have habits, in steps of ten minutes to a day; looks miss up to four objects in ten; the prior that
the agent knows is the true one, a noisy one, one of another home, one that lacks words, or none. No
recorded home and no person's data went into it.""",
    "step_limit": """\
It reads rates and shares, not counts, and learns how fast things move from the memory itself. Give
  the memory a clock, so that it knows how long a step is.""",
    "size_limit": "Homes of more than 60 places were not in its training.",
}
_CEILING = "`ceiling` knows how the home behaves; it is what an answer can be worth.\n"
_KINDS = """
## Homes of every kind

The network beside the best rule in each kind of home (`python -m nep.any_home`). It was trained in
no recorded home.

{}"""
_RECORDED = {
    "data": """\
Recorded homes (docs/traces.md): {memories}. Whoever has the network may find out what was where in
them, and when: hand it on as you would hand on the recordings.""",
    "step_limit": "Let your time steps be as long as those that it was trained with.",
    "size_limit": "How well it does in homes of other sizes than theirs was not measured.",
}


def make_card(name: str, config: Mapping[str, Any]) -> str:
    """Write the card of an exported network, in Markdown.

    Args:
        name: of the network.
        config: its `config.json`, with what was measured.
    """
    notes, calibration = config["notes"], config["calibration"]
    measured = notes["measured"]
    names = {"network": f"**{name}**"}
    training = notes["training"]
    kind = _SIMULATED
    if training is not None:
        if training.get("is_recorded"):
            kind = _RECORDED
        elif training.get("homes", {}).get("homes") == "mixed":
            kind = _MIXED
    is_mixed = measured.get("source", {}).get("homes") == "mixed"
    first_guesses, looks = (measured["scores"][task] for task in SCORED_TASKS)
    scores = join_table(
        ["policy", "right first guesses", "std over homes", "looks until found", "std over homes"],
        [
            [
                names.get(who, who),
                f"{guesses['mean']:.3f}",
                f"{guesses['std']:.3f}",
                f"{looks[who]['mean']:.2f}",
                f"{looks[who]['std']:.2f}",
            ]
            for who, guesses in sorted(first_guesses.items(), key=lambda item: item[1]["mean"])
        ],
    )
    columns = {
        "nll": "NLL",
        "ece": "error, all decisions",
        "ece_first": "error, first looks",
        "ece_elsewhere": 'error of "elsewhere"',
        "elsewhere_there": '"elsewhere" if at a known place',
        "elsewhere_gone": '"elsewhere" if not',
    }
    calibrated = join_table(
        ["probabilities", *columns.values()],
        [
            [when, *(f"{measured[key][column]:.3f}" for column in columns)]
            for when, key in (("softmax of the logits", "before"), ("calibrated", "after"))
        ],
    )
    return TEMPLATE.read_text(encoding="utf-8").format(
        name=name,
        encoder=config["model"]["encoder"]["class_path"].rpartition(".")[2],
        num_parameters=f"{notes['num_parameters']:,}",
        size=notes["num_parameters"] * 4 / 1e6,
        command=notes["command"],
        checkpoint=notes["checkpoint_sha256"],
        scored_homes=measured["homes"],
        scored_in="simulated test homes of a mixture" if is_mixed else "simulated test homes",
        among="" if is_mixed else " among 32 places",
        ceiling=_CEILING if "ceiling" in first_guesses else "",
        kinds=_KINDS.format(notes["kinds"]) if "kinds" in notes else "",
        scored_steps=measured["steps"],
        num_decisions=f"{measured['num_decisions']:,}",
        scores=scores,
        data=kind["data"].format(memories=_describe_training(training)),
        step_limit=kind["step_limit"],
        size_limit=kind["size_limit"],
        calibration=calibrated,
        **{f"calibrated_{key}": value for key, value in calibration.items()},
    )


def _describe_training(training: Mapping[str, Any] | None) -> str:
    if training is None:
        return "its checkpoint does not say how many"
    chosen = (
        "all memories" if training["snapshots"] is None else f"{training['snapshots']:,} memories"
    )
    return (
        f"{chosen} of {training['num_homes']} homes x {training['steps']} time steps, with the\n"
        f"questions and looks of the task `{training['task']}`, collected by `{training['policy']}`"
    )
