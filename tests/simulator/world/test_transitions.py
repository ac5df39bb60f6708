import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.world.streams import sample_categorical
from simulator.world.transitions import Transitions

# Three furniture nodes with two places each; the first two stand in one room.
BLOCKS = np.array([0, 0, 0, 0, 1, 1])
ROWS = np.array([[0.5, 0.25, 0.25, 0, 0, 0], [0, 0.25, 0, 0, 0.5, 0.25], [0, 0, 0, 0, 0, 0]])


def append(made: Transitions, weights: np.ndarray) -> np.ndarray:
    rows, places = np.nonzero(weights)
    return made.append(
        np.zeros(len(weights), int), rows, places, weights[rows, places].astype(float)
    )


@pytest.fixture
def transitions():
    made = Transitions(BLOCKS[None], 2)
    assert append(made, ROWS[:1]).tolist() == [0]
    assert append(made, ROWS[1:]).tolist() == [1, 2]
    return made


def test_rows_are_read_as_they_were_given(transitions):
    read = transitions.read(np.array([1, -1, 0, 2]))
    np.testing.assert_array_equal(read, [ROWS[1], np.zeros(6), ROWS[0], ROWS[2]])
    assert read.dtype == np.float32


def test_where_objects_can_go_by_hand(transitions):
    # Row 0: from furniture 0 to place 2; from furniture 1 to places 0 and 1; room 1 has nothing.
    # Row 1: furniture 0 is alone in its room, furniture 2 too; from furniture 1 to place 1.
    rows = np.array([0, 0, 0, 1, 1, 1, 2])
    places = np.array([1, 2, 4, 1, 5, 3, 0])
    expected = [True, True, False, False, False, True, False]
    assert transitions.can_leave(rows, 0 * rows, places).tolist() == expected


def test_moves_by_hand(transitions):
    rows, places = np.array([0, 0, 0, 1]), np.array([0, 3, 3, 2])
    uniform = np.array([0.99, 0.6, 0.7, 0.0])  # places 0 and 1 have weights 2 to 1
    found, can_leave = transitions.sample_moves(rows, 0 * rows, places, uniform)
    assert found.tolist() == [2, 0, 1, 1]
    assert can_leave.tolist() == [True, True, True, False]


def test_new_places_by_hand(transitions):
    rows = np.array([0, 0, 0, 1])
    found, can_leave = transitions.sample_places(rows, 0 * rows, np.array([0.49, 0.5, 0.75, 0.74]))
    assert found.tolist() == [0, 1, 2, 4]  # row 1: 0.25 place 1, then 0.5 place 4
    assert can_leave.tolist() == [True, True, True, False]


@given(st.integers(0, 2**32), st.sampled_from([3, 300]))
def test_equal_to_drawing_from_the_whole_row(seed, count):
    """To the last bit: leaving out zeros changes no sum."""
    rng = np.random.default_rng(seed)
    blocks = np.sort(rng.integers(0, 3, 6).repeat(2))
    blocks = np.unique(blocks, return_inverse=True)[1]
    weights = (rng.random((50, 12)) * (rng.random((50, 12)) < 0.4)).astype(np.float32)
    weights[:, 0] += np.float32(0.1)
    made = Transitions(blocks[None], 2)
    append(made, weights[:20])
    append(made, weights[20:])
    rows, places = rng.integers(0, 50, count), rng.integers(0, 12, count)
    uniform = rng.random(count)
    drawn, can_leave = made.sample_places(rows, 0 * rows, uniform)
    np.testing.assert_array_equal(drawn, sample_categorical(weights[rows], uniform))
    np.testing.assert_array_equal(can_leave, made.can_leave(rows, 0 * rows, drawn))
    allowed = (np.arange(12) // 2 != places[:, None] // 2) & (blocks == blocks[places][:, None])
    options = np.where(allowed, weights[rows], 0)
    movable = np.flatnonzero(options.any(axis=1))
    np.testing.assert_array_equal(made.can_leave(rows, 0 * rows, places), options.any(axis=1))
    rows, places = rows[movable], places[movable]
    moved, can_leave = made.sample_moves(rows, 0 * rows, places, uniform[movable])
    np.testing.assert_array_equal(moved, sample_categorical(options[movable], uniform[movable]))
    np.testing.assert_array_equal(can_leave, made.can_leave(rows, 0 * rows, moved))
