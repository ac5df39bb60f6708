"""What a question names among the descriptions of a memory, and which words it leaves over."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from sgm.arrays.table import clone
from sgm.messages import shorten
from sgm.names.aliases import AliasTable
from sgm.names.context import make_context_reader
from sgm.names.description_tables import DescriptionTables
from sgm.names.instances import drop_label, drop_track
from sgm.names.known_words import is_word
from sgm.names.modifiers import MATERIALS, ROOMS, is_property, says_how, spell
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_grammar import Reading, make_reader
from sgm.names.name_matching import NameMatcher, Similarity
from sgm.names.phrase import Phrase, make_phrase_reader
from sgm.names.resolution import Resolution
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence, make_sentence_reader
from sgm.names.unread import UnreadWords
from sgm.names.words import POSSESSIVE, normalize, read_name, read_words, split_words

_PARTS = re.compile(r"[.,;]+(?=[^\W\d])")  # "mug.red"
_MOST_RESOLVED = 2000  # questions whose answers are kept


class NameIndex:
    """Says which descriptions a question names.

    What people say around a name is taken off ("where is my ...?", articles, case, punctuation),
    the rest is matched by rules (`NameMatcher`), and words that nothing was made of are listed
    (`UnreadWords`). What acts is stricter: `resolve_exact`.
    """

    def __init__(
        self,
        types: Iterable[str] = (),
        table: AliasTable | None = None,
        encoder: NameEncoder | None = None,
    ) -> None:
        """Start without descriptions.

        `types` are labels of object types that the prior knows. Without an encoder the similarity
        that `resolve` is given is used.
        """
        self._aliases = _add_types(table or AliasTable(), tuple(types))
        self._reader = make_reader(self._aliases)
        declared = () if table is None else table.declared
        self._tables = DescriptionTables(self._reader, declared)
        self._sentences = make_sentence_reader(self._aliases.language)
        self._contexts = make_context_reader(self._aliases.language)
        self._phrases = make_phrase_reader(self._aliases.language)
        listed = self._sentences.language.list_words
        self._nobodys = listed("nobody's")
        self._asking = listed("question words") | listed("where words")
        # By question alone where words said what it means, else by the way to compare names, too.
        self._resolved: dict[str | tuple[str, Similarity | None], Resolution] = {}
        self._described: tuple[str, ...] = ()
        # A table says more of what is meant than the vectors that ship, which then only propose.
        self._is_by_meaning = encoder is not None or table is None
        self._encoder = encoder
        self._read_tables()

    def _read_tables(self) -> None:
        """Match against the tables, and judge what is left over by them."""
        self._matcher = NameMatcher(
            self._tables, self._reader, self._aliases, self._encoder, self._nobodys
        )
        self._unread = UnreadWords(self._tables, self._reader, self._aliases, self._nobodys)

    def copy(self) -> NameIndex:
        """Return the same index, which can be changed alone; no description is read again."""
        copied = clone(self)
        copied._tables, copied._resolved = self._tables.copy(), dict(self._resolved)
        copied._read_tables()
        return copied

    def update(self, descriptions: Sequence[str]) -> None:
        """Take over the descriptions of a memory; only those that are new cost anything."""
        described = tuple(descriptions)  # a tuple is itself, and compared without a copy
        if described != self._described:
            self._described = described
            self._tables.update(described)
            self._resolved.clear()

    def resolve_exact(self, name: str) -> Resolution:
        """Say which description is exactly of a name, for what acts on it.

        Case, articles, plural, accents and the spelling of a word make no difference, nor whether
        it is written together. Aliases of one's own are exact, those of the shipped table are not.

        Returns:
            Matches, "exact"; else none, "unknown", and in `doubtful` what may be meant: what a
            question of that name would be taken for, and what is spelled nearly alike.
        """
        found = self._find_exact(name)
        if found:
            return self._resolution(name, found, "exact")
        things = self.part(name)
        if len(things) > 1:
            return self._resolution(name, (), "several things", things=things)
        phrase = self.read_phrase(things[0])
        said: dict[str, Any] = {
            "unused": (*self._list_unused(phrase), *self._phrases.find_any(phrase.name)),
            "quantity": phrase.quantity,
            "where": phrase.where,
            "is_not_there": phrase.is_not_there,
        }
        if phrase.name and not phrase.excluded:
            found = self._find_exact(phrase.name)
            if found:
                return self._resolution(name, found, "exact", **said)
        taken = self.resolve(name)
        readings = self._matcher.read_main(phrase.name) if phrase.name else []
        near = [
            number
            for reading in readings
            for key in reading.endings[-1:]
            for number, _ in self._tables.endings.get(key, ())
            if not any(reading.stem ^ other.stem for other in self._tables.readings[number])
        ]
        spelled = self._matcher.find_spelled(Name.read(phrase.name)) if phrase.name else []
        names = [*taken.matches, *taken.doubtful]
        if not phrase.excluded:
            names += self._name([*spelled, *near])
        return self._resolution(
            name,
            (),
            "unknown",
            alternatives=taken.alternatives,
            owner=taken.owner,
            doubtful=tuple(dict.fromkeys(names)),
            **said,
        )

    def _find_exact(self, name: str) -> list[int]:
        """Find the descriptions of exactly a name; of those, what is written as it is."""
        asked = Name.read(name)
        found = {n for key in self._tables.list_keys(asked) for n in self._tables.same.find(key)}
        if not found and self._aliases.language != ENGLISH:
            asked = Name.read(self._reader.spell_out(name))
            found = {n for key in asked.keys for n in self._tables.same.find(key)}
        written = [n for n in found if read_name(self._tables.descriptions[n]) == read_name(name)]
        return sorted(written or found)

    def read_sentence(self, question: str, speaker: str = "") -> Sentence:
        """Read a sentence, and part what it asks for into things, each in words of its own.

        `speaker` is who says "my"; empty if that is not known.
        """
        if read_words("description", question) in self._tables.written:
            return Sentence(kind="thing", things=(question,), text=question)
        question = drop_label(question)
        if self._sentences.is_chat(question) and not self._is_name(read_words("text", question)):
            return Sentence(kind="command", things=(), text=question)
        sentence = self._read_context(question) or self._sentences.read(question)
        named = self._find_named(question)
        things = [
            self._name_speaker(self._name_person(part, named), speaker)
            for thing in sentence.things
            for part in self._sentences.part(thing, self._is_name, self._is_property)
        ]
        if sentence.is_corrected:
            things = things[-1:]
        return sentence._replace(things=tuple(things))

    def _name_person(self, thing: str, person: str) -> str:
        """Say whose "her phone" is, where it is known of one that it is of that person."""
        named = self._phrases.name_person(thing, person)
        is_known = named == thing or bool(self.resolve(named).matches)
        return named if is_known else thing

    def _find_named(self, question: str) -> str:
        """Find the one owner of things whom a question names; empty without one, or with more."""
        named = self._tables.owners.intersection(self._sentences.split_words(question))
        return named.pop() if len(named) == 1 else ""

    def _read_context(self, question: str) -> Sentence | None:
        """Read a question without what is said before it; None where that is a part of it.

        Of "I need the kettle. Where is it?" the one known thing that was said is asked for. What
        names a known thing before another question may be asked for, too.
        """
        said = self._contexts.read(question)
        if said is None:
            return None
        known = self._find_known(said.names)
        if said.is_open and len(known) == 1 and self._contexts.is_all(said, known[0]):
            name = self._add_owner(known[0], said.words)
            return said.question._replace(things=(name,), text=name)
        return None if known or said.is_open else said.question

    def _add_owner(self, name: str, words: str) -> str:
        """Return "his keys" where that was said of "keys", in words with spaces before each."""
        before = words.partition(f" {name}")[0].split()[-1:]
        speakers = self._sentences.language.list_words("speaker's")
        is_owned = bool(before) and before[0] in self._nobodys | speakers
        return f"{before[0]} {name}" if is_owned else name

    def _find_known(self, names: Sequence[Sequence[str]]) -> tuple[str, ...]:
        """Find what names known things, of names that begin at each word, the longest first."""
        found: dict[tuple[str, ...], str] = {}
        place = 0
        while place < len(names):
            longest = next((n for n in names[place] if self._is_known(n)), "")
            if longest:
                found.setdefault(self.resolve(longest).matches, longest)
            place += max(len(longest.split()), 1)
        return tuple(found.values())

    def _is_known(self, name: str) -> bool:
        resolution = self.resolve(name)
        return bool(resolution.matches) and resolution.is_sure

    def _name_speaker(self, thing: str, speaker: str) -> str:
        """Say whose "my phone" is, where it is known of one that it is the speaker's."""
        named = self._phrases.name_speaker(thing, speaker)
        is_known = named == thing or f"{normalize(speaker)}{POSSESSIVE}" not in (
            normalize(word) for word in self.resolve(named).unused
        )
        return named if is_known else thing

    def part(self, question: str) -> tuple[str, ...]:
        """Part a question into the things that it is about; itself, if it is about none."""
        return self.read_sentence(question).things or (question,)

    def read_phrase(self, thing: str) -> Phrase:
        """Read what is said of one thing; a name that something has is all of it."""
        phrase = self._phrases.read(self._phrases.turn_owner(thing, self._is_person))
        if not phrase.quantity and self._is_name(read_words("description", thing)):
            return Phrase(name=thing, is_speakers=self._phrases.is_speakers(thing))
        return phrase

    def _is_name(self, text: str) -> bool:
        """Tell whether something is called so, here or in the table."""
        return self._tables.has_name(text)

    def _is_property(self, word: str) -> bool:
        return is_property(spell(self._reader.translate(word)))

    def _is_person(self, text: str) -> bool:
        """Tell whether a word names no thing, or who owns one here."""
        return text in self._tables.owners or not any(map(is_word, text.split()))

    def resolve(self, question: str, similarity: Similarity | None = None) -> Resolution:
        """Say what a question means, such as "the red mugs"; see `SceneGraphMemory.resolve`."""
        if isinstance(question, str):
            for key in (question, (question, similarity)):
                if key in self._resolved:
                    return self._resolved[key]
        resolution, is_by_words = self._resolve(question, similarity)
        if len(self._resolved) >= _MOST_RESOLVED:
            self._resolved.clear()
        self._resolved[question if is_by_words else (question, similarity)] = resolution
        return resolution

    def _resolve(self, question: str, similarity: Similarity | None) -> tuple[Resolution, bool]:
        """Say what a question means, and whether words alone said so."""
        words = read_words("description", question)
        if not self._sentences.split_words(question) and words not in self._tables.written:
            raise ValueError(
                f"description must hold a word, got {shorten(question)}. Name it in words."
            )
        things = self.part(question)
        if len(things) > 1:
            several = [self.resolve(thing, similarity) for thing in things]
            near = dict.fromkeys(name for found in several for name in found.matches)
            said = {"doubtful": tuple(near), "things": things}
            return self._resolution(question, (), "several things", **said), False
        phrase = self.read_phrase(things[0])
        if not phrase.name:
            excluded = [self.resolve(name, similarity) for name in phrase.excluded]
            near = dict.fromkeys(name for out in excluded for name in out.alternatives)
            return self._resolution(
                question,
                (),
                "unknown",
                unused=self._list_unused(phrase),
                doubtful=tuple(near),
            ), False
        resolution, is_by_words = self._resolve_phrase(question, phrase, similarity)
        time = self._sentences.read(question).time
        is_written = read_words("description", question) in self._tables.written
        if time is not None and not is_written:
            resolution = replace(resolution, unused=(*resolution.unused, time.words))
        return resolution, is_by_words

    def _resolve_phrase(
        self, question: str, phrase: Phrase, similarity: Similarity | None
    ) -> tuple[Resolution, bool]:
        """Say what is meant by what is said of one thing."""
        text = self._reader.translate(phrase.name)
        readings = self._matcher.read_main(text)
        any_that_is, any_of = self._list_any(phrase.name), self._find_any_of(phrase.name)
        how, groups = self._matcher.match(readings, text)
        if any_that_is or any_of:
            how, groups = "any of the kind", self._find_any(any_that_is, any_of)
        # "mug red"; "mug_track_9" where there is one mug, without a number; "study lamp"
        room, many = "", len(self._tables.readings)
        no_room = self._drop_room(text, readings[0])
        for other, most in ((_turn(text), many), (drop_track(phrase.name), 1), (no_room, many)):
            if not groups and other:
                turned = self._matcher.read_main(other)
                how, meant = self._matcher.match(turned, other)
                numbers = {number for group in meant for number in group}
                is_numbered = any(self._tables.readings[n][0].instance for n in numbers)
                if 0 < len(numbers) <= most and not (most == 1 and is_numbered):
                    room = "" if other != no_room else self._find_said_room(readings[0])
                    text, readings, groups = other, turned, meant
        text, readings, how, groups = self._mend(text, readings, how, groups)
        is_by_words = bool(groups)
        synonyms, related = ([], []) if groups else self._matcher.find_similar(readings, similarity)
        if not groups and self._is_by_meaning:
            how, groups = "similar meaning", synonyms
        said: dict[str, Any] = {
            "owner": readings[0].owner,
            "where": phrase.where,
            "is_not_there": phrase.is_not_there,
            "quantity": phrase.quantity,
            "unsorted": self._name(self._matcher.list_unsorted(readings)),
        }
        unused = self._list_unused(phrase)
        if phrase.where and groups:
            groups, said = self._find_said_place(phrase, groups, said)
        if phrase.excluded and groups:
            how, groups, left_out = self._leave_out(phrase, how, groups, similarity)
            if not groups:
                said |= {"doubtful": self._name(left_out), "unused": unused}
                return self._resolution(question, (), "unknown", **said), False
        found = sorted({number for group in groups for number in group})
        if not found:
            near = [number for group in synonyms for number in group]
            doubtful = self._name(
                dict.fromkeys([*self._matcher.list_doubtful(readings, text), *near])
            )
            others = self._name(self._matcher.suggest(readings, [], related))
            said |= {
                "alternatives": tuple(name for name in others if name not in doubtful),
                "doubtful": doubtful,
                "unused": unused,
            }
            return self._resolution(question, (), "unknown", **said), False
        others = self._name(self._matcher.suggest(readings, found, ()))
        words = read_words("description", question)
        if len(found) == 1 and self._tables.descriptions[found[0]].casefold() == words:
            how = "exact"
        if room and not phrase.where:
            said |= self._say_room(room)
        elif not phrase.where:
            said |= self._find_room(readings[0], found)
        groups = self._part_owners(phrase, found) or groups
        if readings[0].owner in self._nobodys:  # "her glasses", where some are of a person
            owned = self._matcher.match_owned(readings, text)
            found = sorted({*found, *owned})
            groups = [[number] for number in found] if owned else groups
        owners = {self._tables.readings[number][0].owner for number in found}
        if phrase.is_speakers and len(found) == 1 and owners != {""}:  # "my watch", and Lisa's
            how = "another property"
        # Which of them that was, nothing says; "which fell was where" is more than a clause.
        is_more = not self._asking.isdisjoint(phrase.clause.split()[1:])
        if phrase.clause and (len(found) > 1 or is_more):
            unused = (*unused, phrase.clause)
        unread = (
            () if any_that_is or any_of else self._unread.list_words(text, readings, found, how)
        )
        said |= {
            "alternatives": others,
            "readings": tuple(self._name(group) for group in groups),
            "unused": (*unused, *unread),
        }
        return self._resolution(question, found, how, **said), is_by_words

    def _list_any(self, name: str) -> frozenset[str]:
        """List the properties of "anything red", as they are compared; none of a name."""
        said = frozenset(
            spell(self._reader.translate(word)) for word in self._phrases.split_any(name)
        )
        return said if all(map(says_how, said)) else frozenset()

    def _find_any_of(self, name: str) -> str:
        """Return whose all things are that a name says, "anna" of "anna's things"; else empty."""
        owner = self._phrases.split_belongings(self._reader.translate(name))
        return owner if owner in self._tables.owners else ""

    def _find_any(self, said: frozenset[str], owner: str) -> list[list[int]]:
        """Find all that has some properties, and is of an owner, where one is named."""
        found = [
            n
            for n, (first, *_) in enumerate(self._tables.readings)
            if said <= first.said and owner in ("", first.owner)
        ]
        return [found] if found else []

    def _mend(
        self, text: str, readings: list[Reading], how: str, groups: list[list[int]]
    ) -> tuple[str, list[Reading], str, list[list[int]]]:
        """Mend typing errors, where nothing was found or a word was left over: "red cofee mug"."""
        found = {number for group in groups for number in group}
        if groups and not self._unread.list_words(text, readings, sorted(found), how):
            return text, readings, how, groups
        mended = self._matcher.mend(text)
        if mended == text:
            return text, readings, how, groups
        others = self._matcher.read_main(mended)
        if text.split()[-1] == mended.split()[-1]:  # the thing itself is spelled right
            meant = self._matcher.match(others, mended)[1]
        else:
            meant = self._matcher.match_written(others)
        return (mended, others, "typo", meant) if meant else (text, readings, how, groups)

    def _resolution(self, question: str, found: Iterable[int], how: str, **said: Any) -> Resolution:
        language = self._aliases.language
        return Resolution(question, self._name(found), how, language=language, **said)

    def _list_unused(self, phrase: Phrase) -> tuple[str, ...]:
        """List the words of a phrase that say something, and that no rule reads."""
        if phrase.pronoun:
            return (phrase.pronoun,)
        words = tuple(filter(self._phrases.is_unnamed, phrase.excluded))  # "not hers"
        words += tuple(filter(self._is_no_word, phrase.excluded))
        if self._is_name(phrase.name):  # "post it notes"
            return words
        if self._find_any_of(phrase.name):
            return words
        words += self._phrases.list_unused(phrase.name)
        if phrase.name and self._phrases.is_one(phrase.name):
            words += (phrase.name.split()[-1],)
        return words

    def _is_no_word(self, excluded: str) -> bool:
        """Tell whether what something is not says nothing that is known: "not zorb"."""
        if not self.read_phrase(excluded).name or self._phrases.names_nothing(excluded):
            return True  # "except in"
        words = [word.removesuffix(POSSESSIVE) for word in excluded.split()]
        is_known = self._tables.has_name(excluded) or self._tables.owners.issuperset(words)
        others = [word for word in excluded.split() if not self._is_property(word)]
        if len(others) > 1 and not is_known and not self._matcher.read_main(excluded)[0].things:
            return any(spell(word) not in self._tables.words for word in others)  # "anna bought"
        return not is_known and not any(
            is_word(self._reader.translate(word)) or self._tables.words.get(spell(word))
            for word in words
        )

    def _find_room(self, reading: Reading, found: Sequence[int]) -> dict[str, Any]:
        """Take a room before a name for a place, if no name found says it: "kitchen keys"."""
        known = (other.said for number in found for other in self._tables.readings[number])
        rooms = sorted((reading.properties & ROOMS).difference(*known))
        return self._say_room(rooms[0]) if rooms else {}

    def _say_room(self, room: str) -> dict[str, Any]:
        link = self._sentences.language.list_phrases("at")[0]
        return {"where": f"{link} {room}", "is_soft": True}

    def _find_said_room(self, reading: Reading) -> str:
        """Return the room that stands before a thing, which is no name of the table with it."""
        rooms = sorted(reading.properties & ROOMS)
        return rooms[0] if len(rooms) == 1 else ""

    def _drop_room(self, text: str, reading: Reading) -> str:
        """Return a name without the room before it; empty without one."""
        room = self._find_said_room(reading)
        words = text.split()
        return " ".join(word for word in words if word != room) if room in words else ""

    def _find_said_place(
        self, phrase: Phrase, groups: list[list[int]], said: dict[str, Any]
    ) -> tuple[list[list[int]], dict[str, Any]]:
        """Take what says a place for a part of a name, where a name says so: "tuna in a tin"."""
        _, where = self._phrases.split_where(phrase.where)
        words = frozenset(map(spell, split_words(where)))
        kept = [[n for n in group if words <= self._tables.readings[n][0].said] for group in groups]
        if not any(kept):
            return groups, said
        return [group for group in kept if group], {**said, "where": ""}

    def _leave_out(
        self,
        phrase: Phrase,
        how: str,
        groups: list[list[int]],
        similarity: Similarity | None,
    ) -> tuple[str, list[list[int]], list[int]]:
        """Leave out what something is not; what may be that, too: "mug" of "not the red mug"."""
        head = self._matcher.read_main(phrase.name)[0].head
        out: set[str] = set()
        for excluded in phrase.excluded:
            if self._phrases.is_unnamed(excluded):  # asked back
                continue
            words = excluded.split()
            is_bare = all(self._is_property(word) or word.endswith(POSSESSIVE) for word in words)
            meant = " ".join((*words, *head)) if is_bare else excluded
            other = self.read_phrase(meant)
            if not other.name:
                continue
            resolution, _ = self._resolve_phrase(meant, other, similarity)
            out |= {*resolution.matches, *resolution.doubtful}
        kept = [[n for n in group if self._tables.descriptions[n] not in out] for group in groups]
        left_out = sorted({n for group in groups for n in group} - {n for g in kept for n in g})
        kept = [group for group in kept if group]
        return ("any of the kind" if left_out else how), kept, left_out

    def _part_owners(self, phrase: Phrase, found: Sequence[int]) -> list[list[int]]:
        """Part what "my phone" may be, where it is known whose some are, and not who speaks."""
        owners = [self._tables.readings[number][0].owner for number in found]
        if not phrase.is_speakers or not any(owners) or len(found) < 2:
            return []
        return [[number] for number in found]

    def _name(self, numbers: Iterable[int]) -> tuple[str, ...]:
        return tuple(self._tables.descriptions[number] for number in numbers)


@lru_cache(maxsize=8)  # all memories of one prior have the same
def _add_types(table: AliasTable, types: tuple[str, ...]) -> AliasTable:
    """Add types that the table does not have; a "soap bottle" is none: it is soap, and a bottle."""
    reader = make_reader(table)
    new = (label for label in types if not table.find(split_words(label)))
    return table.with_names(label for label in new if len(reader.read(label)) < 2)


def _turn(name: str) -> str:
    """Return a name with the properties that stand behind it before it: "red mug" of "mug red".

    Empty if none do.
    """
    words = _PARTS.sub(" ", normalize(name)).split()
    place = len(words)
    while place > 1 and _says_how(words[place - 1]):
        place -= 1
    return " ".join((*words[place:], *words[:place])) if place < len(words) else ""


def _says_how(word: str) -> bool:
    """Tell whether a word says how a thing is, and names none, as "glass" does: "wooden" does."""
    spelled = spell(word)
    is_material = spelled in MATERIALS and word.removesuffix("s") == spelled
    return says_how(spelled) and (not is_material or is_property(word))
