"""Tables 1 and 2 from made-up scores: arithmetic, verdicts, the paper's numbers."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nep.report.results import ScoreSummary
from nep.report.tables import compute_difference, correct_rows
from nep.reproduce.experiments import (
    ABLATED,
    ABLATION_SETTING,
    ABLATIONS,
    MODELS,
    SETTINGS,
    Setting,
    list_ablations,
    list_full_models,
)
from nep.reproduce.paper_numbers import PAPER_TABLE_1, PAPER_TABLE_2
from nep.reproduce.paper_tables import (
    Provenance,
    compute_table,
    draw_table_1,
    list_claims,
    load_table_1,
    make_table_1,
    make_table_2,
)
from simulator.policies import POLICIES
from simulator.tasks.metrics import METRICS
from simulator.tasks.registry import TASKS

PROVENANCE = Provenance(
    command="python -m nep.reproduce --table 1",
    num_homes=2,
    steps=2,
    seed=0,
    versions={"numpy": "2.2"},
    configs={"NEP-MLP": "mlp.yaml"},
)
FIND = next(s for s in SETTINGS if s.name == "find_object-on")


def make_scores(first: float, second: float) -> ScoreSummary:
    """Two homes with these means over two steps."""
    values = np.array([[first, first], [second - 1, second + 1]])
    metrics = dict.fromkeys(METRICS, 0.5) | {"away_accuracy": float("nan")}
    return ScoreSummary(values, metrics)


def cells(text: str, start: str) -> list[str]:
    """Cells of the first table line that starts so."""
    line = next(line for line in text.splitlines() if line.startswith(f"| {start} |"))
    return [cell.strip() for cell in line.split("|")[1:-1]]


@pytest.fixture
def location():
    """Predict Object Location: more is better."""
    return {
        "bayesian": make_scores(0.2, 0.4),  # 0.3
        "prior_filter": make_scores(0.3, 0.5),  # 0.4
        "NEP-MLP": make_scores(0.2, 0.3),  # 0.25
        "NEP-GCN": make_scores(0.6, 0.4),  # 0.5
        "NEP-HEAT": make_scores(0.7, 0.7),  # 0.7
        "ceiling": make_scores(0.8, 0.8),
    }


def test_every_row_is_compared_with_the_row_above(location):
    rows = compute_table(ABLATION_SETTING, location)
    wanted = "NEP-MLP bayesian prior_filter NEP-GCN NEP-HEAT ceiling"
    assert " ".join(row.policy for row in rows) == wanted
    above = [row.differences["the row above"] for row in rows]
    assert above[0] is None
    # NEP-GCN minus prior_filter: 0.3 in the first home and -0.1 in the second.
    # s = .2828, error .2, t of one degree 12.706.
    found = (above[3].mean, above[3].low, above[3].high)
    assert found == pytest.approx((0.1, -2.441, 2.641), abs=1e-3)


def test_claims_where_more_is_better(location):
    rows = compute_table(ABLATION_SETTING, location)
    claims = list_claims(ABLATION_SETTING, rows, location)
    assert [(claim.better, claim.worse) for claim in claims] == [
        ("NEP-HEAT", "NEP-GCN"),
        ("NEP-GCN", "NEP-MLP"),
        ("NEP-HEAT", "prior_filter"),
        ("NEP-GCN", "prior_filter"),
        ("NEP-MLP", "prior_filter"),
    ]
    assert {claim.verdict for claim in claims} == {"undecided"}  # no p is corrected yet
    sure = [replace(claim, corrected=0.04).verdict for claim in claims]
    assert sure == ["holds", "holds", "holds", "holds", "reversed"]  # the last one is -0.15
    assert {replace(claim, corrected=0.06).verdict for claim in claims} == {"undecided"}


def test_claims_of_a_table_are_corrected_together(location):
    claims = list_claims(ABLATION_SETTING, compute_table(ABLATION_SETTING, location), location)
    corrected = correct_rows(claims)
    # Differences +.3 and +.1 and so on: t = mean / error of one degree, p = 1 - 2 atan(t) / pi.
    # t = 2, 5 / 3, 3, .5, -3: p = .295, .344, .205, .705, .205; the least times five is above 1.
    p_values = [claim.difference.p for claim in claims]
    assert p_values == pytest.approx([0.295, 0.344, 0.205, 0.705, 0.205], abs=1e-3)
    assert [claim.corrected for claim in corrected] == [1.0] * 5


def test_several_trainings_are_paired_over_homes_and_trainings(location):
    # Differences of the trainings: .5 - .3 and .1 - .3 in every home, so that the mean is 0, and
    # two trainings are all that varies: error .2, t of one degree 12.706. One alone would decide.
    def train(*means):
        return ScoreSummary.join([make_scores(mean, mean) for mean in means])

    scores = {"NEP-MLP": train(0.3, 0.3), "NEP-GCN": train(0.5, 0.1), "bayesian": make_scores(0, 0)}
    setting = SETTINGS[0]
    (claim,) = (
        claim
        for claim in list_claims(setting, compute_table(setting, scores), scores)
        if claim.worse == "NEP-MLP"
    )
    assert claim.difference.mean == pytest.approx(0)
    found = (claim.difference.low, claim.difference.high)
    assert found == pytest.approx((-2.541, 2.541), abs=1e-3)
    assert claim.verdict == "undecided"
    with pytest.raises(ValueError, match="must be trained equally often to be paired, got 3 and 2"):
        compute_difference(train(0.1, 0.2, 0.3), scores["NEP-GCN"])


def test_claims_where_less_is_better():
    scores = {
        "random": make_scores(9, 9),
        "NEP-MLP": make_scores(3, 5),
        "NEP-GCN": make_scores(2, 4),
        "NEP-HEAT": make_scores(2.5, 4.5),
    }
    claims = list_claims(FIND, compute_table(FIND, scores), scores)
    sure = [replace(claim, corrected=0.04) for claim in claims]
    assert [(c.better, c.worse, c.verdict) for c in sure] == [
        ("NEP-HEAT", "NEP-GCN", "reversed"),  # half a look more in both homes
        ("NEP-GCN", "NEP-MLP", "holds"),
        ("NEP-GCN", "random", "holds"),
        ("NEP-HEAT", "random", "holds"),
        ("NEP-MLP", "random", "holds"),
    ]
    assert claims[0].difference.mean == 0.5


def test_table_1_by_hand(location):
    looks = {title: make_scores(3 + i, 5 + i) for i, title in enumerate(location)}
    results = {ABLATION_SETTING: location, FIND: looks}
    files = make_table_1(results, PROVENANCE)
    text = files["table_1.md"].decode()
    assert cells(text, "method") == [
        "method",
        "knows",
        "Predict Object Location ↑, on",
        "Find Object ↓, on",
    ]
    # Homes 0.7 and 0.7; homes 7 and 9. Best of all that are given neither rules nor home, in bold.
    assert cells(text, "NEP-HEAT") == ["NEP-HEAT", "", "**0.700 ± 0.000**", "8.000 ± 1.000"]
    assert cells(text, "bayesian") == ["bayesian", "", "0.300 ± 0.100", "**4.000 ± 1.000**"]
    shown = "ceiling of first guesses"
    assert cells(text, shown) == [shown, "home", "0.800 ± 0.000", "9.000 ± 1.000"]
    first = text.split("## The paper's")[0]
    order = [line.split("|")[1].strip() for line in first.splitlines() if line.startswith("| ")]
    # Heuristics, networks, then who is given the rules, then oracles.
    assert order == [
        "method",
        "---",
        "bayesian",
        "NEP-MLP",
        "NEP-GCN",
        "NEP-HEAT",
        "prior_filter",
        shown,
    ]
    # Homes .1 and .3: error .1, 12.706 x .1 = 1.271; (12.706 + 1.376) x .1 = 1.408
    line = "NEP-HEAT better than NEP-GCN | +0.200 [-1.071, +1.471] | 1.408 | 1.000 | undecided |"
    assert line in text
    assert "python -m nep.reproduce --table 1" in text
    assert files["table_1.png"].startswith(b"\x89PNG")
    panel, _ = draw_table_1(results).axes
    assert panel.get_title(loc="left").startswith("Predict Object Location")
    means = {float(line.get_xdata()[0]) for line in panel.lines if len(line.get_xdata()) == 1}
    assert means == {float(own.home_values.mean()) for own in location.values()}
    assert "numpy 2.2" in text
    assert "Configs: NEP-MLP [mlp.yaml](../nep/configs/mlp.yaml).\n" in first

    read = list(csv.DictReader(io.StringIO(files["table_1.csv"].decode())))
    assert {line["setting"] for line in read} == {"predict_location-on", "find_object-on"}
    heat = next(line for line in read if line["policy"] == "NEP-HEAT")
    assert float(heat["mean"]) == pytest.approx(0.7)
    # From 0.3 (bayesian) to 0.8 (ceiling), 0.7 is four fifths of the way.
    assert float(heat["gap_closed"]) == pytest.approx(0.8)

    stored = json.loads(files["table_1.json"])
    gcn = stored["settings"]["predict_location-on"]["NEP-GCN"]
    assert gcn["mean_of_each_home"] == [0.6, 0.4]
    assert gcn["away_accuracy"] is None
    assert stored["seed"] == 0


def test_the_ceiling_bounds_no_ndcg_and_heat_plus_reads_a_filter_that_knows_the_rules(location):
    likelihood = Setting("relative_likelihood", True)
    scores = location | {"NEP-HEAT+": make_scores(0.9, 0.9)}
    text = make_table_1({likelihood: scores}, PROVENANCE)["table_1.md"].decode()
    assert cells(text, "ceiling of first guesses")[1:] == ["home", "(0.800 ± 0.000)"]
    assert cells(text, "NEP-HEAT+ (reads `home_filter`)")[1:] == ["rules", "0.900 ± 0.000"]
    assert cells(text, "NEP-HEAT")[2] == "**0.700 ± 0.000**"
    assert "gap closed" not in text


def test_the_oracle_bounds_nothing(location):
    scores = location | {"oracle": make_scores(0.6, 0.6)}
    text = make_table_1({ABLATION_SETTING: scores}, PROVENANCE)["table_1.md"].decode()
    assert cells(text, "oracle (no bound)")[1:] == ["home", "0.600 ± 0.000"]
    assert "bounds nothing: 0.600 beside 0.700 of NEP-HEAT where objects come and go.\n" in text
    assert "±" not in text.partition("## The paper's")[2].partition("|")[2].partition("##")[0]


@pytest.mark.slow
def test_table_1_is_made_again_from_its_scores(location, tmp_path):
    looks = {title: make_scores(3 + i, 5 + i) for i, title in enumerate(location)}
    known = replace(
        PROVENANCE,
        versions={"numpy": "2.2", "commit": "abc"},
        test_sets=("paper-32-on-v1",),
        checkpoints={"find_object-on, NEP-MLP, seed 0": "0f" * 32},
    )
    files = make_table_1({ABLATION_SETTING: location, FIND: looks}, known)
    path = tmp_path / "table_1.json"
    path.write_bytes(files["table_1.json"])
    again = make_table_1(*load_table_1(path))
    assert again["table_1.json"] == files["table_1.json"]
    text, told = (own["table_1.md"].decode().split("Configs")[0] for own in (again, files))
    assert text == told
    for own in (again, files):
        footer = own["table_1.md"].decode().rpartition("```")[2]
        for part in ("paper-32-on-v1", "commit abc", "0f" * 32):
            assert part in footer
    known = json.loads(files["table_1.json"])
    known |= {"test_sets": [], "checkpoints": {}}
    del known["versions"]["commit"]
    path.write_text(json.dumps(known), encoding="utf-8")
    text = make_table_1(*load_table_1(path))["table_1.md"].decode()
    assert "The commit was not kept when this was played." in text
    assert "Checksums of the checkpoints were not kept." in text
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(ValueError, match=r"stored must be a table_1\.json .* in .*table_1\.json"):
        load_table_1(path)


def test_table_2_by_hand():
    scores = {network.name: make_scores(0.4, 0.6) for network in list_full_models()}
    scores |= {network.name: make_scores(0.3, 0.3) for network in list_ablations()}
    files = make_table_2(scores, PROVENANCE)
    text = files["table_2.md"].decode()
    assert cells(text, "Full model")[1:] == ["0.500 ± 0.100"] * 3
    assert cells(text, "(-) Transformer")[1:] == ["0.300 ± 0.000"] * 3
    change = text.split("## Minus the full model")[1]
    # Homes differ by -0.1 and -0.3: error .1, and d = 14.08 x .1.
    assert cells(change, "(-) Transformer")[1:] == ["-0.200 [-1.471, +1.071], d 1.408"] * 3
    assert "±" not in text.partition("## The paper's")[2].partition("|")[2]
    read = list(csv.DictReader(io.StringIO(files["table_2.csv"].decode())))
    assert len(read) == 5 * 3
    assert (read[0]["ablation"], read[0]["model"], read[0]["minus_full"]) == ("full", "mlp", "")
    assert float(read[-1]["minus_full"]) == pytest.approx(-0.2)


def test_table_2_says_which_part_is_the_most_critical():
    """In the paper the prior: .977 and .760 over three networks, (.977 - .760) / 3 = .072."""
    full = {network.name: make_scores(0.5, 0.5) for network in list_full_models()}
    losses = {"no_prior": 0.1, "no_transformer": 0.0, "no_temporal": 0.3, "no_semantic": 0.0}

    def say(losses):
        without = {
            f"{model}-{name}": make_scores(0.5 - loss, 0.5 - loss)
            for name, loss in losses.items()
            for model in ABLATED
        }
        return make_table_2(full | without, PROVENANCE)["table_2.md"].decode()

    text = say(losses)
    assert "the prior probability is the most critical part: without it" in text
    assert "lose 0.072 on the mean, and 0.016 without temporal features." in text
    assert "Here it is reversed: they lose 0.100 without the prior probability, and 0.300" in text
    text = say(losses | {"no_prior": 0.4})
    assert "So it is here: they lose 0.400." in text


def test_numbers_of_the_paper():
    """A few cells of the published tables, read off again."""
    assert PAPER_TABLE_1["predict_location-on"]["NEP-HEAT"] == (0.351, 0.033)
    assert PAPER_TABLE_1["relative_likelihood-off"]["NEP-GCN"] == (0.792, 0.002)
    assert PAPER_TABLE_1["find_object-on"]["bayesian"] == (3.469, 0.761)
    assert PAPER_TABLE_1["find_object-off"]["HMS"] == (5.254, 1.458)
    assert PAPER_TABLE_1["predict_location-off"]["oracle"] == (0.475, 0.063)
    assert PAPER_TABLE_2["no_prior"]["gcn"] == (0.233, 0.024)
    assert PAPER_TABLE_2["no_semantic"]["heat"] == (0.328, 0.030)
    # A full model is the same network in both tables.
    titles = {model.name: model.title for model in MODELS}
    for model, number in PAPER_TABLE_2[None].items():
        assert number == PAPER_TABLE_1["predict_location-on"][titles[model]]
    # Settings, rows and columns are named as ours are; the paper has no other ones.
    assert PAPER_TABLE_1.keys() == {setting.name for setting in SETTINGS}
    assert all(
        numbers.keys() <= {*POLICIES, *titles.values()} for numbers in PAPER_TABLE_1.values()
    )
    assert PAPER_TABLE_2.keys() == {None, *ABLATIONS}
    assert all(numbers.keys() == set(ABLATED) for numbers in PAPER_TABLE_2.values())


class TakeTurns(TASKS["find_object"]):
    """A task that the paper does not have."""

    title = "Take Turns"


def test_a_further_task_makes_columns_of_ours_alone(location, monkeypatch):
    for module in ("paper_tables", "experiments"):
        tasks = {**TASKS, "take_turns": TakeTurns}
        monkeypatch.setattr(f"nep.reproduce.{module}.TASKS", tasks)
    further = Setting("take_turns", True)
    files = make_table_1({ABLATION_SETTING: location, further: location}, PROVENANCE)
    ours, paper = files["table_1.md"].decode().split("## The paper's")
    assert "| knows | Predict Object Location ↑, on | Take Turns ↓, on |" in ours
    assert "Take Turns" not in paper.split("## Which")[0]
    assert "| Take Turns, dynamic nodes on | NEP-HEAT better than NEP-GCN |" in paper
    assert further.name in json.loads(files["table_1.json"])["settings"]


def test_a_model_of_ones_own_stands_between_networks_and_oracles(location):
    files = make_table_1({ABLATION_SETTING: location | {"mine": make_scores(0.1, 0.1)}}, PROVENANCE)
    first = files["table_1.md"].decode().split("## The paper's")[0]
    order = [line.split("|")[1].strip() for line in first.splitlines() if line.startswith("| ")]
    assert order[-4:] == ["NEP-HEAT", "mine", "prior_filter", "ceiling of first guesses"]


def train(*means):
    """Trainings in three homes, the second and third of which are .1 and .3 better."""
    metrics = dict.fromkeys(METRICS, 0.5)
    homes = ([[mean], [mean + 0.1], [mean + 0.3]] for mean in means)
    return ScoreSummary.join([ScoreSummary(np.array(own), metrics) for own in homes])


def test_trainings_stay_in_the_stored_scores(tmp_path):
    """Written again from the file, differences are over homes and trainings as they were."""
    scores = {
        "bayesian": train(0.2),
        "NEP-MLP": train(0.3, 0.4),
        "NEP-GCN": train(0.5, 0.3),
        "NEP-HEAT": train(0.6, 0.7),
    }
    told = replace(PROVENANCE, num_trainings=2, title="Twice", played=("0.1.0, commit abc",))
    files = make_table_1({ABLATION_SETTING: scores}, told, page="twice")
    assert sorted(files) == ["twice.csv", "twice.json", "twice.md", "twice.png"]
    path = tmp_path / "twice.json"
    path.write_bytes(files["twice.json"])
    again = make_table_1(*load_table_1(path), page="twice")
    assert again["twice.json"] == files["twice.json"]
    assert again["twice.md"].partition(b"## The")[2] == files["twice.md"].partition(b"## The")[2]
    text = files["twice.md"].decode()
    assert text.startswith("# Twice\n")
    assert "Played with 0.1.0, commit abc." in text
    assert "](twice.png)" in text
    # Every pair of networks. HEAT minus MLP is .3 in both trainings.
    (line,) = (own for own in text.splitlines() if "NEP-HEAT better than NEP-MLP" in own)
    assert "| +0.300 [+0.300, +0.300] |" in line
    paper = text.partition("## The paper's")[2].partition("##")[0]
    assert paper.count("Predict Object Location") == 1  # of the column that was played alone
    assert "Find Object" not in paper


@pytest.mark.slow
@pytest.mark.parametrize("page", ["table_1", "location_200"])
def test_a_page_that_ships_is_what_its_scores_say(page):
    results = Path(__file__).parents[3] / "results"
    files = make_table_1(*load_table_1(results / f"{page}.json"), page)
    assert files[f"{page}.md"].decode() == (results / f"{page}.md").read_text("utf-8")


def test_what_ships_of_location_has_five_trainings_and_names_what_played():
    path = Path(__file__).parents[3] / "results" / "location_200.json"
    results, told = load_table_1(path)
    (scores,) = results.values()
    for title in ("NEP-MLP", "NEP-GCN", "NEP-HEAT", "NEP-HEAT+ (no belief)"):
        assert scores[title].by_training.shape == (5, 200)
        assert sum(f", {title}, seed" in name for name in told.checkpoints) == 5
    assert len(set(told.checkpoints.values())) == len(told.checkpoints)
    (played,) = told.played
    assert "commit" in played
    assert "+changes" not in played
