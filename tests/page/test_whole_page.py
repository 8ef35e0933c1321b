"""What holds for the whole page: nothing from outside, keys, faults, links, who cannot see or use a mouse."""

from __future__ import annotations

import hashlib
import re
import time
from pathlib import Path

import httpx
import pytest
from served_process import ServedProcess, free_port

from service.page.mounting import FOLDER, POLICY
from service.records.database import open_database
from service.records.keys import KeyStore
from service.roles import Role

VIEWS = ["Explorer", "Compare"]  # the others are looked at where there is something in them
LARGEST = 3_000_000  # bytes, of all that opening the page takes


def test_the_vendored_library_is_the_one_that_the_notice_names():
    notice = (FOLDER / "vendor" / "NOTICE.txt").read_text(encoding="utf-8")
    library = FOLDER / "vendor" / "plotly" / "plotly-cartesian.min.js"
    assert hashlib.sha256(library.read_bytes()).hexdigest() in notice
    assert (FOLDER / "vendor" / "plotly" / "LICENSE").read_text(encoding="utf-8").startswith("MIT")


def test_no_file_of_the_page_names_anything_outside_or_runs_script_inline():
    own = [
        path
        for path in FOLDER.rglob("*")
        if path.suffix in (".html", ".css", ".js") and "vendor" not in path.parts
    ]
    assert len(own) > 15
    for path in own:
        text = path.read_text(encoding="utf-8")
        assert not re.findall(r"https?://(?!www\.w3\.org)", text), path
        assert not re.findall(r"\bon\w+=\"|\bstyle=\"|innerHTML|\beval\(", text), path
    page = (FOLDER / "index.html").read_text(encoding="utf-8")
    assert all("src=" in script for script in re.findall(r"<script[^>]*>", page))


def test_the_policy_is_strict_and_stands_on_every_file(service):
    assert "default-src 'none'" in POLICY and "unsafe-inline" not in POLICY and "unsafe-eval" not in POLICY
    for path in ("/page/", "/page/js/main.js", "/page/nothing.js"):
        reply = httpx.get(service.url + path, trust_env=False)
        assert reply.headers.get("content-security-policy") == POLICY or reply.status_code == 404
    assert httpx.get(f"{service.url}/", trust_env=False).headers["location"] == "page/"


def test_opening_the_page_takes_less_than_three_megabytes_all_from_the_service(service, opened):
    page = opened(service, go=False)
    sizes: list[int] = []
    page.page.on("response", lambda r: sizes.append(len(r.body())) if r.request.method == "GET" else None)
    page.open()
    page.settled()
    assert 1_000_000 < sum(sizes) < LARGEST
    # `opened` checks that no request left the origin and that the policy was not broken.


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("view", VIEWS)
def test_axe_finds_nothing_serious(service, opened, pictures, view, theme):
    page = opened(service, f"page/#view={view.lower()}", color_scheme=theme)
    if view == "Explorer":
        page.settled()
    else:
        page.until("document.querySelectorAll('.compare .halves tbody tr').length > 2")
    page.page.wait_for_timeout(800)
    page.page.screenshot(path=pictures / f"{view.lower().replace(' ', '_')}_{theme}.png", full_page=True)
    assert page.violations() == []


def test_every_view_is_reached_and_used_by_keyboard_alone(service, opened):
    page = opened(service)
    page.drawn()
    page.page.keyboard.press("Tab")
    assert page.page.evaluate("document.activeElement.textContent") == "Skip to the charts"
    for _ in range(2):
        page.page.keyboard.press("Tab")
    assert page.page.evaluate("document.activeElement.textContent") == "Compare"
    page.page.keyboard.press("Enter")
    page.until("document.querySelector('#view section.compare') !== null")


def test_a_link_holds_the_state(service, opened):
    page = opened(service)
    page.drawn()
    page.page.click("text=Trailing edge (TE)")
    page.page.click("text=One quarter")
    page.slide("damping", 0.3)
    page.page.select_option("#speed-unit", "ratio")
    page.page.fill("label:has-text('Liner') + input", "12345")
    page.page.keyboard.press("Enter")
    page.drawn()
    title = page.text(".findings .design-title")
    page.page.click("text=Copy link")
    page.until("location.hash.startsWith('#s=')")
    again = opened(service, page.page.evaluate("location.hash").replace("#", "page/#", 1))
    again.drawn()
    assert (
        again.text(".findings .design-title") == title == "nasa-rotor-37 · TE, 1 arc (25 %) · damping × 1.995"
    )
    assert again.page.input_value("label:has-text('Liner') + input") == "12345"
    assert again.page.input_value("#speed-unit") == "ratio"


def test_a_reload_and_the_back_button_lose_nothing(service, opened):
    page = opened(service)
    page.drawn()
    page.page.click("text=Trailing edge (TE)")
    page.slide("damping", 0.5)
    page.drawn()
    page.page.click("nav >> text=Compare")
    page.until("document.querySelector('#view section.compare') !== null")
    page.page.wait_for_timeout(500)
    page.page.reload()
    page.until("document.querySelector('#view section.compare') !== null")
    page.page.go_back()
    page.drawn()
    assert page.text(".findings .design-title") == "nasa-rotor-37 · TE · damping × 3.162"
    page.page.go_forward()
    page.until("document.querySelector('#view section.compare') !== null")


def test_a_link_that_was_cut_says_so_and_shows_an_example(service, opened):
    page = opened(service, "page/#s=q1bKUrIyNDI2")
    page.drawn()
    assert "cut or changed" in page.text("#banner")


def test_a_service_that_is_restarted_underneath_loses_nothing(tmp_path, opened, pictures):
    served = ServedProcess(tmp_path, free_port()).start()
    try:
        page = opened(served)
        page.expected = ["ERR_CONNECTION_REFUSED", "Failed to load resource", "ERR_"]
        page.drawn()
        page.page.click("text=Trailing edge (TE)")
        page.drawn()
        served.kill()
        page.slide("damping", 0.5)
        page.until("!document.querySelector('#banner').hidden")
        page.page.screenshot(path=pictures / "away.png")
        assert "does not answer" in page.text("#banner")
        assert "nasa-rotor-37 · TE" in page.text(".findings .design-title")
        served.start()
        page.until("document.querySelector('#banner').hidden", 60.0)
        page.settled()
        assert page.text(".findings .design-title") == "nasa-rotor-37 · TE · damping × 3.162"
        assert "✕ chatters" in page.text(".findings") or "✓ stable" in page.text(".findings")
    finally:
        served.kill()


def test_a_key_is_asked_for_and_one_that_expires_is_asked_for_again(tmp_path, opened, pictures):
    database = open_database(tmp_path)
    keys = KeyStore(database)
    expires = time.time() + 20.0
    (_, short), (_, long) = keys.create("short", Role.submit, expires), keys.create("long", Role.read)
    database.close()
    served = ServedProcess(tmp_path, free_port(), {"auth": "on"}).start()
    try:
        page = opened(served, go=False)
        page.expected = ["status of 401"]
        page.page.goto(served.url + "/")
        page.until("document.querySelector('#key-dialog').open")
        page.page.screenshot(path=pictures / "key.png")
        assert page.violations() == []
        page.page.fill("#key", short)
        page.page.keyboard.press("Enter")
        page.drawn()
        assert "key “short”, role submit" in page.text("#about")
        time.sleep(max(0.0, expires + 0.5 - time.time()))
        page.slide("damping", 0.5)
        page.until("document.querySelector('#key-dialog').open", 20.0)
        assert "expired" in page.text("#key-why")
        page.page.fill("#key", long)
        page.page.keyboard.press("Enter")
        page.until("document.querySelector('.findings')?.innerText.includes('damping × 3.162')")
        page.drawn()
        # Keys go with requests alone: neither the address nor what outlives the tab has them.
        assert "rub_" not in page.page.url and page.page.evaluate("Object.keys(localStorage).length") <= 1
    finally:
        served.kill()


def test_on_paper_the_page_is_light_and_without_its_tools(service, opened, pictures, tmp_path):
    page = opened(service, color_scheme="dark")
    page.drawn()
    paper = Path(pictures) / "explorer.pdf"
    page.page.pdf(path=paper, format="A4", landscape=True, print_background=True)
    assert paper.stat().st_size > 20_000
    page.page.emulate_media(media="print")
    assert not page.page.is_visible(".chart-tools >> nth=0")
