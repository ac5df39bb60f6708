"""docs/events.md names every rule, file and column."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "events.md").read_text("utf-8")


def test_the_page_names_every_rule():
    from simulator.policies.registry import EVENT_RULES

    rows = [line.split("`")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    assert [*EVENT_RULES] == rows[-len(EVENT_RULES) :]


def test_the_table_names_every_file_and_column():
    from dataclasses import fields

    from simulator.events.files import EVENTS, MANIFEST, NODES, QUESTIONS
    from simulator.events.table import EventQuestions, Events, Nodes

    for name in (EVENTS, NODES, QUESTIONS, MANIFEST):
        assert f"| `{name}` |" in PAGE
    rows = {line.split("`")[1]: line for line in PAGE.splitlines() if line.startswith("| `")}
    for name, columns in ((EVENTS, Events), (NODES, Nodes), (QUESTIONS, EventQuestions)):
        for column in fields(columns):
            assert f"`{column.name}`" in rows[name], (name, column.name)
