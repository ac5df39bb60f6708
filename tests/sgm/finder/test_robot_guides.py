"""docs/robot.md and docs/robot/ are short, and name every field of every answer."""

import re
from dataclasses import fields

import pytest

from sgm.belief import Detector
from sgm.evidence.elsewhere import ELSEWHERE
from sgm.finder.ranking import Place, Ranking
from sgm.finder.search_plan import EXACT_PLACES, Look, SearchPlan
from sgm.memory.noticed_changes import ThingChange, ThingEvent
from sgm.memory.sighting import SeenAt, Sighting
from tests.guides import DOCS, list_blocks

GUIDES = [DOCS / "robot.md", *sorted((DOCS / "robot").glob("*.md"))]
TEXTS = {guide.stem: guide.read_text("utf-8") for guide in GUIDES}


@pytest.mark.parametrize("guide", TEXTS)
def test_a_guide_is_short_and_shows_code(guide):
    prose = re.sub(r"^```.*?^```", "", TEXTS[guide], flags=re.MULTILINE | re.DOTALL)
    num_words = len(prose.split())
    assert 300 <= num_words <= 1200
    assert num_words / TEXTS[guide].count("```python") <= 240


def test_the_main_loop_has_some_sixty_lines():
    first = list_blocks(TEXTS["robot"])[0]
    assert first.saved == "main_loop.py"
    assert len([line for line in first.text.splitlines() if line]) <= 60


@pytest.mark.parametrize(
    "answer",
    [Sighting, SeenAt, Place, Ranking, Look, SearchPlan, Detector, ThingChange, ThingEvent],
)
def test_every_field_is_named(answer):
    guides = "".join(TEXTS.values())
    hidden = {"description", "places", "looks"}  # what they hold is said, not their names
    missing = [field.name for field in fields(answer) if f"`{field.name}`" not in guides]
    missing = [name for name in missing if not re.search(rf"\b{name}=|\.{name}\b", guides)]
    assert set(missing) <= hidden


def test_numbers_of_the_guides():
    assert EXACT_PLACES == 12
    assert "up to twelve looks" in TEXTS["search"]
    assert ELSEWHERE == 0.1
    assert "one in ten" in TEXTS["leaving"]
