"""Which of several a name means, as trackers, simulators and label lists number them."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

from sgm.names.sections import load_grammar
from sgm.names.words import MOST_NAMES, normalize

_GRAMMAR = load_grammar()


def _match_any(*sections: str) -> str:
    """Return the regular expression of any word of some sections, the longest first."""
    words = {word for section in sections for word in _GRAMMAR.list_words(section)}
    return f"(?:{'|'.join(map(re.escape, sorted(words, key=lambda word: (-len(word), word))))})"


_SENSE = re.compile(r"\.[nvar]\.\d\d(?!\d)")  # of WordNet: "pizza.n.01"
_LOCATED = re.compile(r"(?=.*\d)[^|]*[^|\s]\s*\|")  # "Mug|-01.23|+00.95|+01.34"
_HEX = r"(?:[0-9a-f]{8}-(?:[0-9a-f]{4}-){3}[0-9a-f]{12}|(?=[0-9a-f]*\d)[0-9a-f]{4,}|[0-9a-f]{8,})"
_NUMBER = _match_any("number signs")
_TRACK = _match_any("trackers")
_NUMBERED = _match_any("trackers", "number signs")
_OPENING = r"(?:\((?=[^()]*\)$)|\[(?=[^\[\]]*\]$)|\{(?=[^{}]*\}$)|<(?=[^<>]*>$))"
_LAST = re.compile(
    rf"(?<=[^\s])(?:\s*[\s.#:/@~=,;-]\s*(?:{_NUMBER}\.?\s+|{_NUMBERED}[.:=]?)?#?"
    rf"|\s*{_OPENING}(?:{_NUMBERED}[.:=]?\s*)?#?)(?P<mark>\d+|{_HEX})[\])}}>]?$"
)
# Words, the last of which is not read as a part of the mark after them.
_SPELLED = re.compile(rf"(?:[a-z]+ )*(?!(?:{_NUMBER}|{_TRACK}|[a-f]{{8,}})$)[a-z]+")
_LISTED = re.compile(  # "006_mustard_bottle", "track_12_bottle", "[3] bottle", "3: bottle"
    rf"(?P<mark>0\d+|(?:{_NUMBERED}[\s.:#-]*|#)\d+|\[\d+\]|\(\d+\)|\d+:)"
    r"[\s.-]+(?=.*[^\W\d_]{2})"
)
# As trackers and data sets write them, where "_" parts what spaces do not: no "railway track 3".
_TRACKED = re.compile(rf"_{_NUMBERED}_(?=\d+$)", re.IGNORECASE)
_BEFORE_NAME = re.compile(
    r"^(?:[a-z]+_0(?=\d)|(?=[1-9]\d*_))(?P<mark>\d+)_(?=[^\W\d_]{2})", re.IGNORECASE
)
_LABELLED = re.compile(r"^[^\W\d]{3,}[_.-]\d+$")  # "soap_bottle_3": "_" is a letter of these
_WHAT_IT_IS = re.compile(  # "object 12 (cup)"
    rf"^{_NUMBERED}[\s_.#-]*(?P<mark>\d+)\s*\((?P<name>[^()]*[^\W\d_]{{2}}[^()]*)\)$",
    re.IGNORECASE,
)
_SCORE = re.compile(r"\s*\((?:0?\.\d+|1\.0*|\d{1,3}\s?%)\)\s*$")  # "mug (0.87)"
_LABEL = re.compile(rf"^\s*{_match_any('labels')}\s*[:=]\s*(?=[^\W\d_]{{2}})", re.IGNORECASE)
_ON_SIGN = re.compile(r"(?<=[\u3040-\uffff])(?P<mark>\d+)$")  # "杯子1": no spaces
_WRITTEN_ON = re.compile(r"(?P<word>[^\W\d_]{3,})(?P<mark>\d{1,4})$")  # "mug3"
_MEASURE = re.compile(
    r"(?<=[^\s])\s+(?P<mark>m?\d+(?:[.,/x]\d+)*\s?"
    rf"(?:{_match_any('units')}|x\d+|\"|%)?)$"
)
_LETTER = re.compile(r"(?<=[^\s])[\s-]+(?P<mark>[a-z]|i{2,3}|iv|vi{1,3}|ix|v\d+)$")
_CLONE = re.compile(rf"\s*\({_match_any('copies')}\)$")  # of Unity, and of editors
_NUMBER_WORD = re.compile(
    rf"(?P<word>[^\W\d_]+)\s+(?:{_match_any('said before a number')}\s+)?"
    rf"(?P<mark>{_match_any('numbers')})$"
)
_NUMBERS = " ".join(_GRAMMAR.list_lines("numbers")).split()
_CODE = re.compile(r"(?P<rest>.*[^\s])\s+(?P<code>[a-z]{6})$")  # "bottom cabinet nddvba 0"
_UNSPEAKABLE = re.compile(r"[^aeiouy]{4}|^[^aeiou]+$")


@lru_cache(maxsize=MOST_NAMES)
def split_instance(name: str) -> tuple[str, str]:
    """Split the counter or hash of a name from its words: ("mug", "2") of "Mug_002".

    Understood are "mug_1", "mug 1", "cup.001", "mug (2)", "mug #2", "Mug_3f2a1b", "mug[2]",
    "mug no. 2", "mug_track2", "mug id 2", "mug (id 2)", "002_mug", "track_2_mug", "[2] mug",
    "杯子2", "pizza.n.01_1", "bottom_cabinet_nddvba_0", "Mug|-01.23|+00.95", "mug_track_9",
    "3_soap bottle", "ycb_025_mug" and "object 12 (cup)". Leading zeros make no difference.

    Returns:
        The words, as `normalize` gives them, and the instance; empty where the name has none.
    """
    text = normalize(_write_mark_last(name))
    words, _, mark = text.rpartition(" ")
    if mark.isdecimal() and is_spelled(words):  # most of them
        return words, mark.lstrip("0") or "0"
    if "." in text:
        text = _SENSE.sub("", text).strip()
    marks: list[str] = []
    if "|" in text and _LOCATED.match(text):
        text, _, where = text.partition("|")
        text, marks = text.strip(), ["".join(where.split())]
    while (found := _LAST.search(text) or _ON_SIGN.search(text)) and any(
        map(str.isalpha, text[: found.start()])
    ):
        marks.append(found["mark"].lstrip("0") or "0")
        text = text[: found.start()].strip()
    if marks and (coded := _find_code(text)):
        marks.append(coded["code"])
        text = coded["rest"]
    if listed := _LISTED.match(text):
        number = re.sub(r"\D", "", listed["mark"])
        marks.append(number.lstrip("0") or "0")
        text = text[listed.end() :]
    return text, " ".join(reversed(marks))


def drop_label(name: str) -> str:
    """Return a name without what a detector writes around it: "class: mug (0.87)"."""
    if ":" not in name and "(" not in name and "=" not in name:
        return name
    return _LABEL.sub("", _SCORE.sub("", name)) or name


def drop_track(name: str) -> str:
    """Return a name without the number of a tracker or data set; empty if it has none such.

    That number is of the tracker's list, and not which of several mugs is meant: "mug_9", and no
    "mug 9" of a person.
    """
    if _write_mark_last(name) == name and not _LABELLED.match(name.strip()):
        return ""
    return split_instance(name)[0]


def _write_mark_last(name: str) -> str:
    """Write the number of a tracker or data set after the name, "mug_9" for "mug_track_9"."""
    if "_" not in name and "(" not in name:
        return name
    found = _BEFORE_NAME.match(name)
    if found:
        return f"{name[found.end() :]}_{found['mark']}"
    found = _WHAT_IT_IS.match(name.strip())
    return f"{found['name']}_{found['mark']}" if found else _TRACKED.sub("_", name)


@lru_cache(maxsize=MOST_NAMES)
def is_spelled(text: str) -> bool:
    """Tell whether a text is plain words, so that a number after them is the instance."""
    return _SPELLED.fullmatch(text) is not None and _find_code(text) is None


def _find_code(text: str) -> re.Match[str] | None:
    """Split a code of six letters from words; None where the last word can be said."""
    coded = _CODE.match(text)
    return coded if coded and _UNSPEAKABLE.search(coded["code"]) else None


def split_written_on(name: str, is_known: Callable[[str], bool]) -> tuple[str, str]:
    """Split a counter that is written on the last word, if that is known: ("mug", "3") of "mug3".

    So "ps5" and "mp3" stay whole.
    """
    found = _WRITTEN_ON.search(name)
    if found is None or not is_known(found["word"]):
        return name, ""
    return name[: found.start("mark")], found["mark"].lstrip("0") or "0"


def split_spoken(name: str, is_known: Callable[[str], bool]) -> tuple[str, str]:
    """Split what else tells several of one thing apart: ("mug", "b") of "mug b".

    A letter, a measure ("drill bit 6 mm") or a number in words ("mug two"), after a word that is
    known. A name stays another one without it, as for what acts.
    """
    if "(" in name:
        name, number = split_instance(_CLONE.sub("", name))
        if number:
            return name, number
    last = name.rpartition(" ")[2]
    is_plain = len(last) > 1 and last not in _NUMBERS and not set(last) <= set("ivx")
    if is_plain and name.replace(" ", "").isalpha():
        return name, ""  # as of most names
    for pattern in (_LETTER, _MEASURE):
        found = pattern.search(name)
        if found and is_known(name[: found.start()].split()[-1]):
            return name[: found.start()], "".join(found["mark"].split())
    found = _NUMBER_WORD.search(name)
    if found and is_known(found["word"]):
        return name[: found.end("word")], str(_NUMBERS.index(found["mark"]) + 1)
    return name, ""
