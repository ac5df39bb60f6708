"""A new language is made by the page alone: ten words of French."""

import re
import shutil
from pathlib import Path

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.names import sections
from sgm.names.language import Language, list_languages, load_answers
from sgm.names.sections import Sections, load_grammar
from sgm.policies import Adaptive

PAGE = Path(__file__).parents[3] / "docs" / "extend" / "language.md"


@pytest.fixture
def data(tmp_path, monkeypatch):
    """A copy of the folders of languages, which a test may change."""
    folder = tmp_path / "data"
    shutil.copytree(Path(str(sections.DATA)), folder)
    monkeypatch.setattr(sections, "DATA", folder)
    list_languages.cache_clear()
    yield folder
    monkeypatch.undo()
    for load in (list_languages, load_answers):
        load.cache_clear()


def write_french(data: Path) -> Path:
    """Write the two blocks of the page, and the answers of German."""
    names, sentences = re.findall(r"```\w+\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[
        :2
    ]
    folder = data / "fr"
    folder.mkdir()
    (folder / "names.csv").write_text(names, encoding="utf-8")
    (folder / "sentences.txt").write_text(sentences, encoding="utf-8")
    shutil.copy(data / "de" / "answers.txt", folder)
    return folder


def test_the_ten_words_of_the_page_are_a_language(data):
    write_french(data)
    memory = SceneGraphMemory(language="fr")
    kitchen = memory.add_room("kitchen")
    desk = memory.add_furniture("desk", kitchen)
    memory.observe(desk, [Sighting("red mug"), Sighting("blue mug"), Sighting("wallet")])
    service = MemoryService(memory, Finder(Adaptive()), None)
    assert service.where_is("où est la tasse rouge").taken_for == ("red mug",)
    assert service.where_is("le portefeuille et la tasse bleue").also[0].taken_for == ("blue mug",)
    assert service.ask("qu'est-ce qu'il y a sur le bureau ?").kind == "what_at"
    assert service.ask("est-ce que le portefeuille est sur le bureau ?").probability > 0.5
    assert service.ask("où est le portefeuille ?").said.startswith(
        "Der portefeuille ist hier: bureau"
    )
    assert service.ask("où est le zorb ?").status != "ok"


def test_a_section_or_sentence_that_is_missing_is_one_clear_error(data):
    folder = write_french(data)
    text = (folder / "sentences.txt").read_text(encoding="utf-8")
    (folder / "sentences.txt").write_text(text.replace("[questions]", "[fragen]"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"fr/sentences.txt must have the section \[questions\]"):
        Language("fr")
    write = (folder / "sentences.txt").write_text
    write(text, encoding="utf-8")
    answers = (folder / "answers.txt").read_text(encoding="utf-8")
    answers = answers.replace("yes alone = Ja.\n", "")
    (folder / "answers.txt").write_text(answers, encoding="utf-8")
    with pytest.raises(ValueError, match=r"the sentence 'yes alone' in \[ask\], got none"):
        load_answers("fr")


@pytest.mark.parametrize(
    ("text", "section", "error"),
    [
        ("[a]\nx", "b", r"t\.txt must have the section \[b\], got none\."),
        ("x\n[a]", "a", r"t\.txt must begin with a section, got 'x'\."),
        ("[a]\nx", "a", r"a line of \[a\] must be a pair, got 'x' in t\.txt\."),
    ],
)
def test_faults_of_a_file_say_what_to_do(text, section, error):
    with pytest.raises(ValueError, match=error):
        Sections(text, "t.txt").read_pairs(section)


def test_how_names_are_built_is_told_on_the_page():
    page = PAGE.read_text(encoding="utf-8")
    assert [name for name in load_grammar().section_names if f"`{name}`" not in page] == []
