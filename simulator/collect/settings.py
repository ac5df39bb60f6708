"""What to collect."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from sgm.checks import check_at_least, check_at_most, check_choice, check_seed
from sgm.evidence.columns import EVIDENCE_VERSION
from simulator.policies.registry import check_policies, identify_policy
from simulator.snapshots.shards import MAX_HOMES
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task, make_file_name
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import SPLITS

# What a collection may keep beside the memory, by the name of its option.
EXTRAS = ("belief", "evidence", "relevance")


@dataclass(frozen=True, slots=True)
class CollectConfig:
    """What to collect.

    Attributes:
        homes: where homes come from.
        num_homes: how many, from number 0 on.
        steps: time steps per home, or searches of Find Object; where a source says for how long a
            home is lived in, so many of its steps are kept, or `HomeSource.kept_share` of them.
        policy: name of the collecting policy; "module:Class=FILE" for one that is loaded, such as
            a trained network ("nep.players.policy:NEPPolicy=FILE").
        task: name of the task it plays.
        asked: shares of the kinds of questions, of a task that takes them (`Task.shares`); None for
            those of the task.
        split: "train", "val" or "test": their homes never coincide.
        seed: experiment seed.
        belief: whether each snapshot keeps what `HomeFilter` believes about its query object.
        evidence: whether it keeps what the memory says about each place (`sgm.evidence`).
        relevance: whether each snapshot keeps the relevance of every place, if its task knows it.
    """

    homes: HomeSource = field(default_factory=SampledSource)
    num_homes: int = 100
    steps: int = 100
    policy: str = "bayesian"
    task: str = "predict_location"
    asked: QuestionShares | None = None
    split: str = "train"
    seed: int = 0
    belief: bool = False
    evidence: bool = False
    relevance: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a count, a name or the seed is out of range."""
        check_at_least(1, num_homes=self.num_homes, steps=self.steps)
        check_at_most(MAX_HOMES, num_homes=self.num_homes)
        check_seed(self.seed)
        task = find_task(self.task)
        if self.asked is not None and task.shares is None:
            raise ValueError(
                f"asked must be left out for a task with questions of its own, got {self.task}. "
                "Leave it out, or take simulator.tasks.ask_anything:AskAnything."
            )
        check_choice("split", self.split, SPLITS)
        check_policies([self.policy])

    def check_homes(self) -> None:
        """Raise ValueError if there are fewer homes or steps, or the policy cannot play there."""
        self.homes.check_homes(range(self.num_homes))
        self.homes.check_steps(self.steps)
        check_policies([self.policy], self.homes)

    def describe(self) -> dict[str, Any]:
        """Return everything that the bytes of a collection depend on, as JSON values."""
        settings = {field.name: getattr(self, field.name) for field in fields(self)}
        shares = find_task(self.task).shares if self.asked is None else self.asked
        del settings["asked"]
        if shares is not None:
            settings["asked"] = asdict(shares)
        for extra in EXTRAS:
            if not settings[extra]:
                del settings[extra]  # collections without it are what they were before it existed
        if self.evidence:
            settings["evidence"] = EVIDENCE_VERSION
        checksum = identify_policy(self.policy)
        if checksum is not None:  # whatever the file is called
            settings["policy"] = f"{self.policy.partition('=')[0]}={checksum}"
        return {**settings, "homes": self.homes.describe(), "labels": list(self.homes.labels)}

    def name_folder(self) -> Path:
        """Return a folder for the collection, named for its settings: others get another one."""
        settings = self.describe()
        homes = json.dumps(settings["homes"], sort_keys=True).encode()
        policy, loads, checksum = settings["policy"].partition("=")
        if loads:
            policy = f"{policy}-{checksum[:8]}"
        extras = "".join(  # those of which there are versions with theirs
            f"-{extra}" if settings[extra] is True else f"-{extra}{settings[extra]}"
            for extra in EXTRAS
            if extra in settings
        )
        name = f"{make_file_name(self.task)}-{policy}-{self.steps}steps-seed{self.seed}"
        of_homes = f"homes{hashlib.sha256(homes).hexdigest()[:8]}{extras}"
        return Path(f"{name}-{of_homes}") / f"{self.split}-{self.num_homes}homes"
