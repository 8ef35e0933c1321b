"""One self-contained HTML page that prints on A4: no scripts, no links to the outside."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

# Nothing on the page may load or run anything, whatever a name in it holds.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, 'Segoe UI', 'DejaVu Sans', Arial, sans-serif; color: #111; background: #fff;
  max-width: 1120px; margin: 24px auto; padding: 0 20px; }
h1 { font-size: 1.6em; margin: 0 0 .4em; } h2 { font-size: 1.25em; margin: 1.6em 0 .4em;
  border-bottom: 1.5px solid #111; padding-bottom: .15em; overflow-wrap: anywhere; }
h3 { font-size: 1.02em; margin: 1em 0 .3em; } p { margin: .4em 0; }
table { border-collapse: collapse; width: 100%; font-size: .86em; margin: .6em 0 1em; }
th { text-align: left; border-bottom: 1.5px solid #111; padding: 3px 6px; vertical-align: bottom; }
td { border-bottom: 1px solid #ccc; padding: 3px 6px; vertical-align: top; overflow-wrap: break-word; }
td.l { overflow-wrap: anywhere; min-width: 9em; }
th.n, td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.w { white-space: nowrap; }
sub { line-height: 0; }
img, svg { max-width: 100%; height: auto; display: block; }
a { color: inherit; }
.note, .foot { color: #444; font-size: .86em; } .foot { margin-top: 2em; border-top: 1px solid #ccc; }
.beside { display: grid; grid-template-columns: 3fr 2fr; gap: 18px; align-items: start; margin: 1em 0; }
.across { display: grid; grid-template-columns: repeat(2, 1fr); gap: 10px; }
.beside h3:first-child { margin-top: 0; }
@page { size: A4; margin: 13mm; }
@media print {
  body { font-size: 9.5pt; max-width: none; margin: 0; padding: 0; }
  a { text-decoration: none; }
  h2, h3 { break-after: avoid; } thead { display: table-header-group; }
  tr, img, svg, .beside { break-inside: avoid; }
  .sheet { break-before: page; }
  .sheet h2 { margin-top: 0; }
}
"""


def page(title: str, body: str) -> str:
    """A whole document around a body that is HTML already."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
    )


def element(tag: str, text: str, *, cls: str = "", id: str = "") -> str:
    """An element around text, which is escaped.

    Examples
    --------
    >>> element("p", "a < b", cls="note")
    '<p class="note">a &lt; b</p>'
    """
    named = f' id="{escape(id)}"' if id else ""
    styled = f' class="{escape(cls)}"' if cls else ""
    return f"<{tag}{named}{styled}>{escape(text)}</{tag}>"


class Markup(str):
    """Text that is HTML already."""


def table(
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    numbers: Sequence[int] = (),
    long: Sequence[int] = (),
) -> str:
    """A table of text; headings and cells are escaped unless they are `Markup`.

    Parameters
    ----------
    numbers
        Places of the columns that are set flush right.
    long
        Places of the columns whose words may be broken anywhere: names, and what has no spaces.
    """
    places = range(len(headings))
    kind = [' class="n"' if i in numbers else ' class="l"' if i in long else "" for i in places]
    head = "".join(f"<th{k}>{marked(text)}</th>" for k, text in zip(kind, headings, strict=True))
    body = "".join(
        "<tr>" + "".join(f"<td{k}>{marked(cell)}</td>" for k, cell in zip(kind, row, strict=True)) + "</tr>\n"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def marked(text: str) -> str:
    """Text escaped, or as it is where it is `Markup`."""
    return text if isinstance(text, Markup) else escape(text)


def picture(png: bytes, alt: str) -> str:
    """A PNG within the page."""
    return f'<img alt="{escape(alt)}" src="{data_uri(png)}">'


def data_uri(png: bytes) -> str:
    """A PNG as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
