"""A line of a refusal names what a client of HTTP and of MCP has, and nothing of Python."""

import json
import re

import pytest

from sgm.serve.calls import CALLS

from .test_calls import GOOD

BAD = [
    None, 77, -1, 10**30, 1.5, True, "", "zzz", "the zzz in the attic", "x" * 500, "2999-01-01",
    [], ["zzz"], [1e300, 0], {}, {"thing": 3},
]  # fmt: skip
# Words that may name a function, a method or a class; and paths of HTTP.
NAMES = re.compile(r"[A-Za-z]\w*[._]\w+|\b\w+(?=\()|\b[A-Z][a-z]+[A-Z]\w+|(?<![\w<])/[a-z]\w+")


def list_words(schema):
    """All words that a schema has: names of arguments and of their parts, and values."""
    found = set()
    if isinstance(schema, dict):
        found |= {*schema.get("properties", {}), *map(str, schema.get("enum", ()))}
        schema = list(schema.values())
    if isinstance(schema, list):
        found |= {word for part in schema for word in list_words(part)}
    return found


@pytest.mark.slow
def test_a_refusal_names_calls_and_arguments_alone(served):
    known = {call.name for call in CALLS}
    for call in CALLS:
        known |= list_words(call.make_input_schema())
    lines = set()
    for name, good in GOOD.items():
        given = [{**good, key: bad} for key in good for bad in BAD]
        given += [{other: good[other] for other in good if other != key} for key in good]
        for arguments in (*given, {**good, "zzz": 1}):
            answer = served.client.send("POST", f"/v1/{name}", json.dumps(arguments))
            assert answer.status < 500, (name, arguments)
            if answer.status >= 400:
                lines.add(json.loads(answer.text)["error"])
    assert len(lines) > 500  # those of MCP are the same: test_tools.py
    strange = {line: words for line in lines if (words := {*NAMES.findall(line)} - known)}
    assert strange == {}
