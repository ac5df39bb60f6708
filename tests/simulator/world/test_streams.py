import ast
import itertools
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import simulator
from simulator.world.streams import SPLITS, Streams, _multiply_add, sample_categorical


def test_every_seed_split_home_and_purpose_has_numbers_of_its_own():
    firsts = set()
    for seed, split, home in itertools.product([0, 1, 2**40], SPLITS, [0, 1, 2, 1000]):
        streams = Streams(seed, split, [home])
        for purpose in ["objects", "move who", "query"]:
            firsts.add(streams.generator(purpose, 0).random())
    assert len(firsts) == 3 * 3 * 4 * 3


def test_numbers_repeat_and_do_not_depend_on_the_homes_beside():
    alone = Streams(7, "val", [5])
    beside = Streams(7, "val", [3, 5, 9])
    np.testing.assert_array_equal(
        alone.sample_once("objects", 4, 2)[0], beside.sample_once("objects", 4, 2)[1]
    )
    for _ in range(70):  # across two refills
        np.testing.assert_array_equal(
            alone.rows("query", 3).take()[0], beside.rows("query", 3).take()[1]
        )


def test_a_draw_from_one_stream_changes_no_other():
    quiet, busy = Streams(0, "train", [0, 1]), Streams(0, "train", [0, 1])
    for _ in range(10):
        busy.rows("detection", 5).take()
        np.testing.assert_array_equal(quiet.rows("query", 2).take(), busy.rows("query", 2).take())


@pytest.mark.slow
@given(st.lists(st.one_of(st.none(), st.lists(st.integers(0, 2), max_size=80)), max_size=12))
def test_rows_come_in_order_however_they_are_asked_for(requests):
    """None asks for one row of every home, a list for one row per entry."""
    streams = Streams(1, "train", [4, 0, 2])
    rows = streams.rows("instance noise", 3)
    plain = [streams.generator("instance noise", position) for position in range(3)]
    for request in requests:
        if request is None:
            found, homes = rows.take(), [0, 1, 2]
        else:
            homes = sorted(request)
            found = rows.take(np.array(homes, dtype=np.int64))
        expected = np.array([plain[home].random(3) for home in homes]).reshape(-1, 3)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.slow
@given(st.integers(1, 40), st.integers(1, 5), st.integers(0, 2**32))
def test_any_number_of_a_row_can_be_read(width, every, seed):
    streams = Streams(seed, "train", [4, 0, 2])
    stream = streams.rows("add", width)
    stream.take()
    rows = stream.claim(np.array([0, 2, 2]))
    plain = [streams.generator("add", position).random((3, width)) for position in range(3)]
    expected = np.array([plain[0][1], plain[2][1], plain[2][2]])
    np.testing.assert_array_equal(rows.fill(), expected)
    np.testing.assert_array_equal(rows.fill(every), expected[:, ::every])
    row, column = np.nonzero(expected[:, :-1] < 0.5)
    found = rows.read(row, column, 2)
    np.testing.assert_array_equal(found, np.stack([expected[row, column + i] for i in (0, 1)], 1))
    np.testing.assert_array_equal(stream.take()[1], plain[1][1])


def test_purposes_in_the_source_have_different_numbers():
    """A purpose is hashed to 32 bits; two that collide would share their random numbers."""
    purposes = set()
    for file in Path(simulator.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                is_draw = node.func.attr in ("rows", "sample_once", "generator")
                if is_draw and node.args and isinstance(node.args[0], ast.Constant):
                    purposes.add(node.args[0].value)
    assert {"objects", "furniture", "move who", "move where", "query", "detection"} <= purposes
    assert len({zlib.crc32(purpose.encode()) for purpose in purposes}) == len(purposes)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1, "train", [0]), r"seed must be non-negative, got -1\. Choose 0 or more"),
        ((0, "training", [0]), r"split must be one of train, val, test, got 'training'\. Choose"),
        ((0, "train", []), r"homes must be one or more .*, got \[\]\. Ask for at least one"),
        ((0, "train", [3, -1]), r"homes must be .* non-negative numbers, got \[3, -1\]\. Ask"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Streams(*arguments)


def test_categories_by_hand():
    # Weights 1, 0, 3: cumulative 1, 1, 4; the first quarter of [0, 1) is category 0.
    weights = np.array([[1.0, 0.0, 3.0]] * 5)
    uniform = np.array([0.0, 0.2499, 0.25, 0.6, 1 - 1e-16])
    assert sample_categorical(weights, uniform).tolist() == [0, 0, 2, 2, 2]


@given(
    st.lists(st.sampled_from([0.0, 1e-30, 0.1, 1.0, 7.0]), min_size=1, max_size=8).filter(any),
    st.sampled_from([0.0, 0.3, 0.5, 0.999999, 1 - 2**-53]),
    st.sampled_from([np.float32, np.float64]),
)
def test_a_category_of_weight_zero_is_never_drawn(weights, uniform, dtype):
    drawn = sample_categorical(np.array([weights], dtype=dtype), np.array([uniform]))
    assert weights[drawn[0]] > 0


def test_categories_follow_their_weights():
    weights = np.array([0.5, 0.0, 2.0, 1.0, 4.0])
    uniform = np.random.default_rng(0).random(20_000)
    counts = np.bincount(sample_categorical(np.tile(weights, (20_000, 1)), uniform), minlength=5)
    expected = 20_000 * weights / weights.sum()
    used = weights > 0
    assert counts[1] == 0
    assert stats.chisquare(counts[used], expected[used]).pvalue > 0.01


def test_products_of_128_bits_carry_as_those_of_python_do():
    words = [0, 1, 2**32 - 1, 2**32, 2**63, 2**64 - 1]
    for a, b, c, d, e, f in itertools.product(words, repeat=6):
        found = ((a << 64 | b) * (c << 64 | d) + (e << 64 | f)) % 2**128
        assert _multiply_add(*np.array([a, b, c, d, e, f], np.uint64)) == divmod(found, 2**64)
