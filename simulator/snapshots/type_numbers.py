"""Node and edge types of a snapshot's graph by number, and which of them join which."""

from __future__ import annotations

from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

# The edge types that enter each node type: the columns of its `degrees`.
ENTERING = {
    ntype: tuple(etype for etype in EDGE_TYPES if etype[2] == ntype) for ntype in NODE_TYPES
}
MAX_ENTERING = max(map(len, ENTERING.values()))
HOUSE, FLOOR, ROOM, FURNITURE, OBJECT = range(len(NODE_TYPES))
# The first of the edge types that join objects.
FIRST_OBJECT_TYPE = next(number for number, etype in enumerate(EDGE_TYPES) if "object" in etype)
# The edge types that lead from an object up to furniture, which are neighbours: the query edges are
# among them.
OBJECT_UP = slice(EDGE_TYPES.index(QUERY_EDGE_TYPES[0]), EDGE_TYPES.index(QUERY_EDGE_TYPES[-1]) + 1)
