"""The HTML report: it shows what was screened, runs nothing, and stays small."""

from __future__ import annotations

import base64
import io
import re
import shutil
import subprocess
from datetime import UTC, datetime
from html.parser import HTMLParser

import matplotlib.image
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.blade import Blade
from service.screening.batch import Failure, ScreenedBatch
from service.screening.html_axes import Chart, round_steps
from service.screening.html_charts import map_svg, overview_svgs
from service.screening.html_png import indexed_png
from service.screening.html_report import certificate, html_report
from service.screening.screen import screen
from training.answers import CertificateUsed

HOSTILE = '<script>alert("1")</script>&amp;<img src=x onerror=alert(1)>'
MADE = datetime(2026, 3, 1, 12, 30, tzinfo=UTC)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Read(HTMLParser):
    """Elements, their attributes and all text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text = ""
        self.rows: list[list[str]] = []
        self._in_cell = False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self._in_cell = True

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._in_cell = False

    def handle_data(self, data):
        self.text += data
        if self._in_cell:
            self.rows[-1][-1] += data


def named(blade: Blade, name: str) -> Blade:
    return Blade(name, blade.tip_nodes, blade.damping_ratio, blade.states, design_speed_hz=200.0)


def batch_of(blades, lobes, failures=(), ignored=(), **settings) -> ScreenedBatch:
    report = screen(blades, None, lobes, **settings)
    sources = tuple(f"{i}.json" for i in range(len(blades)))
    return ScreenedBatch(report, tuple(blades), sources, tuple(failures), tuple(ignored))


def written(batch: ScreenedBatch, **more) -> str:
    return html_report(batch, **{"policy": "auto", "card": None, "made": MADE, **more})


def cells(svg: str) -> np.ndarray:
    """The grey of each cell of a map's picture, lowest K_e first."""
    (found,) = re.findall(r'href="data:image/png;base64,([^"]+)"', svg)
    return matplotlib.image.imread(io.BytesIO(base64.b64decode(found)), format="png")[::-1, :, :3]


def test_a_name_with_markup_is_shown_as_text_and_runs_nothing(blade, lobes):
    hostile = [named(blade, HOSTILE), named(blade, "plain")]
    failures = [Failure(f"{HOSTILE}.json", HOSTILE)]
    page = Read(written(batch_of(hostile, lobes, failures, [HOSTILE], ke_liner=3000.0)))
    assert not {"script", "iframe", "object", "embed", "link", "form", "img"} & set(page.tags)
    assert not [name for _, name, _ in page.attributes if name.startswith("on")]
    assert page.text.count(HOSTILE) >= 5


def test_a_page_fetches_nothing_and_its_links_lead_to_its_own_sheets(blade, lobes):
    page = Read(written(batch_of([named(blade, "a"), named(blade, "b")], lobes, [Failure("x.json", "why")])))
    addresses = [value for _, name, value in page.attributes if name in ("href", "src", "xlink:href")]
    targets = {value for _, name, value in page.attributes if name == "id"}
    assert addresses
    for address in addresses:
        assert address.startswith("data:image/png;base64,") or address[1:] in targets
    assert "url(" not in page.text
    assert "@import" not in page.text
    policy = next(value for _, name, value in page.attributes if name == "content" and "default-src" in value)
    assert "default-src 'none'" in policy


def test_the_ranking_comes_first_and_in_the_order_of_the_report(blade, lobes):
    batch = batch_of([named(blade, "one")], lobes, ke_liner=3000.0)
    page = Read(written(batch))
    ranking = page.rows[1:4]
    assert [row[2] for row in ranking] == [row.contact_name for row in batch.report.results]
    assert ranking[-1][3] == "2,000"  # parabolic lobes: 4,000 N/m over the two nodes
    assert ranking[-1][-1] == "unstable -33%"
    assert page.text.index("Ranking") < page.text.index("What was screened")


def test_without_a_liner_nothing_is_judged(blade, lobes):
    page = Read(written(batch_of([blade], lobes)))
    assert "verdict" not in page.text.lower()


def test_many_blades_are_ranked_by_their_worst_contact(blade, lobes):
    class Heavier(type(lobes)):
        def critical_ke(self, contact, speed_hz):
            return super().critical_ke(contact, speed_hz) * factor[self.now]

        def boundary(self, blade, *rest, **more):
            self.now = blade.name
            return super().boundary(blade, *rest, **more)

    factor = {f"b{i:02d}": 1 + 0.01 * ((7 * i) % 20) for i in range(20)}
    blades = [named(blade, name) for name in factor]
    page = Read(written(batch_of(blades, Heavier(), map_shape=(5, 5))))
    assert page.rows[0][2:6] == ["Ke LE", "Ke TE", "Ke both", "worst"]
    ranked = [row[1] for row in page.rows[1:21]]
    assert ranked == sorted(factor, key=lambda name: -factor[name])
    assert {row[5] for row in page.rows[1:21]} == {"both"}


def test_failures_are_listed_with_their_reasons_and_counted_in_the_first_lines(blade, lobes):
    failures = [Failure("a.json", "states = []: give one"), Failure("b.json", "damaged")]
    page = Read(written(batch_of([blade], lobes, failures, ["notes.txt"])))
    assert "2 blades could not be screened" in page.text[: page.text.index("Ranking")]
    assert ["a.json", "states = []: give one"] in page.rows
    assert "1 entry ignored, not *.json: notes.txt" in page.text


def test_the_grey_of_a_map_is_its_unstable_share(blade, lobes):
    row = screen([blade], None, lobes).results[0]
    shown = cells(map_svg(row))
    assert shown.shape[:2] == row.map.stable.shape
    unstable = shown.max(axis=-1) < 0.8  # grey, or tinted grey
    assert np.array_equal(unstable, row.map.stable == 0.0)
    tinted = np.ptp(shown, axis=-1) > 0.02
    assert np.array_equal(tinted, row.map.source == "exact")


def test_a_picture_is_read_back_as_it_was_written():
    rng = np.random.default_rng(3)
    palette = [(255, 255, 255), (178, 178, 178), (10, 20, 30)]
    shades = rng.integers(0, 3, (17, 31))
    back = matplotlib.image.imread(io.BytesIO(indexed_png(shades, palette)), format="png")[..., :3]
    assert np.array_equal(np.round(255 * back), np.array(palette)[shades])


def test_the_least_point_is_marked_where_it_is(blade, lobes):
    row = screen([blade], None, lobes).results[-1]
    x, y = map(float, re.search(r'd="M([\d.]+) ([\d.]+)l5 8h-10z"', map_svg(row)).groups())
    # The frame of a chart: 52 to 410 across, 224 up to 40.
    low, high = row.speed_range_hz
    assert low + (x - 52) / 358 * (high - low) == pytest.approx(row.worst.speed_hz, abs=0.2)
    assert (224 - (y - 3)) / 184 * row.ke_max == pytest.approx(row.worst.ke, rel=0.02)


def test_a_line_has_a_gap_where_there_is_no_crossing():
    chart = Chart("t", (0.0, 4.0), 10.0, 1.0)
    chart.line(np.arange(5.0), np.array([1.0, 2.0, np.nan, 3.0, 4.0]))
    (path,) = re.findall(r'<path d="([^"]+)" fill="none"', chart.svg)
    assert path.count("M") == 2
    assert path.count("L") == 2


def test_blades_side_by_side_begin_with_the_safest(blade, lobes):
    blades = [named(blade, "one"), named(blade, "two")]
    (drawing,) = overview_svgs(batch_of(blades, lobes, ke_liner=5000.0).report)
    assert drawing.count("<circle") + drawing.count("l4.5 8.5h-9z") + drawing.count("<rect") == 3 + 6
    assert "liner" in drawing


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(2, 12))
def test_ticks_are_evenly_spaced_within_the_axis(low, width, about):
    ticks = round_steps(low, low + width, about)
    assert 1 <= len(ticks) <= 2.6 * about + 1
    slack = 1e-9 * (abs(low) + width)
    assert low - slack <= ticks[0] <= ticks[-1] <= low + width + slack
    assert np.allclose(np.diff(ticks), width / about, rtol=1.5, atol=slack)


def test_a_report_of_many_blades_stays_small(blade, lobes):
    blades = [named(blade, f"blade {i}") for i in range(10)]
    assert len(written(batch_of(blades, lobes, ke_liner=3000.0))) < 10 * 100_000


def test_the_certificate_says_what_the_card_says():
    figures = {
        "points": 20_000,
        "false_stable": 3,
        "answered_stable": 9_949,
        "false_unstable": 5,
        "answered_unstable": 9_780,
        "exact_share": 0.0135,
    }
    alone = {**figures, "false_stable": 77, "exact_share": 0.0}
    card = {
        "evaluation": {"permanent": {"auto": figures, "alone": alone, "distribution": "reference/1"}},
    }
    said = certificate(card, "auto", CertificateUsed(5e-4, 0.95, "reference/1", 10.0))
    for part in (
        "permanent contact",
        "20,000",
        "3 of 9,949",
        "5 of 9,780",
        "1.4%",
        "0.0005",
        "95%",
        "reference/1",
    ):
        assert part in said
    assert "77 of 9,949" in certificate(card, "surrogate")
    assert "95%" not in certificate(card, "surrogate")
    assert certificate({}, "auto") == "its card names no error rates"


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_a_browser_shows_the_maps_and_runs_nothing(blade, lobes, tmp_path):
    batch = batch_of([named(blade, HOSTILE)], lobes, ke_liner=3000.0)
    report, shot = tmp_path / "report.html", tmp_path / "shot.png"
    report.write_text(written(batch), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    options += ["--hide-scrollbars", "--window-size=1150,2000", f"--screenshot={shot}"]
    subprocess.run([CHROMIUM, *options, report.as_uri()], check=True, capture_output=True, timeout=120)
    seen = matplotlib.image.imread(shot)[..., :3]
    grey = np.all(np.abs(seen - 178 / 255) < 0.01, axis=-1).mean()
    assert grey > 0.01
    dom = subprocess.run(
        [CHROMIUM, *options[:4], "--dump-dom", report.as_uri()], check=True, capture_output=True, timeout=120
    ).stdout.decode()
    assert not {"script", "img"} & set(Read(dom).tags)
