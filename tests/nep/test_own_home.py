"""From log to network in three commands, in a home with habits."""

import pytest
import torch

from nep import ObjectFinder, export, fit
from nep.players.checkpoints import load_trained
from nep.robot.fine_tuning import compare_in_log
from simulator.trace.__main__ import main as trace
from tests.sgm.finder.conftest import Home

WEEK = 252  # looks, three in each of 84 steps


@pytest.fixture(scope="module")
def week(tmp_path_factory):
    """A home after its first week, and its folder with the log."""
    folder = tmp_path_factory.mktemp("own_home")
    home = Home(seed=0, miss_rate=0.0, log=folder / "looks.jsonl")
    home.live(WEEK)
    return home, folder


@pytest.fixture(scope="module")
def network(week, tmp_path_factory):
    """The three commands of docs/robot/learn.md."""
    _, folder = week
    traces = [str(folder / "home" / name) for name in ("train", "val", "test")]
    assert trace(["from-log", str(folder / "looks.jsonl"), "--out", str(folder / "home")]) == 0
    fit.main(
        [
            "--from=heat", "--config=own_home.yaml", f"--log={folder / 'looks.jsonl'}",
            "--data.trace", traces[0],
            "--data.val_trace", traces[1], f"--data.data_dir={folder / 'data'}", "--threads=1",
            f"--trainer.logger.init_args.save_dir={folder / 'runs'}", "--data.workers=1",
            "--trainer.enable_progress_bar=false", "--trainer.max_epochs=4", "--data.replays=8",
        ]
    )  # fmt: skip
    best = folder / "runs" / "own_home" / "version_0" / "checkpoints" / "best.ckpt"
    out = folder / "my_network"
    export.main([str(best), str(out), "--trace", traces[2], "--replays=20", "--threads=1"])
    return out


@pytest.mark.slow
def test_the_network_is_the_start_or_one_that_makes_the_latest_looks_likelier(week, network):
    home, folder = week
    start, own = load_trained("heat"), load_trained(network)
    weights, own_weights = (model.module.state_dict() for model in (start, own))
    is_start = all(torch.equal(value, own_weights[name]) for name, value in weights.items())
    assert is_start or compare_in_log(start, own, folder / "looks.jsonl")[0]
    finder = ObjectFinder.load(network)
    for thing in home.at:
        ranking = finder.rank(home.memory, thing)
        total = sum(place.probability for place in ranking) + ranking.elsewhere
        assert total == pytest.approx(1)


@pytest.mark.slow
def test_the_card_of_the_network_says_where_it_is_from(network):
    card = " ".join((network / "MODEL_CARD.md").read_text(encoding="utf-8").split())
    assert "Its training began with the weights of `heat`." in card
    assert "20 recorded test homes" in card
    assert "No recorded home" not in card
    assert load_trained(network).builder.config == load_trained("heat").builder.config
