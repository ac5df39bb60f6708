"""Concepts have a picture and an equation; the page of formats says what the schema says."""

import pytest

from sgm.schema import HOME, TABLES
from tests.guides import DOCS, read_page

CONCEPTS = ("memory", "belief", "questions", "priors", "time")


@pytest.mark.parametrize("concept", CONCEPTS)
def test_a_concept_has_one_picture_and_one_equation(concept):
    text = read_page(f"concepts/{concept}.md")
    assert text.count("![") == 1
    assert text.count("\n$$\n") == 2  # before and after
    assert (DOCS / "images" / f"concept-{concept}.png").is_file()


def test_the_formats_say_of_every_column_of_a_memory_file_what_the_schema_says():
    text = read_page("reference/files.md")
    rows = [
        f"| `{table}` | `{column.name}` | {column.text} |"
        for table, columns in {**TABLES, "home": HOME}.items()
        for column in columns
        if not column.is_derived
    ]
    assert "\n".join(["| table | column | is |", "| --- | --- | --- |", *rows, ""]) in text
