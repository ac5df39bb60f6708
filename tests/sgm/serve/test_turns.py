"""Functions take turns in threads, and nobody waits for one that is slow."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from sgm.serve import caller
from sgm.serve.caller import Turns


@pytest.fixture
def pool():
    with ThreadPoolExecutor(4) as own:
        yield own


def test_one_at_a_time_in_order(pool, monkeypatch):
    monkeypatch.setattr(caller, "TURN_SECONDS", 60.0)
    begun, num_at_once, most = [], [0], [0]

    def work(number):
        begun.append(number)
        num_at_once[0] += 1
        most[0] = max(most[0], num_at_once[0])
        num_at_once[0] -= 1
        return -number

    async def run():
        own = Turns()
        found = await asyncio.gather(*(own.run(pool, partial(work, n), 20) for n in range(50)))
        return found, len(own)

    assert asyncio.run(run()) == ([-number for number in range(50)], 0)
    assert begun == list(range(50))
    assert most == [1]


def test_a_slow_one_passes_its_turn_on(pool, monkeypatch):
    """Two are held; the third ends meanwhile, and what they return late takes no turn away."""
    monkeypatch.setattr(caller, "TURN_SECONDS", 0.01)
    go_on = threading.Event()

    async def run():
        own = Turns()
        slow = [asyncio.ensure_future(own.run(pool, partial(go_on.wait, 20), 20)) for _ in range(2)]
        assert await own.run(pool, lambda: "done", 20) == "done"
        assert len(own) == 2
        go_on.set()
        assert await asyncio.gather(*slow) == [True, True]
        return len(own)

    assert asyncio.run(run()) == 0


def test_what_is_raised_is_raised_to_who_asked(pool):
    async def run():
        own = Turns()
        with pytest.raises(KeyError, match="none"):
            await own.run(pool, partial({}.__getitem__, "none"), 20)
        return await own.run(pool, lambda: 1, 20)

    assert asyncio.run(run()) == 1


def test_who_waits_no_longer_is_left_out(pool, monkeypatch):
    monkeypatch.setattr(caller, "TURN_SECONDS", 60.0)
    go_on, made = threading.Event(), []

    async def run():
        own = Turns()
        first, second, third = (
            asyncio.ensure_future(own.run(pool, work, 20))
            for work in (partial(go_on.wait, 20), partial(made.append, 2), partial(made.append, 3))
        )
        await asyncio.sleep(0)
        first.cancel()  # it has begun, and has its turn until it ends
        second.cancel()
        await asyncio.sleep(0)
        assert (made, len(own)) == ([], 3)
        go_on.set()
        await third
        return len(own)

    assert asyncio.run(run()) == 0
    assert made == [3]


def test_what_takes_too_long_is_given_up(pool, monkeypatch):
    """One that has begun goes on, one that waits is left out."""
    monkeypatch.setattr(caller, "TURN_SECONDS", 60.0)
    go_on, made = threading.Event(), []

    async def run():
        own = Turns()
        for work in (partial(go_on.wait, 20), partial(made.append, 1)):
            with pytest.raises(asyncio.TimeoutError):
                await own.run(pool, work, 0.01)
        assert len(own) == 2
        go_on.set()
        return await own.run(pool, lambda: 2, 20), len(own)

    assert asyncio.run(run()) == (2, 0)
    assert not made


def test_an_answer_is_sent_before_the_next_one_begins(pool, monkeypatch):
    """The loop would wait for a thread that computes whenever it has written a byte."""
    monkeypatch.setattr(caller, "TURN_SECONDS", 60.0)
    events = []

    async def run():
        own = Turns()

        async def ask(number):
            events.append(("answered", await own.run(pool, partial(work, number), 20)))

        await asyncio.gather(*map(ask, range(5)))

    def work(number):
        events.append(("begun", number))
        return number

    asyncio.run(run())
    assert events == [(what, number) for number in range(5) for what in ("begun", "answered")]
