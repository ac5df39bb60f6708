"""What a question names: other words, more or fewer of them, and typos."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from sgm.arrays.table import clone
from sgm.messages import shorten
from sgm.names.aliases import AliasTable
from sgm.names.comparison import (
    ALL_SAID,
    DOUBTFUL,
    LESS_SAID,
    OTHER_SAID,
    compare,
    is_doubtful,
    is_possible,
    is_written,
    rank,
)
from sgm.names.description_tables import DescriptionTables, Entry
from sgm.names.known_words import is_word
from sgm.names.language import ENGLISH
from sgm.names.modifiers import MATERIALS, PROPERTIES, ROOMS, is_property, says_how, spell
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_grammar import Reading, is_measure, make_reader
from sgm.names.phrase import Phrase, make_phrase_reader
from sgm.names.resolution import MOST_ALTERNATIVES, Resolution
from sgm.names.sentence import Sentence, make_sentence_reader
from sgm.names.spelling import count_mistakes, is_near, is_typo
from sgm.names.words import BREAKS, DETERMINERS, OF, WITH, read_name, read_words, split_words

# How alike two labels are, -1 to 1: cosine of their text vectors.
Similarity = Callable[[str, Sequence[str]], Sequence[float]]

SYNONYM = 0.9  # mug and cup .96, phone and telephone .93; plate and bowl .87 stay apart
RELATED = 0.8  # enough for a "did you mean"
_MOST_RESOLVED = 2000  # questions whose answers are kept
_LEAST_MENDED = 5  # letters
_MOST_SIBLINGS = 12  # of a kind, whose things are offered for one another


class NameIndex:
    """Finds the descriptions that a question names, without looking through all of them.

    What people say around a name is taken off ("where is my ...?", articles, case, punctuation),
    and it is read by `NameReader`: a thing, its properties, its owner and its number. The rules,
    tried one after the other until one finds something:

    1. The thing by any name of the table of aliases, and all kinds of it, with all properties that
       are asked for: "mug" is any mug, "red mug" any that is red, "mug 2" that one. What has the
       asked words in its name comes before what is only called so besides.
    2. The same with fewer words: "mug" for "the red mug", where no other colour is said.
    3. A more general name: "phone" for "iphone".
    4. What has another property, and none that contradicts: "tall mug" for "teal mug".
    5. A part of the name that is no English word: "zorb" for "zorb charger".
    6. What it holds, or a remark in brackets: "cookies" for "cookie jar".
    7. A word that is no English one, of five letters or more, is read as an English one of the
       memory, if it is that with one slip (`is_typo`). What that is a synonym or kind of is not
       meant.
    8. Things that mean nearly the same by their text vectors, where one of the two is not in the
       table: with an encoder of one's own, or if the policy has vectors.

    A description of another owner or number is not meant, nor one of another colour, size, side or
    material. One that has no number or side, where the question has, is `doubtful`. A word that
    makes it another thing (`narrows`) is said by both or by none: a "soda can" is no "trash can".
    Where one of the two does not say it, the other is `doubtful`.

    What acts is stricter: `resolve_exact`.
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
        self._encoder = encoder
        self._sentences = make_sentence_reader(self._aliases.language)
        self._phrases = make_phrase_reader(self._aliases.language)
        self._nobodys = self._sentences.language.list_words("nobody's")
        self._resolved: dict[str, Resolution] = {}

    def copy(self) -> NameIndex:
        """Return the same index, which can be changed alone; no description is read again."""
        copied = clone(self)
        copied._tables, copied._resolved = self._tables.copy(), dict(self._resolved)
        return copied

    def update(self, descriptions: Sequence[str]) -> None:
        """Take over the descriptions of a memory; only those that are new cost anything."""
        if list(descriptions) != self._tables.descriptions:
            self._tables.update(descriptions)
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
            "unused": self._list_unused(phrase),
            "quantity": phrase.quantity,
            "where": phrase.where,
            "is_not_there": phrase.is_not_there,
        }
        if phrase.name and not phrase.excluded:
            found = self._find_exact(phrase.name)
            if found:
                return self._resolution(name, found, "exact", **said)
        taken = self.resolve(name)
        readings = self._read_main(phrase.name) if phrase.name else []
        near = [
            number
            for reading in readings
            for key in reading.endings[-1:]
            for number, _ in self._tables.endings.get(key, ())
            if not any(reading.stem ^ other.stem for other in self._tables.readings[number])
        ]
        spelled = self._find_spelled(Name.read(phrase.name)) if phrase.name else []
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
        sentence = self._sentences.read(question)
        things = [
            self._phrases.name_speaker(part, speaker)
            for thing in sentence.things
            for part in self._sentences.part(thing, self._is_name, self._is_property)
        ]
        return sentence._replace(things=tuple(things))

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
        return text in self._tables.written or bool(self._aliases.find(split_words(text)))

    def _is_property(self, word: str) -> bool:
        return is_property(spell(self._reader.translate(word)))

    def _is_person(self, text: str) -> bool:
        """Tell whether a word names no thing, or who owns one here."""
        return text in self._tables.owners or not any(map(is_word, text.split()))

    def resolve(self, question: str, similarity: Similarity | None = None) -> Resolution:
        """Say what a question means, such as "the red mugs"; see `SceneGraphMemory.resolve`."""
        if isinstance(question, str) and question in self._resolved:
            return self._resolved[question]
        resolution, is_by_words = self._resolve(question, similarity)
        if is_by_words:  # for any way to compare names: it says the same until there are others
            if len(self._resolved) >= _MOST_RESOLVED:
                self._resolved.clear()
            self._resolved[question] = resolution
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
        readings = self._read_main(text)
        how, groups = self._match(readings, text)
        if not groups and (turned := _turn(text)) != text:  # "mug red"
            text, readings = turned, self._read_main(turned)
            how, groups = self._match(readings, text)
        if not groups:
            mended = " ".join(self._mend(word) for word in text.split())
            if mended != text:
                how, groups = "typo", self._match_written(self._read_main(mended))
        is_by_words = bool(groups)
        synonyms, related = ([], []) if groups else self._find_similar(readings, similarity)
        if not groups:
            how, groups = "similar meaning", synonyms
        said: dict[str, Any] = {
            "owner": readings[0].owner,
            "where": phrase.where,
            "is_not_there": phrase.is_not_there,
            "quantity": phrase.quantity,
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
            doubtful = self._name(self._list_doubtful(readings, text))
            others = self._suggest(readings, [], related)
            said |= {
                "alternatives": tuple(name for name in others if name not in doubtful),
                "doubtful": doubtful,
                "unused": unused,
            }
            return self._resolution(question, (), "unknown", **said), False
        others = self._suggest(readings, found, ())
        words = read_words("description", question)
        if len(found) == 1 and self._tables.descriptions[found[0]].casefold() == words:
            how = "exact"
        if not phrase.where:
            said |= self._find_room(readings[0], found)
        groups = self._part_owners(phrase, found) or groups
        owners = {self._tables.readings[number][0].owner for number in found}
        if phrase.is_speakers and len(found) == 1 and owners != {""}:  # "my watch", and Lisa's
            how = "another property"
        if phrase.clause and len(found) > 1:  # which of them that was, nothing says
            unused = (*unused, phrase.clause)
        said |= {
            "alternatives": others,
            "readings": tuple(self._name(group) for group in groups),
            "unused": (*unused, *self._list_unread(text, readings, found, how)),
        }
        return self._resolution(question, found, how, **said), is_by_words

    def _resolution(self, question: str, found: Iterable[int], how: str, **said: Any) -> Resolution:
        language = self._aliases.language
        return Resolution(question, self._name(found), how, language=language, **said)

    def _list_unused(self, phrase: Phrase) -> tuple[str, ...]:
        """List the words of a phrase that say something, and that no rule reads."""
        if phrase.pronoun:
            return (phrase.pronoun,)
        if self._is_name(phrase.name):  # "post it notes"
            return ()
        words = self._phrases.list_unused(phrase.name)
        if phrase.name and self._phrases.is_one(phrase.name):
            words += (phrase.name.split()[-1],)
        return words

    def _list_unread(
        self, name: str, readings: Sequence[Reading], found: Sequence[int], how: str
    ) -> tuple[str, ...]:
        """List the words of a question that what was found does not say, and no table knows.

        What comes after "of", "for" and the like, and what is before a thing and no English word.
        """
        if how in ("exact", "same words", "typo", "similar meaning") or self._is_name(name):
            return ()
        unread: dict[str, None] = {}
        for reading in readings:
            said = [other for number in found for other in self._tables.readings[number]]
            known = frozenset().union(*(other.said for other in said))
            missing = reading.properties - known - PROPERTIES
            for word in missing - reading.head_words:
                slip = any(count_mistakes(word, other, 1) == 1 for other in known)
                if not slip and not is_word(word):
                    unread[word] = None
            unread |= dict.fromkeys(self._list_after_link(name, reading, known))
        return tuple(unread)

    def _list_after_link(self, name: str, reading: Reading, known: frozenset[str]) -> Iterable[str]:
        """List the words after "of", "for" and the like that no name found says, nor the head."""
        words = split_words(name)
        links = [place for place, word in enumerate(words) if word in BREAKS and place > 0]
        if not links or words[links[0]] in WITH:
            return ()
        if words[links[0]] == OF and is_measure(words[links[0] - 1]):
            return ()
        after = [word for word in words[links[0] + 1 :] if word not in DETERMINERS | BREAKS]
        things = self._aliases.find(after) if after else ()
        names = [split_words(self._aliases.names[thing]) for thing in things]
        if any(known.issuperset(map(spell, other)) for other in names):  # "for the air con"
            return ()
        used = known | reading.head_words | frozenset(map(spell, reading.owner.split()))
        return [word for word in after if used.isdisjoint((spell(word), self._reader.spell(word)))]

    def _find_room(self, reading: Reading, found: Sequence[int]) -> dict[str, Any]:
        """Take a room before a name for a place, if no name found says it: "kitchen keys"."""
        known = (other.said for number in found for other in self._tables.readings[number])
        rooms = sorted((reading.properties & ROOMS).difference(*known))
        if not rooms:
            return {}
        link = self._sentences.language.list_phrases("at")[0]
        return {"where": f"{link} {rooms[0]}", "is_soft": True}

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
        head = self._read_main(phrase.name)[0].head
        out: set[str] = set()
        for excluded in phrase.excluded:
            words = excluded.split()
            is_bare = all(self._is_property(word) or word.endswith("'s") for word in words)
            meant = " ".join((*words, *head)) if is_bare else excluded
            resolution, _ = self._resolve_phrase(meant, self.read_phrase(meant), similarity)
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

    def _read_main(self, text: str) -> list[Reading]:
        return [reading for reading in self._reader.read(text) if not reading.is_content]

    def _match(self, readings: Sequence[Reading], text: str) -> tuple[str, list[list[int]]]:
        """Apply rules 1 to 6: how it was found, and the numbers of the descriptions by reading."""
        for how, rule in (
            ("", partial(self._choose, fit=ALL_SAID)),
            ("same words", partial(self._find_joined, text)),
            ("fewer words", partial(self._choose, fit=LESS_SAID)),
            ("more general name", self._find_above),
            ("another property", partial(self._choose, fit=OTHER_SAID)),
            ("part of the name", self._find_part),
            ("what it holds", self._find_contents),
        ):
            found = [group for reading in readings for group in rule(reading)]
            groups = _drop_repeated(found)
            if groups:
                return how or self._tell_how(readings, groups), groups
        return "", []

    def _match_written(self, readings: Sequence[Reading]) -> list[list[int]]:
        """Apply rules 1 and 2 to what has the asked words in its name."""
        for fit in (ALL_SAID, LESS_SAID):
            found = [
                [
                    number
                    for number in group
                    if any(reading.key in other.endings for other in self._tables.readings[number])
                ]
                for reading in readings
                for group in self._choose(reading, fit)
            ]
            groups = _drop_repeated(found)
            if groups:
                return groups
        return []

    def _tell_how(self, readings: Sequence[Reading], groups: Sequence[Sequence[int]]) -> str:
        """Say how rule 1 found descriptions."""
        numbers = [number for group in groups for number in group]
        main = [self._tables.readings[number][0] for number in numbers]
        if all(
            (reading.said, reading.instance) == (other.said, other.instance)
            for other in main
            for reading in readings
        ):
            return "same words"
        things = {thing for reading in readings for thing in reading.things}
        below = self._list_kinds(things)
        for number in numbers:
            others = self._tables.readings[number]
            has_words = any(
                reading.key in other.endings or reading.head_words <= other.said
                for reading in readings
                for other in others
            )
            if not has_words and not any(below & set(other.things) for other in others):
                return "synonym"
        return "any of the kind"

    def _choose(self, reading: Reading, fit: int) -> list[list[int]]:
        """Choose what says as much of the properties, for each thing that the name may be."""
        groups = [
            [
                entry
                for entry in self._list_entries(reading, thing)
                if compare(reading, entry[1]) == fit
            ]
            for thing in reading.things or (None,)
        ]
        # What is written so comes before what is only called so: a "purse" before a wallet.
        written = [[entry for entry in group if is_written(reading, entry[1])] for group in groups]
        is_exact = any(said.said == reading.said for group in written for _, said in group)
        if any(written) and (is_exact or len(reading.things) > 1):
            for place, exact in enumerate(written):
                kinds = self._list_kinds({thing for _, said in exact for thing in said.things})
                groups[place] = [
                    entry
                    for entry in groups[place]
                    if entry in exact or kinds & set(entry[1].things)
                ]
        most = max((rank(reading, said) for group in groups for _, said in group), default=None)
        groups = [[entry for entry in group if rank(reading, entry[1]) == most] for group in groups]
        return [sorted({number for number, _ in group}) for group in groups if group]

    def _list_kinds(self, things: Iterable[int]) -> set[int]:
        """List all kinds of things."""
        return {kind for thing in things for kind in self._aliases.list_below(thing)}

    def _list_entries(self, reading: Reading, thing: int | None) -> list[Entry]:
        """List what is called a thing or a kind of it; None: what ends in the same words."""
        if thing is None:
            ending = next((key for key in reading.endings if key in self._tables.endings), "")
            return self._tables.endings.get(ending, [])
        things = (thing, *self._aliases.list_below(thing))
        return [entry for meant in things for entry in self._tables.things.get(meant, ())]

    def _find_joined(self, text: str, reading: Reading) -> list[list[int]]:
        """Find what is called the same, written apart or together: "fire lighters", "PS5"."""
        name = Name.read(text)
        whole = name.joined
        numbers = {number for key in name.keys for number in self._tables.same.find(key)}
        numbers |= {
            number
            for number, said in self._tables.endings.get(whole, ())
            if said.endings[0] == whole
            and is_possible(reading, said)
            and (said.instance or not reading.instance)
            and said.stem <= set(map(spell, said.words))  # no "cream of tartar"
        }
        return [sorted(numbers)] if numbers else []

    def _find_above(self, reading: Reading) -> list[list[int]]:
        """Apply rule 3, to all that the name may be: no "medicine" for a tablet."""
        nearest = [
            next(filter(None, (self._find_kind(reading, kind) for kind in kinds)), None)
            for kinds in map(self._aliases.list_above, reading.things)
        ]
        return [] if None in nearest else [numbers for numbers in nearest if numbers]

    def _find_kind(self, reading: Reading, kind: int) -> list[int]:
        """Find what is called a kind, and is no sort of it."""
        return [
            number
            for number, said in self._tables.things.get(kind, ())
            if compare(reading, said) in (ALL_SAID, LESS_SAID) and not self._is_sort_of(kind, said)
        ]

    def _is_sort_of(self, kind: int, said: Reading) -> bool:
        """Tell whether a description says a sort of a kind: "wool coat", "necktie" of "tie"."""
        name = self._aliases.names[kind].removesuffix("s")
        word = said.head[-1].removesuffix("s")
        is_longer = word != name and word.endswith(name)
        return is_longer or bool(said.sorts or said.properties & MATERIALS)

    def _find_part(self, reading: Reading) -> list[list[int]]:
        """Apply rule 5: names that have its words, where these name nothing that is known."""
        if reading.things or is_word(reading.head[-1]):
            return []
        numbers = self._find_holding(reading)
        return [numbers] if numbers else []

    def _find_holding(self, reading: Reading) -> list[int]:
        """Find the names that have all words of a reading, and no property against it."""
        holding = [set(self._tables.words.get(word, ())) for word in reading.said]
        found = set.intersection(*holding) if holding else set()
        return [
            number
            for number in sorted(found)
            if not reading.said <= set(self._tables.readings[number][0].owner.split())
            and any(is_possible(reading, other) for other in self._tables.readings[number])
        ]

    def _find_contents(self, reading: Reading) -> list[list[int]]:
        numbers = {
            number
            for thing in reading.things
            for meant in (thing, *self._aliases.list_below(thing))
            for number, other in self._tables.contents.get(meant, ())
            if compare(reading, other) == ALL_SAID
        }
        return [sorted(numbers)] if numbers else []

    def _list_doubtful(self, readings: Sequence[Reading], text: str) -> list[int]:
        """List what may be meant, and may be another thing, the likeliest first."""
        found: list[int] = []
        for reading in readings:
            for thing in reading.things or (None,):
                entries = self._list_entries(reading, thing)
                found += [n for n, said in entries if compare(reading, said) == DOUBTFUL]
            for ending in reading.endings[-1:]:
                entries = self._tables.endings.get(ending, [])
                found += [n for n, said in entries if is_doubtful(reading, said)]
            if not reading.things:
                found += self._find_holding(reading)
        if readings[0].owner in self._nobodys:  # "their phone"
            found += [n for group in self._match(_disown(readings), text)[1] for n in group]
        if not is_word(readings[0].head[-1]):
            found += self._find_spelled(Name.read(text))
        return list(dict.fromkeys(found))

    def _find_spelled(self, asked: Name) -> list[int]:
        """Find what is spelled nearly alike; names that differ in a number are compared once."""
        alike = [numbers for name, numbers in self._tables.spelled.items() if is_near(asked, *name)]
        return sorted(number for numbers in alike for number in numbers)

    def _mend(self, word: str) -> str:
        """Return the word of the memory that this one may be a typo of; itself if it is a word."""
        spelled = spell(word)
        if len(word) < _LEAST_MENDED or not word.isalpha():
            return word
        if spelled in self._tables.words or spelled in self._aliases.words or is_word(word):
            return word
        near = [
            other
            for other in self._tables.words
            if other.isalpha() and is_word(other) and is_typo(spelled, other)
        ]
        return near[0] if len(near) == 1 else word

    def _find_similar(
        self, readings: Sequence[Reading], similarity: Similarity | None
    ) -> tuple[list[list[int]], list[list[int]]]:
        """Apply rule 8: groups of descriptions by their heads, the most similar first.

        Returns:
            Those that mean the same, and those that are related, these among them.
        """
        same, related = SYNONYM, RELATED
        if self._encoder is not None:
            similarity = self._encoder.compare
            same, related = self._encoder.thresholds
        if similarity is None:
            return [], []
        groups: dict[float, dict[int, None]] = {}
        for reading in readings:
            by_head = self._list_heads(reading)
            if by_head:
                values = similarity(" ".join(reading.head), list(by_head))
                for value, numbers in zip(values, by_head.values(), strict=True):
                    groups.setdefault(float(value), {}).update(dict.fromkeys(numbers))
        synonyms, others = [
            _drop_repeated(
                list(groups[value]) for value in sorted(groups, reverse=True) if value >= least
            )
            for least in (same, related)
        ]
        return synonyms, others

    def _list_heads(self, reading: Reading) -> dict[str, list[int]]:
        """List the descriptions that say all of a name but for its head, by their heads.

        One of the two is not in the table. Names that differ in their number are compared once.
        """
        by_head: dict[str, list[int]] = {}
        for numbers in self._tables.texts.values():
            said = self._tables.readings[numbers[0]][0]
            if reading.things and said.things:
                continue
            if reading.instance:
                firsts = ((number, self._tables.readings[number][0]) for number in numbers)
                numbers = [n for n, other in firsts if compare(reading, other) == ALL_SAID]
            elif compare(reading, said) != ALL_SAID:
                continue
            if numbers:
                by_head.setdefault(" ".join(said.head), []).extend(numbers)
        for numbers in by_head.values():
            numbers.sort()
        return dict(sorted(by_head.items(), key=lambda item: item[1][0]))

    def _suggest(
        self, readings: Sequence[Reading], found: Sequence[int], related: Sequence[Sequence[int]]
    ) -> tuple[str, ...]:
        """Return what else may have been meant, the nearest first.

        The same with other properties, other things of its kinds, what has its name, and what means
        nearly the same.
        """
        close: list[int] = []
        for reading in readings:
            for thing in reading.things or (None,):
                close += [number for number, _ in self._list_entries(reading, thing)]
                if thing is not None:
                    near = self._aliases.list_siblings(thing, _MOST_SIBLINGS)
                    close += [
                        number
                        for akin in (*near, *self._aliases.list_above(thing))
                        for number, other in self._tables.things.get(akin, ())
                        if not found and not other.kinds - reading.said
                    ]
            if not found and len(reading.key) > 2:
                close += self._tables.words.get(spell(reading.head[-1]), ())
        for group in related:
            close += group
        others = [number for number in dict.fromkeys(close) if number not in found]
        return self._name(others[:MOST_ALTERNATIVES])


@lru_cache(maxsize=8)  # all memories of one prior have the same
def _add_types(table: AliasTable, types: tuple[str, ...]) -> AliasTable:
    """Add types that the table does not have; a "soap bottle" is none: it is soap, and a bottle."""
    reader = make_reader(table)
    new = (label for label in types if not table.find(split_words(label)))
    return table.with_names(label for label in new if len(reader.read(label)) < 2)


def _drop_repeated(groups: Iterable[Iterable[int]]) -> list[list[int]]:
    """Leave every number in the first group that has it, and drop empty groups."""
    known: set[int] = set()
    kept = []
    for group in groups:
        new = [number for number in dict.fromkeys(group) if number not in known]
        known.update(new)
        kept += [new] if new else []
    return kept


def _disown(readings: Sequence[Reading]) -> list[Reading]:
    """Return readings of a name that does not say whose it is."""
    return [reading._replace(owner="") for reading in readings]


def _turn(name: str) -> str:
    """Return a name with the properties that stand behind it before it: "red mug" of "mug red"."""
    words = name.split()
    place = len(words)
    while place > 1 and _says_how(words[place - 1]):
        place -= 1
    return " ".join((*words[place:], *words[:place]))


def _says_how(word: str) -> bool:
    """Tell whether a word says how a thing is, and names none, as "glass" does."""
    return says_how(spell(word)) and spell(word) not in MATERIALS
