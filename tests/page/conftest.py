"""The chart page in Chromium, against `rubscreen serve` as a process of its own.

Whatever a test does, a page that asks for anything outside its service, breaks its own policy, or writes an
error to the console fails it.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from served_process import ServedProcess, free_port

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# Besides, no look-ups of its own: some runners have no network, and their log fills.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    # The network is cut off: no name is looked up, and this machine alone is reached.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
]

if CHROMIUM is None and os.environ.get("CI") != "true":
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="module")
def browser():
    """Chromium, for the tests of a module.

    No longer: Playwright keeps an event loop running in this thread, and tests of coroutines want their own.
    """
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield started
        started.close()


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProcess]:
    """A service with nothing in it, on the loopback, that asks for no keys."""
    process = ServedProcess(tmp_path_factory.mktemp("page"), free_port()).start()
    yield process
    process.kill()


class WatchedPage:
    """A page of the browser, and what it did that it must not do.

    Attributes
    ----------
    page
        Of Playwright.
    expected
        Parts of console messages that a test provokes: refused requests are written there by the browser.
    """

    def __init__(self, page, url: str) -> None:
        self.page, self.url = page, url
        self.console: list[str] = []
        self.foreign: list[str] = []
        self.expected: list[str] = []
        page.on("console", lambda m: self.console.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.console.append(str(error)))
        page.on("request", self._asked)

    def _asked(self, request) -> None:
        own = (self.url + "/", f"blob:{self.url}/", "data:")
        if not request.url.startswith(own):
            self.foreign.append(request.url)

    def open(self, hash: str = "") -> None:
        """Open the chart page, and wait for its first view."""
        self.page.goto(f"{self.url}/{hash}")
        self.page.wait_for_selector("#view section")

    def until(self, expression: str, within_s: float = 30.0):
        """The value of an expression of JavaScript once it is truthy.

        Playwright's own `wait_for_function` evaluates text inside the page, which the page's policy forbids.
        """
        end = time.monotonic() + within_s
        while not (value := self.page.evaluate(expression)):
            assert time.monotonic() < end, f"never: {expression}\n{self.page.inner_text('#view')[:2000]}"
            time.sleep(0.02)
        return value

    def text(self, selector: str) -> str:
        """What stands in the first element that fits."""
        return self.page.locator(selector).first.inner_text()

    def drawn(self) -> None:
        """Until map and exact boundary are there."""
        self.until("document.querySelector('.findings')?.innerText.includes('Boundary exact')")

    def settled(self) -> None:
        """Until surrogate and exact core have answered all that the explorer asks."""
        self.drawn()
        self.until("!document.querySelector('.findings').innerText.includes('at work')", 60.0)

    def slide(self, name: str, value: float, *, release: bool = True) -> None:
        """Move a slider as a hand does."""
        self.page.evaluate(
            """([name, value, release]) => {
              const slider = document.querySelector(`[data-slider="${name}"]`);
              slider.value = value;
              slider.dispatchEvent(new Event("input", {bubbles: true}));
              if (release) slider.dispatchEvent(new Event("change", {bubbles: true}));
            }""",
            [name, value, release],
        )

    def violations(self) -> list[str]:
        """What axe-core finds that is serious or critical."""
        from axe_playwright_python.sync_playwright import Axe

        found = Axe().run(self.page).response["violations"]
        return [
            f"{v['id']}: {n['html'][:200]}"
            for v in found
            if v["impact"] in ("serious", "critical")
            for n in v["nodes"]
        ]

    def check(self) -> None:
        unexpected = [m for m in self.console if not any(part in m for part in self.expected)]
        assert unexpected == []
        assert self.foreign == []


@pytest.fixture
def opened(browser) -> Iterator[Callable[..., WatchedPage]]:
    """Opens the page of a service in a fresh browser context; checks at the end that it behaved."""
    contexts, pages = [], []

    def open_page(served: ServedProcess, hash: str = "", *, go: bool = True, **context) -> WatchedPage:
        made = browser.new_context(viewport={"width": 1440, "height": 1000}, **context)
        made.set_default_timeout(30_000)
        contexts.append(made)
        watched = WatchedPage(made.new_page(), served.url)
        pages.append(watched)
        if go:
            watched.open(hash)
        return watched

    yield open_page
    for watched in pages:
        watched.check()
    for made in contexts:
        made.close()


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """Where screenshots go: `PAGE_PICTURES` where it is set, so that somebody can look at them."""
    folder = Path(os.environ.get("PAGE_PICTURES", tmp_path))
    folder.mkdir(parents=True, exist_ok=True)
    return folder
