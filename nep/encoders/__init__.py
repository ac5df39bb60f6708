"""Node encoders: one file each, chosen by `class_path` in a config."""

from nep.encoders.encoder import Encoder
from nep.encoders.gcn import GCN
from nep.encoders.han import HAN
from nep.encoders.heat import HEAT
from nep.encoders.hgt import HGT
from nep.encoders.mlp import MLP
from nep.encoders.sets import Sets

__all__ = ["GCN", "HAN", "HEAT", "HGT", "MLP", "Encoder", "Sets"]
