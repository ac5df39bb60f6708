"""English words that are no typing errors: `python -m tools.names.english_words FOLDER`.

Of WordNet (https://wordnet.princeton.edu), whose `dict` folder has `index.sense`: the words that
its texts have, and those that are one slip from a word of the table of names. They are written to
`sgm/names/data/en/wordnet.txt`, as they are compared (`spell`), with WordNet's licence before them.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import sgm.names
from sgm.files import write_whole
from sgm.names.aliases import AliasTable
from sgm.names.modifiers import spell
from sgm.names.spelling import is_typo

_SHORTEST = 5  # letters of a word that is read as a typing error
_WIDTH = 100


def list_words(senses: Path, household: frozenset[str]) -> list[str]:
    """List words of WordNet that its texts have, or that are one slip from a household word.

    Raises:
        ValueError: if the file has another format.
    """
    counts: dict[str, int] = {}
    for number, line in enumerate(senses.read_text(encoding="ascii").splitlines(), 1):
        cells = line.split()
        if len(cells) != 4 or "%" not in cells[0] or not cells[3].isdecimal():
            raise ValueError(
                f"index.sense must have a key and three numbers a line, got line {number} of "
                f"{senses}. Give the dict folder of WordNet 3."
            )
        word = cells[0].partition("%")[0]
        if word.isalpha():
            counts[word] = counts.get(word, 0) + int(cells[3])
    by_first: dict[str, list[str]] = {}
    for word in household:
        by_first.setdefault(word[0], []).append(word)
    return sorted(
        {
            spell(word)
            for word, count in counts.items()
            if count or (len(word) >= _SHORTEST and _is_near(word, by_first))
        }
    )


def _is_near(word: str, by_first: dict[str, list[str]]) -> bool:
    return any(is_typo(word, other) for other in by_first.get(word[0], ()))


def write_lines(words: list[str]) -> Iterator[str]:
    """Write words, as many in a line as have room."""
    line = ""
    for word in words:
        if len(line) + len(word) >= _WIDTH:
            yield line
            line = ""
        line = f"{line} {word}".lstrip()
    yield line


def main(args: Sequence[str] | None = None) -> None:
    """Write the words."""
    parser = argparse.ArgumentParser(prog="tools.names.english_words", description=__doc__)
    parser.add_argument("folder", type=Path, help="dict folder of WordNet, with index.sense")
    parser.add_argument("licence", type=Path, help="WordNet's licence, which goes with the words")
    options = parser.parse_args(args)
    household = frozenset(
        word for word in AliasTable.household().words if len(word) >= _SHORTEST - 1
    )
    words = list_words(options.folder / "index.sense", household)
    notice = [f"# {line.strip()}".rstrip() for line in options.licence.read_text().splitlines()]
    text = "\n".join([*notice, *write_lines(words), ""])
    to = Path(sgm.names.__path__[0]) / "data" / "en" / "wordnet.txt"
    write_whole(to, text.encode())
    print(f"{len(words)} words in {to.name}")


if __name__ == "__main__":
    main()
