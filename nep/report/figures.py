"""Figures of results, and searches of a policy as pictures."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from nep.players.contestants import MakePolicy
from nep.report.results import ScoreSummary
from nep.report.statistics import compute_interval, smooth
from sgm.policies.policy import compute_probabilities
from simulator.tasks.answer import Answer
from simulator.tasks.find_object import FindObject
from simulator.tasks.metrics import STEP_METRICS
from simulator.tasks.task import Task
from simulator.world.source import HomeSource
from simulator.world.streams import Streams

if TYPE_CHECKING:
    from simulator.drawing import FloorPlan

# One colour and line style per policy, the same in every figure; oracles are dashed grey.
_STYLES: Mapping[str, dict[str, Any]] = {
    "random": {"color": "#c7c7c7"},
    "priors": {"color": "#bcbd22"},
    "frequentist": {"color": "#e377c2"},
    "myopic": {"color": "#8c564b"},
    "bayesian": {"color": "#1f77b4"},
    "last_seen": {"color": "#98df8a"},
    "last_seen_prior": {"color": "#2ca02c"},
    "prior_filter": {"color": "#9467bd"},
    "home_filter": {"color": "#c5b0d5"},
    "persistence": {"color": "#5f9ea0"},
    "adaptive": {"color": "#006d5b"},
    "oracle": {"color": "#7f7f7f", "linestyle": ":"},
    "schedule_oracle": {"color": "#404040", "linestyle": "-."},
    "ceiling": {"color": "#404040", "linestyle": "--"},
}


_WINDOW = 10  # steps that a curve is averaged over
# Rules that are drawn where all would be too many to follow.
_FEW = ("random", "priors", "myopic", "bayesian", "persistence", "oracle", "ceiling")
_MOST_CURVES = 10
_NUM_BINS = 10  # of a calibration diagram

# Networks, in the order in which they are given.
_MODEL_COLORS = ("#d62728", "#ff7f0e", "#17becf", "#e41a8c", "#5e3c99", "#2ca02c")
_WARM_UP = 10  # searches before those that are drawn, so that the memory is not empty
_SHOWN = 3  # searches
_MOST_LOOKS = 6  # that are drawn


def draw_over_steps(
    values: Mapping[str, np.ndarray],
    highlight: str | Sequence[str],
    *,
    title: str,
    metric: str,
) -> Figure:
    """Draw a score over steps for every policy, models in bold with a band.

    Curves are averaged over the last ten steps; the band is one standard error over homes.
    A line leads from the end of each curve to its name. Of more than ten policies, a few rules and
    oracles are drawn, and all in bold.

    Args:
        values: score of each home and step, (H, T), by policy.
        highlight: which ones to draw in bold: one name or several.
        title: of the figure.
        metric: what the score is.

    Source: paper figure 4.
    """
    bold = {highlight} if isinstance(highlight, str) else set(highlight)
    if len(values) > _MOST_CURVES:
        values = {name: rows for name, rows in values.items() if name in bold or name in _FEW}
    figure = Figure(figsize=(7.5, 4.8), dpi=120, layout="constrained")
    axes = figure.subplots()
    ends: list[tuple[float, str, str]] = []
    colors = cycle(_MODEL_COLORS)
    for name, rows in values.items():
        style: dict[str, Any] = dict(_STYLES[name] if name in _STYLES else {"color": next(colors)})
        curves = smooth(rows, _WINDOW)  # (H, T)
        mean = curves.mean(axis=0)
        steps = np.arange(1, len(mean) + 1)
        is_bold = name in bold
        axes.plot(steps, mean, linewidth=3 if is_bold else 1.4, zorder=3 if is_bold else 2, **style)
        if is_bold:
            error = curves.std(axis=0) / np.sqrt(len(curves))
            axes.fill_between(
                steps, mean - error, mean + error, color=style["color"], alpha=0.2, linewidth=0
            )
        ends.append((float(mean[-1]), name, style["color"]))
    axes.set_ylim(bottom=0)
    _label_ends(axes, ends, last=len(mean))
    axes.set_xlim(1, len(mean) * 1.3)  # room for the names
    axes.set_xticks([tick for tick in axes.get_xticks() if 0 < tick <= len(mean)])
    axes.set_xlabel("time step")
    axes.set_ylabel(f"{metric}, mean of {_WINDOW} steps")
    axes.set_title(title, loc="left")
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_task(
    task: type[Task], scores: Mapping[str, ScoreSummary], highlight: str | Sequence[str]
) -> Figure:
    """Draw the score of a task over steps in unseen homes, see `draw_over_steps`."""
    return draw_over_steps(
        {name: summary.values for name, summary in scores.items()},
        highlight,
        title=f"{task.title} on unseen homes",
        metric=STEP_METRICS[task.metric].title,
    )


def draw_scores(
    panels: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]], colors: Mapping[str, str]
) -> Figure:
    """Draw the mean score of each contestant with its 95 % interval over homes.

    Args:
        panels: score of each home, (H,), by contestant, by what the marks are, by title of a panel.
            A panel has filled marks and, of a second kind, hollow ones.
        colors: of contestants, which are the rows, the first at the top.
    """
    names = list(colors)
    figure = Figure(figsize=(9.5, 1.1 + 0.24 * len(names)), dpi=100, layout="constrained")
    columns = figure.subplots(1, len(panels), squeeze=False, sharey=True).ravel()
    for axes, (title, kinds) in zip(columns, panels.items(), strict=True):
        for (group, scores), shift in zip(kinds.items(), (-0.14, 0.14), strict=False):
            for height, name in enumerate(names):
                if name not in scores:
                    continue
                color, inside = colors[name], colors[name] if shift < 0 else "white"
                interval, y = compute_interval(scores[name]), height + shift
                axes.plot(interval, [y, y], color=color, linewidth=1.2)
                axes.plot(scores[name].mean(), y, "o", ms=4.5, mec=color, mfc=inside)
            axes.plot(
                [], [], "o", ms=4.5, mec="black", mfc="black" if shift < 0 else "white", label=group
            )
        axes.set_title(fill(title, 28), loc="left", fontsize=10)
        axes.grid(axis="x", alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
    columns[0].set_yticks(
        range(len(names)), [name.replace("_", " ").replace("`", "") for name in names]
    )
    for label, name in zip(columns[0].get_yticklabels(), names, strict=True):
        label.set_color(colors[name])
    columns[0].invert_yaxis()
    handles, labels = columns[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=2, frameon=False, fontsize=9)
    return figure


def draw_by_hour(accuracy: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Draw the share of wrong answers in each hour of the day, a panel each for some kinds of play.

    Rows are the same in all panels: the player that is best over all of them stands at the top.
    Where one has not played, its row is empty.

    Args:
        accuracy: share of right answers in hours 0 to 23, nan where nothing was asked, by player
            and by title.
    """
    hours: dict[str, list[Sequence[float]]] = {}
    for players in accuracy.values():
        for name, by_hour in players.items():
            hours.setdefault(name, []).append(by_hour)
    names = sorted(hours, key=lambda name: -float(np.nanmean(hours[name])))
    num_rows = -(-len(accuracy) // 2)
    figure = Figure(
        figsize=(9.5, 0.9 + (0.55 + 0.19 * len(names)) * num_rows), dpi=100, layout="constrained"
    )
    panels = figure.subplots(num_rows, 2, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, (title, players) in zip(panels, accuracy.items(), strict=False):
        nothing = [np.nan] * 24
        wrong = 1 - np.array([players.get(name, nothing) for name in names])  # (players, 24)
        image = axes.imshow(wrong, vmin=0, vmax=1, cmap="magma_r", aspect="auto")
        axes.set_title(fill(title, 52), loc="left", fontsize=9)
        axes.tick_params(labelsize=9)
    panels[0].set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
    panels[0].set_xticks(range(0, 24, 6), [f"{hour}:00" for hour in range(0, 24, 6)])
    for axes in panels[len(accuracy) :]:
        axes.set_axis_off()
    bar = figure.colorbar(image, ax=list(panels), location="top", pad=0.01, shrink=0.5, aspect=40)
    bar.set_label("share of wrong first guesses")
    return figure


def draw_calibration(confidence: np.ndarray, is_correct: np.ndarray, title: str) -> Figure:
    """Draw how often answers of each confidence are right; the diagonal is a perfect calibration.

    The confidence is the probability of the choice of each answer, (n,), beside whether it was
    right.
    """
    figure = Figure(figsize=(4.6, 4.6), dpi=110, layout="constrained")
    axes = figure.subplots()
    bin_of = np.minimum((confidence * _NUM_BINS).astype(int), _NUM_BINS - 1)
    count = np.bincount(bin_of, minlength=_NUM_BINS)
    shown = np.flatnonzero(count)
    said = np.bincount(bin_of, confidence, _NUM_BINS)[shown] / count[shown]
    right = np.bincount(bin_of, is_correct, _NUM_BINS)[shown] / count[shown]
    axes.plot([0, 1], [0, 1], color="#999999", linewidth=1)
    axes.bar(
        (np.arange(_NUM_BINS) + 0.5) / _NUM_BINS,
        count / max(count.sum(), 1),
        width=0.9 / _NUM_BINS,
        color="#c3cad3",
        label="share of the answers",
    )
    axes.plot(said, right, "o-", color=_MODEL_COLORS[0], label="share that is right")
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="probability of the choice", aspect="equal")
    axes.set_title(title, loc="left", fontsize=10)
    axes.legend(frameon=False, loc="upper left", fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _label_ends(axes: Axes, ends: list[tuple[float, str, str]], last: int) -> None:
    """Write names beside the ends of curves, as near as the others allow, with lines to them."""
    ends = sorted(ends)
    values = np.array([end for end, _, _ in ends])
    bottom, top = axes.get_ylim()
    steps = np.arange(len(ends)) * 0.045 * (top or 1.0)  # a line of text each
    heights = isotonic_regression(values - steps).x + steps
    heights = np.minimum(heights, top + steps - steps[-1])  # as far as they fit, none above
    heights = np.maximum(heights, bottom + steps)  # the axes, and none below
    for y, (end, name, color) in zip(heights, ends, strict=True):
        axes.plot([last, last * 1.015, last * 1.06], [end, end, y], color=color, linewidth=0.8)
        axes.text(last * 1.07, y, name.replace("_", " "), color=color, va="center", fontsize=10)


def make_png(figure: Figure, **told: str) -> bytes:
    """Return a picture as a file, with what is `told` of it; of the same figure the same bytes."""
    image = io.BytesIO()
    figure.savefig(image, format="png", metadata={"Software": None, **told})
    return image.getvalue()


@dataclass(frozen=True)
class SearchStory:
    """One search.

    Attributes:
        plan: of the home.
        description: what was looked for.
        belief: probability of each furniture node before the first look, (F,).
        looks: furniture in the order of the looks.
        true_places: furniture that held it.
    """

    plan: FloorPlan
    description: str
    belief: np.ndarray
    looks: tuple[int, ...]
    true_places: tuple[int, ...]


def play_search_stories(
    make: MakePolicy, source: HomeSource, seed: int, split: str
) -> list[SearchStory]:
    """Let a policy search the first home of a source, and return its last searches.

    There are three, or fewer where the home was recorded for fewer steps.
    """
    homes = source.make(Streams(seed, split, [0]))
    policy = make(homes)
    game = FindObject(homes, policy)
    from simulator.drawing import FloorPlan  # a training without pictures does without

    plan = FloorPlan.of_homes(homes)
    answers: list[Answer] = []
    game.on_answer = answers.append
    num_played = min(_WARM_UP + _SHOWN, source.num_steps or _WARM_UP + _SHOWN)
    found = []
    for search in game.search(num_played):
        first = answers[0]
        belief = compute_probabilities(first.scores, policy.score_kind)[0]
        found.append(
            SearchStory(
                plan,
                homes.object_descriptions.text(int(search.codes[0])),
                belief[: len(plan.furniture)],
                tuple(int(answer.choice[0]) for answer in answers if answer.choice[0] >= 0),
                tuple(np.flatnonzero(first.answers[0]).tolist()),
            )
        )
        answers.clear()
    return found[-_SHOWN:]


def draw_searches(searches: list[SearchStory]) -> Figure:
    """Draw searches side by side: belief before the first look, looks in order, the truth."""
    from simulator.drawing import draw_belief

    figure = Figure(figsize=(6.4 * len(searches), 5.2), dpi=100, layout="constrained")
    panels = figure.subplots(1, len(searches), squeeze=False)[0]
    for axes, search in zip(panels, searches, strict=True):
        draw_belief(
            axes,
            search.plan,
            search.belief,
            order=search.looks[:_MOST_LOOKS],
            true_places=search.true_places,
        )
        count = len(search.looks)
        title = f"{search.description}: {count} look{'' if count == 1 else 's'}"
        axes.set_title(title, loc="left", fontsize=11)
    return figure
