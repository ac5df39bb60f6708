"""Pages of tables, from what the code declares: calls, columns of a memory, features."""

from __future__ import annotations

from datamodules.feature_config import FEATURES
from sgm.evidence.columns import COLUMNS_OF_PLACES, COLUMNS_OF_QUESTIONS, UNITS
from sgm.memory.moments import COLUMNS
from sgm.schema import HOME, TABLES
from sgm.serve.documents import make_tables


def make_table_pages() -> dict[str, str]:
    """Return the text of each page by its path in the site."""
    return {
        "reference/calls.md": make_tables(),
        "reference/columns.md": list_columns(),
        "reference/evidence.md": list_evidence(),
        "reference/features.md": list_features(),
    }


def list_columns() -> str:
    """List the columns of a memory, which a memory file has in its snapshots."""
    lines = ["# Columns of a memory", "", "| table | column | is |", "| --- | --- | --- |"]
    lines += [
        f"| `{table}` | `{column.name}` | {column.text} |"
        for table, columns in {**TABLES, "home": HOME}.items()
        for column in columns
        if not column.is_derived
    ]
    lines += [f"| `moments` | `{name}` | {text} |" for name, text in COLUMNS.items()]
    return "\n".join([*lines, ""])


def list_features() -> str:
    """List what a batch holds of nodes, edges, places and questions."""
    lines = ["# Features", "", "| feature | of | columns | switch |", "| --- | --- | ---: | --- |"]
    lines += [
        f"| {feature.name} | {feature.of} | {feature.width} | `features.{feature.group}` |"
        for feature in FEATURES
    ]
    return "\n".join([*lines, ""])


def list_evidence() -> str:
    """List the columns of evidence, which the network for any home reads."""
    lines = ["# Columns of evidence", "", "| unit | is |", "| --- | --- |"]
    lines += [f"| {unit} | {text} |" for unit, text in UNITS.items()]
    for title, columns in (("place", COLUMNS_OF_PLACES), ("question", COLUMNS_OF_QUESTIONS)):
        lines += ["", f"## Of a {title}", "", "| column | unit | is |", "| --- | --- | --- |"]
        lines += [f"| `{c.group}.{c.name}` | {c.unit} | {c.text} |" for c in columns]
    return "\n".join([*lines, ""])
