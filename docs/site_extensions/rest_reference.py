"""The REST reference, written from docs/openapi.json when the site is built."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

OPENAPI = Path(__file__).parents[1] / "openapi.json"
PLACE = "<!-- rest-reference -->"
PAGE = "reference/rest"
_BOUNDS = {
    "minimum": "≥ {}",
    "exclusiveMinimum": "> {}",
    "maximum": "≤ {}",
    "exclusiveMaximum": "< {}",
    "minItems": "at least {} items",
    "maxItems": "at most {} items",
    "minLength": "at least {} characters",
    "maxLength": "at most {} characters",
    "pattern": "matches `{}`",
}


def reference(document: dict[str, Any]) -> str:
    """Markdown of all calls by tag, of the refusals they share, and of every schema.

    Parameters
    ----------
    document
        OpenAPI 3.1.
    """
    calls: dict[str, list[str]] = {}
    shared = _shared_refusals(document)
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            tag = operation.get("tags", ["other"])[0]
            calls.setdefault(tag, []).append(_call(method.upper(), path, operation, shared))
    out = [f"Version {document['info']['version']} of the contract.\n", _contents(document)]
    out += ["## Refusals\n", "Every refusal is a problem document, {ref}`schema-ProblemDocument`.\n"]
    out.append(_table(("status", "when"), [(status, text) for status, text in sorted(shared.items())]))
    for tag, texts in calls.items():
        out += [f"## {tag.capitalize()}\n", *texts]
    out.append("## Schemas\n")
    out += [_schema(name, schema) for name, schema in sorted(document["components"]["schemas"].items())]
    return "\n".join(out)


def _contents(document: dict[str, Any]) -> str:
    rows = [
        (
            f"[`{method.upper()} {path}`](#{_anchor(method, path)})",
            operation.get("description", "").split("\n")[0],
        )
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
    return _table(("call", ""), rows)


def _shared_refusals(document: dict[str, Any]) -> dict[str, str]:
    """What each status of 400 and above means in most calls."""
    said: dict[str, Counter[str]] = {}
    for methods in document["paths"].values():
        for operation in methods.values():
            for status, answer in operation["responses"].items():
                if status >= "400":
                    said.setdefault(status, Counter())[answer["description"]] += 1
    return {status: count.most_common(1)[0][0] for status, count in said.items()}


def _anchor(method: str, path: str) -> str:
    words = path.strip("/").replace("/", "-").replace("{", "").replace("}", "").replace(".", "-")
    return f"rest-{method.lower()}-{words}".replace("_", "-")


def _call(method: str, path: str, operation: dict[str, Any], shared: dict[str, str]) -> str:
    out = [f"({_anchor(method, path)})=\n### `{method} {path}`\n", operation.get("description", ""), ""]
    parameters = [
        (
            f"`{p['name']}`",
            p["in"],
            _type(p["schema"]),
            "yes" if p.get("required") else "",
            _said(p, p["schema"]),
        )
        for p in operation.get("parameters", ())
    ]
    if parameters:
        out.append(_table(("parameter", "in", "type", "required", ""), parameters))
    body = operation.get("requestBody")
    if body:
        out += ["Body:\n", _forms(body["content"]), *_example(body["content"])]
    rows, others = [], []
    for status, answer in operation["responses"].items():
        if answer["description"] == shared.get(status):
            others.append(status)
        else:
            rows.append((status, answer["description"], _forms_in_a_cell(answer.get("content", {}))))
    out.append(_table(("answer", "", "form"), rows))
    if others:
        out.append(f"May be refused with {', '.join(others)}.\n")
    return "\n".join(out)


def _forms(content: dict[str, Any]) -> str:
    return "\n".join(f"- `{form}`: {_form(part)}" for form, part in content.items()) + "\n"


def _form(part: dict[str, Any]) -> str:
    schema = part.get("schema", {})
    return ". ".join(said for said in (_type(schema), schema.get("description", "")) if said) or "any"


def _forms_in_a_cell(content: dict[str, Any]) -> str:
    return ", ".join(f"`{form}` {_type(part.get('schema', {}))}".strip() for form, part in content.items())


def _example(content: dict[str, Any]) -> list[str]:
    example = content.get("application/json", {}).get("example")
    if example is None:
        return []
    text = json.dumps(example, ensure_ascii=False)
    if len(text) > 2000:  # a whole blade file: its own page shows one
        return []
    return [f"```json\n{_folded(example)}\n```\n"]


def _folded(value: Any, indent: int = 0, width: int = 88) -> str:
    """JSON with short lists and objects on one line."""
    flat = json.dumps(value, ensure_ascii=False)
    if len(flat) + indent <= width or not isinstance(value, dict | list):
        return flat
    pad, step = " " * indent, " " * (indent + 2)
    if isinstance(value, list):
        inner = ",\n".join(step + _folded(item, indent + 2, width) for item in value)
        return f"[\n{inner}\n{pad}]"
    inner = ",\n".join(
        f"{step}{json.dumps(key)}: {_folded(item, indent + 2, width)}" for key, item in value.items()
    )
    return f"{{\n{inner}\n{pad}}}"


def _schema(name: str, schema: dict[str, Any]) -> str:
    out = [f"(schema-{name})=\n### {name}\n", _before_sections(schema.get("description", "")), ""]
    if "properties" in schema:
        required = set(schema.get("required", ()))
        rows = [
            (f"`{field}`", _type(part), "yes" if field in required else "", _said(part, part))
            for field, part in schema["properties"].items()
        ]
        out.append(_table(("field", "type", "required", ""), rows))
    else:
        out.append(_type(schema) + "\n")
    return "\n".join(out)


def _before_sections(text: str) -> str:
    """A docstring up to its parameters, which the table of fields has."""
    return re.split(r"\n[A-Z]\w+\n---", text)[0]


def _type(schema: dict[str, Any]) -> str:
    """A type in words, with links to schemas."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#schema-{name})"
    for choice in ("anyOf", "oneOf", "allOf"):
        if choice in schema:
            return " or ".join(dict.fromkeys(_type(part) for part in schema[choice]))
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    kind = schema.get("type", "")
    if kind == "array":
        items = schema.get("items", {})
        return f"array of {_type(items)}" if items else "array"
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return f"object of {_type(schema['additionalProperties'])}"
    return "binary" if schema.get("format") == "binary" else str(kind)


def _said(part: dict[str, Any], schema: dict[str, Any]) -> str:
    """Description, bounds and default."""
    bounds = [text.format(schema[key]) for key, text in _BOUNDS.items() if key in schema]
    if schema.get("default") is not None:
        bounds.append(f"default `{json.dumps(schema['default'], ensure_ascii=False)}`")
    text = part.get("description") or schema.get("description") or ""
    return f"{text} ({', '.join(bounds)})".strip() if bounds else text


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    def line(cells: tuple[str, ...]) -> str:
        return "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"

    return "\n".join([line(head), "|" + "---|" * len(head), *(line(row) for row in rows), ""])


def _write(app: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        app.env.note_dependency(OPENAPI)
        source[0] = source[0].replace(PLACE, reference(json.loads(OPENAPI.read_text(encoding="utf-8"))))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
