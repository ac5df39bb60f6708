import numpy as np
import pytest
from scipy import stats

from simulator.world.descriptions import DescriptionTable

# mug: two categories. One of them (probability 1/2) or both (1/2):
#   one: either category 1/2 x its words -> red 1/8, blue 1/8, large 1/4
#   both: 1 subset x 2 x 1 words         -> red large 1/4, blue large 1/4
LAW = {"red mug": 1 / 8, "blue mug": 1 / 8, "large mug": 1 / 4, "red large mug": 1 / 4,
       "blue large mug": 1 / 4}  # fmt: skip


@pytest.fixture
def table() -> DescriptionTable:
    labels = ["key", "mug", "book"]
    return DescriptionTable(labels, [[], [["red", "blue"], ["large"]], [["old", "new"], []]])


def list_texts(table):
    return [table.text(code) for code in range(table.num_descriptions)]


def test_every_description_is_listed_type_by_type(table):
    texts = list_texts(table)
    assert texts == ["key", *LAW, "old book", "new book"]
    assert table.type_of_code.tolist() == [0, 1, 1, 1, 1, 1, 2, 2]


def test_draws_follow_the_law_worked_by_hand(table):
    uniform = np.random.default_rng(0).random(8000)
    codes = table.sample(np.full(8000, 1), uniform)
    counts = np.bincount(codes, minlength=8)
    assert counts.sum() == counts[1:6].sum()
    assert stats.chisquare(counts[1:6], 8000 * np.array(list(LAW.values()))).pvalue > 0.01


def test_draws_follow_the_procedure_of_the_paper(table):
    """A plain version: how many categories, which, then a word of each."""
    rng = np.random.default_rng(1)
    categories = [["a1", "a2", "a3"], ["b1", "b2"], ["c1"]]
    table = DescriptionTable(["cup"], [categories])
    plain, texts = np.zeros(table.num_descriptions), list_texts(table)
    for _ in range(6000):
        chosen = np.sort(rng.permutation(3)[: rng.integers(1, 4)])
        words = [categories[i][rng.integers(len(categories[i]))] for i in chosen]
        plain[texts.index(" ".join([*words, "cup"]))] += 1
    codes = table.sample(np.zeros(6000, dtype=int), rng.random(6000))
    drawn = np.bincount(codes, minlength=table.num_descriptions)
    assert stats.chi2_contingency(np.stack([plain, drawn])).pvalue > 0.01


def test_sameness_is_the_sum_of_squares(table):
    # mug: 2 x (1/8)^2 + 3 x (1/4)^2 = 1/32 + 3/16 = 7/32; book: 2 x (1/2)^2; key: 1
    np.testing.assert_allclose(table.compute_sameness(), [1, 7 / 32, 1 / 2])


@pytest.mark.parametrize("uniform", [0.0, 0.5, 1 - 2**-53])
def test_a_draw_never_leaves_its_type(default_prior, uniform):
    rows = default_prior.objects
    table = DescriptionTable([row.label for row in rows], [row.adjectives for row in rows])
    types = np.arange(len(rows))
    codes = table.sample(types, np.full(len(rows), uniform))
    np.testing.assert_array_equal(table.type_of_code[codes], types)


def test_descriptions_of_the_shipped_prior_differ(default_prior):
    """Objects are asked for by description: two codes with one text could not be told apart."""
    rows = default_prior.objects
    table = DescriptionTable([row.label for row in rows], [row.adjectives for row in rows])
    assert len(set(list_texts(table))) == table.num_descriptions


def test_a_table_without_types_is_empty():
    assert DescriptionTable([], []).num_descriptions == 0
