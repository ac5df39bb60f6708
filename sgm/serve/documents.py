"""OpenAPI, a page for people and one of Markdown, all from the declared calls."""

from __future__ import annotations

import html
import json
from typing import Any

from sgm.finder.answers import STATUSES
from sgm.serve.calls import CALLS, REQUIRED, VERSION, Call

_JSON = "application/json"
_LINE = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}
_ERROR = {"description": "refused, in one line", "content": {_JSON: {"schema": _LINE}}}


def make_openapi() -> dict[str, Any]:
    """Return the OpenAPI document."""
    paths: dict[str, Any] = {}
    for call in CALLS:
        content = {_JSON: {"schema": call.make_output_schema()}}
        answer = {"description": "the answer", "content": content}
        answers = {"200": answer, "4XX": _ERROR, "503": _ERROR}
        body = {"required": True, "content": {_JSON: {"schema": call.make_input_schema()}}}
        post = {"operationId": call.name, "summary": call.about, "responses": answers}
        paths[f"/{VERSION}/{call.name}"] = {"post": {**post, "requestBody": body}}
        if not call.is_write:
            paths[f"/{VERSION}/{call.name}"]["get"] = {
                **post,
                "operationId": f"{call.name}_get",
                "parameters": _list_parameters(call),
            }
    paths[f"/{VERSION}/feed"] = {
        "get": {
            "operationId": "feed",
            "summary": "Server-sent events: a `Happened` for every change from now on.",
            "responses": {"200": {"description": "text/event-stream"}, "4XX": _ERROR},
        }
    }
    statuses = " ".join(f'Status "{name}": {about}.' for name, about in STATUSES.items())
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "Scene graph memory",
            "version": VERSION,
            "description": f"A memory of a home that others can talk to. {statuses}",
        },
        "paths": paths,
    }


def _list_parameters(call: Call) -> list[dict[str, Any]]:
    return [
        {
            "name": argument.name,
            "in": "query",
            "required": argument.default is REQUIRED,
            "description": argument.about,
            "schema": argument.rule.schema,
        }
        for argument in call.arguments
    ]


def describe_rule(schema: Any) -> str:
    """Say in a few words what JSON a schema allows, for tables."""
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(describe_rule(allowed) for allowed in schema["anyOf"]))
    json_type = schema["type"]
    if "enum" in schema:
        return ", ".join(f'"{name}"' for name in schema["enum"])
    if json_type == "array":
        if schema.get("minItems", 1) == schema.get("maxItems"):
            return f"[{', '.join([describe_rule(schema['items'])] * schema['minItems'])}]"
        most = f", {schema['maxItems']} at most" if "maxItems" in schema else ""
        return f"list of {describe_rule(schema['items'])}{most}"
    if json_type == "object":
        return schema.get("title") or "{" + ", ".join(schema["properties"]) + "}"
    if json_type == "string" and "maxLength" in schema:
        return f"text of 1 to {schema['maxLength']}"
    if json_type == "integer" and "minimum" in schema:
        return f"whole number {schema['minimum']} to {schema['maximum']}"
    if json_type == "number" and "maximum" in schema:
        least = schema.get("minimum")
        begin = f"above {schema['exclusiveMinimum']:g}" if least is None else f"{least:g}"
        return f"number {begin} to {schema['maximum']:g}"
    return {"string": "text", "integer": "whole number"}.get(json_type, json_type)


def make_tables() -> str:
    """Return a page of Markdown with the arguments of every call, and the fields of its answer."""
    lines = [
        "# Calls of the server",
        "",
        f"Version `{VERSION}`: fields may be added, none changes or goes.",
        "",
    ]
    shapes: dict[str, Any] = {}
    for call in CALLS:
        lines += [f"### {call.name}", "", call.about, ""]
        how = "`POST`" if call.is_write else "`GET` or `POST`"
        answer = call.make_output_schema()
        _gather(answer, shapes)
        lines += [f"{how} `/{VERSION}/{call.name}`; answers `{answer['title']}`.", ""]
        if call.arguments:
            lines += ["| argument | is | |", "| --- | --- | --- |"]
        for argument in call.arguments:
            rule = describe_rule(argument.rule.schema)
            default = argument.default
            note = " (required)" if default is REQUIRED else ""
            note = note or ("" if default is None else f" ({json.dumps(default)} if left out)")
            lines.append(f"| `{argument.name}` | {rule} | {argument.about}{note} |")
        lines.append("")
    for title, schema in shapes.items():
        lines += [f"### {title}", "", "| field | is | |", "| --- | --- | --- |"]
        for name, field in schema["properties"].items():
            lines.append(f"| `{name}` | {describe_rule(field)} | {field['description']} |")
        lines.append("")
    return "\n".join(lines)


def _gather(schema: Any, found: dict[str, Any]) -> None:
    """Gather all objects of a schema by title, the outer ones first."""
    if schema.get("title"):
        found.setdefault(schema["title"], schema)
    inner = [*schema.get("properties", {}).values(), *schema.get("anyOf", ())]
    for part in [*inner, *([schema["items"]] if "items" in schema else [])]:
        _gather(part, found)


def make_page() -> str:
    """Return the page at /, which runs nothing and loads nothing."""
    rows = []
    for call in CALLS:
        arguments = ", ".join(
            argument.name if argument.default is REQUIRED else f"[{argument.name}]"
            for argument in call.arguments
        )
        rows.append(
            f"<tr><td><code>{call.name}({html.escape(arguments)})</code></td>"
            f"<td>{html.escape(call.about)}</td></tr>"
        )
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Scene graph memory</title>"
        "<style>body{font:16px sans-serif;margin:2em;max-width:60em}td{padding:.3em 1em .3em 0;"
        "vertical-align:top}</style><h1>Scene graph memory</h1>"
        f"<p>Calls under <code>/{VERSION}/</code>, with JSON; schemas in "
        "<a href='/openapi.json'>/openapi.json</a>. Tools of MCP under <code>/mcp</code>, changes "
        f"under <code>/{VERSION}/feed</code>, <a href='/health'>/health</a>, "
        f"<a href='/metrics'>/metrics</a>.</p><table>{''.join(rows)}</table></html>\n"
    )


if __name__ == "__main__":
    print(make_tables())
