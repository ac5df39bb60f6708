"""The words of a name, without what people say around it, and their singular."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

_APOSTROPHE = "['\u2019]"
_WORD = re.compile(rf"[^\W_]+(?:{_APOSTROPHE}[^\W_]+)*{_APOSTROPHE}?")
_POSSESSIVE = re.compile(rf"(?:{_APOSTROPHE}s|(?<=s){_APOSTROPHE})$")
DETERMINERS = frozenset(
    "a an the my your his her its our their this that these those some any one another all both "
    "of".split()
)

_WHO = r"(?:i|we|you|he|she|they|it|someone|somebody|anyone|anybody|my \w+|[^\W\d_]+)"
_DID = r"(?:put|place|leave|left|keep|kept|see|seen|saw|store|drop|lay|lose|lost|have|go|gone|been)"
_BEFORE = re.compile(
    r"^(?:"
    r"(?:hey|hi|hello|ok|okay|please|sorry|excuse me|well|so|and|um|robot|now)\b"
    r"|(?:can|could|would|will) (?:you|u|we|i|somebody|someone|anybody|anyone)\b(?: (?:please|just|"
    r"maybe|kindly|quickly))?"
    r"|(?:do|does|did) (?:you|we|anyone|anybody|someone) (?:happen to )?"
    r"(?:know|remember|see|have)\b"
    r"|(?:have|has) (?:you|we|anyone|anybody|someone|somebody) (?:seen|got|found|taken|moved)\b"
    r"|(?:any|have you an|no) idea\b|i wonder\b|(?:tell|show) (?:me|us)\b"
    r"|(?:i am|i[\u2019']m|im|we are|we[\u2019']re) (?:looking|searching|hunting) for\b"
    r"|(?:i am|i[\u2019']m|im|we are|we[\u2019']re) missing\b|(?:looking|searching) for\b"
    r"|(?:i|we) (?:really )?(?:need|want|lost|have lost|misplaced|miss|can[\u2019']?t find|cannot "
    r"find|would like|[\u2019']?d like|have to find|must find)\b|i[\u2019']d like\b"
    r"|help (?:me|us)\b(?: to)?|(?:go (?:and )?)?(?:find|fetch|get|bring|grab|pass|hand|give|"
    r"look for|search for|search|locate)\b(?: me\b| us\b| him\b| her\b)?"
    r"|in which (?:room|drawer|place)\b|which (?:room|drawer|place)\b"
    r"|(?:where|wher)(?: (?:did|do|does|have|has|had|could|might|can|should)"
    rf" {_WHO} (?:last )?{_DID}\b)(?: (?:put|seen|left))?"
    r"|where(?: (?:on earth|the hell|exactly|again))?(?:[\u2019']?s| is| are| was| were|[\u2019']re"
    r"| did| do| does| have| has| had| can| could| might| would| should)\b"
    r"(?: (?:i|we) (?:find|get)\b)?"
    r"|where\b|what happened to\b|who (?:has|took|moved|used)\b|is|are|there"
    r")[\s,:!]+"
)
_AFTER = re.compile(
    r"[\s,]+(?:please|pls|thanks|thank you|thx|cheers|robot|now|again|today|right now|gone|at|be|"
    r"is|are|was|were|located|kept|stored|hiding|hidden|go|gone to|went|got to|anywhere|somewhere|"
    r"here|around|for me|for us|to me|last|then|currently|anymore|any more|i wonder|usually|left|"
    r"at home|in the house|in here)$"
)
# What follows says what was done with it: "the mug that I used", "the book I am reading".
_CLAUSE = re.compile(
    r"\s(?:that|which|who|(?:i|we|you|he|she|they)(?:[\u2019'](?:m|ve|re|d|s|ll))?)\s(?=\S).*$"
)


def strip_question(question: str) -> str:
    """Return what a question is about: "could you find my keys, please?" is about "my keys"."""
    text = " ".join(question.casefold().replace("_", " ").split()).strip(" ?!.,;:")
    before = None
    while before != text:
        before = text
        for shorter in (_BEFORE.sub("", text, count=1), _AFTER.sub("", text)):
            text = shorter.strip(" ?!.,;:") if len(shorter) < len(text) and shorter else text
    return _CLAUSE.sub("", text).strip() or text


def split_words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case, possessives without their ending.

    Determiners at its beginning are left out, and hyphens part words.
    """
    return tuple(word for word, _ in split_possessives(name))


def split_possessives(name: str) -> list[tuple[str, bool]]:
    """Return the words as `split_words` does, and whether each of them is a possessive."""
    found = _WORD.findall(name.casefold().replace("_", " "))
    words = [(_POSSESSIVE.sub("", word), bool(_POSSESSIVE.search(word))) for word in found]
    start = 0
    while start < len(words) - 1 and words[start][0] in DETERMINERS:
        start += 1
    return words[start:] or [(name.casefold().strip(), False)]


def make_key(words: Sequence[str]) -> str:
    """Return what names are compared by: words written together, the last one in the singular."""
    return "".join([*words[:-1], compute_singular(words[-1])])


@lru_cache(maxsize=10_000)
def compute_singular(word: str) -> str:
    """Return an English word without the ending of its plural; both sides are compared by it."""
    for ending, instead in (("ies", "y"), ("ves", "f"), ("sses", "ss"), ("xes", "x")):
        if word.endswith(ending) and len(word) > len(ending) + 1:
            return word[: -len(ending)] + instead
    if word.endswith("fe") and len(word) > 3:  # knife and knives
        return word[:-1]
    if word.endswith(("ches", "shes")):
        return word[:-2]
    if word.endswith("s") and not word.endswith(("ss", "us", "is")) and len(word) > 3:
        return word[:-1]
    return word
