"""Docstrings as they are meant: plain text with equations, not reStructuredText.

The code writes |μ|, K_e* and indented equations as one reads them. Here they are made safe for the parser:
bars and asterisks are escaped, an indented equation becomes a literal block.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

_CODE = re.compile(r"(``.*?``|`[^`]*`(?:_\b)?)")
_SPECIAL = re.compile(r"([|*])|(?<=\w)_(?=\W|$)")
_RULE = re.compile(r"^-{3,}$")
_TABLE = re.compile(r"^=+( +=+)+$")


def plain(lines: list[str]) -> list[str]:
    """The lines of a docstring as reStructuredText that says the same.

    Examples
    --------
    >>> plain(["Of |μ|:", "", "    x = 2 * y", "", "Done."])
    ['Of \\\\|μ\\\\|:', '', '::', '', '    x = 2 * y', '', 'Done.']
    """
    out: list[str] = []
    in_section = in_equation = in_table = False
    for i, line in enumerate(lines):
        following = lines[i + 1] if i + 1 < len(lines) else ""
        in_section |= bool(_RULE.match(following.strip())) and len(following.strip()) == len(line.strip())
        in_table = (in_table or bool(_TABLE.match(line))) and bool(line.strip())
        deep = len(line) - len(line.lstrip())
        starts = deep >= 4 and not in_section and (not out or not out[-1].strip())
        if starts and not in_equation:
            out += ["::", ""]
        in_equation = starts or (in_equation and (deep >= 4 or not line.strip()))
        example = line.lstrip().startswith((">>>", "..."))
        out.append(line if in_equation or example or in_table else _escaped(line))
    return out


def _escaped(line: str) -> str:
    """Without marks in the text, those in code aside."""
    parts = _CODE.split(line)
    parts[::2] = [_SPECIAL.sub(lambda found: "\\" + found.group(0), part) for part in parts[::2]]
    return "".join(parts)


def _process(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    lines[:] = plain(lines)


def _dashes(app: Sphinx, doctree: nodes.document) -> None:
    """A dash between a parameter and what is said of it; quotes and hyphens elsewhere stay as written."""
    for text in doctree.findall(nodes.Text):
        if text.astext() == " -- ":
            text.parent.replace(text, nodes.Text(" – "))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", _process, priority=400)  # before napoleon, at 500
    app.connect("doctree-read", _dashes)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
