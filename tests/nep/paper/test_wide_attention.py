"""Of very many query edges, all attend to the same few: those that stand out, and a sample."""

import pytest
import torch
from torch.nn import functional

from nep.paper import query_attention
from nep.paper.query_attention import MOST_KEYS, AttentionConfig, QueryAttention, choose_keys

NUM_WIDE = 3 * MOST_KEYS


@pytest.fixture
def attention():
    torch.manual_seed(0)
    return QueryAttention(16, AttentionConfig(feed_forward_units=12)).eval().double()


@pytest.fixture
def places():
    """Many places that differ a little, and three where the object was seen."""
    generator = torch.Generator().manual_seed(1)
    rows = torch.randn(NUM_WIDE, 16, generator=generator, dtype=torch.float64) * 0.3
    rows[[5, 700, 2500]] += 4
    return rows


def test_those_that_stand_out_count_once_and_the_others_for_all():
    query = torch.zeros(2 * MOST_KEYS, 1)
    query[[3, 9]] = torch.tensor([[50.0], [-60.0]])
    rows, weight = choose_keys(query)
    assert rows[:2].tolist() == [9, 3]  # the furthest from the mean first
    assert len(rows.unique()) == len(weight) == MOST_KEYS
    # 256 count once; 768 stand for the other 2,048 - 256 = 1,792: 7 / 3 each
    assert weight[:256].eq(1).all()
    assert weight[256:].tolist() == pytest.approx([7 / 3] * 768)
    assert weight.sum().item() == pytest.approx(2 * MOST_KEYS, rel=1e-5)


def test_it_comes_close_to_what_all_would_say(attention, places, monkeypatch):
    no_snapshot = torch.zeros(NUM_WIDE, dtype=torch.int64)
    with torch.inference_mode():
        found = attention(places, no_snapshot, 1)
        monkeypatch.setattr(query_attention, "MOST_KEYS", NUM_WIDE)
        exact = attention(places, no_snapshot, 1)
    assert not torch.equal(found, exact)
    assert (found - exact).abs().mean() < 0.03  # of layer norms: numbers of about 1
    assert (found - exact).abs().max() < 0.1


def test_nobody_attends_to_more(attention, places, monkeypatch):
    """Pairs grow with the number of places, not with its square."""
    sizes = []

    def attend(q, k, v, *others, **more):
        sizes.append((q.shape[2], k.shape[2], v.shape[2]))
        return functional.scaled_dot_product_attention(q, k, v, *others, **more)

    attends = type("functional", (), {"scaled_dot_product_attention": staticmethod(attend)})
    monkeypatch.setattr(query_attention, "functional", attends)
    attention(places, torch.zeros(NUM_WIDE, dtype=torch.int64), 1)
    attention(places[:MOST_KEYS], torch.zeros(MOST_KEYS, dtype=torch.int64), 1)
    assert sizes == [(NUM_WIDE, MOST_KEYS, MOST_KEYS)] * 2 + [(MOST_KEYS,) * 3] * 2


def test_a_wide_snapshot_in_a_batch_is_what_it_is_alone(attention, places):
    """It gets no row of the table, whose pairs would be 10^7 for each of the others, too."""
    counts = torch.tensor([4, 0, NUM_WIDE, 7])
    snapshot = torch.repeat_interleave(counts)
    small = torch.randn(11, 16, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    query = torch.cat([small[:4], places, small[4:]])
    with torch.inference_mode():
        order = torch.arange(len(query)).roll(2)  # the last two of the last one come first
        found = torch.empty_like(query)
        found[order] = attention(query[order], snapshot[order], 4)
        for number in (0, 2, 3):
            rows = snapshot == number
            alone = attention(query[rows], torch.zeros(int(rows.sum()), dtype=torch.int64), 1)
            torch.testing.assert_close(found[rows], alone)


@pytest.mark.slow
def test_it_learns(attention, places):
    attention.train()
    attention(places, torch.zeros(NUM_WIDE, dtype=torch.int64), 1).square().sum().backward()
    assert all(part.grad.abs().sum() > 0 for part in attention.parameters())
