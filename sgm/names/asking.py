"""What is asked back, in the words of a language."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from functools import lru_cache

from sgm.messages import shorten, shorten_text
from sgm.names.language import load_answers, load_language
from sgm.names.phrase import make_phrase_reader
from sgm.names.sections import ENGLISH
from sgm.names.words import POSSESSIVE, normalize
from sgm.schema import RELATION_TABLE

MOST_NAMED = 5  # names in a question
_ROBOT = "robot"  # as who said or did something
MOST_NAME = 60  # characters of a name in a question


class Asking:
    """Writes sentences by the tables of a language (`answers.txt`).

    Example:
        >>> make_asking("en").ask_which(["anna's phone", "red mug"])
        "Do you mean anna's phone or the red mug?"
    """

    def __init__(self, code: str) -> None:
        """Write by the tables of a language; raises ValueError if there is none of that code."""
        answers = load_answers(code)
        self._names, self._how = answers["names"], answers["how"]
        self._ask = {
            name: text
            for section, sentences in answers.items()
            if section not in ("names", "how")
            for name, text in sentences.items()
        }
        marks = [mark.strip() for mark in self._names["no article"].split("|")]
        self._owned = tuple(mark for mark in marks if mark.startswith("'"))
        self._words = frozenset(marks) - frozenset(self._owned)
        language = load_language(code)
        # The first word of each name, and its gender, by name in the shipped table.
        self._called = {name: (words[0], gender) for name, gender, words in language.names}
        self._written = {normalize(w): w for _, _, words in language.names for w in words}
        pairs = language.read_pairs("properties")
        self._properties = {english: word for word, english in reversed(pairs.items())}
        self._months = _split(self._ask["months"])
        self._articles = load_language(code).list_words("articles")
        self._pronouns = load_language(code).list_words("pronouns")
        self._of = re.compile(rf"{load_language(code).compile_section('of')} ")
        self._plural, self._singular = (
            tuple(_split(self._names.get(number, ""))) or ("\0",)
            for number in ("plural", "singular")
        )
        self._verbs = {verb: [*_split(self._names[verb]) * 2][:2] for verb in ("is", "was", "has")}

    def say(self, sentence: str, **values: object) -> str:
        """Return a sentence with values filled in."""
        return self._ask[sentence].format(**values)

    def say_look(self, relation: str, place: str) -> str:
        """Say where to look; of a relation that the language has no words for, by the schema's."""
        sentence = f"look {relation}"
        if sentence in self._ask:
            return self.say(sentence, place=place)
        return self.say("look by", relation=RELATION_TABLE[relation].preposition, place=place)

    def count(self, sentence: str, number: int, **values: object) -> str:
        """Return a sentence with a number: its first form for one, else its last."""
        form = _split(self._ask[sentence])[0 if number == 1 else -1]
        return form.format(number=number, **values)

    def tell_how(self, how: str) -> str:
        """Say how a question was taken for a description."""
        return self._how[how]

    def tell_who(self, by: str) -> str:
        """Say who said something; `by` is "robot" for the robot."""
        return self.say(_ROBOT) if by == _ROBOT else by

    def tell_steps(self, step: int, now: int) -> str:
        """Say a time step, as it is said at another one: "now", "3 steps ago"."""
        if step == now:
            return self.say("now")
        return self.count("ago" if step < now else "ahead", abs(now - step))

    def say_the(self, name: str) -> str:
        """Return a name as it stands in a sentence: "the red mug", "anna's phone"."""
        called = self._find_called(name)
        name = shorten_text(self.translate(name), MOST_NAME)
        if called is not None and name.endswith(called[0]):  # no place in a room
            return self._names["called"].format(article=self._names[called[1]], name=name)
        words = name.casefold().replace("\u2019", "'").split()
        is_owned = any(word.endswith(self._owned) for word in words[:-1]) if self._owned else False
        if is_owned or (words and words[0] in self._words):
            return name
        return self._names["the"].format(name=name)

    def translate(self, name: str) -> str:
        """Return a name of a thing, or of a place in a room, as the language has it."""
        if not self._called:
            return name
        phrases = make_phrase_reader(ENGLISH)
        phrase = phrases.read(name)
        if phrase.where and phrase.name:
            room = self.translate(phrases.split_where(phrase.where)[1])
            return self._names["place"].format(place=self.translate(phrase.name), room=room)
        words = name.casefold().split()
        for start in range(len(words)):
            called = self._called.get(" ".join(words[start:]))
            if called is not None:
                before = self._translate_before(words[:start], called[1] == "p")
                return name if before is None else " ".join((*before, called[0]))
        return self._written.get(normalize(name), name)

    def _find_called(self, name: str) -> tuple[str, str] | None:
        """Return what a language calls the thing of a name, and its gender; None for no such."""
        if not self._called or make_phrase_reader(ENGLISH).read(name).where:
            return None
        words = name.casefold().split()
        if any(word.endswith(POSSESSIVE) for word in words):
            return None
        endings = (" ".join(words[start:]) for start in range(len(words)))
        return next((self._called[ending] for ending in endings if ending in self._called), None)

    @property
    def is_translated(self) -> bool:
        """Whether things are called otherwise than in the shipped table."""
        return bool(self._called)

    def _translate_before(self, words: Sequence[str], is_plural: bool) -> list[str] | None:
        """Return the words before a name; None if one is not known."""
        form = self._names["adjectives" if is_plural else "adjective"]
        told = []
        for word in words:
            if word.endswith(POSSESSIVE):
                told.append(f"{word.removesuffix(POSSESSIVE).capitalize()}s")
            elif word in self._properties:
                told.append(form.format(word=self._properties[word]))
            else:
                return None
        return told

    def tell_time(self, time: datetime, now: datetime) -> str:
        """Say a time as people do: "at 9:10", "yesterday at 21:40", "on 3 November at 8:00"."""
        at_hour = self.say("at", hour=f"{time.hour}:{time.minute:02}")
        days = (now.date() - time.date()).days
        if days == 0:
            return at_hour
        if abs(days) == 1:
            return self.say("yesterday" if days > 0 else "tomorrow", at=at_hour)
        month = self._months[time.month - 1]
        sentence = "date" if time.year == now.year else "date of year"
        return self.say(sentence, day=time.day, month=month, year=time.year, at=at_hour)

    def list_names(
        self, names: Sequence[str], link: str = "or", plain: bool = False, most: int = MOST_NAMED
    ) -> str:
        """Return "the red mug, the blue mug or the bowl"; plain, without articles."""
        told = [
            self.translate(name) if plain else self.say_the(name) for name in dict.fromkeys(names)
        ]
        return self.join(told, link, most)

    def tell_several(self, sentence: str, names: Sequence[str], **values: object) -> str:
        """Return a sentence about things, with its verb, and without articles."""
        told = self.join([self.translate(name) for name in names], "and", most=len(names))
        are = len(names) > 1 or any(map(self.is_plural, names))
        verbs = {verb: forms[are] for verb, forms in self._verbs.items()}
        return self.say(sentence, names=told, **verbs, **values)

    def join(self, told: Sequence[str], link: str = "or", most: int = MOST_NAMED) -> str:
        """Return texts with commas, and "or" before the last one."""
        if len(told) > most:
            sentence = "and others" if link == "and" else "others"
            more = self.count(sentence, len(told) - most)
            told = [*told[:most], more]
        if len(told) < 2:
            return "".join(told)
        return f"{', '.join(told[:-1])} {self._names[link]} {told[-1]}"

    def is_plural(self, name: str) -> bool:
        """Tell whether a name is in the plural, by the tables of the language."""
        called = self._find_called(name)
        if called is not None:
            return called[1] == "p"
        head = self._of.split(name, maxsplit=1)[0]  # "deck of cards"
        return head.endswith(self._plural) and not head.endswith(self._singular)

    def tell(self, sentence: str, thing: str = "", **values: object) -> str:
        """Return a sentence about a thing, with its verb: "The keys are at the desk in study."."""
        number = self.is_plural(thing)
        verbs = {verb: forms[number] for verb, forms in self._verbs.items()}
        told = self.say(sentence, **{"thing": self.say_the(thing), **verbs, **values})
        return told[:1].upper() + told[1:]

    def strip_article(self, name: str) -> str:
        """Return a name without the article before it."""
        words = name.split()
        while len(words) > 1 and words[0].casefold() in self._articles:
            words = words[1:]
        return " ".join(words)

    def ask_which(self, names: Sequence[str]) -> str:
        """Return "Do you mean the red mug or the blue mug?"."""
        return self.say("which", names=self.list_names(names))

    def ask_unknown(self, name: str, near: Sequence[str], call: str) -> str:
        """Return what to ask of a name that nothing has; a call tells what there is."""
        nothing = self.say("unknown", name=shorten(name, MOST_NAME))
        return f"{nothing} {self.ask_which(near) if near else self.say(call)}"

    def tell_unused(self, words: Sequence[str]) -> str:
        """Return "I do not understand 'zorb'."."""
        quoted = [shorten(word, MOST_NAME) for word in dict.fromkeys(words)]
        sentence = "pronoun" if self._pronouns.issuperset(words) else "unused"
        return self.say(sentence, words=self.join(quoted, "and"))


def _split(forms: str) -> list[str]:
    return [form.strip() for form in forms.split("|") if form.strip()]


@lru_cache(maxsize=8)
def make_asking(code: str = ENGLISH) -> Asking:
    """Return what writes the sentences of a language."""
    return Asking(code)
