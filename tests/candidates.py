"""The places that query edges lead to."""


def list_candidates(memory, queries):
    """Mark the remembered and the hypothetical edges of queries, bool (Q, F, relations)."""
    found = memory.propose_places(queries)
    query, edge = memory.edges_of(queries)
    found[query, memory.edges["furniture"][edge], memory.edges["relation"][edge]] = True
    return found
