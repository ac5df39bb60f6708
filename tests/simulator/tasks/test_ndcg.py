import numpy as np
import pytest
from sklearn.metrics import ndcg_score

from simulator.tasks.ndcg import compute_ndcg

NO = -np.inf


def test_ndcg_by_hand():
    # Discounts: 1, 1 / log2(3) = 0.6309298, 1 / log2(4) = 0.5.
    # Gains 0.2, 0.3, 0.5; the ideal order gives 0.5 + 0.3 * 0.6309298 + 0.2 * 0.5 = 0.7892789.
    gains = np.array([[0.2, 0.3, 0.5]])
    # Ranked 0, 2, 1: 0.2 + 0.5 * 0.6309298 + 0.3 * 0.5 = 0.6654649.
    found = compute_ndcg(np.array([[9.0, 1.0, 5.0]]), gains)
    assert found == pytest.approx(0.6654649 / 0.7892789, abs=1e-7)
    assert compute_ndcg(gains * 7 - 1, gains) == pytest.approx(1)


def test_ndcg_shares_the_ranks_of_ties():
    # The first two tie: both count (1 + 0.6309298) / 2 = 0.8154649.
    # (0.2 + 0.3) * 0.8154649 + 0.5 * 0.5 = 0.6577324.
    gains = np.array([[0.2, 0.3, 0.5]])
    found = compute_ndcg(np.array([[4.0, 4.0, 1.0]]), gains)
    assert found == pytest.approx(0.6577324 / 0.7892789, abs=1e-7)


def test_ndcg_puts_what_has_no_score_last():
    # Place 1 first; 0 and 2 tie at ranks 2 and 3: (0.6309298 + 0.5) / 2 = 0.5654649 each.
    # 0.3 + (0.2 + 0.5) * 0.5654649 = 0.6958254, below a score however low.
    gains = np.array([[0.2, 0.3, 0.5]])
    found = compute_ndcg(np.array([[NO, -1e9, NO]]), gains)
    assert found == pytest.approx(0.6958254 / 0.7892789, abs=1e-7)
    # No opinion at all: every place counts the mean discount.
    nothing = compute_ndcg(np.full((1, 3), NO), gains)
    assert nothing == pytest.approx(2.1309298 / 3 / 0.7892789, abs=1e-7)


def test_ndcg_equals_scikit_learn():
    rng = np.random.default_rng(0)
    gains = rng.random((60, 32)) * (rng.random((60, 32)) < 0.4)
    gains[3] = 0  # a row without any gain
    scores = rng.integers(0, 6, (60, 32)).astype(float)  # many ties
    scores[rng.random((60, 32)) < 0.3] = NO
    finite = np.where(np.isfinite(scores), scores, -1.0)  # scikit-learn takes no infinity
    expected = [
        ndcg_score(gains[i : i + 1], finite[i : i + 1], ignore_ties=False) for i in range(60)
    ]
    np.testing.assert_allclose(compute_ndcg(scores, gains), expected, rtol=1e-12)


def test_ndcg_refuses_nan_and_other_shapes():
    with pytest.raises(ValueError, match=r"numbers or -inf, got nan\. Check the policy"):
        compute_ndcg(np.array([[1.0, np.nan]]), np.ones((1, 2)))
    with pytest.raises(ValueError, match=r"shape of the scores \(1, 2\), got \(1, 3\)"):
        compute_ndcg(np.ones((1, 2)), np.ones((1, 3)))


def test_what_is_no_place_is_not_ranked():
    """Scores 5 and twice none at three places, and two columns that are no places."""
    relevance = np.array([[1.0, 2.0, 3.0, 9.0, 9.0]])
    is_place = np.array([[True, True, True, False, False]])
    for beyond in (NO, 0.0, 99.0):
        scores = np.array([[5.0, NO, NO, beyond, beyond]])
        found = compute_ndcg(scores, relevance, is_place)
        np.testing.assert_allclose(found, compute_ndcg(scores[:, :3], relevance[:, :3]))
