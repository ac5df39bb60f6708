"""Traces in steps, by hand: slots, moves, newcomers, days."""

import numpy as np
import pytest

from simulator.trace import load_trace, make_episode, split_days

HOUR = 3600


def list_rows(episode):
    return list(
        zip(
            episode.step.tolist(),
            episode.slot.tolist(),
            episode.place.tolist(),
            [
                episode.descriptions[i] if p >= 0 else None
                for i, p in zip(episode.description, episode.place, strict=True)
            ],
            episode.is_move.tolist(),
            episode.is_new.tolist(),
            strict=True,
        )
    )


def test_changes_by_hand(write_home):
    episode = make_episode(load_trace(write_home()), HOUR)
    assert episode.num_steps == 6  # 21600 s
    assert list_rows(episode) == [
        (0, 0, 1, "large red mug", False, True),
        (0, 1, 0, "milk", False, True),
        (0, 2, 2, "book", False, True),
        # step 2 ends at 7200: the mug is back on the table, so nothing has happened
        (3, 0, 2, "large red mug", True, False),
        (3, 1, 5, "pen", False, True),  # in the slot of the milk
        (4, 2, 3, "book", False, False),  # onTop instead of in: no move
        (6, 2, 5, "book", True, False),
    ]
    assert episode.num_moves.tolist() == [0, 0, 1, 0, 0, 1]
    assert episode.num_present.tolist() == [3] * 6
    assert episode.is_dynamic
    assert episode.crosses_rooms


def test_long_steps_join_what_happened(write_home):
    episode = make_episode(load_trace(write_home()), 3 * HOUR)
    assert episode.num_steps == 2
    assert [row[:3] for row in list_rows(episode)[3:]] == [(1, 0, 2), (1, 1, 5), (2, 2, 5)]


def test_an_episode_may_start_later(write_home):
    episode = make_episode(load_trace(write_home()), HOUR, start_s=3 * HOUR, num_steps=2)
    # At 10800 s: the pen took the lowest free slot, because the milk was never there.
    assert list_rows(episode) == [
        (0, 0, 2, "large red mug", False, True),
        (0, 1, 2, "book", False, True),
        (0, 2, 5, "pen", False, True),
        (1, 1, 3, "book", False, False),
    ]
    assert not episode.is_dynamic


def test_what_comes_and_goes_within_a_step_was_never_there(write_home):
    head = "time_s,object,furniture,relation\n"
    events = "0,mug,table,in\n10,pen,table,in\n20,pen,,\n30,mug,,\n"
    events += "40,mug,shelf 1,in\n3600,mug,shelf 1,in\n"
    episode = make_episode(load_trace(write_home(events=head + events)), HOUR)
    assert [row[:3] for row in list_rows(episode)] == [(0, 0, 0), (1, 0, 2)]
    assert episode.num_moves.tolist() == [1]
    assert not episode.is_dynamic


def test_too_short_or_empty(write_home):
    with pytest.raises(ValueError, match=r"at least one step of 3600 s, got 0 s.*Set end_s"):
        make_episode(
            load_trace(write_home(events="time_s,object,furniture,relation\n5,a,table,in\n")), HOUR
        )
    events = "time_s,object,furniture,relation\n0,a,table,in\n4000,a,,\n9000,a,table,in\n"
    with pytest.raises(
        ValueError, match=r"an object at every step, got none at step 2 \(time 7200"
    ):
        make_episode(load_trace(write_home(events=events, name="other")), HOUR)


def test_days_from_midnight_to_midnight(write_home):
    events = "time_s,object,furniture,relation\n0,mug,table,in\n" + "".join(
        f"{time},mug,{place},in\n"
        for time, place in [(50_000, "shelf 1"), (100_000, "table"), (190_000, "shelf 2")]
    )
    # Second 0 is 18:00, so that midnights are at 21600, 108000 and 194400 s.
    trace = load_trace(write_home(events=events, start="2024-05-06T18:00", end_s=200_000))
    days, left_out = split_days(trace, HOUR)
    assert [day.name for day in days] == ["home 2024-05-07", "home 2024-05-08"]
    assert [day.start_s for day in days] == [21_600, 108_000]
    assert [day.num_steps for day in days] == [24, 24]
    assert list_rows(days[0])[0][:3] == (0, 0, 0)
    # 50000 - 21600 = 28400 s, in the eighth hour; 100000 - 21600 = 78400 s, in the 22nd
    assert [row[:3] for row in list_rows(days[0])[1:]] == [(8, 0, 2), (22, 0, 0)]
    assert [row[:3] for row in list_rows(days[1])] == [(0, 0, 0), (23, 0, 4)]
    assert left_out == [
        "home 2024-05-06: only 25% of the day was recorded",
        "home 2024-05-09: only 6% of the day was recorded",
    ]
    with pytest.raises(ValueError, match="step must divide a day of 86400 s, got 7000 s"):
        split_days(trace, 7000)
    with pytest.raises(ValueError, match="must cover a day from midnight to midnight"):
        split_days(load_trace(write_home(name="short")), HOUR)


def test_steps_partition_time_whatever_their_length(write_home):
    """The state after k steps is that of all events until then."""
    trace = load_trace(write_home())
    for seconds in (60, 100, 700, 1234.5, HOUR):
        episode = make_episode(trace, seconds)
        place = np.full(trace.num_slots, -1)
        at = {}
        for step in range(episode.num_steps + 1):
            rows = episode.step == step
            place[episode.slot[rows]] = episode.place[rows]
            for event in trace.events:
                if event.time_s <= step * seconds + 1e-6:
                    at[event.object] = event.furniture * 2 + event.relation
            expected = sorted(value for value in at.values() if value >= 0)
            assert sorted(place[place >= 0].tolist()) == expected
