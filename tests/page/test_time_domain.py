"""The view "Time domain": a rub simulated from the page, held against the exact core, kept, refused."""

from __future__ import annotations

import base64
import json
import re
import zlib

import httpx
import pytest
from axe_playwright_python.sync_playwright import Axe
from served_process import ServedProcess, free_port

from service.records.database import open_database
from service.records.keys import KeyStore
from service.roles import Role

UNSTABLE = {"speed_hz": 100.0, "ke": 15e3}  # LE of rotor 37: ln |μ| = +0.0859, chatter at 2,573 Hz
GROWTH, CHATTER_HZ = 0.0859, 2573.0


def link(point: dict | None = UNSTABLE, weights: dict | None = None, **more) -> str:
    """What follows the page's address, for rotor 37 in the time domain with speeds in Hz."""
    design = {"label": "nasa-rotor-37", "weights": weights or {"LE": 1}, "arcs": None, "damping": 1}
    design |= {"frequency": [1] * 5, "amplitude": [1] * 5, "shape": {"thickness": 1, "lean_deg": 0}}
    design |= {"example": "nasa_rotor_37", "base": None, "profile": None}
    state = {"version": 1, "view": "time", "designs": [design], "active": 0, "bases": [], "profiles": []}
    state |= {"range": {"low_hz": 90, "high_hz": 290, "ke_max": 25e3, "ke_liner": 15e3}, "unit": "hz"}
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(json.dumps(state | {"point": point} | more).encode()) + packer.flush()
    return "#s=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")


def at_the_end(page) -> str:
    """Wait for a new job's results; its sentence."""
    page.wait_for_selector(".job .state:text-matches('^(Waits|Simulating)')")
    page.wait_for_selector(".job .state:text-matches('^Done')", timeout=60_000)
    page.wait_for_selector(".result[aria-busy=false] .plot .main-svg")
    return page.inner_text(".verdict")


def field(page, label: str, form: str = ".question"):
    return page.locator(form).get_by_label(label, exact=True)


def response_form(page):
    return page.locator("form", has=page.get_by_text("Response at this speed"))


def wear_form(page):
    return page.locator("form", has=page.get_by_text("Wear map round this speed"))


def ask_response(page) -> str:
    page.get_by_role("button", name="Response at this speed").click()
    return at_the_end(page)


def serious(page) -> list:
    found = Axe().run(page).response["violations"]
    return [
        (v["id"], [n["html"] for n in v["nodes"]]) for v in found if v["impact"] in ("serious", "critical")
    ]


@pytest.fixture
def rub(service, opened):
    """The view at the unstable point of the leading edge."""
    return opened(service, link())


def test_a_rub_that_grows_grows_as_the_exact_core_says_and_at_its_chatter_frequency(rub, pictures):
    page = rub.page
    assert field(page, "Rotor speed").input_value() == "100"
    assert field(page, "Kₑ of the liner").input_value() == "15000"
    sentence = ask_response(page)
    assert "grows by 8.9 % a revolution" in sentence
    assert "the exact core agrees: permanent contact is unstable" in sentence
    assert "no longer cuts all the way round" in sentence
    rows = page.locator(".tables tbody").first.locator("tr").all_inner_texts()
    growth = [float(n) for n in re.findall(r"\+(0\.\d+)", rows[1])]
    assert growth == pytest.approx([GROWTH, GROWTH], rel=0.01)
    chatter = [float(n.replace(",", "")) for n in re.findall(r"([\d,]+) Hz", rows[2])]
    assert chatter == pytest.approx([CHATTER_HZ, CHATTER_HZ], rel=1e-3)
    assert page.locator(".response .plot .main-svg").count() >= 7
    page.screenshot(path=pictures / "time_response.png", full_page=True)
    page.select_option("#theme", "dark")
    page.wait_for_timeout(300)
    assert serious(page) == []
    page.set_viewport_size({"width": 800, "height": 1000})
    page.wait_for_timeout(300)
    page.screenshot(path=pictures / "time_response_dark_800.png", full_page=True)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_below_the_critical_stiffness_the_rub_dies_away_and_its_figures_can_be_saved(rub):
    page = rub.page
    field(page, "Kₑ of the liner").fill("5000")
    field(response_form(page), "Revolutions", "fieldset").fill("60")
    sentence = ask_response(page)
    assert "dies away" in sentence and "the exact core agrees: permanent contact is stable" in sentence
    assert page.locator(".verdict.good").count() == 1
    for what, name in (("the figures as CSV", "rub-growth.csv"), ("as SVG", "rub-growth.svg")):
        with page.expect_download() as saved:
            page.get_by_role("button", name=f"Growth of the vibration: save {what}").click()
        assert saved.value.suggested_filename == name
        text = saved.value.path().read_text()
        assert text.startswith("revolution,change_um\n") if name.endswith("csv") else "<svg" in text
    assert len(text) > 1000


def test_a_liner_worn_through_ends_the_simulation_and_the_page_says_when(rub):
    page = rub.page
    page.get_by_text("Friction, thickness, steps").click()
    field(page, "Thickness of the liner").fill("0.3")
    sentence = ask_response(page)
    found = re.search(r"worn through in revolution (\d+)", sentence)
    assert found and 20 < int(found[1]) < 40
    assert f"after {found[1]} revolutions" in page.inner_text(".tables")
    with page.expect_download() as saved:
        page.get_by_role(
            "button", name="Two revolutions about the largest displacement: save the figures"
        ).click()
    moved = [float(line.split(",")[1]) for line in saved.value.path().read_text().splitlines()[1:]]
    assert max(moved) < -10.0  # pressed back by the liner to the last, and not at rest afterwards


def test_an_oval_casing_lets_the_tip_go_and_the_page_says_that_the_two_are_not_comparable(rub, pictures):
    page = rub.page
    response_form(page).get_by_label("The casing").select_option("oval")
    assert field(response_form(page), "Ovalisation", "fieldset").input_value() == "200"
    sentence = ask_response(page)
    assert "settles" in sentence and "permanent contact is unstable" in sentence
    assert "different questions" in sentence
    page.locator(".result").screenshot(path=pictures / "time_oval.png")


def test_a_wear_map_has_every_speed_with_the_exact_core_beside_it(service, rub, pictures):
    page = rub.page
    for label, value in (("From", "95"), ("to", "120"), ("Speeds", "9"), ("Revolutions at each", "30")):
        field(wear_form(page), label, "fieldset").fill(value)
    page.get_by_role("button", name="Wear map round this speed").click()
    sentence = at_the_end(page)
    newest = httpx.get(f"{service.url}/v1/simulations", trust_env=False).json()["jobs"][0]["id"]
    found = httpx.get(f"{service.url}/v1/simulations/{newest}/results", trust_env=False).json()
    assert len(found["speed_hz"]) == 9 and found["unstable_speeds_hz"]
    assert f"calls {found['stable'].count(False)} of 9 simulated speeds unstable" in sentence
    charts = page.locator(".wear .plot")
    assert charts.count() == 4
    assert page.locator(".wear .heatmaplayer image").count() == 2
    bars = page.locator(".wear .plot").first.locator(".shapelayer path")
    assert bars.count() == len(found["unstable_speeds_hz"])
    page.get_by_text("Figures by speed").click()
    rows = page.locator(".wear tbody tr")
    assert rows.count() == 9
    said = rows.locator("td:nth-of-type(1)").all_inner_texts()
    assert said == ["stable" if stable else "unstable" for stable in found["stable"]]
    page.screenshot(path=pictures / "time_wear.png", full_page=True)
    assert serious(page) == []
    page.get_by_role("button", name="Look closer at 120 Hz").click()
    assert field(page, "Rotor speed").input_value() == "120"
    page.select_option("#speed-unit", "rpm")
    assert field(page, "Rotor speed").input_value() == "7200"
    assert "rpm" in page.inner_text(".verdict")


def test_what_the_service_refuses_is_said_at_its_field_and_nothing_typed_is_lost(rub, pictures):
    page = rub.page
    rub.expected = ["422", "413"]

    def refused(form, label: str, value: str, said: str, button: str) -> None:
        entry = field(form, label, "fieldset")
        before = entry.input_value()
        entry.fill(value)
        page.get_by_role("button", name=button).click()
        problem = page.locator(".question .problem:visible")
        problem.wait_for()
        assert said in problem.inner_text()
        assert problem.get_attribute("role") == "alert"
        assert entry.get_attribute("aria-invalid") == "true"
        assert problem.get_attribute("id") in entry.get_attribute("aria-describedby")
        assert entry.input_value() == value
        entry.fill(before)
        assert page.locator(".question .problem:visible").count() == 0

    response, wear, whole = response_form(page), wear_form(page), page.locator(".question")
    one, many = "Response at this speed", "Wear map round this speed"
    refused(response, "Clearance", "-100", "the tip reaches into the liner", one)
    refused(response, "Revolutions", "100000", "give at most 1000", one)
    refused(wear, "Lobes of the ovalisation", "0", "from 1 to 200", many)
    refused(wear, "to", "5000", "modal data from 0 to", many)
    refused(wear, "Speeds", "1", "2 speeds or more", many)
    refused(whole, "Kₑ of the liner", "1e7", "springs back whole", one)
    page.get_by_text("Friction, thickness, steps").click()
    refused(whole, "Friction coefficient", "-1", "from 0 up to 10", one)
    field(response, "Clearance", "fieldset").fill("-100")
    page.get_by_role("button", name=one).click()
    page.wait_for_selector(".question .problem:visible")
    page.screenshot(path=pictures / "time_refused.png", full_page=True)
    assert serious(page) == []
    assert page.locator(".result *").count() == 0


def test_a_job_is_cancelled_and_an_earlier_one_opened_again_and_kept_in_the_link(service, opened):
    page = opened(service, link()).page
    field(wear_form(page), "Speeds", "fieldset").fill("1000")
    field(wear_form(page), "Revolutions at each", "fieldset").fill("100")
    page.get_by_role("button", name="Wear map round this speed").click()
    page.get_by_role("button", name="Cancel").click()
    page.wait_for_selector(".job .state:text-matches('^Cancelled')")
    page.get_by_text("Earlier simulations").first.click()
    assert "cancelled" in page.locator(".earlier tbody tr").first.inner_text()
    field(response_form(page), "Revolutions", "fieldset").fill("40")
    sentence = ask_response(page)
    page.get_by_role("button", name="Open").nth(1).click()
    page.wait_for_selector(".job .state:text-matches('^Cancelled')")
    page.get_by_role("button", name="Open").first.click()
    page.wait_for_selector(".response .plot .main-svg")
    assert page.inner_text(".verdict") == sentence
    before = page.evaluate("location.hash")
    page.click("#copy-link")
    page.wait_for_function("before => location.hash !== before", arg=before)
    again = opened(service, page.evaluate("location.hash")).page
    again.wait_for_selector(".response .plot .main-svg")
    assert again.inner_text(".verdict") == sentence


def test_a_key_that_may_only_read_sees_why_it_cannot_simulate(tmp_path, opened):
    database = open_database(tmp_path)
    _, key = KeyStore(database).create("visitor", Role.read)
    database.close()
    service = ServedProcess(tmp_path, free_port(), {"auth": "on", "run_jobs": "false"}).start()
    try:
        watched = opened(service, link(), go=False)
        watched.page.add_init_script(f"sessionStorage.setItem('rubscreen.key', {json.dumps(key)})")
        watched.open(link())
        page = watched.page
        for name in ("Response at this speed", "Wear map round this speed"):
            assert page.get_by_role("button", name=name).is_disabled()
        assert "role “read”" in page.locator(".question .warning").inner_text()
        assert serious(page) == []
    finally:
        service.kill()
