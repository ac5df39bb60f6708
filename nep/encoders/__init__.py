"""Node encoders: one file each, chosen by `class_path` in a config."""

from nep.encoders.dgl_hgt import DGLHGT
from nep.encoders.encoder import DGLEncoder, Encoder
from nep.encoders.gcn import GCN
from nep.encoders.han import HAN
from nep.encoders.heat import HEAT
from nep.encoders.hgt import HGT
from nep.encoders.mlp import MLP
from nep.encoders.sets import Sets

__all__ = ["DGLHGT", "GCN", "HAN", "HEAT", "HGT", "MLP", "DGLEncoder", "Encoder", "Sets"]
