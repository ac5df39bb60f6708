"""Node encoders: one file each, chosen by `class_path` in a config, loaded when first used."""

from typing import TYPE_CHECKING

from sgm.lazy_names import load_lazily

if TYPE_CHECKING:
    from nep.encoders.dgl_hgt import DGLHGT
    from nep.encoders.encoder import DGLEncoder, Encoder
    from nep.encoders.gcn import GCN
    from nep.encoders.han import HAN
    from nep.encoders.heat import HEAT
    from nep.encoders.hgt import HGT
    from nep.encoders.mlp import MLP
    from nep.encoders.sets import Sets

_MODULES = {
    "DGLHGT": "nep.encoders.dgl_hgt",
    "DGLEncoder": "nep.encoders.encoder",
    "Encoder": "nep.encoders.encoder",
    "GCN": "nep.encoders.gcn",
    "HAN": "nep.encoders.han",
    "HEAT": "nep.encoders.heat",
    "HGT": "nep.encoders.hgt",
    "MLP": "nep.encoders.mlp",
    "Sets": "nep.encoders.sets",
}

__all__ = ["DGLHGT", "GCN", "HAN", "HEAT", "HGT", "MLP", "DGLEncoder", "Encoder", "Sets"]

__getattr__ = load_lazily(__name__, _MODULES)


def load_all() -> None:
    """Load every encoder, so that it is found by its name among the subclasses of `Encoder`."""
    for name in __all__:
        __getattr__(name)
