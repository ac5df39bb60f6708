"""Training in bfloat16, and on a device that refuses to mix its tensors with those of another."""

from __future__ import annotations

import lightning.pytorch as pl
import pytest
import torch
from torch import nn
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_flatten, tree_map
from torch.utils.data import DataLoader

from nep.paper.encoders import GCN, HAN, HEAT, HGT, MLP
from nep.paper.nep_module import NEPModule
from nep.paper.query_attention import AttentionConfig

OURS = {"mlp": MLP, "gcn": GCN, "heat": HEAT, "hgt": HGT, "han": HAN}
DEVICE = torch.device("meta")  # stands for a GPU: the numbers are there, in `DeviceTensor.content`


@pytest.mark.parametrize("encoder", OURS.values())
def test_a_step_of_training_in_bfloat16(random_batch, encoder):
    batches = [random_batch(seed) for seed in range(3)]
    torch.manual_seed(0)
    module = NEPModule(encoder(16), attention=AttentionConfig(dropout=0.0), listwise_weight=1.0)
    with torch.no_grad():
        expected = module(batches[0])
        with torch.autocast("cpu", torch.bfloat16):
            found = module(batches[0])
    assert found.dtype == torch.bfloat16
    torch.testing.assert_close(found.float(), expected, rtol=0.05, atol=0.05)
    before = [parameter.clone() for parameter in module.parameters()]
    trainer = pl.Trainer(
        accelerator="cpu",
        precision="bf16-mixed",
        max_epochs=1,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    loader = DataLoader(batches, batch_size=None)
    trainer.fit(module, loader, loader)
    for parameter, old in zip(module.parameters(), before, strict=True):
        assert parameter.dtype == torch.float32
        assert parameter.isfinite().all()
        assert not parameter.equal(old)


class DeviceTensor(torch.Tensor):
    """A tensor that says it is on `DEVICE`."""

    @staticmethod
    def __new__(cls, real):
        made = torch.Tensor._make_wrapper_subclass(
            cls, real.shape, strides=real.stride(), dtype=real.dtype, device=DEVICE
        )
        made.content = real
        return made

    __torch_function__ = torch._C._disabled_torch_function_impl

    def tolist(self):
        """Copy the numbers back."""
        return self.content.tolist()

    @classmethod
    def __torch_dispatch__(cls, func, types, args=(), kwargs=None):
        return run(func, args, kwargs or {})


class Factories(TorchDispatchMode):
    """Catches what makes tensors on `DEVICE` out of nothing, and what copies them there."""

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        return run(func, args, kwargs or {})


def run(func, args, kwargs):
    """Compute on the CPU; the result is on `DEVICE` if the arguments are, or if it was asked for.

    Raises:
        RuntimeError: if tensors of both are mixed, as a GPU does; numbers without axes may be.
    """
    tensors = [value for value in tree_flatten((args, kwargs))[0] if torch.is_tensor(value)]
    is_there = [isinstance(tensor, DeviceTensor) for tensor in tensors]
    target = kwargs.get("device")
    is_copy = func in (torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default)
    if any(is_there) and not is_copy:
        strangers = [
            tensor
            for tensor, there in zip(tensors, is_there, strict=True)
            if not there and tensor.dim()
        ]
        if strangers:
            raise RuntimeError(f"{func} mixes devices: {[tuple(t.shape) for t in strangers]}")
    if target is not None:
        kwargs = {**kwargs, "device": torch.device("cpu")}
        wraps = torch.device(target) == DEVICE
    else:
        wraps = any(is_there)
    real = tree_map(_unwrap, (args, kwargs))
    found = func(*real[0], **real[1])
    if not wraps:
        return found
    if func.name().endswith("_") or func.name().split(".")[0].endswith("_"):
        return args[0]  # in place
    return tree_map(lambda value: DeviceTensor(value) if torch.is_tensor(value) else value, found)


def make_tensor(values, device=None, make=torch.tensor, **kwargs):
    """`torch.tensor`, which makes its tensors without telling anybody."""
    made = make(values, **kwargs)
    return DeviceTensor(made) if device == DEVICE else made


def _unwrap(value):
    return value.content if isinstance(value, DeviceTensor) else value


def move(module: nn.Module) -> None:
    """Move parameters and buffers."""
    for part in module.modules():
        for name, parameter in part.named_parameters(recurse=False):
            setattr(part, name, nn.Parameter(DeviceTensor(parameter.detach())))
        for name, buffer in part.named_buffers(recurse=False):
            part.register_buffer(name, DeviceTensor(buffer), persistent=False)


def test_the_stand_in_refuses_to_mix():
    with Factories():
        there = torch.zeros(3, device=DEVICE)
        assert there.device == DEVICE
        assert (there + torch.tensor(1.0)).device == DEVICE
        with pytest.raises(RuntimeError, match="mixes devices"):
            there + torch.ones(3)


@pytest.mark.parametrize("num_snapshots", [1, 3])
@pytest.mark.parametrize("encoder", [name for name in OURS if name != "hgt"])  # DGL's layer
def test_nothing_is_made_on_another_device(random_batch, monkeypatch, encoder, num_snapshots):
    """Forward, loss and backward on the device give what they give on the CPU."""
    torch.manual_seed(0)
    batch = random_batch(0, num_snapshots)
    module = NEPModule(
        OURS[encoder](16), attention=AttentionConfig(dropout=0.0), listwise_weight=1.0
    )

    def compute(graph):
        loss = module.compute_loss(graph)[0]
        loss.backward()
        return loss

    expected = compute(batch).detach()
    gradients = [parameter.grad for parameter in module.parameters()]
    monkeypatch.setattr(torch, "tensor", make_tensor)
    with Factories():
        move(module)
        graph = batch.to(DEVICE)
        assert {type(getattr(graph, name)) for name in ("label", "edge_src", "text")} == {
            DeviceTensor
        }
        loss = compute(graph)
    torch.testing.assert_close(loss.content, expected)
    for parameter, gradient in zip(module.parameters(), gradients, strict=True):
        torch.testing.assert_close(parameter.grad.content, gradient)


@pytest.mark.dgl
def test_where_a_layer_of_dgl_does_not_go_is_named(random_batch):
    batch = random_batch(0).to(DEVICE)
    with pytest.raises(ValueError, match=r"must be one that DGL was built for, got meta\. Install"):
        NEPModule(HGT(16)).to(DEVICE)(batch)
