"""Equations as MathML, written at build time: the reader's browser needs no script and no network."""

from __future__ import annotations

from html import escape

from docutils import nodes
from math_core import LatexToMathML
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)
_CONVERTER = LatexToMathML()


def _mathml(node: nodes.Element, block: bool) -> str:
    """MathML of a formula; one that cannot be read is a warning, which fails the build, and stays."""
    formula = node.astext()
    try:
        return _CONVERTER.convert_with_local_state(formula, displaystyle=block)
    except Exception as unreadable:  # of a class of the library's own that it does not export
        logger.warning("formula %r: %s", formula, unreadable, location=node)
        return f"<code>{escape(formula)}</code>"


def visit_inline(translator: HTML5Translator, node: nodes.Element) -> None:
    """One formula in a line of text."""
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.Element) -> None:
    """One formula by itself, with its number where it has a label."""
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    translator.body.append(_mathml(node, block=True))
    if node["number"]:
        translator.body.append(f'<span class="eqno">({node["number"]})')
        translator.add_permalink_ref(node, "Link to this equation")
        translator.body.append("</span>")
    translator.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))  # type: ignore[arg-type]
    return {"parallel_read_safe": True, "parallel_write_safe": True}
