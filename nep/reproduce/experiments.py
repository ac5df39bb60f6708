"""What the tables of the paper are made of: settings, models and ablations, by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sgm.messages import shorten
from simulator.policies import POLICIES
from simulator.tasks.metrics import STEP_METRICS, Metric
from simulator.tasks.registry import TASKS


@dataclass(frozen=True, slots=True)
class Setting:
    """A task and the rules of the homes that it is played in: whether objects come and go."""

    task: str
    dynamic_nodes: bool

    @property
    def name(self) -> str:
        """Name in folders and files, such as "find_object-on"."""
        return f"{self.task}-{self.nodes}"

    @property
    def nodes(self) -> str:
        """Return "on" or "off"."""
        return "on" if self.dynamic_nodes else "off"

    @property
    def title(self) -> str:
        """Title in tables."""
        return f"{TASKS[self.task].title}, dynamic nodes {self.nodes}"

    @property
    def metric(self) -> Metric:
        """What a step is scored with."""
        return STEP_METRICS[TASKS[self.task].metric]


@dataclass(frozen=True, slots=True)
class Model:
    """A network that is trained afresh for every setting.

    Attributes:
        name: of its folders.
        title: in tables.
        is_default: whether it is trained unless models are named.
        config: name of a packaged config, or the path of any; `NAME.yaml` if left out.
    """

    name: str
    title: str
    is_default: bool = True
    config: str = ""

    @property
    def file(self) -> str:
        """Name or path of its config."""
        return self.config or f"{self.name}.yaml"


@dataclass(frozen=True, slots=True)
class Contestant:
    """A network of a table: one training in one setting.

    Attributes:
        setting: what it learns and plays.
        name: of its folder.
        title: in tables.
        configs: names of packaged configs, or paths; later ones win.
    """

    setting: Setting
    name: str
    title: str
    configs: tuple[str, ...]

    @property
    def key(self) -> str:
        """Folder of the training, relative to that of all runs."""
        return f"{self.setting.name}/{self.name}"


# The columns of Table 1.
PAPER_TASKS = ("predict_location", "relative_likelihood", "find_object")
SETTINGS = tuple(Setting(task, dynamic) for task in PAPER_TASKS for dynamic in (True, False))
# The setting of Table 2 and of figure 4.
ABLATION_SETTING = Setting("predict_location", True)
# A row of Table 1 each. One line here and a config of that name make one more.
MODELS = (
    Model("hms", "HMS"),
    Model("mlp", "NEP-MLP"),
    Model("gcn", "NEP-GCN"),
    Model("han", "NEP-HAN", is_default=False),
    Model("hgt", "NEP-HGT", is_default=False),
    Model("heat", "NEP-HEAT"),
    Model("heat_two_heads", "NEP-HEAT (two heads)"),
    Model("heat_plus", "NEP-HEAT+"),
    Model("heat_plus_no_belief", "NEP-HEAT+ (no belief)", is_default=False),
)
# What the paper finds, the best first, after the model that goes beyond it; every network is also
# compared with the best heuristic.
CLAIMED_ORDER = ("NEP-HEAT+", "NEP-HEAT", "NEP-GCN", "NEP-MLP")
# The columns of Table 2, by name of a model.
ABLATED = ("mlp", "gcn", "heat")
# The rows of Table 2 under "Full Model": config of that name, title.
ABLATIONS = {
    "no_prior": "(-) Prior probability",
    "no_transformer": "(-) Transformer",
    "no_temporal": "(-) Temporal features",
    "no_semantic": "(-) Semantic features",
}


def find_models(names: Sequence[str] | None) -> tuple[Model, ...]:
    """Return models by name, or by config; None gives those of Table 1.

    Args:
        names: of `MODELS`, or config files such as `my_model.yaml`: their title is their name.

    Raises:
        ValueError: if a name is unknown, or taken.
    """
    if names is None:
        return tuple(model for model in MODELS if model.is_default)
    known = {model.name: model for model in MODELS}
    found = [model for name, model in known.items() if {name, f"{name}.yaml"} & {*names}]
    taken = {*POLICIES, *known}
    for name in names:
        path = Path(name)
        if name in known or name.removesuffix(".yaml") in known:
            continue
        if path.suffix != ".yaml":
            raise ValueError(
                f"model must be one of {', '.join(known)}, got {shorten(name)}. Choose one of "
                "these, or give a config file, my_model.yaml."
            )
        if path.stem in taken:
            raise ValueError(
                "config files must be named otherwise than models, policies and each other, got "
                f"{shorten(name)}. Rename the file."
            )
        taken.add(path.stem)
        config = str(path.absolute()) if path.is_file() else name
        found.append(Model(path.stem, path.stem, config=config))
    return tuple(found)


def enter(model: Model, setting: Setting) -> Contestant:
    """Let a model take part in a setting."""
    return Contestant(setting, model.name, model.title, (model.file,))


def list_full_models() -> list[Contestant]:
    """Return the networks of the first row of Table 2."""
    return [enter(model, ABLATION_SETTING) for model in find_models(ABLATED)]


def list_ablations() -> list[Contestant]:
    """Return the networks of its other rows."""
    return [
        Contestant(
            ABLATION_SETTING,
            f"{model.name}-{ablation}",
            f"{model.title} {title}",
            (f"{model.name}.yaml", f"{ablation}.yaml"),
        )
        for ablation, title in ABLATIONS.items()
        for model in find_models(ABLATED)
    ]
