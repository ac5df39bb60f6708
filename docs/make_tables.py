"""Pages of tables, from what the code declares: calls, columns of a memory, features."""

from __future__ import annotations

from datamodules.feature_config import FEATURES
from sgm.memory.moments import COLUMNS
from sgm.schema import HOME, TABLES
from sgm.serve.documents import make_tables


def make_table_pages() -> dict[str, str]:
    """Return the text of each page by its path in the site."""
    return {
        "reference/calls.md": make_tables(),
        "reference/columns.md": list_columns(),
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
