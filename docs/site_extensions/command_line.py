"""The command line's reference, written from the commands themselves when the site is built."""

from __future__ import annotations

import re

import typer
from sphinx.application import Sphinx
from typer.cli import get_docs_for_click

from service.cli import app as rubscreen

PLACE = "<!-- command-line -->"
PAGE = "reference/command-line"


def reference() -> str:
    """Markdown of every command, its headings below the page's own."""
    command = typer.main.get_command(rubscreen)
    text = get_docs_for_click(obj=command, ctx=typer.Context(command, info_name="rubscreen"), name="rubscreen")
    _, _, body = text.partition("**Usage**")
    # The language of a console example is not one of ours to run: `console` blocks of the pages are tests.
    return re.sub(r"^```console$", "```text", "**Usage**" + body, flags=re.MULTILINE)


def _write(app: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        source[0] = source[0].replace(PLACE, reference())


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
