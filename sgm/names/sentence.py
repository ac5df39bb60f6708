"""A sentence read whole: what kind of question it is, what it asks for, and what is left over."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

from sgm.names.language import Language, load_language
from sgm.names.sections import ENGLISH
from sgm.names.time_words import TimeReader, TimeSaid
from sgm.names.words import MOST_READ, POSSESSIVE, normalize

IsName = Callable[[str], bool]
_TOKEN = re.compile(r",|[^\s,]+")
_ENDS = '?!.;:\u2026"\u201c\u201d'
_LABEL = re.compile(r"\b[^\W_]+(?:_[^\W_]+)*_\d+\b")  # of a tracker, which is one word: "mug_3"
_LINE = "\u23af"  # in place of its "_", which is a space in any other name
_DASHES = frozenset("-\u2013\u2014")  # between clauses
_IN_PLACE = frozenset(
    ("where", "is_at", "which", "who", "when_at", "when_moved")
)  # a place is of the thing
_SMILEY = re.compile(r"[()<>^;:*'_\-|\[\]]+|[:;=x]-?[()dp]+")
# Kinds that say nothing of where something is.
_EVENTS = frozenset(("who", "when", "when_at", "when_moved", "moved", "count", "whose", "history"))
_AT_A_TIME = frozenset(("past", "future"))  # and these, where something was or will be
_LONGEST_SHORTENED = 3  # letters and a point: "no. 4"
_APOSTROPHE = "\u2019"
_SLASH = re.compile(r"(?<=[^\W\d_]{2})/(?=[^\W\d_]{2})")


class Sentence(NamedTuple):
    """What a sentence asks.

    Attributes:
        kind: "thing" of a name alone; else of the table of questions: "where", "past", "future",
            "when", "when_at", "when_moved", "who", "whose", "moved", "history", "changes", "count",
            "what_at", "which",
            "is_at", "is_there", "together", "room", "place"; "command" of what is no question.
        things: what is asked for, each in words of its own ("red mug", "blue mug").
        where: of `what_at` and `count`, "in the fridge"; of `whose`, who may own it; of `together`,
            "room" where that is what is asked for.
        time: when, if that is said.
        tense: "past" or "future", where a word says so.
        text: what is asked for, as it stands.
        is_corrected: whether the last one is meant alone: "the red mug, no, the blue one".
    """

    kind: str
    things: tuple[str, ...]
    where: str = ""
    time: TimeSaid | None = None
    tense: str = ""
    text: str = ""
    is_corrected: bool = False


class SentenceReader:
    """Reads sentences by the tables of a language (`sentences.txt`).

    What says nothing, "please", is taken off both ends, and so is a time. The first pattern of a
    question that fits all the rest says what kind it is, and what it asks for. Without one it is a
    name. Several things are parted at "and", "or", commas and slashes: "red and blue mug" is two
    mugs, and "salt and pepper" one thing, where it has that name.
    """

    def __init__(self, language: Language) -> None:
        """Read by the tables of a language."""
        self.language = language
        self._times = TimeReader(language)
        self._short = language.read_pairs("short forms")
        self._relatives = {phrase.split()[0] for phrase in language.list_phrases("that is")}
        self._after_participle = language.list_words("after a participle")
        self._participles = tuple(language.list_phrases("participle endings"))
        self._where_words = language.list_words("where words")
        self._contracted = language.list_words("after a contraction")
        self._is = next(iter(language.list_phrases("contraction")), "")
        self._fillers = language.list_words("fillers")
        prefixes = "|".join(map(re.escape, language.list_words("not"))) or "(?!)"
        self._prefixes = re.compile(rf"\b({prefixes})-(?=\w)")  # "non-red"
        first, last, after = (
            language.compile_section(f"chat {where}") for where in ("first", "last", "after thing")
        )
        self._first = re.compile(rf"^(?:(?: ,)*{first}(?= |$))+(?: ,)*(?= )")
        self._last = re.compile(rf"(?:(?: ,)*{last})+(?: ,)*$")
        self._after = re.compile(rf"(?:(?: ,)*(?:{after}|{last}))+(?: ,)*$")
        self._commands = [
            re.compile(f"^{language.compile(line)}$") for line in language.list_lines("commands")
        ]
        correction = language.compile_section("corrections")
        self._corrections = re.compile(
            rf"^(?P<before>.*[^,]) ,(?:{correction})(?: ,)*(?P<after>(?: [^ ,]+)+)$"
        )
        self._past, self._future = (
            language.list_words(f"{tense} words") for tense in ("past", "future")
        )
        self._joins = language.list_words("and") | {"/", ","}
        self._negations = language.list_words("not") | language.list_words("but")
        self._bare = language.list_words("articles") | language.list_words("speaker's")
        self._one = language.list_words("one")
        both = language.list_words("both") | language.list_words("either")
        self._both = both - self._bare - language.list_words("of")
        self._that_is = re.compile(language.compile_section("that is"))
        self._chat = re.compile(f"^(?:{first}|{last}| ,)+$")
        self._pronouns = language.list_words("pronouns")
        self._function_words = language.list_words("function words")
        self._belongings = f" {next(iter(language.list_phrases('belongings')), '')}"
        self._in = language.list_phrases("at")[0]
        self.signals = self._list_signals()
        self.read = lru_cache(maxsize=MOST_READ)(self._read)

    def _list_signals(self) -> frozenset[str]:
        """List the words of which a plain name has none."""
        sections = (
            "chat first, chat last, questions, commands, and, not, but, pronouns, both, every, "
            "that is, owned, not owned, left there, at, near, from, fillers, function words, "
            "times, parts of the day, days, units, ago, ahead, clock, speaker's, clauses"
        )
        words = {
            word
            for section in sections.split(", ")
            for line in self.language.list_lines(section)
            for word in re.findall(r"[^\W\d_]+(?:'[^\W\d_]+)?", line)
        }
        return frozenset(words | self._short.keys())

    def _read(self, text: str) -> Sentence:
        words = self.split_words(text)
        if self.signals.isdisjoint(words) and self._joins.isdisjoint(words):
            return Sentence(kind="thing", things=(text,), text=text)
        words = [word for word in words if word not in self._fillers] or words
        words, is_corrected = self._correct(words)
        whole, num_asked = set(words), self._count_where(words)
        tense = self._find_tense(words)
        padded = self.strip_chat(pad_words(words))
        words, time = self._times.split(padded.split())
        if not words and time is not None:  # "now", "tomorrow": a name, perhaps
            return Sentence(kind="thing", things=(text,), text=text)
        padded = self.strip_chat(pad_words(words))
        kind, asked, where = self._match(padded)
        stripped = whole - set(padded.split())
        is_else = kind in _EVENTS and not self._where_words.isdisjoint(stripped)
        is_else |= kind == "whose" and not self._where_words.isdisjoint(whole)
        if kind in _AT_A_TIME:  # "where was it on Monday, and where is it now?"
            is_else = self._count_where(padded.split()) < num_asked
        if is_else:  # "and where is it"
            return Sentence(kind="command", things=(), time=time, tense=tense, text=padded.strip())
        if kind == "thing" and self._is_command(padded):
            return Sentence(kind="command", things=(), time=time, tense=tense, text=padded.strip())
        if kind in _IN_PLACE:  # "is the remote still on the sofa?"
            asked, where = asked + where, ""
        if asked and kind != "thing":
            asked = self._strip(asked, self._first, self._after)
        if time is None:
            words, time = self._times.split(asked.split())
            asked = pad_words(words) if time is not None and words else asked
        if time is None and where:  # "what was at noon on the desk?"
            words, said = self._times.split(where.split())
            where, time = (pad_words(words), said) if words else (where, time)
        text = asked.strip()
        return Sentence(
            kind=kind,
            things=(text,) if text else (),
            where=where.strip(),
            time=time,
            tense=tense,
            text=text,
            is_corrected=is_corrected,
        )

    def _count_where(self, words: Sequence[str]) -> int:
        return sum(word in self._where_words for word in words)

    def _correct(self, words: list[str]) -> tuple[list[str], bool]:
        """Write a comma for what takes back what was said: "the red pen - no, the black one"."""
        found = self._corrections.search(pad_words(words))
        if found is None:
            return words, False
        return [*found["before"].split(), ",", *found["after"].split()], True

    def split_words(self, text: str) -> list[str]:
        """Return the words of a sentence, and its commas; short forms are written out."""
        text = _LABEL.sub(lambda found: found[0].replace("_", _LINE), text)
        text = normalize(text).replace(_LINE, "_").replace(_APOSTROPHE, "'")
        text = _SLASH.sub(" / ", text)
        text = self._prefixes.sub(r"\g<1> ", text)
        words: list[str] = []
        for token in _TOKEN.findall(text.rstrip(_ENDS + " ")):
            is_shortened = len(token) <= _LONGEST_SHORTENED and token[-1] == "."  # "no. 4"
            word = token.lstrip(_ENDS) if is_shortened else token.strip(_ENDS)
            if word in _DASHES and words:
                words.append(",")
            elif word in self._short:
                words += self._short[word].split()
            elif word in self._contracted and words and words[-1].endswith(POSSESSIVE):
                words[-1:] = [words[-1].removesuffix(POSSESSIVE), self._is, word]  # "keys's not"
            elif word and word not in _ENDS and not (words and _SMILEY.fullmatch(word)):
                words.append(word)
                if token[-1] in ".;:" and word != token:
                    words.append(",")
        words = words[:-1] if words[-1:] == [","] else words
        return self._write_out(words)

    def _write_out(self, words: list[str]) -> list[str]:
        """Write "anna is looking for" of "anna's looking for"; no "anna's reading glasses"."""
        for place in range(1, len(words)):
            before, word = words[place - 1], words[place]
            after = words[place + 1] if place + 1 < len(words) else ""
            is_verb = word.endswith(self._participles) if self._participles else False
            if is_verb and before.endswith(POSSESSIVE) and after in self._after_participle:
                is_said = [before.removesuffix(POSSESSIVE), self._is]
                return [*words[: place - 1], *is_said, *self._write_out(words[place:])]
        return words

    def is_chat(self, text: str) -> bool:
        """Tell whether a text says nothing: "thanks!"; "where is it?" does."""
        words = self.split_words(text)
        return self._pronouns.isdisjoint(words) and bool(self._chat.match(pad_words(words)))

    def strip_chat(self, padded: str) -> str:
        """Take what says nothing off the beginning and the end of words, but never all."""
        return self._strip(padded, self._first, self._last)

    def _is_command(self, padded: str) -> bool:
        """Tell whether a person tells what was done; no "mug that is in the sink"."""
        is_told = any(pattern.match(padded) for pattern in self._commands)
        return is_told and not self._that_is.search(padded)

    def _find_tense(self, words: Sequence[str]) -> str:
        if not self._future.isdisjoint(words):
            return "future"
        return "" if self._past.isdisjoint(words) else "past"

    def _strip(self, padded: str, first: re.Pattern[str], last: re.Pattern[str]) -> str:
        """Take what says nothing off both ends, but never all."""
        before = None
        while before != padded:
            before = padded
            for pattern in (first, last):
                shorter = pattern.sub("", padded, count=1)
                padded = shorter if shorter.strip(" ,") else padded
        return padded

    def _match(self, padded: str) -> tuple[str, str, str]:
        """Return the kind of a question, what it asks for and where."""
        for kind, pattern in self.language.questions:
            found = pattern.match(padded)
            said = found.groupdict("").get("thing", "").split() if found else []
            # No "saw and kettle", no "mug that is not on the desk".
            is_part = not (
                self._joins.isdisjoint(said[:1])
                and self._relatives.isdisjoint(said[-1:])
                and self._where_words.isdisjoint(said[1:])  # "where is it now and where was it"
            )
            if found and not is_part:
                slots = found.groupdict("")
                thing, where = slots.get("thing", ""), slots.get("where", "")
                if "owner" in slots:  # "how many keys does Tom have?"
                    thing = f"{slots['owner']}{POSSESSIVE}{thing or self._belongings}"
                if "quality" in slots:  # "whose phone is the black one"
                    thing = f"{slots['quality']}{thing}"
                if "place" in slots:  # "the contents of the fridge"
                    where = f" {self._in}{slots['place']}"
                return kind, thing, where
        return "thing", padded, ""

    def part(self, text: str, is_name: IsName, is_property: IsName) -> tuple[str, ...]:
        """Part what is asked for into things, each in words of its own.

        Args:
            text: "red and blue mugs".
            is_name: whether something is called so, and is one thing.
            is_property: whether a word says how a thing is.
        """
        words = self.split_words(text)
        if self._joins.isdisjoint(words) or not self._negations.isdisjoint(words):
            return (text,)
        if is_name(text) or is_name(" ".join(self._drop_articles(words))):
            return (text,)
        parts = self._split(words, is_name)
        if not parts:
            return (text,)
        if len(parts) > 1 and parts[0][0] in self._both and len(parts[0]) > 1:
            parts[0] = parts[0][1:]  # "both the keys and the wallet"
        bare = self._drop_articles(parts[-1])
        bare = bare[:-1] if bare[-1] in self._one else bare  # "the mug, the red one"
        is_plain = not any(map(is_property, parts[0]))  # else it is another thing
        if len(parts) == 2 and is_plain and "," in words and bare and all(map(is_property, bare)):
            parts = [[*bare, *self._drop_articles(parts[0])]]
        if len(parts) < 2:
            return (" ".join(parts[0]),)
        return tuple(" ".join(part) for part in self._lend(parts, is_property))

    def _split(self, words: Sequence[str], is_name: IsName) -> list[list[str]]:
        """Split words at "and" and the like, but where a name has it."""
        parts: list[list[str]] = [[]]
        place = 0
        while place < len(words):
            if words[place] not in self._joins:
                parts[-1].append(words[place])
                place += 1
                continue
            left = parts[-1][-2:]
            whole = [
                (start, end)
                for start in range(len(left))
                for end in (place + 3, place + 2)
                if is_name(" ".join((*left[start:], *words[place:end])))
            ]
            if words[place].isalpha() and whole:  # "salt and pepper"
                parts[-1] += words[place : whole[0][1]]
                place = whole[0][1]
                continue
            parts.append([])
            place += 1
        return [part for part in parts if part]

    def _lend(self, parts: list[list[str]], is_property: IsName) -> list[list[str]]:
        """Give each part the thing that is named once: "red and blue mug"."""
        whole: list[list[str]] = []
        head: list[str] = []  # of the part after this one, or before
        for part in reversed(parts):
            kept = self._count_bare(part, is_property)
            if kept < len(part):
                head = part[kept:]
            whole.append([*part, *head] if kept == len(part) else part)
        whole.reverse()
        for number, part in enumerate(whole):  # "the red mug and the blue one"
            if part[-1] in self._one and number:
                before = whole[number - 1]
                kept = self._count_bare(before, is_property)
                whole[number] = [*part[:-1], *before[kept:]]
        return whole

    def _count_bare(self, words: Sequence[str], is_property: IsName) -> int:
        """Count the words at the beginning that name no thing: articles, owners, properties."""
        place = 0
        while place < len(words) and (
            words[place] in self._bare
            or words[place].endswith((POSSESSIVE, POSSESSIVE[::-1]))
            or is_property(words[place])
        ):
            place += 1
        return place

    def _drop_articles(self, words: Sequence[str]) -> Sequence[str]:
        start = 0
        while start < len(words) - 1 and words[start] in self._bare:
            start += 1
        return words[start:]


@lru_cache(maxsize=8)
def make_sentence_reader(code: str = ENGLISH) -> SentenceReader:
    """Return the reader of a language, which remembers what it has read."""
    return SentenceReader(load_language(code))


def pad_words(words: Sequence[str]) -> str:
    """Write words with a space before each, as patterns are compiled for."""
    return "".join(f" {word}" for word in words)
