"""What settles the paper's claims: what is trained and played, readings, the page of results."""

import json

import numpy as np
import pytest
from torch.utils.tensorboard import SummaryWriter

from nep.bench.paper.training import SCORES, Training
from nep.bench.runner import play_all
from nep.players.contestants import list_contestants
from nep.report.results import ScoreSummary, unpack_summary
from sgm.memory.queries import Queries
from simulator.policies import POLICIES, make_policy
from simulator.tasks.answer import Answer
from simulator.tasks.evaluation import play_task
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tools.claims import networks
from tools.claims.plan import LOCATION, ClaimsPlan
from tools.claims.readings import READINGS, compute_listed_ndcg, find_reach, play_readings
from tools.claims.report import make_report
from tools.claims.scores import ClaimsScores
from tools.claims.suite import main


@pytest.fixture
def plan(tmp_path):
    return ClaimsPlan(tmp_path / "runs", tmp_path / "data", num_homes=2, steps=2)


def play(plan, policies, *names):
    """Let policies play some games."""
    games = {name: game for name, game in plan.list_games().items() if name in names}
    return play_all(
        games, lambda game: list_contestants(game.setting.task, policies, []), plan.runs / SCORES
    )


def find_cells(text, start):
    line = next(line for line in text.splitlines() if line.startswith(f"| {start} |"))
    return [cell.strip() for cell in line.split("|")[1:-1]]


def test_every_training_is_in_a_folder_of_its_own(plan):
    trainings = plan.list_all_trainings()
    assert len({training.folder for training in trainings}) == len(trainings)
    # three networks x three seeds x two kinds of homes x on and off, fourteen with a change, and
    # three at each of two more learning rates
    assert len(trainings) == 36 + 14 + 6
    assert [t.contestant.name for t in trainings[:3]] == ["mlp", "gcn", "heat"]
    changed = next(t for t in trainings if t.contestant.name == "heat-no_absence")
    assert changed.list_options()[2:4] == ["--config=heat.yaml", "--config=no_absence.yaml"]
    assert "--data.homes=paper" in trainings[9].list_options()


def test_table_1_stands_for_seed_0(plan, tmp_path):
    on, off = (plan.make_game("sampled", setting).name for setting in LOCATION.values())
    played = play(plan, ["bayesian"], on, off).scores
    means = unpack_summary(played[on]["bayesian"]).home_values.tolist()
    rows = {"bayesian": {"mean_of_each_home": means}, "NEP-MLP": {"mean_of_each_home": [0.5, 1]}}
    others = unpack_summary(played[off]["bayesian"]).home_values.tolist()
    settings = {
        LOCATION["on"].name: rows,
        LOCATION["off"].name: {"bayesian": {"mean_of_each_home": others}},
    }
    path = tmp_path / "table_1.json"
    path.write_text(json.dumps({"settings": settings}))
    known = ClaimsPlan(plan.runs, plan.data, num_homes=2, steps=2, table_1=path)
    cache = known.load_cache()
    assert known.load_table_1(LOCATION["on"], cache)["NEP-MLP"].home_values.tolist() == [0.5, 1.0]
    assert len(known.list_all_trainings()) == len(plan.list_all_trainings()) - 6
    rows["bayesian"]["mean_of_each_home"] = [means[0], means[1] + 0.5]
    path.write_text(json.dumps({"settings": settings}))
    with pytest.raises(ValueError, match="table_1 must be of the same test homes"):
        known.load_table_1(LOCATION["on"], cache)


def test_the_page_says_how_to_make_it_again(plan):
    text = make_report(plan)["claims.md"].decode()
    assert "python -m nep.bench claims --num_homes 2 --steps 2\n" in text
    assert text.count("- heat, 32 places, dynamic nodes on, seed 1\n") == 1


def test_every_network_is_trained_and_plays_where_it_was_trained(plan):
    collections, trainings = plan.plan_stages()
    assert len(trainings) == 56
    names = {job.name for job in (*collections, *trainings)}
    assert len(names) == len([*collections, *trainings])
    assert all(job.after and job.after[0] in names for job in trainings)
    trained = {plan.name_training(row): row for row in plan.list_all_trainings()}
    assert len(trained) == 56
    games = plan.list_games()
    players = {name: plan.list_players(game, {}) for name, game in games.items()}
    assert {*players[plan.make_game("paper", LOCATION["off"]).name]} == {*POLICIES}
    assert not any("heat" in who for own in players.values() for who in own)
    played = [
        who for game in games.values() for who in plan.list_players(game, trained) if who in trained
    ]
    # every network once, and under every reading those of the order with the seed of changes
    assert {*played} == {*trained}
    assert len(played) == 56 + 3 * 2 * 2


def test_adaptation_by_hand(plan):
    """The first step of two against the last, and the networks that have not played are listed."""
    game = plan.make_game("sampled", LOCATION["on"]).name
    played = play(plan, ["bayesian", "oracle"], game).scores[game]
    text = make_report(plan)["claims.md"].decode()
    rows = text.partition("## Adaptation")[2].partition("## ")[0]
    for name in ("bayesian", "oracle"):
        first, last = unpack_summary(played[name]).values.mean(axis=0)
        assert f"| on | {name} | {first:.3f} | {last:.3f} | {last - first:+.3f} [" in rows
    assert "| off |" not in rows
    for line in ("bayesian, steps, dynamic nodes off", "NEP-HEAT, steps, dynamic nodes on"):
        assert f"- {line}\n" in text
    assert "Table 1 has the means of homes, not of steps" in rows.replace("\n", " ")


def test_the_released_code_stands_beside_ours(plan, monkeypatch):
    scores = {"mlp": [0.2, 0.4], "heat": [0.3, 0.5]}

    def load(self, source, nodes, configs, seeds):
        own = scores.get("-".join(configs)) if (source, nodes) == ("paper", "off") else None
        return {0: ScoreSummary(np.array(own)[:, None], {})} if own else {}

    monkeypatch.setattr(ClaimsScores, "load_trainings", load)
    text = make_report(plan)["claims.md"].decode().partition("## The authors' code")[2]
    assert find_cells(text, "off")[1:] == ["+0.048", "+0.100", "0.400 and 0.300"]
    assert find_cells(text, "on")[1:] == ["+0.027", "", ""]


def test_orders_by_hand(plan, monkeypatch):
    # HEAT is .2 better than GCN in both trainings and homes, GCN as good as MLP on the mean.
    scores = {
        "mlp": {0: [0.2, 0.4], 1: [0.3, 0.3]},
        "gcn": {0: [0.3, 0.3], 1: [0.2, 0.4]},
        "heat": {0: [0.5, 0.5], 1: [0.4, 0.6], 2: [0.9, 0.9]},
    }

    def load(self, source, nodes, configs, seeds):
        own = scores.get("-".join(configs), {}) if (source, nodes) == ("sampled", "on") else {}
        return {
            seed: ScoreSummary(np.array(homes)[:, None], {})
            for seed, homes in own.items()
            if seed in seeds
        }

    monkeypatch.setattr(ClaimsScores, "load_trainings", load)
    files = make_report(plan)
    text = files["claims.md"].decode()
    assert find_cells(text, "32 places, on")[1:] == [
        "0.300 (0.300, 0.300)",
        "0.300 (0.300, 0.300)",
        "0.633 (0.500, 0.500, 0.900)",
    ]
    lines = [line for line in text.splitlines() if line.startswith("| 32 places, on | NEP")]
    heat = next(line for line in lines if "NEP-HEAT better than NEP-GCN" in line)
    # .2 in every training and home, whatever the correction for three rows.
    assert "| 2 | +0.200 [+0.200, +0.200] | 0.000 | < .001 | holds |" in heat
    gcn = next(line for line in lines if "NEP-GCN better than NEP-MLP" in line)
    assert "| 2 | +0.000 [" in gcn
    assert "undecided" in gcn
    assert json.loads(files["claims.json"])["orders"]["sampled-on"]["heat"]["2"] == [0.9, 0.9]
    # HEAT minus MLP is .3 and .1, then .1 and .3: trainings and homes are alike, and what is left
    # varies: E = .04, error .1 of one degree, 12.706 x .1.
    assert "Of 2 comparisons of GCN or HEAT with NEP-MLP in the tables above, 0 have" in text
    assert "highest is NEP-HEAT, 32 places, on: +0.200 [-1.071, +1.471];" in text
    assert "lowest NEP-GCN, 32 places, on: +0.000 [" in text
    assert find_cells(text, "as it is")[1:4] == ["0.300", "0.300", "0.500"]


@pytest.fixture
def fake_trainings(monkeypatch):
    """Let trainings have played in two homes: scores by configs, of every seed."""

    def fake(scores):
        def load(self, source, nodes, configs, seeds):
            homes = scores.get("-".join(configs))
            row = None if homes is None else ScoreSummary(np.array(homes)[:, None], {})
            return {} if row is None else dict.fromkeys(seeds, row)

        monkeypatch.setattr(ClaimsScores, "load_trainings", load)

    return fake


def test_a_change_of_one_network_is_compared_with_the_others_as_they_are(plan, fake_trainings):
    fake_trainings(
        {
            "mlp": [0.3, 0.3], "gcn": [0.2, 0.2], "heat": [0.4, 0.4], "heat_two_heads": [0.6, 0.4],
            "mlp_equal": [0.4, 0.4], "gcn_equal": [0.5, 0.5],
        }
    )  # fmt: skip
    text = make_report(plan)["claims.md"].decode()
    assert find_cells(text, "as many parameters as NEP-HEAT")[1:] == [
        "0.400 (+0.100 [+0.100, +0.100])",
        "0.500 (+0.300 [+0.300, +0.300])",
        "",
        "+0.100 [+0.100, +0.100]",
        "+0.000 [+0.000, +0.000]",
    ]
    assert find_cells(text, "two heads, the input added to the output")[1:] == [
        "",
        "",
        "0.500 (+0.100 [-1.171, +1.371])",
        "",
        "+0.200 [-1.071, +1.471]",
    ]


def test_the_rate_is_chosen_by_validation_alone(plan, fake_trainings, monkeypatch):
    # (validation, test): 3e-4 is best in validation, 1e-3 in the test homes.
    known = {"1e-4": (0.30, 0.1), "3e-4": (0.40, 0.2), "1e-3": (0.35, 0.9)}
    names = {f"{name}-rate_{rate}": (name, rate) for name in ("mlp", "gcn") for rate in known}
    names = {**names, "mlp": ("mlp", "1e-4"), "gcn": ("gcn", "1e-4")}
    fake_trainings({own: [known[rate][1]] * 2 for own, (_, rate) in names.items()})
    monkeypatch.setattr(Training, "is_done", lambda own: own.contestant.name in names)
    monkeypatch.setattr(ClaimsPlan, "compute_checksums", lambda own: {})
    monkeypatch.setattr(networks, "count_parameters", lambda own: 1234)
    monkeypatch.setattr(
        networks, "read_validation", lambda own: known[names[own.contestant.name][1]][0]
    )
    files = make_report(plan)
    text = files["claims.md"].decode()
    assert find_cells(text, "3e-4")[1:] == ["**0.400**", "**0.200**"] * 2 + ["", ""]
    assert find_cells(text, "1e-3")[1:] == ["0.350", "0.900"] * 2 + ["", ""]
    assert json.loads(files["claims.json"])["rates"]["chosen"] == {"mlp": "3e-4", "gcn": "3e-4"}
    assert "Parameters: `mlp` 1,234, `gcn` 1,234.\n" in text
    claim = "| NEP-GCN better than NEP-MLP | 1 | +0.000 [+0.000, +0.000]"
    undecided = f"{claim} | 0.000 | 1.000 | undecided |"
    assert f"| 1e-3 {undecided}" in text
    assert f"| best of three {undecided}" in text


def test_a_training_knows_its_last_validation(plan):
    training = plan.make_training("sampled", "on", ("mlp",), 0)
    with SummaryWriter(str(training.folder)) as writer:
        for step, value in enumerate((0.25, 0.5, 0.375)):
            writer.add_scalar("2_hits_at_1/val", value, step)
    assert networks.read_validation(training) == 0.375


def test_what_was_not_run_is_listed(plan):
    text = make_report(plan)["claims.md"].decode()
    assert "- heat, 32 places, dynamic nodes on, seed 2" in text
    assert "- informed, 24 places (`--homes paper`), dynamic nodes off" in text
    assert all(
        f"- oracle, readings, 32 places, dynamic nodes {nodes}" in text for nodes in LOCATION
    )


@pytest.mark.slow
def test_informed_plays_some_homes_at_a_time(plan, monkeypatch):
    game = plan.make_informed("paper", "on")
    players = plan.list_players(game, {})
    (own,) = game.play(players).values()
    monkeypatch.setattr("tools.claims.plan._HOMES_AT_ONCE", 1)
    (apart,) = game.play(players).values()
    np.testing.assert_array_equal(own["values"], apart["values"])
    assert len(own["sizes"]) == 11
    assert 1 <= own["sizes"][0] <= own["sizes"][10] <= 1024


@pytest.fixture
def tiny_command(tmp_path, monkeypatch):
    """`tools.claims` with two policies, in one home and step; returns what runs it."""
    for module in ("plan", "scores", "known", "open_questions"):
        for name in ("POLICIES", "PAPER_POLICIES"):
            own = ("random", "bayesian")
            monkeypatch.setattr(f"tools.claims.{module}.{name}", own, raising=False)
    folders = [f"--{name}={tmp_path / name}" for name in ("out", "runs", "data")]

    def run(*options):
        main(["--num_homes=1", "--steps=1", "--workers=1", *folders, *options])
        return (tmp_path / "out" / "claims.md").read_text()

    return run


@pytest.mark.slow
def test_the_command_plays_what_is_missing_and_no_more(tiny_command, capsys, tmp_path):
    first = tiny_command("--train=false")
    assert "python -m nep.bench claims" in first
    assert "| 32 places, on | informed |" in first
    played = "predict_location-on, 1 homes x 1 steps, seed 0: bayesian"
    assert played in capsys.readouterr().out
    assert tiny_command("--train=false") == first
    assert "homes x" not in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "claims.json").read_text())["rooms"]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--seeds=0", "seeds must be at least 1, got 0"),
        ("--table_1=nowhere.json", "table_1 must be a file, got nowhere.json"),
    ],
)
def test_bad_input(option, message, tiny_command, capsys):
    with pytest.raises(SystemExit) as stop:
        tiny_command(option)
    assert stop.value.code == 2
    assert message in capsys.readouterr().err


def make_answer(scores, relevance, answers):
    query = np.zeros(1, dtype=int)
    queries = Queries(query, query, np.zeros((1, len(scores), 2)))
    return Answer(
        queries,
        np.array([answers], dtype=bool),
        np.array([scores]),
        query,
        relevance=np.array([relevance]),
    )


def test_readings_by_hand():
    # Ranked: place 1, 0, 2; the object is at place 1, and cannot go to place 2.
    # Discounts 1, .63093, .5. T: .2, .3, .5.
    answer = make_answer([0.3, 0.6, 0.1], [0.2, 0.3, 0.5], [0, 1, 0])
    reach = np.array([[True, True, False]])
    found = {
        name: float(reading.compute(answer.scores, answer, reach)[0])
        for name, reading in READINGS.items()
    }
    # (.3 + .2 * .63093 + .5 * .5) / (.5 + .3 * .63093 + .2 * .5) = .67619 / .78928
    assert found["home"] == found["listed"] == pytest.approx(0.85672, abs=1e-5)
    assert found["reach"] == pytest.approx(1.0)  # .3 before .2
    # Without place 1: (.2 * .63093 + .5 * .5) / (.5 + .2 * .63093) = .37619 / .62619
    assert found["moved"] == found["moved_listed"] == pytest.approx(0.60076, abs=1e-5)
    assert found["here"] == pytest.approx(1.0)


def test_a_list_that_ends_early_loses_what_it_leaves_out():
    # Only place 2 is listed, first: .5 of the best .78928.
    scores, relevance = np.array([[-np.inf, -np.inf, 1.0]]), np.array([[0.2, 0.3, 0.5]])
    assert compute_listed_ndcg(scores, relevance)[0] == pytest.approx(0.63349, abs=1e-5)
    nothing = np.full((1, 3), -np.inf)
    assert compute_listed_ndcg(nothing, relevance).tolist() == [0.0]


@pytest.mark.parametrize("crosses", [False, True])
def test_reach_is_the_room_unless_moves_lead_anywhere(crosses):
    home = HomeConfig(furniture_per_room=2, cross_room_moves=crosses)
    homes = SampledSource(home=home).make(Streams(0, "test", range(1)))
    answer = make_answer([0.0] * 8, [0.125] * 8, [0, 0, 0, 1, 0, 0, 0, 0])
    assert find_reach(homes, answer)[0].tolist() == [crosses] * 2 + [True] * 2 + [crosses] * 4


def test_the_first_reading_is_the_score_of_the_task():
    def make():
        return SampledSource().make(Streams(0, "test", range(2)))

    found = play_readings(make(), make_policy("bayesian", make()), num_steps=4)
    task = "relative_likelihood"
    scores = play_task(lambda homes: make_policy("bayesian", homes), make(), 4, task=task)
    np.testing.assert_allclose(found["home"], scores.home_values)
