"""From log to network in three commands, in a home with habits."""

import numpy as np
import pytest

from nep import ObjectFinder, export, fit
from nep.players.checkpoints import load_trained
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
def test_a_week_of_looks_makes_a_network_that_is_no_worse_in_the_next(week, network):
    home, _ = week
    finders = [ObjectFinder.load("heat"), ObjectFinder.load(network)]
    hits, nll = [], []
    for step in range(28):
        home.pass_time()
        for thing in list(home.at)[step % 4 :: 4]:
            truth = home.furniture[home.at[thing]]
            rankings = [finder.rank(home.memory, thing) for finder in finders]
            hits.append([ranking.places[0].furniture == truth for ranking in rankings])
            nll.append([-np.log(_find(ranking, truth)) for ranking in rankings])
        for furniture in home.choose(3):
            home.memory.observe(furniture, home.look(furniture))
    for differences in (np.diff(np.array(hits, dtype=float)), -np.diff(np.array(nll))):
        standard_error = differences.std() / np.sqrt(len(differences))
        assert differences.mean() >= -2 * standard_error


@pytest.mark.slow
def test_the_card_of_the_network_says_where_it_is_from(network):
    card = " ".join((network / "MODEL_CARD.md").read_text(encoding="utf-8").split())
    assert "Its training began with the weights of `heat`." in card
    assert "20 recorded test homes" in card
    assert "No recorded home" not in card
    assert load_trained(network).builder.config == load_trained("heat").builder.config


def _find(ranking, furniture):
    return next(place.probability for place in ranking if place.furniture == furniture)
