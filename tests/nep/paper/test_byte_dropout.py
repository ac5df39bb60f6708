"""Dropout of random bytes against its law."""

import pytest
import torch

from nep.paper.query_attention import ByteDropout


def test_byte_dropout_drops_its_share_and_keeps_the_mean():
    torch.manual_seed(0)
    dropout = ByteDropout(0.1)  # rounds to 26 / 256
    ones = torch.ones(1003, 997)
    dropped = dropout(ones)
    share = (dropped == 0).float().mean().item()
    # standard deviation of the share: sqrt(0.1 * 0.9 / 1e6) = 0.0003
    assert share == pytest.approx(26 / 256, abs=0.0015)
    assert dropped.max().item() == pytest.approx(256 / 230)
    # every position is drawn on its own: neighbours and bytes of one word are uncorrelated
    zero = (dropped == 0).float().flatten()
    for lag in (1, 7, 8):
        both = (zero[lag:] * zero[:-lag]).mean().item()
        assert both == pytest.approx((26 / 256) ** 2, abs=0.001)
    assert dropout.eval()(ones) is ones
    with pytest.raises(ValueError, match=r"dropout must lie in \[0, 1\), got 1.0"):
        ByteDropout(1.0)
