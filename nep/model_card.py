"""The model card of an exported network: what it is, how well it does, where it ends."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nep.tables import join_table

# Who is scored in the same homes, worst first as a rule.
REFERENCES = ("priors", "last_seen_prior", "bayesian", "prior_filter", "ceiling")

TEMPLATE = Path(__file__).parent / "pretrained" / "card_template.md"


def make_card(name: str, config: Mapping[str, Any]) -> str:
    """Write the card of an exported network, in Markdown.

    Args:
        name: of the network.
        config: its `config.json`, with what was measured.
    """
    notes, calibration = config["notes"], config["calibration"]
    measured = notes["measured"]
    names = {"network": f"**{name}**"}
    scores = sorted(measured["accuracy"].items(), key=lambda item: item[1]["mean"])
    accuracy = join_table(
        ["policy", "accuracy", "std over homes"],
        [[names.get(who, who), f"{own['mean']:.3f}", f"{own['std']:.3f}"] for who, own in scores],
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
        homes=measured["homes"],
        steps=measured["steps"],
        num_decisions=f"{measured['num_decisions']:,}",
        accuracy=accuracy,
        calibration=calibrated,
        temperature=calibration["temperature"],
        elsewhere_logit=calibration["elsewhere_logit"],
        absent_logit=calibration["absent_logit"],
    )
