"""Draws the pictures of docs/concepts from the package itself.

From the root of a checkout: `python -m docs.draw_concepts`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from sgm import Adaptive, Detector, Finder, SceneGraphMemory, Sighting
from sgm.prior.prior_graph import PriorGraph

IMAGES = Path(__file__).parent / "images"
ORANGE, GREY, GREEN = "#e8743b", "#9aa0a6", "#3a7d44"


def make_memory() -> SceneGraphMemory:
    """Return a home with three places, of which the counter was looked at last."""
    memory = SceneGraphMemory()
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    for label, room in (("fridge", kitchen), ("counter top", kitchen), ("desk", study)):
        memory.add_furniture(label, room)
    memory.observe(0, [Sighting("milk", "in")])
    memory.observe(1, [Sighting("mug"), Sighting("bowl")])
    memory.observe(2, [Sighting("laptop")])
    memory.step()
    memory.observe(1, [Sighting("bowl")])
    memory.observe(2, [Sighting("mug"), Sighting("laptop")])
    return memory


def draw_memory(axes: Axes) -> None:
    """Draw rooms, furniture and things of a small memory, with the counters of each edge."""
    memory = make_memory()
    places = [memory.describe(number).split(" in ") for number in memory.furniture_ids]
    rooms = list(dict.fromkeys(room for _, room in places))
    seen_at = {
        thing: [seen.furniture for seen in memory.places_of(thing)] for thing in memory.descriptions
    }
    things = sorted(seen_at, key=lambda thing: np.mean(seen_at[thing]))  # edges do not cross
    at = {("room", room): (2 * number + 0.5, 2.0) for number, room in enumerate(rooms)}
    at |= {("place", number): (1.5 * number, 1.0) for number in range(len(places))}
    at |= {("thing", thing): (1.1 * number - 0.2, 0.0) for number, thing in enumerate(things)}
    for number, (_, room) in enumerate(places):
        draw_line(axes, at["room", room], at["place", number], GREY, "-", "")
    for thing in things:
        for seen in memory.places_of(thing):
            text = f"{seen.times_seen} of {seen.times_looked}"
            colour, style = (GREEN, "-") if seen.is_there else (ORANGE, "--")
            draw_line(axes, at["place", seen.furniture], at["thing", thing], colour, style, text)
    for (kind, name), (x, y) in at.items():
        label = places[name][0] if isinstance(name, int) else name
        face = {"room": "#dfe6f5", "place": "#f7e3cd", "thing": "white"}[kind]
        box = {"boxstyle": "round", "facecolor": face, "edgecolor": GREY}
        axes.text(x, y, label, ha="center", va="center", bbox=box)
    axes.set(xlim=(-0.8, 3.8), ylim=(-0.3, 2.3))
    axes.axis("off")


def draw_line(
    axes: Axes,
    one: tuple[float, float],
    other: tuple[float, float],
    colour: str,
    style: str,
    text: str,
) -> None:
    """Draw an edge with its label in the middle."""
    axes.plot(*zip(one, other, strict=True), style, color=colour, zorder=0)
    near = 0.7 * np.array(other) + 0.3 * np.array(one)
    axes.text(
        *near, text, color=colour, ha="center", va="center", fontsize=9, backgroundcolor="white"
    )


def draw_belief(axes: Axes) -> None:
    """Draw how looks that do not show a thing move the belief to other places and elsewhere."""
    memory = make_memory()
    memory.step(60)
    finder = Finder(Adaptive(), detector=Detector(miss_rate=0.25))
    names = [memory.describe(number) for number in memory.furniture_ids] + ["elsewhere"]
    for column, num_looks in enumerate((0, 1, 2)):
        ranking = finder.rank(memory, "milk")
        by_id = {place.furniture: place.probability for place in ranking}
        values = [by_id.get(number, 0.0) for number in memory.furniture_ids] + [ranking.elsewhere]
        title = ("no look", "one look", "two looks")[num_looks]
        left = np.arange(len(names)) + 0.27 * (column - 1)
        axes.bar(left, values, 0.25, label=title, color=(GREY, "#f2b591", ORANGE)[column])
        memory.note_absent(0, "milk")
    axes.set_xticks(range(len(names)), names, fontsize=8)
    axes.set(ylabel="probability", ylim=(0, 1))
    axes.legend(title="at the fridge", frameon=False)


def draw_questions(axes: Axes) -> None:
    """Draw one time step of a task: the home moves, a question, an answer, a look."""
    boxes = [
        "the home\nchanges",
        "a question:\nwhere is the mug?",
        "an answer:\na score for each place",
        "a look at\nthe best place",
        "the memory\nlearns from it",
    ]
    for number, text in enumerate(boxes):
        face = "#f7e3cd" if number in (1, 2) else "#dfe6f5"
        box = {"boxstyle": "round,pad=0.6", "facecolor": face, "edgecolor": GREY}
        axes.text(2.2 * number, 0, text, ha="center", va="center", bbox=box, fontsize=8)
        if number:
            axes.annotate(
                "",
                (2.2 * number - 0.85, 0),
                (2.2 * number - 1.35, 0),
                arrowprops={"arrowstyle": "->"},
            )
    axes.annotate(
        "",
        (0, -0.5),
        (8.8, -0.5),
        arrowprops={"arrowstyle": "->", "connectionstyle": "arc3,rad=-0.12", "color": GREY},
    )
    axes.text(4.4, -1.25, "next time step", ha="center", color=GREY, fontsize=8)
    axes.set(xlim=(-1.2, 10), ylim=(-1.5, 0.8))
    axes.axis("off")


def draw_priors(axes: Axes) -> None:
    """Draw where the household prior keeps three things in a kitchen of five places."""
    prior = PriorGraph.household()
    labels = [kind.label for kind in prior.objects]
    places = ("fridge", "cabinet", "counter", "sink", "dining table")
    nodes = [(node.label, node.room) for node in prior.furniture]
    rows = [next(n for n, node in enumerate(nodes) if node[0] == place) for place in places]
    for column, (thing, colour) in enumerate((("mug", ORANGE), ("milk", GREY), ("pan", GREEN))):
        weights = prior.weights[labels.index(thing)].sum(axis=1)[rows]
        left = np.arange(len(places)) + 0.27 * (column - 1)
        axes.bar(left, weights / weights.sum(), 0.25, label=thing, color=colour)
    axes.set_xticks(range(len(places)), places)
    axes.set(ylabel="P(place | thing)", ylim=(0, 1))
    axes.legend(frameon=False)


def draw_time(axes: Axes) -> None:
    """Draw how the belief in the last place falls with time, for two rates of moves."""
    steps = np.arange(0, 25, 2)
    for period, colour in ((24, GREEN), (8, ORANGE)):
        memory = SceneGraphMemory()
        room = memory.add_room("kitchen")
        for label in ("table", "sink", "shelf"):
            memory.add_furniture(label, room)
        for step in range(49):  # it goes from one place to the other, and is seen at once
            is_moved = bool(step // period % 2)
            memory.observe(0, [] if is_moved else [Sighting("mug")])
            memory.observe(1, [Sighting("mug")] if is_moved else [])
            if step < 48:
                memory.step()
        finder = Finder(Adaptive())
        rankings = [finder.rank(memory, "mug", at=memory.time + int(step)) for step in steps]
        values = [place.probability for r in rankings for place in r if place.furniture == 0]
        label = f"has moved every {period} steps"
        axes.plot(steps, values, "o-", ms=3, color=colour, label=label)
    axes.set(xlabel="steps since the last look", ylabel="P(still at the table)", ylim=(0, 1))
    axes.legend(frameon=False)


PICTURES: dict[str, tuple[Callable[[Axes], None], tuple[float, float]]] = {
    "memory": (draw_memory, (7, 3.2)),
    "belief": (draw_belief, (7, 3.2)),
    "questions": (draw_questions, (9, 2)),
    "priors": (draw_priors, (7, 3.6)),
    "time": (draw_time, (7, 3.2)),
}


def main() -> None:
    """Draw all of them."""
    for name, (draw, size) in PICTURES.items():
        figure, axes = plt.subplots(figsize=size, layout="constrained")
        draw(axes)
        figure.savefig(IMAGES / f"concept-{name}.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    main()
