"""What a call is asked for in words: the things, each by itself, and the time."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from sgm.finder.finder import Finder
from sgm.finder.meanings import MOST_CANDIDATES, Unclear
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.names.asking import Asking, make_asking
from sgm.names.sentence import Sentence

MOST_THINGS = 10  # that a call is asked for at once
# Kinds of sentences that ask where something is.
WHERE_KINDS = frozenset(
    ("thing", "where", "past", "future", "is_at", "is_there", "room", "place", "which")
)


class AskedThings(NamedTuple):
    """What a call is asked for.

    Attributes:
        things: in words, each by itself; at least one.
        span: first and last time step of the time that is asked about; None for now.
        is_past: whether that has passed.
        time_words: words of it.
        unclear: what to ask, where a part of the words was not understood; else None.
        is_exact: whether the things are descriptions, and mean nothing else.
    """

    things: tuple[str, ...]
    span: tuple[int, int] | None = None
    is_past: bool = False
    time_words: str = ""
    unclear: Unclear | None = None
    is_exact: bool = False


def read_asked(
    memory: SceneGraphMemory, finder: Finder, thing: str | Sequence[str], speaker: str = ""
) -> AskedThings:
    """Read what a call is asked for.

    Args:
        memory: of the home.
        finder: says what names mean.
        thing: in words, or a list of them.
        speaker: who says "my".

    Raises:
        ValueError: if one is no name (`read_words`), or there are none or more than `MOST_THINGS`.
    """
    texts = [thing] if isinstance(thing, str) else list(thing)
    sentences = [memory.read_sentence(text, speaker) for text in texts]
    return read_sentences(memory, finder, sentences, texts)


def read_sentences(
    memory: SceneGraphMemory, finder: Finder, sentences: Sequence[Sentence], texts: Sequence[str]
) -> AskedThings:
    """Read what a call is asked for from sentences and their texts; see `read_asked`."""
    asking = make_asking(memory.language)
    things: list[str] = []
    unclear: Unclear | None = None
    for text, sentence in zip(texts, sentences, strict=True):
        if sentence.kind not in WHERE_KINDS or not sentence.things:
            unclear = Unclear("ambiguous", asking.say("another question"), (), text)
        for name in sentence.things or (text,):
            is_part = len(sentence.things) > 1  # "did the phone move, the green one"
            if is_part and memory.read_sentence(name).kind not in WHERE_KINDS:
                unclear = Unclear("ambiguous", asking.say("another question"), (), name)
            meant, several = list_all(memory, finder, name, asking)
            things += meant
            unclear = unclear or several
    if not 1 <= len(things) <= MOST_THINGS:
        raise ValueError(
            f"thing must be 1 to {MOST_THINGS} things, got {len(things)} in {shorten(texts)}. Ask "
            "for fewer at once."
        )
    return add_time(
        memory, AskedThings(things=tuple(things), unclear=unclear), sentences[0], asking
    )


def list_all(
    memory: SceneGraphMemory, finder: Finder, name: str, asking: Asking
) -> tuple[list[str], Unclear | None]:
    """List what "both mugs" or "all mugs" are; a name itself, where it says no such thing."""
    resolution = finder.resolve(memory, name)
    if not resolution.quantity or resolution.is_ambiguous or not resolution.matches:
        return [name], None
    number = len(resolution.matches)
    if number <= MOST_CANDIDATES and resolution.has_quantity:
        return list(resolution.matches), None
    near = resolution.matches[:MOST_CANDIDATES]
    ask = f"{asking.say('all', number=number)} {asking.ask_which(near)}"
    return [name], Unclear("ambiguous", ask, near, name)


def add_time(
    memory: SceneGraphMemory, asked: AskedThings, sentence: Sentence, asking: Asking
) -> AskedThings:
    """Add the time of a sentence, in time steps of the memory's clock."""
    said = sentence.time
    if said is None:
        if sentence.kind == "future" and asked.unclear is None:
            return asked._replace(unclear=Unclear("ambiguous", asking.say("when"), ()))
        return asked
    words = said.words
    if memory.clock is None:
        unclear = Unclear("ambiguous", asking.say("no clock", words=words), ())
        return asked._replace(time_words=words, unclear=asked.unclear or unclear)
    if said.link != "at":
        unclear = Unclear("ambiguous", asking.say("since", words=words), ())
        return asked._replace(time_words=words, unclear=asked.unclear or unclear)
    now = memory.clock.get_time(memory.time)
    begin, end = said.find(now, sentence.tense)
    if is_present(begin, end, now, sentence.tense):
        return asked._replace(time_words=words)
    if sentence.tense == "past" and begin > now:  # "where was it tonight?"
        unclear = Unclear("ambiguous", asking.say("since", words=words), ())
        return asked._replace(time_words=words, unclear=asked.unclear or unclear)
    return asked._replace(
        span=count_steps(memory, begin, end), is_past=end <= now, time_words=words
    )


def is_present(begin: datetime, end: datetime, now: datetime, tense: str) -> bool:
    """Tell whether a time that was said is the present: "today", if nothing says the past."""
    return begin <= now < end or (begin <= now == end and (tense != "past" or begin == end))


def count_steps(memory: SceneGraphMemory, begin: datetime, end: datetime) -> tuple[int, int]:
    """Return the first and the last time step of a time; its end is no part of it."""
    last = max(begin, end - timedelta(microseconds=1))
    return count_step(memory, begin), count_step(memory, last)


def count_step(memory: SceneGraphMemory, moment: datetime) -> int:
    """Return the time step that a moment is in, below 0 for one before the first."""
    clock = memory.clock
    assert clock is not None
    return int((moment - clock.start).total_seconds() // clock.step_seconds)
