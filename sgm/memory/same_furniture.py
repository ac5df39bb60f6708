"""Furniture nodes that are one: what was seen at either was seen at the one that stays."""

from __future__ import annotations

import numpy as np

from sgm.memory.merged_rows import Groups, group_places, merge_rows
from sgm.memory.written_tables import Tables, list_written


def merge_places(tables: Tables, kept_place: int, gone_place: int) -> tuple[Tables, Groups]:
    """Return tables in which all of one furniture node is of another, by position.

    The row of the furniture itself stays, of which nothing else speaks any longer.

    Returns:
        The tables, and which edges became one.
    """
    merged, of_edges = {}, Groups(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    for table, before in tables.items():
        columns = {name: values.copy() for name, values in before.items()}
        declared = list_written(table)
        for column in declared:
            if column.refers_to == "furniture":
                values = columns[column.name]
                values[values == gone_place] = kept_place
                if table != "furniture" and column.name != "furniture" and "furniture" in columns:
                    values[(values == kept_place) & (columns["furniture"] == kept_place)] = (
                        column.default
                    )
        if table == "furniture":
            num_rows = len(columns[declared[0].name])
            group = np.arange(num_rows)
            group[gone_place] = kept_place
            kept, of_row = np.unique(group, return_inverse=True)
            for name, values in merge_rows(declared, before, Groups(of_row, kept)).items():
                columns[name][kept] = values
        elif "furniture" in columns:
            groups = group_places(columns, before["furniture"] != gone_place)
            columns = merge_rows(declared, columns, groups)
            of_edges = groups if table == "edges" else of_edges
        merged[table] = columns
    return merged, of_edges
