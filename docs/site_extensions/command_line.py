"""The command line's reference, written from the commands themselves when the site is built."""

from __future__ import annotations

import re
from typing import Any

import typer
from sphinx.application import Sphinx
from typer.cli import get_docs_for_click

from service.cli import app as rubscreen

PLACE = "<!-- command-line -->"
PAGE = "reference/command-line"


def reference() -> str:
    """Markdown of every command, its headings below the page's own."""
    command = typer.main.get_command(rubscreen)
    text = get_docs_for_click(
        obj=command, ctx=typer.Context(command, info_name="rubscreen"), name="rubscreen"
    )
    # Usage and the cut-off list of commands, of which the page's own table is the whole.
    _, _, commands = text.partition("\n## ")
    return _table(command) + "\n## " + re.sub(r"^```console$", "```text", commands, flags=re.MULTILINE)


def _table(group: Any) -> str:
    """Every command with the first paragraph of its help."""
    rows = ["| command | |", "|---|---|"]
    for name, command in group.commands.items():
        said = " ".join((command.help or "").split("\n\n")[0].split())
        rows.append(f"| [`rubscreen {name}`](#rubscreen-{name}) | {said} |")
    return "\n".join(rows) + "\n"


def _write(app: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        source[0] = source[0].replace(PLACE, reference())


def _always(app: Sphinx, *_: Any) -> list[str]:
    """The page is read at every build: what it says comes from modules that Sphinx does not watch."""
    return [PAGE]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _write)
    app.connect("env-get-outdated", _always)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
