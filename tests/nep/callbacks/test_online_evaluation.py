"""The online evaluation: what it logs, draws, prints and writes."""

import itertools
import json

import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from nep.callbacks.online_config import OnlineConfig
from nep.callbacks.online_evaluation import OnlineEvaluation
from nep.fit import main
from nep.players.policy import NEPPolicy
from nep.report.figures import draw_over_steps
from nep.report.results import ScoreSummary
from simulator import HomeConfig, Streams, evaluate_policy
from simulator.policies import POLICIES, make_policy
from simulator.tasks.metrics import METRICS
from simulator.world.source import SampledSource

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def fit(tmp_path_factory):
    """A short fit with two online evaluations: its folder, and the epoch of each play."""
    folder, epochs, play = tmp_path_factory.mktemp("fit"), [], OnlineEvaluation._play

    def record(self, trainer, make):
        epochs.append(trainer.current_epoch + 1)
        return play(self, trainer, make)

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(OnlineEvaluation, "_play", record)
        main(
            (
                "--config mlp.yaml --trainer.max_epochs=3 --data.num_homes=2 --data.steps=8 "
                "--data.num_val_homes=1 --data.batch_size=8 --data.workers=1 --online.num_homes=2 "
                "--online.steps=5 --online.every_n_epochs=2 --trainer.log_every_n_steps=1 "
                "--trainer.enable_progress_bar=false"
            ).split()
        )
    return folder / "runs" / "mlp" / "version_0", epochs


@pytest.fixture(scope="module")
def run(fit):
    """Folder of the fit."""
    return fit[0]


def test_heuristics_play_once_and_not_before_the_model(fit):
    # Evaluations after epochs 2 and 3: in the first, all heuristics and then the model.
    assert fit[1] == [2] * (len(POLICIES) + 1) + [3]


def test_logs_scalars_figure_and_chart(run):
    events = EventAccumulator(str(run), size_guidance={"scalars": 0, "images": 0, "tensors": 0})
    events.Reload()
    tags = events.Tags()
    # Epoch 2 by the interval, epoch 3 because it is the last.
    assert len(events.Scalars("3_online/accuracy")) == 2
    for tag in ("candidate_recall", "gap_closed_oracle", "gap_closed_ceiling"):
        assert f"4_more_online/{tag}" in tags["scalars"]
    for name in POLICIES:
        assert len(events.Scalars(f"3_online/{name}")) == 2
    for name in ("accuracy_over_steps", "calibration", "searches"):
        assert len(events.Images(f"3_online/{name}")) == 2
    (table,) = events.Tensors("3_online/table/text_summary")
    written = (run / "online_evaluation.md").read_bytes()
    assert table.tensor_proto.string_val[0] == written
    assert "_hparams_/session_start_info" in events.summary_metadata


def test_tensorboard_opens_on_what_is_read_first(run):
    """Its groups are in the order of the alphabet; no group is a counter, or of a single point."""
    events = EventAccumulator(str(run), size_guidance={"scalars": 0}).Reload()
    tags = events.Tags()["scalars"]
    groups = list(dict.fromkeys(tag.partition("/")[0] for tag in sorted(tags)))
    assert groups[:3] == ["1_loss", "2_hits_at_1", "3_online"]
    assert all(group[0].isdigit() for group in groups)
    assert [tag for tag in tags if len(events.Scalars(tag)) < 2] == []
    (layout,) = events.Tensors("custom_scalars__config__")
    shown = layout.tensor_proto.string_val[0]
    for tag in ("1_loss/train", "2_hits_at_1/val", "3_online/accuracy", "3_online/bayesian"):
        assert tag.encode() in shown


def test_written_scores_are_those_of_the_checkpoint(run):
    """The final table of the model is what its last checkpoint scores when played again."""
    written = json.loads((run / "online_evaluation.json").read_text())
    assert set(written) == {*POLICIES, "NEP-MLP"}
    policy = NEPPolicy.load(run / "checkpoints" / "last.ckpt")
    again = evaluate_policy(lambda homes: policy, SampledSource(), Streams(0, "val", range(2)), 5)
    assert written["NEP-MLP"]["accuracy_per_home"] == again.home_values.tolist()
    assert written["NEP-MLP"]["accuracy"] == pytest.approx(again.is_correct.mean())


def test_table_is_sorted_and_paired(capsys):
    evaluation = OnlineEvaluation(OnlineConfig(num_homes=3, steps=10, name="NEP"))

    def make_scores(*first: int) -> ScoreSummary:
        right = np.arange(10) < np.array(first)[:, None]
        return ScoreSummary(right.astype(float), dict.fromkeys(METRICS, 1.0))

    evaluation.scores = {
        "bayesian": make_scores(2, 4, 3),  # accuracy 0.3
        "oracle": make_scores(6, 8, 7),  # 0.7
        "ceiling": make_scores(8, 8, 8),  # 0.8
        "NEP": make_scores(4, 6, 5),  # 0.5: half of 0.3 -> 0.7, two fifths of 0.3 -> 0.8
    }
    evaluation.print_table()
    out = capsys.readouterr().out
    lines = [line.split() for line in out.splitlines()]
    assert [line[0] for line in lines if len(line) > 2 and line[1][0] == "0"] == [
        "bayesian",
        "NEP",
        "oracle",
        "ceiling",
    ]
    assert "-0.200 [-0.200, -0.200]" in out  # Bayesian: all homes differ by exactly 0.2
    # the ceiling: homes differ by 0.4, 0.2 and 0.3; of three, t = 4.303 standard errors of 0.0577
    assert "+0.300 [+0.052, +0.548]" in out
    flat = " ".join(out.split())
    assert (
        "From bayesian up, NEP goes 50% of the way to oracle and 40% of the way to ceiling." in flat
    )
    assert "bayesian are rules that read the memory and the prior alone." in flat
    assert "oracle, ceiling are given what no robot knows" in flat


def test_markdown_says_what_the_terminal_says(run):
    text = (run / "online_evaluation.md").read_text(encoding="utf-8")
    written = json.loads((run / "online_evaluation.json").read_text())
    rows = {line.split("|")[1].strip(" *"): line for line in text.splitlines() if "|" in line}
    assert rows.keys() == {"policy", "---", *written}
    for name, scores in written.items():
        assert f"{scores['accuracy']:.3f}" in rows[name]
    assert "gap closed" in text


def test_names_at_the_ends_of_curves_do_not_overlap():
    same = np.ones((2, 10), dtype=bool)
    values = dict.fromkeys(list(POLICIES)[:10], same)
    figure = draw_over_steps(values, "bayesian", title="equal scores", metric="accuracy")
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert len(boxes) == len(values)
    heights = sorted((box.y0, box.y1) for box in boxes)
    # Letters may reach below their line; lines themselves are apart.
    assert all(low[1] - next_low[0] < 2 for low, next_low in itertools.pairwise(heights))
    bottom, top = figure.axes[0].get_ylim()
    assert all(bottom <= text.get_position()[1] <= top for text in figure.axes[0].texts)


def test_of_many_curves_a_few_rules_and_all_networks_are_drawn_with_lines_to_their_names():
    rng = np.random.default_rng(0)
    values = {name: rng.random((3, 10)) for name in [*POLICIES, "mine", "other"]}
    figure = draw_over_steps(values, ["mine", "other"], title="many", metric="accuracy")
    (axes,) = figure.axes
    names = {text.get_text() for text in axes.texts}
    assert {"mine", "other", "bayesian", "oracle"} <= names
    assert len(names) == 9
    curves = [line for line in axes.lines if len(line.get_xdata()) == 10]
    leaders = [line for line in axes.lines if len(line.get_xdata()) == 3]
    assert len(curves) == len(leaders) == 9
    # Each line starts at the end of a curve of its colour, and ends at a name.
    ends = {(line.get_color(), line.get_ydata()[-1]) for line in curves}
    assert {(line.get_color(), line.get_ydata()[0]) for line in leaders} == ends
    heights = {text.get_position()[1] for text in axes.texts}
    assert {line.get_ydata()[-1] for line in leaders} == heights
    assert len({color for color, _ in ends}) == 9


def test_plays_the_task_of_the_data_beside_some_policies(tmp_path, monkeypatch, capsys):
    """Find Object without dynamic nodes: looks, of which fewer are better."""
    monkeypatch.chdir(tmp_path)
    cli = main(
        [
            "--config",
            "mlp.yaml",
            "--trainer.max_epochs=1",
            "--data.num_homes=2",
            "--data.steps=4",
            "--data.num_val_homes=1",
            "--data.batch_size=8",
            "--data.workers=1",
            "--online.num_homes=2",
            "--data.task=find_object",
            "--data.home.dynamic_nodes=false",
            "--online.steps=3",
            "--online.policies=[bayesian, ceiling]",
            "--trainer.log_every_n_steps=1",
            "--trainer.enable_progress_bar=false",
        ]
    )
    run = tmp_path / "runs" / "mlp" / "version_0"
    written = json.loads((run / "online_evaluation.json").read_text())
    assert set(written) == {"bayesian", "ceiling", "NEP-MLP"}
    for name, scores in written.items():
        again = evaluate_policy(
            lambda homes, name=name: (
                NEPPolicy.load(run / "checkpoints" / "last.ckpt")
                if name == "NEP-MLP"
                else make_policy(name, homes)
            ),
            SampledSource(home=HomeConfig(dynamic_nodes=False)),
            Streams(0, "val", range(2)),
            3,
            task="find_object",
        )
        assert scores["looks_per_home"] == again.home_values.tolist()
        assert scores["looks_per_step"] == again.values.mean(axis=0).tolist()
    bayesian, ceiling, model = (
        written[name]["looks"] for name in ("bayesian", "ceiling", "NEP-MLP")
    )
    gap = (bayesian - model) / (bayesian - ceiling)  # fewer looks close it
    assert cli.trainer.logged_metrics["online/gap_closed_ceiling"] == pytest.approx(gap)
    assert cli.trainer.logged_metrics["online/looks"] == pytest.approx(model)
    events = EventAccumulator(str(run))
    events.Reload()
    assert "3_online/looks_over_steps" in events.Tags()["images"]
    text = " ".join(capsys.readouterr().out.split())
    assert "Find Object, dynamic nodes off, 2 unseen homes x 3 steps" in text
    up = f"From bayesian up, NEP-MLP goes {gap:.0%} of the way to ceiling."
    assert (up if gap > 0 else "NEP-MLP does not reach bayesian.") in text
    assert "oracle" not in text


def test_without_policies_nothing_is_said_of_gaps(capsys):
    evaluation = OnlineEvaluation(OnlineConfig(num_homes=2, steps=10, policies=[]))
    evaluation.scores["NEP"] = ScoreSummary(np.full((2, 10), 0.5), dict.fromkeys(METRICS, 1.0))
    evaluation.print_table()
    out = capsys.readouterr().out
    assert "In 100.0% of the questions the true place was among those scored." in out
    assert "bayesian" not in out


def test_unknown_policies_are_refused():
    with pytest.raises(
        ValueError, match=r"policy must be one of random, .*, got 'clever'\. Choose"
    ):
        OnlineConfig(policies=["random", "clever"])


@pytest.mark.parametrize("name", ["num_homes", "steps", "every_n_epochs"])
def test_counts_below_one_are_refused(name):
    with pytest.raises(ValueError, match=rf"{name} must be at least 1, got 0"):
        OnlineConfig(**{name: 0})
