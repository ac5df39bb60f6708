"""Files of torch that say more than they hold: checkpoints, and days of HOMER households."""

from __future__ import annotations

import json
import pickle
import struct
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mutate
import numpy as np
import targets
import torch
from torch._weights_only_unpickler import _get_allowed_globals

from nep.importers.homer import read_homer
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import check_resumable
from simulator.trace.trace import save_trace

Rng = np.random.Generator
DAY = "train/000.pt"
MARKED = 12_345  # numbers of elements; a file says another one in its place
_HUGE = (-1, 0, 2**20, 10**9, 2**31 - 1)
_DEFLATED_MB = 1500


def make_good(folder: Path) -> None:
    """Write a good checkpoint, a good household, and a small file that unpacks to a large one."""
    targets.make_checkpoint(folder)
    content = torch.load(folder / "last.ckpt", weights_only=True)
    going_on = {"loops": {}, "optimizer_states": [], "lr_schedulers": [], "epoch": 0}
    torch.save({**content, **going_on, "global_step": 0}, folder / "last.ckpt")
    for part in ("train", "test"):
        (folder / "home" / part).mkdir(parents=True)
        torch.save(make_day(), folder / "home" / part / "000.pt")
    classes = ["kitchen", "table", "shelf", "cup"]
    categories = ["Rooms", "Furniture", "Furniture", "placable_objects"]
    common = {"node_classes": classes, "node_categories": categories}
    (folder / "home" / "common_data.json").write_text(json.dumps(common))
    torch.save(torch.zeros(MARKED), folder / "small.pt")
    number = struct.pack("<I", _DEFLATED_MB << 18)
    with (
        zipfile.ZipFile(folder / "small.pt") as small,
        zipfile.ZipFile(folder / "deflated.pt", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as big,
    ):
        for name in small.namelist():
            if not name.endswith("data/0"):
                content = small.read(name)
                big.writestr(name, content.replace(struct.pack("<BH", 77, MARKED), b"J" + number))
                continue
            with big.open(name, "w", force_zip64=True) as file:
                for _ in range(_DEFLATED_MB):
                    file.write(bytes(1 << 20))


def make_day() -> list[torch.Tensor]:
    """Return a day of three snapshots: edges, nodes, activity, minutes."""
    edges = torch.zeros(3, 4, 4)
    edges[:, 1, 0] = edges[:, 2, 0] = 1
    edges[:2, 3, 1] = edges[2, 3, 2] = 1
    return [edges, torch.zeros(3, 4), torch.zeros(3), torch.tensor([380.0, 400.0, 500.0])]


def spread(tensor: torch.Tensor, rng: Rng) -> torch.Tensor:
    """Return a tensor that takes no memory for some of its size: strides of 0."""
    if rng.random() < 0.4:
        return (
            tensor.reshape(-1)[:1]
            .expand(tensor.numel())
            .as_strided(tensor.shape, [0] * tensor.dim())
        )
    size = int(rng.choice([10**3, 10**5, 10**8, 10**10]))
    shape = (*tensor.shape[:-1], size) if rng.random() < 0.5 else (size, *tensor.shape[1:])
    return torch.zeros(1).expand(size).as_strided(shape, [0] * len(shape))


def change_kind(tensor: torch.Tensor, rng: Rng) -> Any:
    """Return a tensor of another type, layout or content."""
    kinds: list[Callable[[], Any]] = [
        *(
            lambda dtype=dtype: tensor.to(dtype)
            for dtype in (
                torch.bfloat16,
                torch.half,
                torch.complex64,
                torch.int8,
                torch.bool,
                torch.float64,
            )
        ),
        lambda: tensor.to_sparse(),
        lambda: tensor.to("meta"),
        lambda: torch.nn.Parameter(tensor.float()),
        lambda: torch.quantize_per_tensor(tensor.float(), 0.1, 0, torch.quint8),
        lambda: tensor.float() * float(rng.choice([np.nan, np.inf, -1e38, 1e30])),
        lambda: tensor.reshape(-1)[:0],
        lambda: tensor.reshape(-1)[0],
        lambda: tensor.flip(0).mT if tensor.dim() > 1 else tensor[None],
        lambda: torch.zeros(10**6)[: tensor.numel()].reshape(tensor.shape),
        lambda: rng.choice([0, 1.5]).item(),
        lambda: tensor.tolist(),
    ]
    return kinds[int(rng.integers(len(kinds)))]()


def change_tensors(tensors: Any, rng: Rng) -> None:
    """Change some tensors of a list or dictionary."""
    keys = list(tensors) if isinstance(tensors, dict) else list(range(len(tensors)))
    change = spread if rng.random() < 0.5 else change_kind
    for key in rng.choice(len(keys), size=int(rng.integers(1, 4)), replace=False):
        tensors[keys[key]] = change(tensors[keys[key]], rng)


def change_checkpoint(folder: Path, rng: Rng) -> None:
    """Let a checkpoint say more than it holds."""
    path, kind = folder / "last.ckpt", rng.integers(5)
    content = torch.load(path, weights_only=True)
    if kind == 0:  # a wide network, every weight of which is one number
        units = int(rng.choice([64, 1000, 20_000, 40_000, 10**6]))
        with torch.device("meta"):
            wide = NEPModule(MLP(units=units)).state_dict()
        content["hyper_parameters"]["encoder"]["init_args"]["units"] = units
        content["state_dict"] = {
            name: torch.zeros(1).as_strided(tensor.shape, [0] * tensor.dim())
            for name, tensor in wide.items()
        }
    elif kind == 1:
        change_tensors(content["state_dict"], rng)
    elif kind == 2:
        content["state_dict"]["predictor.head.0.bias"] = torch.zeros(MARKED)
    elif kind == 3:
        (folder / "deflated.pt").replace(path)
        return
    else:
        path.write_bytes(mutate.mutate_bytes(path.read_bytes(), rng))
        return
    save(content, path, rng)


def save(content: Any, path: Path, rng: Rng) -> None:
    """Write a file of torch in one of its two formats, with sizes that it does not have."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of layouts that are being taken out
        torch.save(content, path, _use_new_zipfile_serialization=bool(rng.random() < 0.5))
    marked, data = struct.pack("<BH", 77, MARKED), path.read_bytes()
    if marked in data:
        number = int(rng.choice(_HUGE))
        other = b"J" + struct.pack("<i", number)
        if rng.random() < 0.7:  # where the file itself says how long it is
            data = data.replace(struct.pack("<q", MARKED), struct.pack("<q", number))
        if zipfile.is_zipfile(path):
            rewrite(path, lambda name, part: part.replace(marked, other))
        else:
            path.write_bytes(data.replace(marked, other, int(rng.choice([1, 2, -1]))))


def rewrite(path: Path, change: Callable[[str, bytes], bytes]) -> None:
    """Change the parts of an archive, so that its checksums are right."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, change(name, part))


def make_call(rng: Rng) -> bytes:
    """Return opcodes of a pickle: a call with odd arguments, or numbers that lie about a length."""
    numbers = (4 * 10**9, 6 * 10**9, 2**40, -1, 3, 2**63 - 1)
    allowed = sorted(_get_allowed_globals())
    called = str(
        rng.choice(
            [
                "builtins.bytearray",
                "builtins.set",
                "torch._utils._rebuild_tensor_v2",
                "torch._utils._rebuild_tensor",
                "torch.storage.UntypedStorage",
                "torch.FloatStorage",
                str(rng.choice(allowed)),
                "torch.Tensor",
                "_codecs.encode",
                "builtins.eval",
                "posix.system",
                "evilmod.P",
                "builtins.range",
                "numpy.zeros",
            ]
        )
    )
    if rng.random() < 0.4:  # what allocates as it is called
        called = str(rng.choice(["builtins.bytearray", "torch.Tensor", "torch.FloatStorage"]))
    module, _, name = called.rpartition(".")
    values: list[Any] = [int(rng.choice(numbers)) for _ in range(int(rng.integers(1, 4)))]
    if rng.random() < 0.4:
        values[0] = [(10**5, 10**5), "touch ran", b"x" * 100, [10**9] * 3][int(rng.integers(4))]
    given = pickle.dumps(tuple(values), 2)[2:-1]
    kinds = [
        f"c{module}\n{name}\n".encode() + given + b"R",
        f"c{module}\n{name}\n".encode() + given + b"\x81",
        b"](" + b"cbuiltins\nbytearray\n(J\0\0\0\x20tR" * 10 + b"e",  # half a gigabyte, ten times
        b"]" * 100_000 + b"a" * 99_999,
        b"(" * 1_000_000,
        b"]" + b"".join(b"q%c(h%ch%cl" % (n, n, n) for n in range(60)),  # doubles sixty times
        b"\x8e" + struct.pack("<q", 2**40) + b"x",  # bytes of a length
        b"X" + struct.pack("<I", 2**32 - 1) + b"x",  # a text of a length
        b"\x8b" + struct.pack("<i", 2**31 - 1) + b"x",  # a number of a length
        b"Nr\xff\xff\xff\x7f",
    ]
    return kinds[0] if rng.random() < 0.6 else kinds[int(rng.integers(len(kinds)))]


def change_pickle(folder: Path, rng: Rng, path: Path | None = None) -> None:
    """Let the pickle in a file call something, in the place of a value or of everything."""
    path = path or folder / "last.ckpt"
    call = make_call(rng)
    if rng.random() < 0.3:  # in no archive
        path.write_bytes(b"\x80\x02" + call + b".")
        return

    def change(name: str, part: bytes) -> bytes:
        if not name.endswith("data.pkl"):
            return part
        if rng.random() < 0.4:
            return b"\x80\x02" + call + b"."
        return part[:2] + b"}(" + b"X\x01\0\0\0a" + call + b"u0" + part[2:]

    rewrite(path, change)


def use_checkpoint(folder: Path) -> None:
    """Load a checkpoint in every way that there is, which leaves nothing behind."""
    try:
        targets.use_checkpoint(folder)
    finally:
        assert not Path("ran").exists(), "a file was executed"
    check_resumable(folder / "last.ckpt", NEPModule(MLP(units=8)))


def change_homer(folder: Path, rng: Rng) -> None:
    """Change a file of a household."""
    path, kind = folder / "home" / DAY, rng.integers(7)
    common = folder / "home" / "common_data.json"
    content: Any = make_day()
    if kind == 0:
        change_pickle(folder, rng, path)
        return
    if kind == 1:
        path.write_bytes(mutate.mutate_bytes(path.read_bytes(), rng))
        return
    if kind == 2:
        data = mutate.mutate_json(json.loads(common.read_text()), rng)
        common.write_text(json.dumps(data))
        return
    if kind == 3:
        (folder / "deflated.pt").replace(path)
        return
    if kind == 4:  # a long day of nothing
        steps = int(rng.choice([10**4, 10**6, 10**8, 10**10]))
        content[0] = torch.zeros(1).as_strided((steps, 4, 4), (0, 0, 0))
        content[3] = torch.zeros(1).as_strided((steps,), (0,))
    elif kind == 5:
        content[0] = torch.zeros(MARKED)
    else:
        change_tensors(content, rng)
        if rng.random() < 0.3:  # as HOMER+ has it
            names = ["home", "kitchen", "table", "cup"]
            content = {"edges": content[0], "times": content[3], "class_names": names}
    save(content, path, rng)


def use_homer(folder: Path) -> None:
    """Import a household."""
    try:
        trace, summary = read_homer(folder / "home")
    finally:
        assert not Path("ran").exists(), "a file was executed"
    summary.summarise()
    save_trace(trace, folder / "trace")


TARGETS = {
    "tensor": targets.Target(make_good, change_checkpoint, use_checkpoint),
    "pickle": targets.Target(make_good, change_pickle, use_checkpoint),
    "homer": targets.Target(make_good, change_homer, use_homer),
}
