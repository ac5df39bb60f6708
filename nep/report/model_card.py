"""The model card of an exported network: what it is, how well it does, where it ends."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nep.report.tables import join_table
from sgm.evidence.columns import CLOCK_GROUPS
from sgm.evidence.elsewhere import ELSEWHERE

# Who is scored in the same homes, worst first as a rule.
REFERENCES = ("priors", "last_seen_prior", "bayesian", "prior_filter", "ceiling")

SCORED_TASKS = ("predict_location", "find_object")

TEMPLATE = Path(__file__).with_name("card_template.md")

# What is true of networks that were trained in simulated homes, and of those in recorded ones.
_SIMULATED = {
    "data": """\
Simulated homes alone, sampled from a prior over rooms, furniture and objects (docs/priors.md):
{memories}. Homes have 4 rooms with 8 pieces of furniture each and about 190 objects. In each
time step one object in twenty moves; a look misses each object there with probability 0.25. No
household of people, scripted or recorded, went into it.""",
    "step_limit": """\
In its training homes one object in twenty moves per time step. Let your steps be as long as it
  takes for that.""",
    "size_limit": """\
All training homes had 32 places, one of which was looked at in a time step. In homes of 8 and 16 it
  is better than Bayesian (results/experiments.md), but it makes too little of negative looks at one
  place in several time steps, which such homes hardly teach.""",
}
_MIXED = {
    "data": """\
Simulated homes alone, drawn from a mixture (`simulator.world.mixture`): {memories}.
Homes have 1 to 8 rooms and 4 to 60 places; objects move as in the paper's homes or with people who
have habits, in steps of ten minutes to a day; looks miss up to four objects in ten; the prior that
the agent knows is the true one, a noisy one, one of another home, one that lacks words, or none. No
household of people, scripted or recorded, went into it.""",
    "step_limit": """\
It reads rates and shares, not counts, and learns how fast things move from the memory itself. Give
  the memory a clock, so that it knows how long a step is.""",
    "size_limit": "Homes of more than 60 places were not in its training.",
}
_LIVED_IN = _MIXED | {
    "data": """\
Simulated homes alone: {memories}. Things move in sessions of residents, with people who have
habits, or as in the paper's homes (docs/worlds.md), in steps of 30 seconds to a day. Homes have 1
to 8 rooms and 4 to 60 places; looks miss up to four objects in ten; the prior that the agent knows
is the true one, a noisy one, one of another home, one that lacks words, or none. No household of
people, scripted or recorded, went into it.""",
}
_CEILING = """\
`ceiling` knows the true dynamics of the home: it bounds right first guesses. `prior_filter` is
given the rules of these homes; the others are not.
"""
_KINDS = """
## Homes of every kind

The network beside the best rule in each kind of home (`python -m tools.bench any_home`). None of
the households was in its training. Those of HOMER are scripted: days composed of people's
schedules, played in a simulator.

{}"""
_RECORDED = {
    "data": """\
Recorded homes (docs/traces.md): {memories}. A reader of the network may find out what was where in
them, and when: hand it on as you would hand on the recordings.""",
    "step_limit": "Let your time steps be as long as those that it was trained with.",
    "size_limit": "How well it does in homes of other sizes than theirs was not measured.",
}
_DRAWN = {"mixed": _MIXED, "lived in": _LIVED_IN}
_ELSEWHERE = {  # limits, by whether it is an answer of the network
    True: """\
"Elsewhere" is an answer of the network, learnt in homes of which some things are carried out or
  used up. The section above does not measure it: results/elsewhere.md does.""",
    False: """\
"Elsewhere" means no more than this: {share} of the searches the object was at no known place, and
  negative looks make that likelier. The network cannot tell a thing that has left from one that it
  has not found yet. Of a thing that was seen, `ObjectFinder` asks the memory instead
  (docs/robot/leaving.md, not measured here).""",
}

_MEASURED = """\
## Scores

{question}, and looks until an object is found, in
{homes} {kind} test homes{mixture} x {steps} steps, none of them seen in training:

{scores}
{ceiling}{kinds}
## Probabilities

Measured in the same homes: {steps} searches in each, up to 8 looks per search, {num_decisions}
decisions. One search in ten is for something that is not in the home. Errors are expected
calibration errors (10 bins).

{calibrated}
In these figures "elsewhere" is {elsewhere_share} before any look of a time step, the same for every
question. Things that are gone are rather those that a network is unsure of, so that it is too low
where the best place is unlikely, and too high after a negative look at a likely one.
"""
_UNMEASURED = """\
## Scores and probabilities

Not measured: it was exported with `--num_homes=0`.
"""


def make_card(name: str, config: Mapping[str, Any]) -> str:
    """Write the card of an exported network, in Markdown.

    Args:
        name: of the network.
        config: its `config.json`, with what was measured, if anything was.
    """
    notes = config["notes"]
    training = notes["training"] or {}
    texts = _SIMULATED
    if training.get("is_recorded"):
        texts = _RECORDED
    elif (drawn := training.get("homes", {}).get("homes")) in _DRAWN:
        texts = _DRAWN[drawn]
    measured = _UNMEASURED
    if "measured" in notes:
        kinds = _KINDS.format(notes["kinds"]) if "kinds" in notes else ""
        measured = _describe_measured(name, notes["measured"], kinds)
    share = "it is taken that in one of ten" if "measured" not in notes else "in one of ten"
    start = training.get("start")
    features, is_any_home = config["features"], "encoder" not in config["model"]
    hides_clock = set(CLOCK_GROUPS) <= set(features.get("evidence_without", ()))
    has_hours = features.get("evidence", False) and not hides_clock
    reads_clock = features["clock"] or has_hours
    blind = "poses or people" if reads_clock else "poses, people or the time of day"
    return TEMPLATE.read_text(encoding="utf-8").format(
        name=name,
        encoder="Sets" if is_any_home else config["model"]["encoder"]["class_path"].split(".")[-1],
        num_parameters=f"{notes['num_parameters']:,}",
        size=notes["num_parameters"] * 4 / 1e6,
        command=notes["command"],
        checkpoint=notes["checkpoint_sha256"],
        versions=_describe_versions(notes.get("versions", {})),
        data=texts["data"].format(memories=_describe_training(notes["training"]))
        + (f"\nIts training began with the weights of `{start}`." if start else ""),
        step_limit=texts["step_limit"],
        size_limit=texts["size_limit"],
        measured=measured,
        elsewhere=_ELSEWHERE[is_any_home].format(share=share),
        blind=f"It does not see {blind}.",
    )


def _describe_measured(name: str, measured: Mapping[str, Any], kinds: str) -> str:
    """Write the sections on scores and probabilities."""
    source = measured.get("source", {})
    is_recorded, is_mixed = source.get("source") == "recorded", source.get("homes") in _DRAWN
    first_guesses, looks = (measured["scores"][task] for task in SCORED_TASKS)
    scores = join_table(
        ["policy", "right first guesses", "std over homes", "looks until found", "std over homes"],
        [
            [
                {"network": f"**{name}**"}.get(who, who),
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
            for when, key in (
                ("softmax of the logits, asked after every look", "before"),
                ("asked once, looks by Bayes' rule", "after"),
            )
        ],
    )
    return _MEASURED.format(
        question="Share of right first guesses" + _tell_places(source),
        kind="recorded" if is_recorded else "simulated",
        homes=measured["homes"],
        steps=measured["steps"],
        num_decisions=f"{measured['num_decisions']:,}",
        scores=scores,
        mixture=" of a mixture" if is_mixed else "",
        ceiling=_CEILING if "ceiling" in first_guesses else "",
        kinds=kinds,
        calibrated=calibrated,
        elsewhere_share=ELSEWHERE,
    )


def _tell_places(source: Mapping[str, Any]) -> str:
    """Say among how many places was guessed, where all homes have as many."""
    if source.get("source") != "sampled":
        return ""
    home = source["home"]
    return f" among {len(home['rooms']) * home['furniture_per_room']} places"


def _describe_versions(versions: Mapping[str, str]) -> str:
    """Say with what it was exported, as far as it was kept."""
    known = ", ".join(f"{name} {version}" for name, version in versions.items())
    return known if "commit" in versions else f"{known}; the commit was not kept"


def _describe_training(training: Mapping[str, Any] | None) -> str:
    if training is None:
        return "its checkpoint does not say how many"
    if "num_memories" in training:
        chosen = f"{training['num_memories']:,} memories"
    elif training["snapshots"] is None:
        chosen = "all memories"
    else:
        chosen = f"at most {training['snapshots']:,} memories"
    num_sources = 1 + len(training.get("also_homes", ()))
    sources = f" of each of {num_sources} sources" if num_sources > 1 else ""
    text = (
        f"{chosen} of {training['num_homes']} homes{sources} x {training['steps']} time steps, "
        "with the\n"
        f"questions and looks of the task `{training['task']}`, collected by `{training['policy']}`"
    )
    for policy in training.get("also_policies", ()):
        text += f",\nand of as many others by `{policy}`"
    return text
