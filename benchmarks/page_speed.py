"""The chart page in Chromium on the loopback: from a moved slider to map and exact boundary on screen.

Times are the browser's own (User Timing): from the event of the slider to the frame that shows the answer.
The slider is dragged without a stop, as a hand does it, and then let go.
"""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright
from rich.table import Table

from benchmarks.jobs.service_process import ServiceProcess

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
DRAGS, STEPS = 8, 20
CONTACTS = {"permanent contact": "All round", "two arcs of contact": "Two quarters"}
MEASURES = {
    "map of 120 × 120 by the surrogate": "map on screen",
    "exact boundary": "exact boundary on screen",
    "exact boundary, at more speeds": "finer boundary on screen",
    "map re-verified": "verified map on screen",
}
# A hand on the slider: some sixteen changes a second.
_DRAG = """async ([from, to, steps]) => {
  const slider = document.querySelector("[data-slider=damping]");
  for (let i = 0; i <= steps; i += 1) {
    slider.value = from + (to - from) * i / steps;
    slider.dispatchEvent(new Event("input", {bubbles: true}));
    await new Promise((next) => setTimeout(next, 60));
  }
  slider.dispatchEvent(new Event("change", {bubbles: true}));
}"""


@dataclass(frozen=True)
class Opening:
    """A first look: seconds from the address to the first map, and to all answers; bytes fetched."""

    first_map_s: float
    bytes: int


def table() -> Table:
    """Opening, and both contacts."""
    out = Table(
        title=f"The chart page, rotor 37, both edges; {DRAGS} drags of the damping of {STEPS} steps each"
    )
    for column in ("what", "median", "95 % within", "largest", "times"):
        out.add_column(column, justify="left" if column == "what" else "right")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        sys.exit("chromium = not found: install it (Debian: apt install chromium)")
    with (
        TemporaryDirectory() as folder,
        ServiceProcess(Path(folder)) as service,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 1000})
        opening = _open(page, service.url)
        size = f"{opening.bytes / 1e6:.2f} MB"
        out.add_row(f"first map after opening, service just started ({size})", f"{opening.first_map_s:.2f} s")
        for name, button in CONTACTS.items():
            out.add_section()
            out.add_row(name, style="bold")
            page.click(f"text={button}")
            _settle(page)
            page.evaluate("performance.clearMeasures()")
            for drag in range(DRAGS):
                ends = (-0.4, 0.4) if drag % 2 == 0 else (0.4, -0.4)
                page.evaluate(_DRAG, [*ends, STEPS])
                _settle(page)
            for what, measure in MEASURES.items():
                times = np.array(_durations(page, measure))
                if not len(times):
                    continue
                told = [
                    f"{value:.0f} ms" for value in (np.median(times), np.quantile(times, 0.95), times.max())
                ]
                out.add_row(what, *told, str(len(times)))
        browser.close()
    return out


def _open(page: Page, address: str) -> Opening:
    sizes: list[int] = []
    page.on("response", lambda reply: sizes.append(len(reply.body())) if "/page/" in reply.url else None)
    begun = time.perf_counter()
    page.goto(f"{address}/")
    _until(page, "performance.getEntriesByName('rubscreen: map on screen').length")
    first = time.perf_counter() - begun
    _settle(page)
    return Opening(first, sum(sizes))


def _settle(page: Page) -> None:
    """Until nothing is asked any more."""
    page.wait_for_timeout(300)
    _until(page, "document.querySelector('.findings').innerText.includes('Boundary exact')")
    _until(page, "!document.querySelector('.findings').innerText.includes('at work')")


def _until(page: Page, expression: str, within_s: float = 120.0) -> Any:
    end = time.monotonic() + within_s
    while not (value := page.evaluate(expression)):
        if time.monotonic() > end:
            raise TimeoutError(f"the page never showed: {expression}")
        time.sleep(0.02)
    return value


def _durations(page: Page, measure: str) -> list[float]:
    """Milliseconds."""
    found = f"performance.getEntriesByName('rubscreen: {measure}').map((entry) => entry.duration)"
    return list(page.evaluate(found))
