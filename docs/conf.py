"""Sphinx: the documentation as pages that need no network (decision 24). `make docs` builds it."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from sdm_core.version import __version__  # noqa: E402

project = "rubscreen"
author = "the rubscreen developers"
release = version = __version__
language = "en"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "site_extensions.mathml",
    "site_extensions.docstrings",
    "site_extensions.command_line",
    "site_extensions.rest_reference",
]
exclude_patterns = ["how-to/README.md"]  # for whoever reads the pages in the repository
nitpicky = True
default_role = "code"
smartquotes = False  # what is said of code is to be found as it was written
highlight_language = "text"

myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "attrs_inline", "colon_fence"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True}
python_use_unqualified_type_names = True
maximum_signature_line_length = 90
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
# Nothing is linked to pages of other projects, which a closed network has not got; private classes and
# aliases of types stand in signatures without a page of their own. Links written in the pages are all held.
nitpick_ignore_regex = [(r"py:.*", r".*")]

html_theme = "furo"
pygments_dark_style = "github-dark"
html_title = f"rubscreen {release}"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["rubscreen.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_theme_options = {"navigation_with_keys": True, "top_of_page_buttons": []}
