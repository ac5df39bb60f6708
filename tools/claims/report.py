"""`results/claims.md` and `claims.json` from what has been played so far."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from nep.report.results import list_versions
from tools.claims.adaptation import make_adaptation
from tools.claims.known import make_known
from tools.claims.networks import NetworkSections
from tools.claims.open_questions import make_readings, make_rooms
from tools.claims.plan import ClaimsPlan
from tools.claims.released_code import make_released
from tools.claims.scores import ClaimsScores


def make_report(plan: ClaimsPlan) -> dict[str, bytes]:
    """Return the files by name: what was trained and played, and last what was not."""
    scores = ClaimsScores(plan)
    networks = NetworkSections(scores)
    sections: Mapping[str, Callable[[], tuple[str, Any]]] = {
        "orders": networks.make_orders,
        "switches": networks.make_switches,
        "rates": networks.make_rates,
        "messages": networks.make_messages,
        "released": partial(make_released, scores),
        "adaptation": partial(make_adaptation, scores),
        "known": partial(make_known, scores),
        "readings": partial(make_readings, scores),
        "rooms": partial(make_rooms, scores),
    }
    command = _make_command(plan)
    content = {"command": command, "versions": list_versions()}
    texts = []
    for name, make in sections.items():
        text, content[name] = make()
        texts.append(text)
    parts = [
        "# What the paper claims\n",
        f"{plan.num_homes} test homes x {plan.steps} steps, seed 0, the same for all rows. "
        "Differences are paired over homes, and over trainings where there are several, with "
        "95 % intervals. Nothing here was chosen by its scores in these homes. A "
        "training has the paper's setting (10,000 memories of "
        "100 homes, 25 epochs) unless its row says otherwise.\n",
        *texts,
        "## Not run\n",
        "".join(f"- {line}\n" for line in dict.fromkeys(scores.missing))
        or "Nothing that the command runs is missing.\n",
        "Not part of the command: 10,000 training homes "
        "([How NEP-HEAT+ came about](experiments.md#ten-thousand-training-homes)), "
        "`en_core_web_sm`.\n",
        _make_footer(plan, command),
    ]
    return {
        "claims.md": "\n".join(parts).encode(),
        "claims.json": (json.dumps(content, indent=1) + "\n").encode(),
    }


def _make_command(plan: ClaimsPlan) -> str:
    """Return the command line; folders change nothing in what it writes."""
    usual = ClaimsPlan(plan.runs, plan.data)
    options = ["python", "-m", "nep.bench", "claims"]
    for name, value, default in (
        ("seeds", plan.num_seeds, usual.num_seeds),
        ("num_homes", plan.num_homes, usual.num_homes),
        ("steps", plan.steps, usual.steps),
        ("epochs", plan.epochs, usual.epochs),
    ):
        options += [f"--{name}", str(value)] if value != default else []
    if plan.table_1 is not None:
        options += ["--table_1", f"results/{plan.table_1.name}"]
    return shlex.join(options)


def _make_footer(plan: ClaimsPlan, command: str) -> str:
    notes = []
    if plan.table_1 is not None:
        notes.append(
            "Seed 0 in homes of 32 places is that of [Table 1](table_1.md), which was "
            "played in the same test homes (checked by `bayesian`, home by home)."
        )
    versions = ", ".join(f"{name} {number}" for name, number in list_versions().items())
    return "\n".join(["", *notes, "", f"```\n{command}\n```\n\n{versions}.\n"])
