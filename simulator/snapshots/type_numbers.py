"""Node and edge types of a snapshot's graph by number, and which of them join which."""

from __future__ import annotations

from sgm.schema import EDGE_TYPES, LAYOUT_EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

# The edge types that enter each node type: the columns of its `degrees`.
ENTERING = {
    ntype: tuple(etype for etype in EDGE_TYPES if etype[2] == ntype) for ntype in NODE_TYPES
}
MAX_ENTERING = max(map(len, ENTERING.values()))
FURNITURE, OBJECT = map(NODE_TYPES.index, ("furniture", "object"))
# The first of the edge types that looks update: those of the layout come before.
FIRST_REMEMBERED_TYPE = len(LAYOUT_EDGE_TYPES)
# The edge types that lead from an object up to furniture, which are neighbours: the query edges are
# among them.
OBJECT_UP = slice(EDGE_TYPES.index(QUERY_EDGE_TYPES[0]), EDGE_TYPES.index(QUERY_EDGE_TYPES[-1]) + 1)
