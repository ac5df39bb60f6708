"""Functions take turns in threads, and nobody waits for one that is slow."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from sgm.serve import turns
from sgm.serve.turns import Turns


@pytest.fixture
def pool():
    with ThreadPoolExecutor(4) as own:
        yield own


def test_one_at_a_time_in_order(pool, monkeypatch):
    monkeypatch.setattr(turns, "TURN_SECONDS", 60.0)
    begun, num_at_once, most = [], [0], [0]

    def work(number):
        begun.append(number)
        num_at_once[0] += 1
        most[0] = max(most[0], num_at_once[0])
        num_at_once[0] -= 1
        return -number

    async def run():
        own = Turns()
        found = await asyncio.gather(*(own.run(pool, partial(work, n)) for n in range(50)))
        return found, len(own)

    assert asyncio.run(run()) == ([-number for number in range(50)], 0)
    assert begun == list(range(50))
    assert most == [1]


def test_a_slow_one_passes_its_turn_on(pool, monkeypatch):
    """Two are held; the third ends meanwhile, and what they return late takes no turn away."""
    monkeypatch.setattr(turns, "TURN_SECONDS", 0.01)
    go_on = threading.Event()

    async def run():
        own = Turns()
        slow = [asyncio.ensure_future(own.run(pool, partial(go_on.wait, 20))) for _ in range(2)]
        assert await asyncio.wait_for(own.run(pool, lambda: "done"), 20) == "done"
        assert len(own) == 2
        go_on.set()
        assert await asyncio.gather(*slow) == [True, True]
        return len(own)

    assert asyncio.run(run()) == 0


def test_what_is_raised_is_raised_to_who_asked(pool):
    async def run():
        own = Turns()
        with pytest.raises(KeyError, match="none"):
            await own.run(pool, partial({}.__getitem__, "none"))
        return await own.run(pool, lambda: 1)

    assert asyncio.run(run()) == 1


def test_who_waits_no_longer_is_left_out(pool, monkeypatch):
    monkeypatch.setattr(turns, "TURN_SECONDS", 60.0)
    go_on, made = threading.Event(), []

    async def run():
        own = Turns()
        first, second, third = (
            asyncio.ensure_future(own.run(pool, work))
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
