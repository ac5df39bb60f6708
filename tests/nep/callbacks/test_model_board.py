"""TensorBoard shows the graph of the model, and histograms of its weights and attention."""

from __future__ import annotations

import lightning.pytorch as pl
import pytest
import torch
from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from torch.utils.data import DataLoader

from nep.callbacks.model_board import ModelBoard
from nep.paper.encoders import HAN, HEAT
from nep.paper.nep_module import NEPModule


def train(module, batches, logger, callbacks):
    torch.manual_seed(3)
    loaders = [DataLoader(batches, batch_size=None) for _ in range(2)]
    trainer = pl.Trainer(
        accelerator="cpu",
        max_epochs=2,
        logger=logger,
        callbacks=callbacks,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        log_every_n_steps=1,
    )
    trainer.fit(module, *loaders)


@pytest.fixture
def batches(random_batch):
    return [random_batch(seed) for seed in range(2)]


@pytest.mark.slow
@pytest.mark.parametrize("encoder", [HEAT, HAN])
@pytest.mark.filterwarnings("ignore:.*does not have many workers")
@pytest.mark.filterwarnings("ignore:.isinstance.treespec, LeafSpec")
def test_board_has_graph_weights_and_attention(encoder, batches, tmp_path):
    module = NEPModule(encoder(units=8))
    train(module, batches, TensorBoardLogger(tmp_path, "", ""), [ModelBoard()])
    events = EventAccumulator(str(tmp_path), size_guidance={"histograms": 0}).Reload()
    tags = events.Tags()
    assert tags["graph"]
    names = {f"weights/{name}" for name, _ in module.named_parameters()}
    shares = {name for name in tags["histograms"] if name.startswith("attention/")}
    assert {*tags["histograms"]} - shares == names
    assert "attention/predictor.encoder.convolutions.0" in shares
    assert len(shares) == 3  # the convolution, and both layers among query edges
    for name in shares:
        found = events.Histograms(name)
        assert len(found) == 2, "a histogram for each epoch"
        assert all(0 < each.histogram_value.min <= each.histogram_value.max <= 1 for each in found)


@pytest.mark.filterwarnings("ignore:.*does not have many workers")
@pytest.mark.filterwarnings("ignore:.isinstance.treespec, LeafSpec")
@pytest.mark.slow
def test_looking_changes_nothing(batches, tmp_path):
    found = []
    for callbacks in ([], [ModelBoard()]):
        torch.manual_seed(0)
        module = NEPModule(HEAT(units=8))
        train(module, batches, TensorBoardLogger(tmp_path, str(len(callbacks)), ""), callbacks)
        found.append(torch.cat([weight.detach().flatten() for weight in module.parameters()]))
    assert found[0].equal(found[1])


@pytest.mark.filterwarnings("ignore:.*does not have many workers")
@pytest.mark.filterwarnings("ignore:.isinstance.treespec, LeafSpec")
def test_without_a_board_it_is_refused(batches, tmp_path):
    with pytest.raises(ValueError, match="must have a logger of TensorBoard to write to, got none"):
        train(NEPModule(HEAT(units=8)), batches, CSVLogger(tmp_path), [ModelBoard()])
