"""Plain technical English over pages, docstrings, comments and messages; links, terms, widths."""

import itertools
import re
from functools import cache
from pathlib import Path

import pytest

from tests.prose import (
    IS_OUT,
    MEAN_WORDS,
    MOST_WORDS,
    count_words,
    drop_code,
    drop_formulas,
    list_comments,
    list_docstring_sentences,
    list_docstrings,
    list_messages,
    list_paragraphs,
    list_sentences,
    list_thoughts,
)

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/**/*.md", "benchmarks/*.md", "notebooks/*.md", "ros/*.md")
    for path in ROOT.glob(pattern)
)
RESULTS = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "results").glob("*.md"))
CODE = ("sgm", "simulator", "datamodules", "nep", "tools", "benchmarks", "docs", "ros")
MOST_WORDS_OF_RESULTS = 25  # in a sentence
WIDTH = 200  # characters of a line of prose; tables are as wide as they are
# Abbreviations that a reader from the field knows; all others are in the glossary or spelled out.
KNOWN = """
    AI API AUROC AVX BEHAVIOR CI CLI CONTRIBUTING CPU CSV CUDA DGL EPYC FIFO GB GCN GELU GPU GRU
    EPIC HAN HD HEAT HGT HMS HOMER HTML HTTP ICML ID ISO JSON JSONL KB LLVM MB MIT ML MLP ONNX OWL
    PNG DINO MCAP NF POSIX RAM README REP REST ROS SECURITY SHA SIGTERM SLAM SQL SVG TB TGB TGM TGN
    TLS TXT URL UTC UTF VS XML YAML
""".split()
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def read(page: str) -> str:
    return (ROOT / page).read_text("utf-8")


def list_page_sentences(page: str) -> list[str]:
    return [s for text in list_paragraphs(read(page)) for s in list_sentences(text)]


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_no_words_that_are_out(page):
    text = re.sub(r"`[^`]*`", "", drop_code(read(page)))
    assert IS_OUT.findall(text) == []


@pytest.mark.parametrize("page", PAGES)
def test_sentences_of_a_page_are_short(page):
    words = {sentence: count_words(sentence) for sentence in list_page_sentences(page)}
    assert [sentence for sentence, number in words.items() if number > MOST_WORDS] == []
    assert not words or sum(words.values()) / len(words) <= MEAN_WORDS


@pytest.mark.parametrize("page", RESULTS)
def test_results_are_told_in_plain_words_and_short_sentences(page):
    """Lists of homes and measures, which follow a colon, are no sentences; nor are formulas."""
    assert IS_OUT.findall(re.sub(r"`[^`]*`", "", drop_code(read(page)))) == []
    told = [sentence.partition(": ")[0] for sentence in list_page_sentences(page)]
    assert [text for text in told if count_words(drop_formulas(text)) > MOST_WORDS_OF_RESULTS] == []


@pytest.mark.parametrize("page", PAGES)
def test_lines_of_a_page_are_not_too_wide(page):
    lines = drop_code(read(page)).split("\n")
    assert [line for line in lines if len(line) > WIDTH and not line.lstrip().startswith("|")] == []


@pytest.mark.parametrize("page", PAGES)
def test_lists_and_tables_begin_after_an_empty_line(page):
    """Else the site shows them as part of the paragraph, or of the table above."""
    lines = drop_code(read(page)).split("\n")
    begins = re.compile(r"(?:[-*] |\d+\. |\|)")
    lost = [
        line
        for before, line in itertools.pairwise(lines)
        if (begins.match(line) and before.strip() and not re.match(r"\s|[-*] |\d+\. |\|", before))
        or (before.lstrip().startswith("|") and re.match(r"\s*(?:[-*] |\d+\. )", line))
    ]
    assert lost == []


def list_anchors(path: Path) -> set[str]:
    """Anchors of a page: its headings in small letters, as site and repository make them."""
    headings = re.findall(r"^#+ (.+)$", drop_code(path.read_text("utf-8")), re.MULTILINE)
    plain = [re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading) for heading in headings]
    return {re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-") for text in plain}


@pytest.mark.parametrize("page", [*PAGES, *RESULTS])
def test_links_lead_somewhere(page):
    broken = []
    for link in LINK.findall(drop_code(read(page))):
        path, _, anchor = link.partition("#")
        if re.match(r"\w+:", path):
            continue
        target = (ROOT / page).parent / path if path else ROOT / page
        is_there = target.exists() and (
            not anchor or target.suffix != ".md" or anchor in list_anchors(target)
        )
        broken += [] if is_there else [link]
    assert broken == []


@pytest.mark.parametrize("page", [*PAGES, *RESULTS])
def test_links_to_pages_carry_a_title(page):
    """Not the name of a file, which says less."""
    assert re.findall(r"\[[\w/]+\.md\]\([^)]*\)", drop_code(read(page))) == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/")])
def test_abbreviations_are_defined(page):
    """In the glossary, on the page itself in brackets, or known in the field."""
    text = re.sub(r"`[^`]*`|\]\([^)]*\)", "", drop_code(read(page)))
    used = set(re.findall(r"\b(?:[A-Z][a-z]?){2,}[A-Z]?\b", text))
    used = {word for word in used if sum(letter.isupper() for letter in word) >= 2}
    spelled = set(re.findall(r"\(([A-Za-z]+)\)|\*\*([A-Z]+)\*\*", text))
    defined = {word for pair in spelled for word in pair} | set(KNOWN)
    defined |= set(re.findall(r"\*\*([A-Z]\w+)\*\*", read("docs/concepts/glossary.md")))
    names = set(re.findall(r"\*\*([A-Z][\w.-]+)", text))
    assert {word for word in used if word.isupper()} - defined - names == set()


def test_the_glossary_has_some_twenty_words_in_one_sense():
    rows = re.findall(
        r"^\| (\*{2,3}.+?\*{2,3}) \| (.+) \|$", read("docs/concepts/glossary.md"), re.M
    )
    words = [word for term, _ in rows for word in term.strip("*").split(", ")]
    assert 20 <= len(words) <= 35
    assert len(set(words)) == len(words)
    pages = " ".join(read(page) for page in PAGES if page != "docs/concepts/glossary.md").lower()
    assert [word for word in words if word.lower() not in pages] == []


@cache
def list_texts(folder: str) -> list[tuple[str, str, bool]]:
    """Docstrings, comments and messages: where, the text, and whether it is a docstring."""
    return [
        (f"{path.relative_to(ROOT)}:{line}", text, texts is list_docstrings)
        for path in sorted((ROOT / folder).rglob("*.py"))
        for source in [path.read_text("utf-8")]
        for texts in (list_docstrings, list_comments, list_messages)
        for line, text in texts(source)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("folder", CODE)
def test_words_that_are_out_are_in_no_docstring_comment_or_message(folder):
    found = []
    for where, text, _ in list_texts(folder):
        found += [f"{where}: {word}" for word in IS_OUT.findall(re.sub(r"`[^`]*`", "", text))]
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize("folder", CODE)
def test_sentences_of_the_code_are_short(folder):
    counts, long = [], []
    for where, text, is_docstring in list_texts(folder):
        for sentence in (list_docstring_sentences if is_docstring else list_thoughts)(text):
            counts.append(count_words(drop_formulas(sentence)))
            if counts[-1] > MOST_WORDS:
                long.append(f"{where}: {sentence}")
    assert long == []
    assert sum(counts) / len(counts) <= MEAN_WORDS


def test_the_reader_of_prose_reads_as_a_person_does():
    page = "# No\n\nOne `a.b` two. Three [four](x.md#y):\n- five\n  six.\n\n| no | no |\n"
    assert list_paragraphs(page) == ["One `a.b` two. Three [four](x.md#y):", "five six."]
    assert list_sentences("One `a.b` two. Three [four](x.md#y).") == ["One X two.", "Three four."]
    assert list_sentences("See e.g. Figure 3. It shows .5 of 2.") == [
        "See e.g Figure 3.",
        "It shows .5 of 2.",
    ]
    assert IS_OUT.findall("It was looked for in vain, and was worth it.") == ["in vain", "worth"]
    source = '# One\n# two.\nraise ValueError("a b", x)\n'
    assert [text for _, text in list_comments(source)] == ["One two."]
    assert [text for _, text in list_messages(source)] == ["a b"]
    assert list_docstring_sentences("Doc one.\n\nArgs:\n    a: of it.\n") == [
        "Doc one.",
        "Args:",
        "a: of it.",
    ]
