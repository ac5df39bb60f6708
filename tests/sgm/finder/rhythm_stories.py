"""Stories of rhythm: how a home goes for some weeks, and what a person would say then.

`python -m tests.sgm.finder.rhythm_stories adaptive network` tells all of them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timedelta

from tests.sgm.finder.stories import ELSEWHERE, Flat, Story, tell_stories

MONDAY = datetime(2026, 1, 5)
_OUT = None  # of the home


def go_on(flat: Flat, now: datetime) -> None:
    """Let time pass until then."""
    flat.memory.step_to(now)


def list_times(
    num_days: int, hours: Sequence[float], is_day: Callable[[datetime], bool] = lambda day: True
) -> Iterator[datetime]:
    """List times of days from Monday, 5 January 2026, in order."""
    for number in range(num_days):
        day = MONDAY + timedelta(days=number)
        if is_day(day):
            for hour in hours:
                yield day + timedelta(hours=hour)


def is_workday(day: datetime) -> bool:
    return day.weekday() < 5


def watch(
    where: Callable[[datetime], str | None],
    times: Iterator[datetime],
    places: Sequence[str],
    asked_at: datetime,
    thing: str = "keys",
) -> Flat:
    """Look at some places at some times, and ask later; the thing is where it is said to be."""
    flat = Flat(600)
    for now in times:
        if now >= asked_at:
            break
        if now <= flat.memory.clock.get_date(flat.memory.time):
            continue
        go_on(flat, now)
        there = where(now)
        for place in places:
            flat.look(place, *([thing] if there == place else []))
    go_on(flat, asked_at)
    return flat


def at(day: int, hour: float) -> datetime:
    """Return the time on a day after the first Monday."""
    return MONDAY + timedelta(days=day, hours=hour)


def by_hour(*stays: tuple[float, str | None]) -> Callable[[datetime], str | None]:
    """Return where a thing is from some hours of the day on, the first from midnight."""

    def where(now: datetime) -> str | None:
        hour = now.hour + now.minute / 60
        return [place for start, place in stays if start <= hour][-1]

    return where


def on_workdays(
    where: Callable[[datetime], str | None], otherwise: Callable[[datetime], str | None]
) -> Callable[[datetime], str | None]:
    return lambda now: where(now) if is_workday(now) else otherwise(now)


def tell_tablet(day: int, hour: float, *last: float) -> Flat:
    """On the dining table at noon, on the dresser in the morning and evening."""
    where = by_hour((0, "dresser"), (10, "dining table"), (15, "dresser"))
    places = ("dresser", "dining table")
    times = [*list_times(day, (7, 12, 20)), *(at(day, hour) for hour in last)]
    return watch(where, iter(times), places, at(day, hour), "tablet")


def tell_car_keys(day: int, hour: float) -> Flat:
    """On the shelf but at work hours, when four places are looked at and do not show them."""
    where = on_workdays(by_hour((0, "shelf"), (8.5, _OUT), (17.5, "shelf")), by_hour((0, "shelf")))
    places = ("shelf", "hook", "counter", "coffee table")
    times = list_times(day + 1, (7, 11, 15, 19, 22))
    return watch(where, times, places, at(day, hour), "car keys")


def tell_lunch_box(days: int, later: float) -> Flat:
    """At irregular hours from the fridge to the table, an hour later counter, then fridge again."""
    flat, thing, places = Flat(600), "lunch box", ("fridge", "dining table", "counter")
    for day in range(days):
        begin = at(day, 9 + day * 5 % 9)
        for hours, there in ((0, "fridge"), (1, "dining table"), (2, "counter"), (4, "fridge")):
            go_on(flat, begin + timedelta(hours=hours))
            for place in places:
                flat.look(place, *([thing] if place == there else []))
    begin = at(days, 11)
    go_on(flat, begin)
    for place in places:
        flat.look(place, *([thing] if place == "dining table" else []))
    go_on(flat, begin + timedelta(hours=later))
    return flat


def tell_weekend(day: int, hour: float) -> Flat:
    """A football that is on the sofa at the weekend and by the hook on workdays."""
    where = on_workdays(by_hour((0, "hook")), by_hour((0, "sofa")))
    places = ("hook", "sofa", "shelf")
    return watch(where, list_times(day + 1, (10, 18)), places, at(day, hour), "football")


def tell_glasses(day: int, hour: float, looks: tuple[float, ...] = (7.5, 13, 22)) -> Flat:
    """Dresser at night, counter in the morning, coffee table in the evening; sparse looks."""
    where = by_hour((0, "dresser"), (7, "counter"), (10, "shelf"), (20, "coffee table"))
    places = ("dresser", "counter", "shelf", "coffee table")
    return watch(where, list_times(day + 1, looks), places, at(day, hour), "glasses")


def tell_two_people(day: int, hour: float) -> Flat:
    """One takes the laptop to the bed at night, the other to the dining table by day."""
    where = on_workdays(
        by_hour((0, "bed"), (8, "dining table"), (19, "sofa"), (22, "bed")),
        by_hour((0, "bed"), (10, "sofa"), (22, "bed")),
    )
    places = ("bed", "dining table", "sofa")
    return watch(where, list_times(day + 1, (7, 11, 16, 21)), places, at(day, hour), "laptop")


def tell_routine_that_ends(day: int, hour: float) -> Flat:
    """Three weeks by the hours of the tablet, and then it stays on the shelf for ten days."""
    before = by_hour((0, "dresser"), (10, "dining table"), (15, "dresser"))
    places = ("dresser", "dining table", "shelf")
    return watch(
        lambda now: before(now) if now < at(21, 0) else "shelf",
        list_times(day + 1, (7, 12, 20)),
        places,
        at(day, hour),
        "tablet",
    )


def tell_holiday(day: int, hour: float) -> Flat:
    """Three weeks of workdays, one week in which the bag stays on the hook, and work again."""
    works = on_workdays(by_hour((0, "hook"), (8, _OUT), (18, "hook")), by_hour((0, "hook")))
    places = ("hook", "sofa", "bed")
    return watch(
        lambda now: "hook" if at(21, 0) <= now < at(28, 0) else works(now),
        list_times(day + 1, (7, 10, 14, 20)),
        places,
        at(day, hour),
        "bag",
    )


def tell_trash(day: int, hour: float) -> Flat:
    """Never moved; looked at once every other day."""
    times = list_times(day, (9,), lambda each: (each - MONDAY).days % 2 == 0)
    return watch(lambda now: "counter", times, ("counter", "fridge"), at(day, hour), "toaster")


def tell_cup(later: float) -> Flat:
    """Coffee at whatever hour: counter, in half an hour the sofa, two hours on the counter."""
    flat, places = Flat(600), ("counter", "sofa", "coffee table")
    for day in range(12):
        begin = at(day, 9 + day * 7 % 11)
        for hours, there in ((0, "counter"), (0.5, "sofa"), (2.5, "counter")):
            go_on(flat, begin + timedelta(hours=hours))
            for place in places:
                flat.look(place, *(["cup"] if place == there else []))
    begin = at(12, 10)
    go_on(flat, begin)
    for place in places:
        flat.look(place, *(["cup"] if place == "sofa" else []))
    go_on(flat, begin + timedelta(hours=later))
    return flat


def miss_once() -> Flat:
    """One look shows a sweater, and one in the evening does not."""
    flat = Flat(600)
    for hour, place, seen in ((16, "dresser", ["sweater"]), (20, "bed", []), (21, "dresser", [])):
        go_on(flat, at(0, hour))
        flat.look(place, *seen)
    go_on(flat, at(0, 21.5))
    return flat


RHYTHMS = {
    "tablet at noon, seen in the morning": Story(
        lambda: tell_tablet(20, 12, 7), {"dining table": 0.85}, thing="tablet"
    ),
    "tablet at noon after five days": Story(
        lambda: tell_tablet(5, 12, 7),
        {},
        likelier=("dining table", "dresser"),
        thing="tablet",
    ),
    "tablet in the evening, seen at noon": Story(
        lambda: tell_tablet(20, 20, 7, 12), {"dresser": 0.6}, thing="tablet"
    ),
    "car keys on a Monday at eleven": Story(
        lambda: tell_car_keys(28, 11), {}, at_most={"shelf": 0.2}, thing="car keys"
    ),
    "car keys on a Saturday at eleven": Story(
        lambda: tell_car_keys(26, 11), {"shelf": 0.6}, thing="car keys"
    ),
    "lunch box an hour after the table": Story(
        lambda: tell_lunch_box(20, 1), {}, likelier=("counter", "dining table"), thing="lunch box"
    ),
    "lunch box three hours after the table": Story(
        lambda: tell_lunch_box(20, 3), {}, likelier=("fridge", "counter"), thing="lunch box"
    ),
    "football on a Saturday, seen on Friday": Story(
        lambda: tell_weekend(26, 10), {"sofa": 0.5}, thing="football"
    ),
    "football on a Monday, seen on Sunday": Story(
        lambda: tell_weekend(28, 10), {"hook": 0.5}, thing="football"
    ),
    "glasses in the evening, seen at one": Story(
        lambda: tell_glasses(10, 22), {"coffee table": 0.5}, thing="glasses"
    ),
    "glasses in the morning, seen at night": Story(
        lambda: tell_glasses(10, 7.5), {"counter": 0.5}, thing="glasses"
    ),
    "laptop on a workday at eleven": Story(
        lambda: tell_two_people(24, 11), {"dining table": 0.5}, thing="laptop"
    ),
    "laptop on a Sunday at eleven": Story(
        lambda: tell_two_people(27, 11), {}, likelier=("sofa", "dining table"), thing="laptop"
    ),
    "a routine that ended ten days ago": Story(
        lambda: tell_routine_that_ends(31, 12), {"shelf": 0.8}, thing="tablet"
    ),
    "the second workday after a holiday": Story(
        lambda: tell_holiday(29, 14), {}, likelier=(ELSEWHERE, "hook"), thing="bag"
    ),
    "what never moves": Story(lambda: tell_trash(20, 15), {"counter": 0.85}, thing="toaster"),
    "a sweater that was missed once": Story(
        miss_once, {"dresser": 0.5}, {ELSEWHERE: 0.2}, thing="sweater"
    ),
    "a cup half an hour after coffee": Story(
        lambda: tell_cup(0.5), {"sofa": 0.4}, likelier=("sofa", "counter"), thing="cup"
    ),
    "a cup two hours after coffee": Story(
        lambda: tell_cup(2), {}, likelier=("counter", "sofa"), thing="cup"
    ),
}


if __name__ == "__main__":
    tell_stories(RHYTHMS, sys.argv[1:])
