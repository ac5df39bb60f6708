"""The words of a question that what was found does not say, and no table knows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sgm.names.aliases import AliasTable
from sgm.names.description_tables import DescriptionTables
from sgm.names.known_words import is_formed, is_word
from sgm.names.modifiers import BRANDS, FAULTS, PROPERTIES, is_made_otherwise, spell
from sgm.names.name_grammar import NameReader, Reading, is_measure
from sgm.names.resolution import SAYS_LESS
from sgm.names.spelling import count_mistakes
from sgm.names.words import BREAKS, DETERMINERS, OF, POSSESSIVE, WITH, split_words


class UnreadWords:
    """Lists the words of a question that say something, and that nothing was made of."""

    def __init__(
        self,
        tables: DescriptionTables,
        reader: NameReader,
        aliases: AliasTable,
        nobodys: frozenset[str],
    ) -> None:
        """Judge by the descriptions of tables.

        `nobodys` are owners that name no person: "their".
        """
        self._tables, self._reader, self._aliases = tables, reader, aliases
        self._nobodys = nobodys

    def list_words(
        self, name: str, readings: Sequence[Reading], found: Sequence[int], how: str
    ) -> tuple[str, ...]:
        """List the words of a question that what was found does not say, and no table knows.

        What comes after "of", "for" and the like, and what is before a thing and no English word,
        whose it is, and of what it is made, if that makes it another thing ("plastic hammer").
        """
        if how in ("exact", "same words", "typo", "similar meaning"):
            return ()
        if self._tables.has_name(name):  # a "wooden spoon" is more than a spoon
            is_more = how == "more general name"
            return tuple(self._list_other_makes(readings[0], self._list_said(found))) * is_more
        unread: dict[str, None] = {}
        for reading in readings:
            said = [other for number in found for other in self._tables.readings[number]]
            known = self._list_said(found)
            written = {ending for other in said for ending in other.endings}  # "olive oil" bottle
            missing = reading.properties - known - PROPERTIES - written
            for word in missing - reading.head_words:
                slip = any(count_mistakes(word, other, 1) == 1 for other in known)
                is_known = is_word(word) or is_formed(word) or bool(self._aliases.find([word]))
                if not slip and not is_known:
                    unread[self._show(word, reading)] = None
            if how in SAYS_LESS:
                unread |= dict.fromkeys(self._list_other_makes(reading, known))
            owners = {other.owner for other in said}
            if reading.owner and reading.owner not in known | owners | self._nobodys | BRANDS:
                unread[f"{reading.owner}{POSSESSIVE}"] = None
            unread |= dict.fromkeys(self._list_after_link(name, reading, known))
        return tuple(unread)

    def _list_said(self, found: Sequence[int]) -> frozenset[str]:
        """List the words that names found say."""
        readings = (other for number in found for other in self._tables.readings[number])
        return frozenset().union(*(other.said for other in readings))

    def _show(self, word: str, reading: Reading) -> str:
        """Return a word as it stands in the question, "rag" of "rag doll"."""
        return next((w for w in reading.words if word in self._reader.list_spellings(w)), word)

    def _list_other_makes(self, reading: Reading, known: frozenset[str]) -> Iterable[str]:
        """List the materials and faults that no name found says, and that make it another one."""
        head = spell(reading.head[-1])
        words = [word for word in reading.words[:-1] if spell(word) not in known]
        return [w for w in words if spell(w) in FAULTS or is_made_otherwise(spell(w), head)]

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
        used |= frozenset(map(spell, reading.words))  # turned, "toothbrush" of "brush for teeth"
        return [word for word in after if used.isdisjoint(self._reader.list_spellings(word))]
