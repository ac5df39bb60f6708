"""Words that say when: "yesterday evening", "at noon", "two hours ago", "since Monday"."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from sgm.names.language import Language

_DAY = timedelta(days=1)
_WEEK = timedelta(weeks=1)
_CLOCK = re.compile(r"(?P<hour>\d{1,2})(?:[:.](?P<minutes>\d{2}))?(?P<half>[a-z]+)?")
_LONGEST = 8  # words
_TENS = frozenset(range(20, 100, 10))  # after which a number below ten is a part of one
_LONGEST_HOUR = 3  # words: "six thirty pm"
_ABOUT = "-ish"
_EARLIEST = 7  # hour of the clock that is of the morning where nothing else is said


class TimeSaid(NamedTuple):
    """A time as it was said.

    Attributes:
        words: as they stand.
        link: "at", "since" or "before".
        day: days from today; None where no day is said.
        weekday: 0 for Monday; None where none is said.
        hours: of that day, from and to; None where none are said.
        ago: seconds back, or ahead below 0; None where none are said.
        is_last: whether "last" is said of a weekday or of `ago`.
        is_next: whether "next" is.
        is_moment: whether `ago` is of hours, and means no whole day: "forty hours ago".
    """

    words: str
    link: str = "at"
    day: int | None = None
    weekday: int | None = None
    hours: tuple[float, float] | None = None
    ago: float | None = None
    is_last: bool = False
    is_next: bool = False
    is_moment: bool = False

    @property
    def is_hour_alone(self) -> bool:
        """Whether a time of the clock is said, and nothing else."""
        is_day = self.day is not None or self.weekday is not None or self.ago is not None
        return not is_day and self.hours is not None and self.hours[0] == self.hours[1]

    def join(self, other: TimeSaid) -> TimeSaid | None:
        """Return the time that two say together, "yesterday" and "at six"; None if they do not."""
        defaults = TimeSaid._field_defaults
        first, second = (
            {name: said[name] for name, default in defaults.items() if said[name] != default}
            for said in (self._asdict(), other._asdict())
        )
        spans = [said for said in (first, second) if "ago" in said]
        if spans and first != second:  # "two days ago" and "at noon"; no "now" and "on Monday"
            days = all(
                abs(said["ago"]) >= _DAY.total_seconds() and "is_moment" not in said
                for said in spans
            )
            if not days or not {"day", "weekday"}.isdisjoint({*first, *second}):
                return None
        if not _agree(first, second):
            return None
        return TimeSaid(words=f"{self.words}, {other.words}", **{**first, **second})

    def find(self, now: datetime, tense: str = "") -> tuple[datetime, datetime]:
        """Return the first and the last moment that are meant, of the present time.

        `tense` is "past" or "future" where the sentence says it; else the nearest time is meant.
        """
        if self.ago is not None:
            moment = now - timedelta(seconds=self.ago)
            if self.is_last:  # "last week": all of it
                return moment, now
            if abs(self.ago) >= _DAY.total_seconds() and not self.is_moment:  # "two days ago"
                return _bound_day(moment) if self.hours is None else self._bound_hours(moment)
            return moment, moment
        today = now.replace(hour=0, minute=0, second=0, microsecond=0)
        if self.weekday is not None:
            back = (now.weekday() - self.weekday) % 7
            if tense == "future" or self.is_next:
                day = today + ((self.weekday - now.weekday()) % 7 or 7) * _DAY
            else:
                day = today - (back or (7 if self.is_last else 0)) * _DAY
        else:
            day = today + (self.day or 0) * _DAY
        if self.hours is None:
            return (day, min(now, day + _DAY)) if day <= now else (day, day + _DAY)
        begin, end = self._bound_hours(day)
        if tense == "past" and begin > now and self.weekday is not None:
            return begin - _WEEK, end - _WEEK  # "on Tuesday at noon", said on Tuesday at nine
        half = timedelta(hours=12)
        if tense == "past" and begin == end and now < begin <= now + half and begin.hour >= 12:
            if self.day is not None:  # "at six today", said at nine
                return begin - half, end - half
        if self.day is None and self.weekday is None:  # the hour alone
            if tense == "past" and begin > now:
                begin, end = begin - _DAY, end - _DAY
            elif tense != "past" and end < now:
                begin, end = begin + _DAY, end + _DAY
        return begin, end

    def _bound_hours(self, day: datetime) -> tuple[datetime, datetime]:
        assert self.hours is not None
        midnight = day.replace(hour=0, minute=0, second=0, microsecond=0)
        begin, end = (midnight + timedelta(hours=hour) for hour in self.hours)
        if begin == end:
            return begin, begin
        return begin, end


def _bound_day(moment: datetime) -> tuple[datetime, datetime]:
    day = moment.replace(hour=0, minute=0, second=0, microsecond=0)
    return day, day + _DAY


class TimeReader:
    """Takes what says when off the end or the beginning of a sentence, by tables of a language."""

    def __init__(self, language: Language) -> None:
        """Read by the tables of a language."""
        self._named = _make_phrases(language.read_pairs("times"))
        self._parts = _make_phrases(language.read_pairs("parts of the day"))
        links = language.read_pairs("time links")
        self._links = _make_phrases(links)
        self._free_links = _make_phrases({**links, **language.read_pairs("free time links")})
        self._units = _make_phrases(language.read_pairs("units"))
        self._numbers = _make_phrases(language.read_pairs("numbers"))
        self._clock = _make_phrases(language.read_pairs("clock"))
        self._minutes = _make_phrases(language.read_pairs("minutes"))
        self._fractions = _make_phrases(language.read_pairs("parts of an hour"))
        days = [line.split("|") for line in language.list_lines("days")]
        names = {name.strip(): str(number) for line in days for number, name in enumerate(line)}
        self._days = _make_phrases(names)
        self._tenses = language.list_words("past words") | language.list_words("future words")
        self._last, self._next = (
            _make_phrases(dict.fromkeys(language.list_phrases(section), ""))
            for section in ("last", "next")
        )
        self._counted = [
            (side, *(part.split() for part in line.split("<time>")))
            for side in ("ago", "ahead", "since counted")
            for line in language.list_lines(side)
        ]
        tables = (self._named, self._parts, self._units, self._clock, self._days)
        self._signals = frozenset(phrase[-1] for table in tables for phrase, _ in table)
        self._signals |= {word for _, *sides in self._counted for side in sides for word in side}
        self._signals |= {
            phrase[-1] for phrase, _ in (*self._numbers, *self._fractions, *self._minutes)
        }

    def split(self, words: Sequence[str]) -> tuple[list[str], TimeSaid | None]:
        """Split a time from the end or the beginning of words."""
        words = list(words)
        if not any(word in self._signals or word[:1].isdigit() for word in words):
            return words, None
        for start in range(max(len(words) - _LONGEST, 0), len(words)):
            said = self._read(words[start:])
            if said is not None:
                return _drop_comma(words[:start]), said
        for end in range(min(_LONGEST, len(words)), 0, -1):
            said = self._read(words[:end])
            if said is not None:
                return _drop_comma(words[end:]), said
        return self._split_middle(words)

    def _split_middle(self, words: list[str]) -> tuple[list[str], TimeSaid | None]:
        """Split a day that is said after the verb: "what was yesterday on the desk?"."""
        for start in range(1, len(words) - 1):
            if words[start - 1] not in self._tenses:
                continue
            for end in range(min(start + _LONGEST, len(words)), start, -1):
                said = self._read(words[start:end])
                if said is not None and (said.day is not None or said.weekday is not None):
                    return [*words[:start], *words[end:]], said
        return words, None

    def find(
        self, words: Sequence[str], named: Collection[str] = ()
    ) -> tuple[list[str], list[TimeSaid]]:
        """Take all times out of words, wherever they stand: "yesterday, half six, where was it".

        Args:
            words: of a clause.
            named: words of names, after which a number is of the name: "mug 2 yesterday".
        """
        words, found = list(words), []
        signs = (word.removesuffix(_ABOUT) for word in words)
        if not any(word in self._signals or word[:1].isdigit() for word in signs):
            return words, []
        length, told = self._read_piece(words, 0, has_link=True, is_free=True)
        if length == len(words):  # "noon", "seven"
            return [], [TimeSaid(words=" ".join(words), **told)]
        start = 0
        while start < len(words):
            end, said = self._find_at(words, start, named)
            if said is None:
                start += 1
                continue
            found.append(said)
            del words[start:end]
        return words, found

    def _find_at(
        self, words: list[str], start: int, named: Collection[str]
    ) -> tuple[int, TimeSaid | None]:
        """Find the longest time that begins at a word; one of a number alone only at an end."""
        if start and words[start][:1].isdigit() and words[start - 1] in named:
            return start, None
        for end in range(min(start + _LONGEST, len(words)), start, -1):
            if end < len(words) and words[end - 1] in named and words[end] in named:
                continue  # "in the night stand"
            said = self._read(words[start:end], is_free=True)
            is_end = start == 0 or end == len(words)
            if said is not None and (is_end or not said.is_hour_alone):
                return end, said
        return start, None

    def _read(self, words: Sequence[str], is_free: bool = False) -> TimeSaid | None:
        """Read words that all say when; None if they do not.

        With `is_free` a number beside a day is an hour, "ten this morning", and "half six" is one.
        """
        found: dict[str, Any] = {"words": " ".join(words)}
        place, is_told = 0, False
        while place < len(words):
            link = self._count_links(words, place, found, is_free)
            place += link
            has_link = bool(link) or (is_free and self._is_beside_day(words, place, is_told))
            length, said = self._read_piece(words, place, has_link, is_free)
            if not length or not _agree(found, said):
                return None
            found |= said
            place += length
            is_told = True
        return TimeSaid(**found) if is_told else None

    def _count_links(
        self, words: Sequence[str], place: int, found: dict[str, Any], is_free: bool
    ) -> int:
        """Count the words that link a time, "at around", and note what they say of it."""
        links = self._free_links if is_free else self._links
        count = 0
        while True:
            link, value = _match(links, words, place + count)
            if not link or self._read_counted(words, place + count)[0]:
                return count
            if found.get("link", "at") == "at":
                found["link"] = value
            count += link
            if not is_free:
                return count

    def _is_beside_day(self, words: Sequence[str], place: int, is_told: bool) -> bool:
        """Tell whether a number is beside a day: "ten this morning", "yesterday ten"."""
        if is_told:
            return True
        tables = (self._named, self._days)
        ends = range(place + 1, min(place + _LONGEST_HOUR, len(words)) + 1)
        return any(_match(table, words, end)[0] for end in ends for table in tables)

    def _read_piece(
        self, words: Sequence[str], place: int, has_link: bool, is_free: bool = False
    ) -> tuple[int, dict[str, Any]]:
        """Read a day, a part of it, a time of the clock or a span; the words that it took."""
        length, value = _match(self._named, words, place)
        if length:
            return length, _read_named(value)
        length, said = self._read_counted(words, place)
        if length:
            return length, said
        last, _ = _match(self._last, words, place)
        coming, _ = _match(self._next, words, place)
        skipped = last or coming
        length, value = _match(self._days, words, place + skipped)
        if length:
            said = {"weekday": int(value), "is_last": bool(last), "is_next": bool(coming)}
            return skipped + length, {
                name: told for name, told in said.items() if told is not False
            }
        length, value = _match(self._units, words, place + skipped)
        if length and last:
            return skipped + length, {"ago": float(value), "is_last": True}
        if length and coming:
            return skipped + length, {"ago": -float(value), "is_last": True}
        length, value = _match(self._parts, words, place)
        if length:
            first, end = map(float, value.split())
            is_said = has_link or place > 0  # no "dinner knife"
            return (length, {"hours": (first, end)}) if is_said else (0, {})
        return self._read_clock(words, place, has_link, is_free)

    def _read_counted(self, words: Sequence[str], place: int) -> tuple[int, dict[str, Any]]:
        """Read "two hours ago", or "in ten minutes"."""
        for side, before, after in self._counted:
            start = place + len(before)
            if list(words[place:start]) != before:
                continue
            length, number = self._read_number(words, start)
            unit, size = _match(self._units, words, start + length)
            end = start + length + unit
            if length and unit and list(words[end : end + len(after)]) == after:
                seconds = number * float(size)
                said: dict[str, Any] = {"ago": -seconds if side == "ahead" else seconds}
                if float(size) < _DAY.total_seconds():
                    said["is_moment"] = True
                if side == "since counted":  # "in the last two days"
                    said |= {"link": "since", "is_last": True}
                return end + len(after) - place, said
        return 0, {}

    def _read_number(self, words: Sequence[str], place: int) -> tuple[int, float]:
        """Read "45", "forty-five" and "forty five"; how many words that took, 0 for none."""
        if place < len(words) and words[place].isdecimal():
            return 1, float(words[place])
        length, value = _match(self._numbers, words, place)
        if length:
            number, tail = float(value), words[place + length : place + length + 1]
            after, more = _match(self._numbers, tail, 0)
            is_more = after and number in _TENS and 1 <= float(more) < 10 and tail[0].isalpha()
            return (length + 1, number + float(more)) if is_more else (length, number)
        parts = words[place].split("-") if place < len(words) else []
        if len(parts) == 2:
            length, number = self._read_number(parts, 0)
            return (1, number) if length == 2 else (0, 0.0)
        return 0, 0.0

    def _read_clock(
        self, words: Sequence[str], place: int, has_link: bool, is_free: bool = False
    ) -> tuple[int, dict[str, Any]]:
        """Read "5 pm", "17:30", and "5" where a link stands before it."""
        part, more = _match(self._fractions, words, place)
        if part and (has_link or is_free):  # "half past seven"
            length, told = self._read_clock(words, place + part, has_link=True)
            if not length:
                return 0, {}
            hour = told["hours"][0] + float(more)
            return part + length, {"hours": (hour, hour)}
        said = words[place] if place < len(words) else ""
        said = said.removesuffix(_ABOUT)
        is_hour = has_link or (is_free and _match(self._clock, words, place + 1)[0])
        spoken = dict(_join(self._numbers)).get(said, "") if is_hour else ""  # "at nine"
        found = _CLOCK.fullmatch(spoken or said)
        if found is None:
            return 0, {}
        minutes, spoken_minutes = _match(self._minutes, words, place + 1) if spoken else (0, "")
        length, value = _match(self._clock, words, place + 1 + minutes)
        if found["half"]:
            length, value = 0, dict(_join(self._clock)).get(found["half"], "-1")
        if not (length or found["half"] or found["minutes"] or has_link):
            return 0, {}
        hour = int(found["hour"]) + int(found["minutes"] or spoken_minutes or 0) / 60
        if value == "12" and hour < 12:
            hour += 12
        elif value == "0" and hour >= 12:
            hour -= 12
        elif value in ("", "-1") and not found["minutes"] and hour < _EARLIEST:
            hour += 12  # "at five" is in the afternoon
        return (1 + minutes + length, {"hours": (hour, hour)}) if hour <= 24 else (0, {})


def _agree(found: dict[str, Any], said: dict[str, Any]) -> bool:
    """Tell whether nothing is said twice, but a part of the day and a time of the clock."""
    twice = [name for name in said if found.get(name, said[name]) != said[name]]
    if twice != ["hours"]:
        return not twice
    if said["hours"][0] != said["hours"][1]:
        said["hours"], found["hours"] = found["hours"], said["hours"]
    first, end = found["hours"]
    hour = said["hours"][0]
    # "last night at eight" is 20:00, "five in the morning" 5:00.
    within = [hour + more for more in (0, 12, -12, 24) if first <= hour + more <= end]
    if within:
        said["hours"] = (within[0], within[0])
    return bool(said["hours"][0] == said["hours"][1])


def _make_phrases(pairs: Mapping[str, str]) -> list[tuple[list[str], str]]:
    """Return phrases as words with their values, the longest first."""
    return sorted(
        ((name.split(), value) for name, value in pairs.items()), key=lambda p: -len(p[0])
    )


def _join(phrases: Sequence[tuple[list[str], str]]) -> Iterator[tuple[str, str]]:
    return ((" ".join(words), value) for words, value in phrases)


def _match(
    phrases: Sequence[tuple[list[str], str]], words: Sequence[str], place: int
) -> tuple[int, str]:
    """Return how many words a phrase takes from a place on, and its value; 0 for none."""
    for phrase, value in phrases:
        if list(words[place : place + len(phrase)]) == phrase:
            return len(phrase), value
    return 0, ""


def _read_named(value: str) -> dict[str, Any]:
    """Read "day -1, 18 24", "since weekday 0", or "now"."""
    if value == "now":
        return {"ago": 0.0}
    if value.startswith("since"):
        return {"link": "since", "weekday": int(value.split()[-1])}
    day, _, hours = value.partition(",")
    said: dict[str, Any] = {"day": int(day.split()[1])}
    if hours:
        first, end = map(float, hours.split())
        said["hours"] = (first, end)
    return said


def _drop_comma(words: list[str]) -> list[str]:
    while words and words[-1] == ",":
        words = words[:-1]
    while words and words[0] == ",":
        words = words[1:]
    return words
