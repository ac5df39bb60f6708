"""Node encoders: one file each, chosen by `class_path` in a config, loaded when first used."""

from typing import TYPE_CHECKING

from sgm.lazy_names import load_lazily

if TYPE_CHECKING:
    from nep.paper.encoders.encoder import Encoder
    from nep.paper.encoders.gcn import GCN
    from nep.paper.encoders.han import HAN
    from nep.paper.encoders.heat import HEAT
    from nep.paper.encoders.hetero_encoder import HeteroEncoder
    from nep.paper.encoders.hgt import HGT
    from nep.paper.encoders.mlp import MLP

_MODULES = {
    "Encoder": "nep.paper.encoders.encoder",
    "GCN": "nep.paper.encoders.gcn",
    "HAN": "nep.paper.encoders.han",
    "HEAT": "nep.paper.encoders.heat",
    "HGT": "nep.paper.encoders.hgt",
    "HeteroEncoder": "nep.paper.encoders.hetero_encoder",
    "MLP": "nep.paper.encoders.mlp",
}

__all__ = ["GCN", "HAN", "HEAT", "HGT", "MLP", "Encoder", "HeteroEncoder"]

__getattr__ = load_lazily(__name__, _MODULES)


def load_all() -> None:
    """Load every encoder, so that it is found by its name among the subclasses of `Encoder`."""
    for name in __all__:
        __getattr__(name)
