"""Nothing of the contract or of the command line is missing in the references."""

from __future__ import annotations

import importlib
import json
import os
import re
import sys
from html import unescape
from pathlib import Path

import pytest
import typer

from service.cli import app

DOCS = Path(__file__).parents[2] / "docs"
CONTRACT = json.loads((DOCS / "openapi.json").read_text(encoding="utf-8"))


def text_of(page: Path) -> str:
    """What is read on a page."""
    text = re.sub(r"<(script|style).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]+>", "", text)).split())


def test_every_call_is_in_the_reference_with_its_body_and_its_answers(site):
    page = (site / "reference" / "rest.html").read_text(encoding="utf-8")
    said = text_of(site / "reference" / "rest.html")
    for path, methods in CONTRACT["paths"].items():
        for method, operation in methods.items():
            assert f"{method.upper()} {path}" in said
            first = operation.get("description", "").split("\n")[0].replace("`", "")
            assert " ".join(first.split()) in said
            for content in [operation.get("requestBody", {}), *operation["responses"].values()]:
                for part in content.get("content", {}).values():
                    if "$ref" in part.get("schema", {}):
                        assert (
                            f'href="#schema-{part["schema"]["$ref"].rsplit("/", 1)[1]}"'.lower()
                            in page.lower()
                        )


def test_every_field_of_every_schema_is_in_the_reference(site):
    said = text_of(site / "reference" / "rest.html")
    for schema in CONTRACT["components"]["schemas"].values():
        for field, part in schema.get("properties", {}).items():
            assert field in said
            description = " ".join(part.get("description", "").replace("`", "").split())
            assert description in said


def commands(group, path="rubscreen"):
    for name, command in group.commands.items():
        yield f"{path} {name}", command
        if hasattr(command, "commands"):
            yield from commands(command, f"{path} {name}")


def test_every_command_is_in_the_reference_with_its_options(site):
    said = text_of(site / "reference" / "command-line.html")
    for name, command in commands(typer.main.get_command(app)):
        assert name in said
        for parameter in command.params:
            if not getattr(parameter, "hidden", False):
                assert all(option in said for option in parameter.opts if option.startswith("--"))


@pytest.mark.parametrize(
    "page", sorted((DOCS / "reference" / "python").glob("[!i]*.md")), ids=lambda p: p.stem
)
def test_what_is_public_in_a_documented_module_is_on_its_page(site, page):
    built = (site / "reference" / "python" / f"{page.stem}.html").read_text(encoding="utf-8")
    modules = re.findall(r"automodule:: (\S+)", page.read_text(encoding="utf-8"))
    assert modules
    for name in modules:
        module = importlib.import_module(name)
        own = [
            key
            for key, value in vars(module).items()
            if not key.startswith("_") and getattr(value, "__module__", None) == name and value.__doc__
        ]
        assert [
            key for key in own if callable(getattr(module, key)) and f'id="{name}.{key}"' not in built
        ] == []


def test_bars_and_equations_of_docstrings_survive_the_parser(site):
    if not os.environ.get("CI"):
        pytest.importorskip("sphinx", reason="the documentation's tools are not installed: .[docs]")
    sys.path.insert(0, str(DOCS))
    try:
        from site_extensions.docstrings import plain
    finally:
        sys.path.remove(str(DOCS))
    assert plain(["Of |μ| and K_e*.", "", "    x = |y|", "", "Done: ``a|b``."]) == [
        "Of \\|μ\\| and K_e\\*.",
        "",
        "::",
        "",
        "    x = |y|",
        "",
        "Done: ``a|b``.",
    ]
    said = text_of(site / "reference" / "python" / "methods.html")
    assert "1 + K_e(1 − e^{−iωτ})λ = (1 + K_eλ)(1 − q e^{−iωτ})" in said
