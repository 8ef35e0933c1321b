"""The built pages, as a browser on a closed network meets them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from fontTools.ttLib import TTFont

from sdm_core.version import __version__

# What a browser fetches by itself; a link that a reader may follow is none of it.
LOADED = {
    ("script", "src"),
    ("link", "href"),
    ("img", "src"),
    ("img", "srcset"),
    ("source", "src"),
    ("source", "srcset"),
    ("iframe", "src"),
    ("video", "src"),
    ("audio", "src"),
    ("object", "data"),
    ("embed", "src"),
    ("use", "href"),
    ("image", "href"),
}
_CSS_LOADS = re.compile(r"""(?:@import\s+|url\()\s*["']?([^"')\s;]+)""")
_SCRIPT_LOADS = re.compile(r"""(?:fetch|import|importScripts|src\s*=)\s*\(?\s*["']((?:https?:)?//[^"']+)""")


class Page(HTMLParser):
    """What a page loads, links to, and names; its equations."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.letters: list[tuple[str, bool]] = []
        self._math: list[tuple[str, bool]] = []
        self._style = False
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.loads += [given[name] for t, name in LOADED if t == tag and name in given]
        self.loads += _CSS_LOADS.findall(given.get("style", ""))
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "math" or self._math:
            self._math.append((tag, given.get("mathvariant") == "normal"))
        self._style = tag == "style"

    def handle_endtag(self, tag: str) -> None:
        while self._math and self._math.pop()[0] != tag:
            pass
        self._style = False

    def handle_data(self, data: str) -> None:
        if self._style:
            self.loads += _CSS_LOADS.findall(data)
        if self._math and data.strip():
            tag, upright = self._math[-1]
            self.letters.append((data.strip(), tag == "mi" and not upright and len(data.strip()) == 1))


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in sorted(site.rglob("*.html"))}


def outside(url: str) -> bool:
    """Whether a browser has to leave the folder for it."""
    return bool(urlsplit(url).netloc) or urlsplit(url).scheme in ("http", "https", "ftp")


def test_no_page_loads_a_script_a_font_or_a_picture_from_outside(site, pages):
    for path, page in pages.items():
        assert [url for url in page.loads if outside(url)] == [], path
    for sheet in site.rglob("*.css"):
        found = _CSS_LOADS.findall(sheet.read_text(encoding="utf-8"))
        assert [url for url in found if outside(url)] == [], sheet
    for script in site.rglob("*.js"):
        assert _SCRIPT_LOADS.findall(script.read_text(encoding="utf-8")) == [], script


@pytest.mark.parametrize(
    "harmful",
    [
        '<script async src="https://cdn.example/mathjax.js"></script>',
        '<link rel="stylesheet" href="//fonts.example/css?family=X">',
        "<style>@import 'https://fonts.example/x.css';</style>",
        '<p style="background: url(http://img.example/x.png)">',
    ],
)
def test_what_would_be_loaded_from_outside_is_seen(tmp_path, harmful):
    (tmp_path / "page.html").write_text(f"<html>{harmful}</html>")
    assert any(outside(url) for url in Page(tmp_path / "page.html").loads)


def local(path: Path, url: str) -> tuple[Path, str] | None:
    """File and fragment that a link on a page means, None outside the folder."""
    if outside(url) or urlsplit(url).scheme:
        return None
    parts = urlsplit(url)
    return (path.parent / unquote(parts.path)).resolve() if parts.path else path.resolve(), unquote(
        parts.fragment
    )


def test_every_file_that_is_loaded_and_every_place_that_is_linked_to_is_there(pages):
    by_file = {path.resolve(): page for path, page in pages.items()}
    for path, page in pages.items():
        for url in page.loads + page.links:
            meant = local(path, url)
            if meant is None or path.name in ("genindex.html", "search.html"):
                continue
            file, fragment = meant
            assert file.exists(), f"{path}: {url}"
            if fragment and file in by_file:
                assert fragment in by_file[file].anchors, f"{path}: {url}"


def reached(site: Path, pages: dict[Path, Page]) -> Iterator[Path]:
    by_file = {path.resolve(): page for path, page in pages.items()}
    waiting, seen = [(site / "index.html").resolve()], set()
    while waiting:
        file = waiting.pop()
        if file in seen or file not in by_file:
            continue
        seen.add(file)
        yield file
        waiting += [meant[0] for url in by_file[file].links if (meant := local(file, url))]


@pytest.mark.parametrize(
    "folder", ["how-to", "theory", "decisions", "reference", "reference/python", "paper"]
)
def test_every_page_is_reached_from_the_first(site, pages, folder):
    written = Path(__file__).parents[2] / "docs" / folder
    there = {site / folder / f"{page.stem}.html" for page in written.glob("*.md") if page.stem != "README"}
    assert there and {page.resolve() for page in there} <= set(reached(site, pages))


def test_equations_need_no_script_and_every_letter_is_in_the_font_that_is_shipped(site, pages):
    font = TTFont(next(site.rglob("stix-two-math.woff")))
    drawn = set(font.getBestCmap())
    assert "MATH" in font  # what makes brackets grow
    letters = [letter for page in pages.values() for letter in page.letters]
    assert len(letters) > 500
    missing = {c for text, italic in letters for c in (italics(text) if italic else text)}
    missing = {c for c in missing if ord(c) not in drawn and not c.isspace()}
    assert missing == set()
    assert not any(r"\mathbf" in path.read_text(encoding="utf-8") for path in pages)


def test_no_markup_is_left_over_on_a_page(pages):
    for path in pages:
        text = re.sub(r"<(pre|code|script)\b.*?</\1>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not re.search(
            r":::|\$\$|\{eq\}|\]\(|<!-- (rest|command)-", re.sub(r"<[a-z][^>]*>", "", text)
        ), path


def italics(letter: str) -> str:
    """What a browser draws for a single letter in <mi>."""
    if letter == "h":
        return "\N{PLANCK CONSTANT}"
    for first, last, slanted in (("A", "Z", 0x1D434), ("a", "z", 0x1D44E), ("α", "ω", 0x1D6FC)):
        if first <= letter <= last:
            return chr(slanted + ord(letter) - ord(first))
    return letter


def test_the_pages_name_their_version(site):
    assert f"rubscreen {__version__}" in (site / "index.html").read_text(encoding="utf-8")
