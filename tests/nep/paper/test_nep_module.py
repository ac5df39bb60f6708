"""Loss and metrics by hand, training, and checkpoints that hold plain data."""

from __future__ import annotations

import math
from dataclasses import replace

import lightning.pytorch as pl
import pytest
import torch
from torch.utils.data import DataLoader

from nep.paper.encoders import GCN, HEAT, MLP
from nep.paper.loss import balanced_bce
from nep.paper.nep_module import NEPModule
from nep.paper.query_attention import AttentionConfig
from nep.training.hits_at_one import HitsAtOne
from nep.training.listwise_loss import listwise_loss, relevance_loss
from sgm.schema import QUERY_EDGE_TYPES


def test_loss_by_hand():
    # true: logit 0 -> -log 0.5 = log 2. false: logit 0 -> log 2, logit log 3 -> -log(1 - 3/4)
    # = log 4, each times #true / #false = 1/2. The edge of unknown truth does not enter: a mean
    # over three.
    # (log 2 + (log 2 + log 4) / 2) / 3 = (log 2 + 1.5 log 2) / 3 = 2.5 log 2 / 3
    logits = torch.tensor([0.0, 0.0, math.log(3), 50.0], requires_grad=True)
    target = torch.tensor([1.0, 0.0, 0.0, math.nan])
    loss = balanced_bce(logits, target)
    assert loss.item() == pytest.approx(2.5 * math.log(2) / 3)
    loss.backward()
    # gradient of each: weight * (probability - target) / 3; unknown: 0
    want = [(0.5 - 1) / 3, 0.5 * 0.5 / 3, 0.5 * 0.75 / 3, 0.0]
    torch.testing.assert_close(logits.grad, torch.tensor(want))


def test_loss_of_one_class_or_none():
    logits = torch.tensor([0.0, 0.0])
    # no true edge: every weight is 0; no false edge: the weight of false edges is never used
    assert balanced_bce(logits, torch.tensor([0.0, 0.0])).item() == 0
    assert balanced_bce(logits, torch.tensor([1.0, 1.0])).item() == pytest.approx(math.log(2))
    assert balanced_bce(logits, torch.tensor([math.nan, math.nan])).item() == 0


def test_half_is_the_best_constant_answer():
    target = torch.tensor([1.0] + [0.0] * 9)
    losses = {
        p: balanced_bce(torch.full((10,), math.log(p / (1 - p))), target).item()
        for p in (0.4, 0.5, 0.6)
    }
    assert min(losses, key=losses.__getitem__) == 0.5


def test_listwise_loss_by_hand():
    # snapshot 0: shares 1/4, 1/2, 1/4 of logits 0, log 2, 0; true are the first two: -log 3/4
    # snapshot 1: one edge, unknown; snapshot 2: shares 1/2, 1/2, one true: -log 1/2
    # snapshot 3: no true edge. Only snapshots 0 and 2 enter: (log 4/3 + log 2) / 2
    logits = torch.tensor([0.0, 5.0, math.log(2), 0.0, 1.0, 1.0, 3.0], requires_grad=True)
    target = torch.tensor([1.0, math.nan, 1.0, 0.0, 0.0, 1.0, 0.0])
    snapshot = torch.tensor([0, 1, 0, 0, 2, 2, 3])
    loss = listwise_loss(logits, target, snapshot, 4)
    assert loss.item() == pytest.approx((math.log(4 / 3) + math.log(2)) / 2)
    loss.backward()
    # gradient of -log of the true share: share - share given true, half of it in the mean
    want = [(1 / 4 - 1 / 3) / 2, 0, (1 / 2 - 2 / 3) / 2, 1 / 8, 1 / 4, -1 / 4, 0]
    torch.testing.assert_close(logits.grad, torch.tensor(want))


def test_listwise_loss_of_the_best_true_edge_by_hand():
    # As above, but of the true shares 1/4 and 1/2 the greater counts: (log 2 + log 2) / 2
    logits = torch.tensor([0.0, 5.0, math.log(2), 0.0, 1.0, 1.0, 3.0], requires_grad=True)
    target = torch.tensor([1.0, math.nan, 1.0, 0.0, 0.0, 1.0, 0.0])
    snapshot = torch.tensor([0, 1, 0, 0, 2, 2, 3])
    loss = listwise_loss(logits, target, snapshot, 4, best=True)
    assert loss.item() == pytest.approx(math.log(2))
    loss.backward()
    want = [1 / 8, 0, -1 / 4, 1 / 8, 1 / 4, -1 / 4, 0]
    torch.testing.assert_close(logits.grad, torch.tensor(want))


@pytest.mark.parametrize(("best", "sure"), [(False, 1.0), (True, 2.0)])
def test_of_two_mugs_it_settles_for_one(best, sure):
    """Places 0 and 1 both hold a mug six times of ten, else place 2 does: 0 is right in .6.

    Whoever shares what is right says .3 of it and goes to place 2, which is right in .4.
    """
    logits = torch.tensor([0.01, 0.0, 0.0], requires_grad=True)
    target = torch.tensor([[1.0, 1, 0]] * 6 + [[0.0, 0, 1]] * 4).flatten()
    snapshot = torch.arange(10).repeat_interleave(3)
    optimizer = torch.optim.Adam([logits], lr=0.1)
    for _ in range(300):
        optimizer.zero_grad()
        listwise_loss(logits.repeat(10), target, snapshot, 10, best).backward()
        optimizer.step()
    share = logits.detach().softmax(dim=0)
    assert share[:2].sum().item() == pytest.approx(0.6, abs=0.01)
    assert share[0].item() == pytest.approx(0.3 * sure, abs=0.01)
    assert int(share.argmax()) == (0 if best else 2)


def test_relevance_loss_by_hand():
    # snapshot 0: relevance 1, 3 -> weights 1/4, 3/4; logits 0, 0 -> shares 1/2: log 2
    # snapshot 1: none, does not enter. snapshot 2: weight 1 on a share of 3/4: log 4/3
    logits = torch.tensor([0.0, 5.0, 0.0, math.log(3), 0.0], requires_grad=True)
    relevance = torch.tensor([1.0, 0.0, 3.0, 0.2, 0.0])
    snapshot = torch.tensor([0, 1, 0, 2, 2])
    loss = relevance_loss(logits, relevance, snapshot, 3)
    assert loss.item() == pytest.approx((math.log(2) + math.log(4 / 3)) / 2)
    loss.backward()
    # gradient: (share - weight) / 2
    want = [(1 / 2 - 1 / 4) / 2, 0, (1 / 2 - 3 / 4) / 2, (3 / 4 - 1) / 2, (1 / 4 - 0) / 2]
    torch.testing.assert_close(logits.grad, torch.tensor(want))
    logits = logits.detach().requires_grad_()
    nothing = relevance_loss(logits, torch.zeros(5), snapshot, 3)
    assert nothing.item() == 0
    nothing.backward()
    assert not logits.grad.any()


def test_a_batch_with_relevance_is_learned_by_it(random_batch):
    """The same batch with and without relevance: it alone makes the loss."""
    torch.manual_seed(0)
    module = NEPModule(MLP(units=8), listwise_weight=1.0).eval()
    batch = random_batch(seed=1)
    logits = module(batch)
    plain, answers = module.compute_loss(batch)
    torch.testing.assert_close(answers.logits, logits)
    expected = balanced_bce(logits, batch.query_target) + listwise_loss(
        logits, batch.query_target, batch.query_snapshot, batch.num_snapshots
    )
    torch.testing.assert_close(plain, expected)
    relevance = torch.rand(len(batch.query_edge))
    batch = replace(batch, query_relevance=relevance)
    data = [batch.to_pyg()[etype] for etype in QUERY_EDGE_TYPES]
    found = torch.cat([columns["relevance"][columns["query"] >= 0] for columns in data])
    torch.testing.assert_close(found, relevance)
    expected = relevance_loss(logits, relevance, batch.query_snapshot, batch.num_snapshots)
    torch.testing.assert_close(module.compute_loss(batch)[0], expected)


def test_listwise_loss_without_a_true_edge():
    logits = torch.tensor([1.0, 2.0], requires_grad=True)
    for target in ([0.0, math.nan], [math.nan, math.nan]):
        loss = listwise_loss(logits, torch.tensor(target), torch.tensor([0, 1]), 2)
        assert loss.item() == 0
        loss.backward()
        assert not logits.grad.any()


def test_the_cosine_schedule_ends_at_zero(random_batch):
    module = NEPModule(MLP(units=8), learning_rate=0.01, schedule="cosine")
    loader = DataLoader([random_batch(seed=s) for s in range(4)], batch_size=None)
    rates = []

    class Watch(pl.Callback):
        def on_train_batch_start(self, trainer, pl_module, batch, batch_idx):
            rates.append(trainer.optimizers[0].param_groups[0]["lr"])

    pl.Trainer(
        max_epochs=2,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        accelerator="cpu",
        callbacks=[Watch()],
    ).fit(module, loader, loader)
    # 8 steps: 0.01 x (1 + cos(pi t / 8)) / 2
    want = [0.01 * (1 + math.cos(math.pi * step / 8)) / 2 for step in range(8)]
    assert rates == pytest.approx(want)


def test_hits_at_1_by_hand():
    metric = HitsAtOne()
    # snapshot 0: best is true -> 1. snapshot 2: best is false -> 0. snapshot 5: two tie, one of
    # them true -> 1/2.
    metric.update(
        torch.tensor([0.1, 3.0, 2.0, 1.0, 7.0, 7.0, -1.0]),
        torch.tensor([0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]),
        torch.tensor([0, 0, 2, 2, 5, 5, 5]),
    )
    # snapshot 0 of the next batch has no true edge -> 0
    metric.update(torch.tensor([1.0]), torch.tensor([0.0]), torch.tensor([0]))
    assert metric.compute().item() == pytest.approx((1 + 0 + 0.5 + 0) / 4)


def fit(module, batches, max_epochs=2, ckpt_path=None):
    loader = DataLoader(batches, batch_size=None)
    trainer = pl.Trainer(
        accelerator="cpu",
        max_epochs=max_epochs,
        log_every_n_steps=1,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    trainer.fit(module, loader, loader, ckpt_path=ckpt_path, weights_only=True)
    return trainer


@pytest.mark.slow
def test_a_module_that_was_compiled_as_a_whole_is_refused_in_one_line(random_batch):
    """It ended in an internal error at `self.log`, after eight compilations."""
    module = torch.compile(NEPModule(MLP(units=8)), backend="eager")
    with pytest.raises(ValueError, match=r"must not be compiled as a whole, got .* Train") as error:
        fit(module, [random_batch(0)])
    assert "\n" not in str(error.value)


@pytest.mark.slow
@pytest.mark.parametrize("encoder", [MLP, GCN, HEAT])
def test_a_reloaded_checkpoint_gives_equal_logits(encoder, random_batch, tmp_path):
    torch.manual_seed(0)
    module = NEPModule(encoder(units=16), attention=AttentionConfig(heads=4, feed_forward_units=8))
    trainer = fit(module, [random_batch(seed) for seed in range(2)])
    assert {"train/loss", "train/hits_at_1", "train/auroc"} <= trainer.callback_metrics.keys()
    assert {"val/loss", "val/hits_at_1", "val/auroc", "val/average_precision"} <= (
        trainer.callback_metrics.keys()
    )
    path = tmp_path / "model.ckpt"
    trainer.save_checkpoint(path)
    plain = torch.load(path, weights_only=True)["hyper_parameters"]
    assert plain["encoder"]["init_args"]["units"] == 16

    again = NEPModule.load_from_checkpoint(path, weights_only=True)
    assert type(again.predictor.encoder) is encoder
    batch = random_batch(5)
    with torch.inference_mode():
        assert torch.equal(again.eval()(batch), module.eval()(batch))


def test_training_resumes_without_pickle(random_batch, tmp_path):
    def make():
        torch.manual_seed(0)
        return NEPModule(HEAT(units=16), attention=AttentionConfig(dropout=0.0))

    batches = [random_batch(seed) for seed in range(2)]
    straight, half, resumed = make(), make(), make()
    fit(straight, batches)
    path = tmp_path / "half.ckpt"
    fit(half, batches, max_epochs=1).save_checkpoint(path)
    fit(resumed, batches, ckpt_path=path)
    for want, got in zip(straight.parameters(), resumed.parameters(), strict=True):
        torch.testing.assert_close(got, want)


@pytest.mark.slow
def test_learns_what_decides(random_batch):
    """The last feature of an edge decides its truth; unseen batches are ranked by it."""

    def make(seed):
        batch = random_batch(seed, num_snapshots=20)
        is_true = batch.edge_feature[batch.query_edge, 8] > 0.8
        return replace(batch, query_target=is_true.float())

    torch.manual_seed(0)
    module = NEPModule(HEAT(units=16), learning_rate=3e-3)
    trainer = fit(module, [make(seed) for seed in range(5)], max_epochs=30)
    result = trainer.validate(module, DataLoader([make(99)], batch_size=None), verbose=False)[0]
    assert result["val/auroc"] > 0.95
