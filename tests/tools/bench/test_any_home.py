"""The table of one network in homes of every kind, shrunk."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from nep.players.contestants import Checkpoint
from nep.report.results import describe_code
from sgm.network.shipped import PRETRAINED
from sgm.prior.prior_graph import PriorGraph
from tools.bench.any_home import main, note_kinds
from tools.bench.columns import COLUMNS, COMPARED, find_best_rule, make_network_table, make_table
from tools.bench.home_games import deal_placements, list_simulated
from tools.bench.task_game import SHARED_METRICS


def make_scores(**accuracy):
    """Scores of one kind: two homes, all columns but the first guess alike."""
    return {
        player: {
            "accuracy": values,
            "nll": [1.0, 1.0],
            "looks": [2.0, 2.0],
            "calibration_error": [0.1],
            "away_accuracy": [0.2],
        }
        for player, values in accuracy.items()
    }


def test_the_best_rule_is_no_network_and_no_oracle():
    fewest = replace(COLUMNS["accuracy"], is_higher_better=False)
    scores = make_scores(
        net=[0.9, 0.9], heat=[0, 0], oracle=[1, 1], ceiling=[1, 1], schedule_oracle=[1, 1],
        adaptive=[0.2, 0.6], priors=[0.5, 0.1],
    )  # fmt: skip
    assert find_best_rule(scores, COLUMNS["accuracy"]) == "adaptive"
    assert find_best_rule(scores, fewest) == "priors"


def test_networks_beside_each_other():
    scores = {"small": make_scores(net=[0.5, 0.7], seed_1=[0.2, 0.6], adaptive=[0.2, 0.2])}
    text = make_network_table({"small": "Small homes"}, scores, ["net", "seed_1"])
    assert "| homes | net | seed_1 |" in text
    assert "| Small homes | 0.600 / 1.00 / 0.100 / 2.00 | 0.400 / 1.00 / 0.100 / 2.00 |" in text


def test_the_card_gets_one_section_however_often(tmp_path):
    folder = tmp_path / "heat"
    shutil.copytree(PRETRAINED / "heat", folder)
    before = (folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    note_kinds(folder, "| a |\n")
    once = (folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert once.index("## Scores") < once.index("| a |") < once.index("## Probabilities")
    note_kinds(folder, "| b |\n")
    card = (folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert card == once.replace("| a |", "| b |")
    assert len(card) > len(before)


def test_a_card_makes_no_other_network_and_a_setting_does(tmp_path):
    folder = tmp_path / "heat"
    shutil.copytree(PRETRAINED / "heat", folder)
    before = Checkpoint("heat", folder).compute_checksum()
    note_kinds(folder, "| a |\n")
    assert Checkpoint("heat", folder).compute_checksum() == before
    config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    config["model"]["dropout"] = 0.5
    (folder / "config.json").write_text(json.dumps(config), encoding="utf-8")
    assert Checkpoint("heat", folder).compute_checksum() != before


def test_the_best_comes_last():
    text = make_table(make_scores(net=[0.5, 0.7], a=[0.2, 0.6]))
    assert text.index("| a ") < text.index("| net ")


def test_another_prior_graph_is_the_same_places_dealt_anew():
    prior = PriorGraph.default()
    dealt = deal_placements(prior)
    rows = dealt.weights.reshape(len(prior.objects), -1)
    before = prior.weights.reshape(len(prior.objects), -1)
    assert sorted(map(tuple, rows.tolist())) == sorted(map(tuple, before.tolist()))
    assert (rows != before).any(axis=1).mean() > 0.9
    assert dealt.objects == prior.objects
    assert dealt.furniture == prior.furniture
    assert dealt.checksum == deal_placements(prior).checksum
    assert dealt.checksum != prior.checksum


def test_simulated_kinds_can_be_played_by_policies():
    kinds = list_simulated(2, 3, 2)
    assert {"paper-32", "routine", "mixed", "no-prior"} <= kinds.keys()
    for kind in kinds.values():
        assert {"adaptive", "home_filter"} <= kind.list_players([]).keys()
    assert "ceiling" not in kinds["mixed"].list_players([])


@pytest.mark.slow
def test_the_command_plays_on_where_it_stopped(tmp_path, capsys):
    out = tmp_path / "any_home.md"
    size = ["--num_homes", "2", "--steps", "4", "--searches", "2", "--out", str(out)]
    main(["--checkpoint", "heat", "--kinds", "paper-8", *size])
    played = json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))
    scores = played["scores"]
    for player in scores["paper-8"].values():
        assert {name: np.shape(player[name]) for name in COMPARED} == dict.fromkeys(COMPARED, (2,))
        assert {name: len(player[name]) for name in SHARED_METRICS} == dict.fromkeys(
            SHARED_METRICS, 1
        )
    scores["paper-8"]["random"]["accuracy"] = [0.123, 0.123]
    out.with_suffix(".json").write_text(json.dumps(played), encoding="utf-8")
    main(["--checkpoint", "heat", "--kinds", "paper-8", *size])
    assert "0.123" in out.read_text(encoding="utf-8")
    main(["--checkpoint", "heat", "other=heat", "--kinds", "paper-8", *size])
    text = out.read_text(encoding="utf-8")
    assert "| homes | heat | other |" in text
    assert describe_code() in text  # that played
    main(["--play", "false", "--checkpoint", "heat", "other", "--kinds", "paper-8", *size])
    assert out.read_text(encoding="utf-8") == text  # without the networks
    with pytest.raises(SystemExit):
        main(["--play", "false", "--checkpoint", "nobody", *size])
    assert "one that has played, got 'nobody'" in " ".join(capsys.readouterr().err.split())
    with pytest.raises(SystemExit):
        main(["--checkpoint", "heat", "--kinds", "paper-8", *size, "--steps", "5"])
    assert "got others for paper-8" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kinds", "castle"], r"kinds must be some of paper-32.*got 'castle'"),
        (["--num_homes", "0"], r"num_homes must be at least 1, got 0"),
        (["--recorded", "nowhere"], r"nowhere"),
        (["--card", "nowhere"], r"exported folder must have config\.json, got .* in nowhere"),
        (["--out", "."], r"out must be a file, got a folder at"),
    ],
)
def test_bad_input_ends_with_a_message(options, message, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["--checkpoint", "heat", "--out", str(tmp_path / "t.md"), *options])
    assert re.search(message, " ".join(capsys.readouterr().err.split()))
