"""The chart page at ``/page/``: plain files, under a policy that lets nothing else run or load."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

from fastapi import FastAPI
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from service.screening import html_axes, html_page

FOLDER = Path(__file__).parent / "static"
PATH = "/page/"
# plotly.js puts these on the picture of a heat map, as attributes; nothing else may carry a style of its own.
_PLOTLY_STYLES = (
    "",
    "image-rendering: optimizeSpeed; image-rendering: -moz-crisp-edges; image-rendering: -o-crisp-edges; "
    "image-rendering: -webkit-optimize-contrast; image-rendering: optimize-contrast; "
    "image-rendering: crisp-edges; image-rendering: pixelated; ",
)
# A report opened in a tab of its own comes from the page and so is under its policy; these are its styles.
_REPORT_STYLES = (html_page.STYLE, html_axes.PIXELATED)


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        f"style-src 'self' 'unsafe-hashes' {' '.join(map(_hash, _PLOTLY_STYLES + _REPORT_STYLES))}",
        "img-src 'self' blob: data:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    # Asked about again each time, by its ETag: a page and the service behind it never differ in version.
    "Cache-Control": "no-cache",
}


class _Page(StaticFiles):
    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers.update(_HEADERS)
        return response


def install(app: FastAPI) -> None:
    """Serve the page at `PATH`, and send who asks for ``/`` there."""
    app.mount(PATH.rstrip("/"), _Page(directory=FOLDER, html=True), name="page")

    @app.get("/", include_in_schema=False)
    async def to_the_page() -> RedirectResponse:
        # Relative, so that it holds behind a proxy that serves all of this under a path of its own.
        return RedirectResponse(PATH.removeprefix("/"), status_code=307)
