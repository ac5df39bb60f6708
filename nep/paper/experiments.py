"""What the tables of the paper are made of: settings, models and ablations, by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simulator.tasks.metrics import STEP_METRICS, Metric
from simulator.tasks.registry import TASKS


@dataclass(frozen=True, slots=True)
class Setting:
    """A task and the rules of the homes that it is played in.

    Attributes:
        task: its name.
        dynamic_nodes: whether objects are added and removed.
    """

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
        name: of its folders; also of its config, `NAME.yaml`.
        title: in tables.
        is_default: whether it is trained unless models are named.
    """

    name: str
    title: str
    is_default: bool = True


@dataclass(frozen=True, slots=True)
class Contestant:
    """A network of a table: one training in one setting.

    Attributes:
        setting: what it learns and plays.
        name: of its folder.
        title: in tables.
        configs: packaged configs; later ones win.
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
SETTINGS = tuple(Setting(task, dynamic) for task in TASKS for dynamic in (True, False))
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
    Model("heat_plus", "NEP-HEAT+"),
)
# What the paper finds, the best first, after the model that goes beyond it; every network is also
# compared with the best heuristic.
CLAIMED_ORDER = ("heat_plus", "heat", "gcn", "mlp")
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
    """Return models by name; None gives those of Table 1.

    Raises:
        ValueError: if a name is unknown.
    """
    if names is None:
        return tuple(model for model in MODELS if model.is_default)
    known = {model.name: model for model in MODELS}
    for name in names:
        if name not in known:
            raise ValueError(
                f"model must be one of {', '.join(known)}, got {name!r}. Choose one of these."
            )
    return tuple(model for model in MODELS if model.name in names)


def enter(model: Model, setting: Setting) -> Contestant:
    """Let a model take part in a setting."""
    return Contestant(setting, model.name, model.title, (f"{model.name}.yaml",))


def list_claimed_order() -> list[str]:
    """Return the titles of `CLAIMED_ORDER`."""
    titles = {model.name: model.title for model in MODELS}
    return [titles[name] for name in CLAIMED_ORDER]


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
