"""How often a question is taken for what was meant: `python -m tools.names`.

Two tables: pairs of our own, and, with `--labels_too`, the labels of public lists asked in memories
of other lists. The pairs are `tools/names/data/name_pairs.json`: what a detector named in a home, a
question, and the descriptions that it means, none where nothing of that name was seen.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import write_whole
from sgm.names.aliases import AliasTable
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_index import NameIndex
from sgm.names.name_matching import SYNONYM, Similarity
from sgm.names.resolution import Resolution
from sgm.text.vectors import compare
from tools.names.label_lists import ASKED_LAST, load_lists
from tools.names.labels import OUTCOMES as LABEL_OUTCOMES
from tools.names.labels import ask_labels
from tools.names.labels import count_outcomes as count_labels

PARTS = ("tuning", "report", "spoken", "fresh")
MOST = 3  # matches among which a right one counts
OUTCOMES = ("right", "among three", "among more", "in part", "offered", "lost", "wrong")
THRESHOLDS = (0.8, 0.85, 0.9, 0.95)
_WIDTH = 512  # of the vectors of letters


def load_homes() -> list[dict[str, Any]]:
    """Load the homes with their pairs: `name`, `part`, `seen`, `pairs` of question and answers."""
    path = Path(__file__).parent / "data" / "name_pairs.json"
    homes: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["homes"]
    return homes


def judge(resolution: Resolution, right: Collection[str]) -> str:
    """Return the outcome of a question, one of `OUTCOMES`.

    "right": exactly what is meant; "among three": all of it, among at most three; "in part": some
    of what is meant is missing; "offered": nothing was found, and it is among the offers; "wrong":
    something was found, and nothing of it is meant.
    """
    found, meant = set(resolution.matches), set(right)
    if found == meant:
        return "right"
    if found and not found & meant:
        return "wrong"
    if not found:
        offered = {*resolution.doubtful, *resolution.alternatives}
        return "offered" if meant & offered else "lost"
    if not meant <= found:
        return "in part"
    return "among three" if len(found) <= MOST else "among more"


def count_outcomes(
    part: str,
    table: AliasTable | None,
    encoder: NameEncoder | None = None,
    similarity: Similarity | None = None,
) -> Counter[str]:
    """Ask all questions of a part, and count the outcomes."""
    counts: Counter[str] = Counter()
    for home in load_homes():
        if home["part"] == part:
            index = NameIndex((), table, encoder)
            index.update(home["seen"])
            for question, *right in home["pairs"]:
                counts[judge(index.resolve(question, similarity), right)] += 1
    return counts


def encode_letters(names: Sequence[str]) -> np.ndarray:
    """Return counts of three letters in a row, hashed: a simple encoder, in place of one's own."""
    vectors = np.zeros((len(names), _WIDTH))
    for number, name in enumerate(names):
        text = f"  {name} "
        for start in range(len(text) - 2):
            vectors[number, zlib.crc32(text[start : start + 3].encode()) % _WIDTH] += 1
    return vectors


def make_report() -> str:
    """Make the tables of results/names.md."""
    table = AliasTable.household()
    rows = []
    for part in PARTS:
        for way, values in (
            ("grammar alone", count_outcomes(part, None)),
            ("grammar and aliases", count_outcomes(part, table)),
            ("and shipped text vectors", count_outcomes(part, table, similarity=_compare)),
            ("and an encoder of letters", count_outcomes(part, table, _make_encoder(table))),
        ):
            rows.append(_make_row(part, way, values))
    thresholds = []
    for part in PARTS[:2]:
        for least in THRESHOLDS:
            values = count_outcomes(part, None, similarity=_shift(least))
            thresholds.append(_make_row(part, f"{least:.2f}", values))
    head = " | ".join(["part", "names by", "pairs", *OUTCOMES, "right or among three"])
    line = " | ".join(["---", "---", *["---:"] * (len(OUTCOMES) + 2)])
    return "\n".join(
        [
            f"| {head} |",
            f"| {line} |",
            *rows,
            "",
            "Text vectors without the table of aliases:",
            "",
            f"| {head.replace('names by', 'cosine of')} |",
            f"| {line} |",
            *thresholds,
            "",
        ]
    )


def make_labels_report(files: Mapping[str, Path]) -> str:
    """Make the table of public labels: every list asked in memories of every other one."""
    lists = load_lists(files)
    head = " | ".join(["half", "asked", "names asked", *LABEL_OUTCOMES])
    lines = [f"| {head} |", f"| --- | --- | ---: {'| ---: ' * len(LABEL_OUTCOMES)}|"]
    known = [label_list for label_list in lists if label_list.name != ASKED_LAST]
    last = [label_list for label_list in lists if label_list.name == ASKED_LAST]
    for half, use, all_asked in (
        (0, "tuned on", known),
        (1, "reported", known),
        (None, "asked last", last),
    ):
        total: Counter[str] = Counter()
        for asked in all_asked:
            counts: Counter[str] = Counter()
            for seen in known:
                if seen is not asked:
                    counts += count_labels(list(ask_labels(asked, seen, half)))
            total += counts
            lines.append(_make_labels_row(use, asked.name, counts))
        if len(all_asked) > 1:
            lines.append(_make_labels_row(use, "all", total))
    return "\n".join([*lines, ""])


def _make_labels_row(half: str, name: str, counts: Counter[str]) -> str:
    total = max(sum(counts.values()), 1)
    shares = [f"{counts[outcome] / total:.2%}" for outcome in LABEL_OUTCOMES]
    return f"| {' | '.join([half, name, f'{sum(counts.values()):,}', *shares])} |"


def _read_labels(text: str) -> tuple[str, Path]:
    name, _, path = text.partition("=")
    if not name or not Path(path).is_file():
        raise argparse.ArgumentTypeError(f"labels must be NAME=FILE of a file, got {text!r}.")
    return name, Path(path)


def _make_encoder(table: AliasTable) -> NameEncoder:
    return NameEncoder(encode_letters, table)


def _compare(name: str, others: Sequence[str]) -> list[float]:
    values: list[float] = compare([name], list(others))[0].tolist()
    return values


def _shift(least: float) -> Similarity:
    """Return the similarity by which a cosine of `least` is just enough."""
    return lambda name, others: [value + SYNONYM - least for value in _compare(name, others)]


def _make_row(part: str, way: str, counts: Counter[str]) -> str:
    total = sum(counts.values())
    shares = [f"{counts[outcome] / total:.1%}" for outcome in OUTCOMES]
    good = (counts["right"] + counts["among three"]) / total
    return f"| {' | '.join([part, way, str(total), *shares, f'{good:.1%}'])} |"


def main(args: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="tools.names", description=__doc__)
    parser.add_argument("--out", type=Path, help="also write them to a file")
    parser.add_argument("--labels_too", action="store_true", help="ask for public labels, too")
    parser.add_argument(
        "--labels",
        metavar="NAME=FILE",
        type=_read_labels,
        action="append",
        default=[],
        help="a list of labels, one a line or YAML with `names`",
    )
    options = parser.parse_args(args)
    report = make_report()
    if options.labels_too or options.labels:
        report += "\nPublic labels:\n\n" + make_labels_report(dict(options.labels))
    print(report)
    if options.out is not None:
        write_whole(options.out, report.encode())


if __name__ == "__main__":
    main()
