import numpy as np
import pytest
from sklearn.metrics import ndcg_score

from simulator.tasks.metrics import (
    compute_away,
    compute_calibration_error,
    compute_ndcg,
    compute_nll,
    compute_probabilities,
)

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


def test_weights_are_probabilities_in_proportion():
    scores = np.array([[1.0, 3.0, NO, 0.0], [0.0, 0.0, 0.0, 0.0], [NO, NO, NO, NO]])
    found = compute_probabilities(scores, "weights")
    np.testing.assert_allclose(found[0], [0.25, 0.75, 0, 0])
    np.testing.assert_allclose(found[1:], 0.25)  # no mass: anywhere


def test_logits_are_probabilities_by_softmax():
    # Odds 1 : 3; a factor on all odds (the class weights of the loss) changes nothing.
    scores = np.log([[1.0, 3.0, 1e-300, 1e-300], [1, 1, 1, 1]])
    scores[0, 2] = NO
    for factor in (1.0, 20.0):
        found = compute_probabilities(scores + np.log(factor), "logits")
        np.testing.assert_allclose(found[0], [0.25, 0.75, 0, 0], atol=1e-12)
        np.testing.assert_allclose(found[1], 0.25)
    huge = compute_probabilities(np.array([[900.0, 900.0, NO], [NO, NO, NO]]), "logits")
    np.testing.assert_allclose(huge, [[0.5, 0.5, 0], [1 / 3, 1 / 3, 1 / 3]])


def test_calibration_error_by_hand():
    # Bin [0.2, 0.3): confidences 0.22 and 0.28, one of two right: |0.5 - 0.25| = 0.25, 2 answers.
    # Bin [0.9, 1.0]: 0.95 and 1.0, both right: |1 - 0.975| = 0.025, 2 answers.
    # Mean over the four answers: (2 * 0.25 + 2 * 0.025) / 4 = 0.1375.
    confidence = np.array([0.22, 0.95, 0.28, 1.0])
    is_correct = np.array([True, True, False, True])
    assert compute_calibration_error(confidence, is_correct) == pytest.approx(0.1375)
    # In one bin: mean confidence 0.6125, accuracy 0.75.
    assert compute_calibration_error(confidence, is_correct, 1) == pytest.approx(0.1375)
    assert np.isnan(compute_calibration_error(confidence[:0], is_correct[:0]))


def test_nll_by_hand():
    # -(ln 0.5 + ln 0.25) / 2 = 3 ln 2 / 2 = 1.0397208
    assert compute_nll(np.array([0.5, 0.25])) == pytest.approx(1.0397208)
    # What was held impossible costs -ln 1e-6 = 13.8155106.
    assert compute_nll(np.array([0.0])) == pytest.approx(13.8155106)
    assert np.isnan(compute_nll(np.zeros(0)))


def test_away_means_seen_before_and_gone(make_tiny_memory):
    memory = make_tiny_memory(3)
    memory.step()
    home, keys = np.arange(3), np.full(3, 7)
    rows = memory.ensure_objects(home, keys, keys * 0, keys * 0)
    # Homes 0 and 1 saw the object on furniture 2; home 2 never saw it.
    memory.observe(home[:2], np.array([2, 2]), rows[:2], np.array([1, 1]))
    memory.step()
    queries = memory.query(home, keys, keys * 0, keys * 0)
    answers = np.zeros((3, 6), dtype=bool)
    answers[0, [2, 4]] = True  # one such object is still there
    answers[1, 4] = True
    answers[2, 4] = True
    assert compute_away(memory, queries, answers).tolist() == [False, True, False]
