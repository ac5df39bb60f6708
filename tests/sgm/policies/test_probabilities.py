import numpy as np

from sgm.policies.policy import compute_probabilities

NO = -np.inf


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
