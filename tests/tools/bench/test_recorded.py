"""The benchmark of recorded homes, on two that are written here."""

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from nep.report.figures import draw_by_hour
from sgm.network.shipped import find_trained
from sgm.prior.prior_graph import PriorGraph
from simulator.policies import POLICIES
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.streams import Streams
from tools.bench.comparisons import compare_priors, make_comparison
from tools.bench.home_games import list_benchmark
from tools.bench.recorded import main

SIZE = ["--steps", "6", "--step_seconds", "14400", "--replays", "2"]
PATROL = ["--kinds", "episodes-patrol-shipped", "lives-patrol-counted"]


def write_home(folder, cup_place):
    """Twelve days in a kitchen: a cup is on the table at noon, at night in its usual place."""
    folder.mkdir(parents=True)
    furniture = [{"name": name, "room": "kitchen"} for name in ("shelf", "fridge", "table")]
    layout = {
        "version": 1,
        "rooms": ["kitchen"],
        "furniture": furniture,
        "start": "2024-05-06T00:00",
        "end_s": 12 * 86400,
    }
    (folder / "layout.json").write_text(json.dumps(layout))
    rows = ["time_s,object,furniture,relation,description", f"0,cup,{cup_place},in,"]
    rows += ["0,milk,fridge,in,"]
    for day in range(12):
        rows += [f"{day * 86400 + 36000},cup,table,onTop,"]
        rows += [f"{day * 86400 + 50400},cup,{cup_place},in,"]
    (folder / "events.csv").write_text("\n".join(rows) + "\n")
    return str(folder)


@pytest.fixture
def homes(tmp_path):
    return [write_home(tmp_path / "a", "shelf"), write_home(tmp_path / "b", "fridge")]


def test_a_home_is_left_out_of_the_prior_that_is_counted(homes):
    kinds = list_benchmark(homes, 6, 14400.0, 2)
    (shipped,) = kinds["episodes-policy-shipped"].sources
    assert shipped.num_homes == 4  # two homes, two replays each
    priors = [source.prior for source in kinds["episodes-policy-counted"].sources]
    cups = [
        {placement.furniture for placement in prior.placements if placement.object == "cup"}
        for prior in priors
    ]
    # Home a has its cup on the shelf: it is known from b, where it is in the fridge.
    assert cups == [{"fridge", "table"}, {"shelf", "table"}]


def test_a_further_prior_has_kinds_of_its_own(homes):
    prior = PriorGraph.default()
    kinds = list_benchmark(homes, 6, 14400.0, 2, {"words": prior})
    without = list_benchmark(homes, 6, 14400.0, 2)
    more = [name for name in kinds if name not in without]
    assert more == [
        "episodes-policy-words",
        "lives-policy-words",
        "episodes-patrol-words",
        "lives-patrol-words",
    ]
    assert kinds[more[0]].sources[0].prior is prior
    assert kinds[more[0]].title.endswith("the prior `words`")
    assert [kinds[name].describe() for name in without] == [k.describe() for k in without.values()]
    with pytest.raises(ValueError, match="also_prior must have a name of its own, got 'counted'"):
        list_benchmark(homes, 6, 14400.0, 2, {"counted": prior})


def test_a_further_prior_needs_name_and_file(homes, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["--trace", *homes, "--out", str(tmp_path / "x.md"), *SIZE, "--also_prior", "words"])
    assert "also_prior must be NAME=FILE, got 'words'" in capsys.readouterr().err


def test_priors_are_paired_home_by_home():
    """Two homes of two replays each: replays are averaged first, and a home is one unit."""
    units = ["a", "a", "b", "b"]
    values = {"shipped": [0.0, 0.2, 0.1, 0.1], "words": [0.4, 0.2, 0.6, 0.2], "own": [0.5] * 4}
    kinds = {f"episodes-{name}": {"x": {"accuracy": own}} for name, own in values.items()}
    kinds["lives-shipped"] = kinds["episodes-shipped"]  # without the further priors
    about = {kind: {"units": units} for kind in kinds}
    rows = compare_priors(about, kinds, ["words", "own"], ["x", "absent"])
    assert [(row.first, row.second) for row in rows] == [
        ("words", "shipped"),
        ("own", "shipped"),
        ("own", "words"),
    ]
    # Homes of words minus shipped: .3 - .1 and .4 - .1, so .2 and .3: mean .25, error .05,
    # t of one degree 12.706. p = 1 - 2 atan(5) / pi = .126.
    found = rows[0].difference
    assert (found.mean, found.low, found.high) == pytest.approx((0.25, -0.385, 0.885), abs=1e-3)
    assert found.p == pytest.approx(0.126, abs=1e-3)
    # own minus shipped: .4 both times: p = 0. own minus words: .2 and .1: t = 3, p = .205.
    assert [row.corrected for row in rows] == pytest.approx([0.251, 0.0, 0.251], abs=1e-3)
    text = make_comparison(rows)
    assert "| episodes | `x` | own minus shipped | **+0.400 [+0.400, +0.400]** |" in text
    assert "all 3 comparisons" in text
    assert compare_priors(about, kinds, [], ["x"]) == []


def test_of_a_long_life_the_last_ten_days_are_scored(homes):
    kind = list_benchmark(homes, 6, 14400.0, 2)["lives-patrol-shipped"]
    assert (kind.num_steps, kind.num_warm_up) == (72, 12)  # 12 and 2 days of six steps
    scores = kind.play({"x": POLICIES["last_seen"].make})["x"]
    assert "looks" not in scores
    assert np.shape(scores["accuracy"]) == (2,)
    asked = [hour for hour in range(24) if not np.isnan(scores["by_hour"][hour])]
    assert asked == [0, 4, 8, 12, 16, 20]


def test_on_patrol_all_policies_read_the_same_memory(homes):
    kinds = list_benchmark(homes, 20, 14400.0, 2)
    away = {
        looks: [
            evaluate_policy(
                POLICIES[name].make,
                *kinds[f"episodes-{looks}-shipped"].sources,
                Streams(0, "test", range(4)),
                20,
            ).is_away
            for name in ("random", "myopic")
        ]
        for looks in ("policy", "patrol")
    }
    np.testing.assert_array_equal(*away["patrol"])
    assert (away["policy"][0] != away["policy"][1]).any()


@pytest.mark.slow
def test_the_command_resumes_and_takes_more_networks(homes, tmp_path, capsys):
    out = tmp_path / "out" / "recorded.md"
    command = ["--trace", *homes, "--out", str(out), *SIZE, *PATROL]
    main(command)
    stored = json.loads(out.with_suffix(".json").read_text())
    assert list(stored["scores"]) == ["episodes-patrol-shipped", "lives-patrol-counted"]
    stored["scores"]["lives-patrol-counted"]["random"]["accuracy"] = [0.123, 0.123]
    out.with_suffix(".json").write_text(json.dumps(stored))
    main([*command, "--checkpoint", "heat", "--checkpoint", "again=heat"])
    text = out.read_text()
    assert "0.123" in text
    assert str(tmp_path) not in text
    (heat, again) = (re.search(rf"\| {name} \|.*", text)[0] for name in ("heat", "again"))
    assert heat.replace("heat", "again") == again
    assert (out.parent / "recorded_by_hour.png").stat().st_size > 10_000


@pytest.mark.slow
def test_every_home_is_played_by_the_network_that_has_not_seen_it(homes, tmp_path, capsys):
    shutil.copytree(find_trained("heat"), tmp_path / "without_a")
    shutil.copytree(find_trained("any_home"), tmp_path / "without_b")
    out = tmp_path / "recorded.md"
    command = ["--trace", *homes, "--out", str(out), *SIZE, "--kinds", "episodes-patrol-shipped"]
    source = f"own={tmp_path}/without_{{home}}"
    main([*command, "--checkpoint", "heat", "--checkpoint", "any_home", "--left_out", source])
    (played,) = json.loads(out.with_suffix(".json").read_text())["scores"].values()
    first, second = (np.array(played[name]["nll"]) for name in ("heat", "any_home"))
    assert (first != second).any()
    # Two replays of home a, then two of home b.
    np.testing.assert_allclose(played["own"]["nll"], [*first[:2], *second[2:]], rtol=1e-5)
    text = out.read_text()
    assert "--left_out own=DIR" in text
    assert "`own`: networks that were each trained in the other homes" in text
    shutil.rmtree(tmp_path / "without_b")
    for bad in (source, "own", "=x{home}"):
        with pytest.raises(SystemExit):
            main([*command, "--left_out", bad])
    assert "with {home} in SOURCE, got '=x{home}'" in capsys.readouterr().err


def test_short_lives_are_refused(homes, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["--trace", *homes, "--step_seconds", "86400", "--steps", "0"])
    assert "steps must be at least 1" in capsys.readouterr().err
    with pytest.raises(ValueError, match=r"longer than the 10 steps of their last ten days"):
        list_benchmark([write_short(tmp_path / str(n)) for n in range(2)], 6, 86400.0, 1)


def write_short(folder):
    path = write_home(folder, "shelf")
    layout = json.loads((folder / "layout.json").read_text())
    (folder / "layout.json").write_text(json.dumps(layout | {"end_s": 9 * 86400}))
    rows = (folder / "events.csv").read_text().splitlines()
    kept = [row for row in rows[1:] if int(row.split(",")[0]) < 9 * 86400]
    (folder / "events.csv").write_text("\n".join([rows[0], *kept]) + "\n")
    return path


def test_rows_of_the_figure_are_the_same_in_all_panels_the_best_at_the_top():
    hours = {"a": [0.5] * 24, "b": [0.75] * 23 + [float("nan")]}
    # In "two" b is the worst, and over all panels the best: .75, .25 and .9 beside .5
    others = {"two": {"a": [0.5] * 24, "b": [0.25] * 24}, "three": {"b": [0.9] * 24}}
    figure = draw_by_hour({"one": hours, **others})
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert labels == ["b", "a"]
    shown = [axes.images[0].get_array() for axes in figure.axes[:3]]
    np.testing.assert_allclose(shown[0][1], 0.5)
    np.testing.assert_allclose(shown[1][0], 0.75)
    np.testing.assert_allclose(shown[2][0], 0.1)
    assert np.isnan(np.ma.filled(shown[2], np.nan)[1]).all()  # a has not played


@pytest.mark.slow
def test_the_page_of_language_priors_is_what_its_scores_say(tmp_path):
    results = Path(__file__).parents[3] / "results"
    name = "language_priors.json"
    shutil.copy(results / name, tmp_path / name)
    page = (results / "language_priors.md").read_text()
    words = shlex.split(re.search(r"`python -m tools\.bench recorded (.*?)`\. ", page).group(1))
    out = tmp_path / "language_priors.md"
    main(["--play", "false", *words, "--out", str(out)])
    assert out.read_text() == page
    scores = json.loads((results / name).read_text())["scores"]
    notes = (results / "notes.md").read_text()
    for kind, title in (
        ("shipped", "default (counted"),
        ("words", "word vectors alone"),
        ("filled", "filled in by a language model"),
        ("household", "household (written"),
        ("counted", "counted in the other"),
    ):
        line = next(line for line in notes.splitlines() if line.startswith(f"| {title}"))
        for player in ("priors", "adaptive", "any_home"):
            own = scores[f"episodes-policy-{kind}"][player]
            forms = (("accuracy", ".3f"), ("nll", ".2f"), ("looks", ".2f"))
            cell = " / ".join(shorten(np.mean(own[name]), form) for name, form in forms)
            assert f"| {cell} |" in line


def shorten(number, form):
    """Without the zero before the point, as tables by hand have it."""
    return f"{number:{form}}".removeprefix("0")
