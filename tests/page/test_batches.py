"""Batches in the browser: asked for, watched, ranked, filtered, taken away; refused where it has to be."""

from __future__ import annotations

import csv
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from served_process import ServedProcess, free_port

from sdm_core.blade import blade_to_dict, example_blade
from service.records.database import open_database
from service.records.keys import KeyStore
from service.roles import Role

DONE = ".job-view .state[data-state=done]"
ROWS = ".ranking tbody tr"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProcess]:
    """One worker, so that the machine is left something."""
    settings = {"engine_workers": "1", "min_free_bytes": "0", "drain_s": "0"}
    process = ServedProcess(tmp_path_factory.mktemp("batches"), free_port(), settings).start()
    yield process
    process.kill()


def batches(opened, service: ServedProcess, **context):
    """The page with its view of batches."""
    watched = opened(service, "page/#view=batches", **context)
    watched.page.wait_for_selector(".order")
    return watched


def screen(page, fields: dict[str, str], points: int = 8) -> None:
    """Fill in the form, and send it."""
    page.get_by_label("Speeds in each map").fill(str(points))
    page.get_by_label("Stiffnesses in each map").fill(str(points))
    for label, text in fields.items():
        page.get_by_label(label, exact=True).fill(text)
    page.locator(".order button.primary").click()


def rows(watched, count: int) -> None:
    """Until the ranking has so many."""
    watched.until(f"document.querySelectorAll('{ROWS}').length === {count}")


def the_job(service: ServedProcess, name: str) -> dict:
    jobs = httpx.get(f"{service.url}/v1/screenings", trust_env=False).json()["jobs"]
    return next(job for job in jobs if job["name"] == name)


@pytest.fixture(scope="module")
def first(service) -> dict:
    """A batch that is done: two examples under the usual contacts, at a liner of 9,000 N/m."""
    question = {
        "name": "the first",
        "blades": [{"example": "nasa_rotor_37"}, {"example": "generic_compressor_blade"}, {"schema": "none"}],
        "ke_liner": 9000.0,
        "criteria": {"least_margin": 0.0},
        "map_shape": [8, 8],
        "bad_blades": "skip",
    }
    with httpx.Client(base_url=service.url, timeout=60.0, trust_env=False) as http:
        job = http.post("/v1/screenings", json=question).json()
        with http.stream("GET", job["links"]["events"]) as events:
            assert '"state":"done"' in list(events.iter_lines())[-2]
        return http.get(job["links"]["self"]).json()


def test_a_batch_is_asked_for_watched_and_ranked(opened, service, pictures):
    watched = batches(opened, service)
    page = watched.page
    page.get_by_label("generic-compressor-blade").check()
    page.screenshot(path=pictures / "batches-form.png", full_page=True)
    assert page.get_by_text("2 blades chosen.").is_visible()
    screen(page, {"Name": "as a user would", "Kₑ of the liner": "9000", "Margin at least": "50"})
    page.wait_for_selector(DONE)
    assert page.get_by_role("heading", name="as a user would").is_visible()
    job = the_job(service, "as a user would")
    assert job["progress"]["total"] == 2 and job["priority"] == 5
    rows(watched, 6)
    results = httpx.get(f"{service.url}{job['links']['results']}", trust_env=False).json()["results"]
    shown = [row.inner_text() for row in page.locator(ROWS).all()]
    for row, found in zip(shown, results, strict=True):
        assert found["blade"] in row and found["contact_name"] in row and found["verdict"] in row
        assert ("met" if found["meets_criteria"] else "missed: margin") in row
    assert page.locator("button.job[aria-current]").inner_text().startswith("as a user would")
    assert page.evaluate("location.hash").startswith("#s=")
    page.screenshot(path=pictures / "batches-done.png", full_page=True)


def test_maps_come_when_their_rows_are_in_sight_and_open_large(opened, service, first):
    watched = opened(service, "page/#view=batches")
    page, asked = watched.page, []
    page.on("request", lambda r: asked.append(r.url) if "map.png" in r.url else None)
    page.set_viewport_size({"width": 1200, "height": 420})
    page.get_by_role("button", name="the first").click()
    watched.until("[...document.querySelectorAll('.small-map img')].some(i => i.naturalWidth > 100)")
    page.wait_for_timeout(1500)
    assert 0 < len(asked) < 6
    page.locator(ROWS).last.scroll_into_view_if_needed()
    watched.until("document.querySelectorAll('.small-map img').length === 6")
    assert len(asked) == len(set(asked)) == 6
    page.get_by_role("button", name="Stability map of nasa-rotor-37, contact both").click()
    page.wait_for_selector("dialog[open] img >> nth=1")
    page.get_by_role("button", name="Close").click()
    assert page.locator("dialog[open]").count() == 0


def test_a_ranking_is_filtered_and_taken_away(opened, service, first, tmp_path):
    watched = batches(opened, service)
    page = watched.page
    page.get_by_role("button", name="the first").click()
    page.wait_for_selector(ROWS)
    page.get_by_label("Contact", exact=True).select_option("TE")
    rows(watched, 2)
    page.get_by_label("Verdict", exact=True).select_option("unstable at some speed")
    page.get_by_text("No result fits.").wait_for()
    page.get_by_label("Contact", exact=True).select_option("")
    page.get_by_label("Criteria", exact=True).select_option("false")
    rows(watched, 2)
    assert all("missed: margin" in row.inner_text() for row in page.locator(ROWS).all())
    for form, whole in (("CSV", 7), ("JSON", 6), ("Parquet", None)):
        with page.expect_download() as download:
            page.get_by_role("button", name=f"Save the ranking as {form}").click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        assert path.name == f"screening-{first['id'][:8]}.{form.lower()}"
        if form == "CSV":
            assert len(list(csv.reader(path.read_text().splitlines()))) == whole
        elif form == "JSON":
            assert len(json.loads(path.read_text())["results"]) == whole
        else:
            assert path.read_bytes()[:4] == b"PAR1"
    with page.context.expect_page() as tab:
        page.get_by_role("button", name="Open the report in a new tab").click()
    report, said = tab.value, []
    report.on("console", lambda message: said.append(message.text))
    report.get_by_role("heading", name="Ranking, safest first").wait_for()
    assert report.evaluate("getComputedStyle(document.body).maxWidth") == "1120px" and said == []


def test_blades_that_could_not_be_screened_are_listed_with_the_reason(opened, service, first):
    watched = batches(opened, service)
    page = watched.page
    page.get_by_role("button", name="the first").click()
    page.get_by_text("1 blade not screened", exact=True).click()
    assert "rubscreen/blade/1" in page.locator(".unscreened td").last.inner_text()


def test_a_link_to_a_batch_survives_a_reload(opened, service, first):
    watched = batches(opened, service)
    page = watched.page
    page.get_by_role("button", name="the first").click()
    page.wait_for_selector(ROWS)
    page.reload()
    page.wait_for_selector(ROWS)
    assert page.get_by_role("heading", name="the first").is_visible()
    assert page.locator(".batches button.job[aria-current]").inner_text().startswith("the first")


def test_a_row_leads_to_the_explorer_with_its_blade_and_contact(opened, service, first):
    watched = batches(opened, service)
    page = watched.page
    page.get_by_role("button", name="the first").click()
    page.get_by_role("button", name="Explore generic-compressor-blade, contact LE").click()
    page.wait_for_selector("#view section.explorer")
    page.get_by_role("link", name="Batches").click()
    page.get_by_role("button", name="New screening").click()
    designs = page.get_by_role("group", name="Designs kept in the explorer").locator("li").all_inner_texts()
    assert [name.strip() for name in designs] == ["nasa-rotor-37", "generic-compressor-blade"]
    assert (
        "“generic-compressor-blade” in the explorer: LE" in page.locator(".order .choice").nth(1).inner_text()
    )


def test_files_are_sent_ahead_and_what_is_wrong_with_them_is_said_at_once(opened, service, tmp_path):
    blade = blade_to_dict(example_blade("generic_compressor_blade"))
    for i in range(2):
        (tmp_path / f"good_{i}.json").write_text(json.dumps(blade | {"name": f"good {i}"}))
    (tmp_path / "torn.json").write_text('{"schema": ')
    (tmp_path / "other.json").write_text('{"schema": "none"}')
    with zipfile.ZipFile(tmp_path / "stage.zip", "w") as archive:
        archive.writestr("inner.json", json.dumps(blade | {"name": "inner"}))
    watched = batches(opened, service)
    page = watched.page
    page.get_by_label("nasa-rotor-37").first.uncheck()
    names = ["good_0.json", "good_1.json", "torn.json", "other.json", "stage.zip"]
    page.get_by_label("choose files").set_input_files([tmp_path / name for name in names])
    page.get_by_text("4 blades chosen.").wait_for()
    listed = " ".join(page.locator(".files li").all_inner_texts())
    assert "torn.json: left out: this is no JSON" in listed and "stage.zip: 1 blade" in listed
    assert "the first that cannot be used: files/other.json.schema = none" in listed
    screen(page, {"Name": "from files"})
    page.wait_for_selector(DONE)
    rows(watched, 9)
    ranked = " ".join(page.locator(f"{ROWS} th").all_inner_texts())
    assert all(name in ranked for name in ("good 0", "files/good_1.json", "inner", "stage.zip/inner.json"))
    assert page.get_by_text("1 blade not screened", exact=True).is_visible()


def test_a_dropped_file_is_taken_and_can_be_taken_away_again(opened, service):
    watched = batches(opened, service)
    page = watched.page
    blade = json.dumps(blade_to_dict(example_blade("nasa_rotor_37")))
    page.locator(".drop").evaluate(
        """(place, text) => {
            const data = new DataTransfer();
            data.items.add(new File([text], "dropped.json"));
            place.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true }));
        }""",
        blade,
    )
    page.get_by_text("2 blades chosen.").wait_for()
    page.get_by_role("button", name="Remove dropped.json").click()
    page.get_by_text("1 blade chosen.").wait_for()


def test_what_is_refused_is_said_at_its_field_and_nothing_typed_is_lost(opened, service):
    watched = opened(service, "page/#view=batches")
    watched.expected.append("422")
    page = watched.page
    screen(page, {"Name": "too stiff a liner", "Kₑ of the liner": "30000"})
    fault = page.locator(".order .problem:visible")
    fault.wait_for()
    assert "ke_liner" in fault.inner_text() and "give at most ke_max, 25000 N/m" in fault.inner_text()
    field = page.get_by_label("Kₑ of the liner")
    assert field.get_attribute("aria-invalid") == "true"
    assert field.evaluate("field => field === document.activeElement")
    assert page.get_by_label("Name", exact=True).input_value() == "too stiff a liner"
    page.get_by_label("nasa-rotor-37").first.uncheck()
    page.locator(".order button.primary").click()
    assert "Choose at least one blade" in page.locator(".order .problem:visible").inner_text()


def test_a_batch_is_cancelled_and_its_rest_is_run(opened, service, tmp_path):
    blade = blade_to_dict(example_blade("generic_compressor_blade"))
    many = tmp_path / "many.ndjson"
    many.write_text("\n".join(json.dumps(blade | {"name": f"blade {i}"}) for i in range(40)))
    watched = batches(opened, service)
    page = watched.page
    page.get_by_label("choose files").set_input_files(many)
    page.get_by_text("41 blades chosen.").wait_for()
    screen(page, {"Name": "long"}, points=60)
    page.get_by_role("button", name="Cancel", exact=True).click()
    page.wait_for_selector(".job-view .state[data-state=cancelled]")
    page.get_by_role("button", name="Run the rest").click()
    page.wait_for_selector(".job-view .state[data-state=running], .job-view .state[data-state=queued]")
    assert page.get_by_text("attempt 2").is_visible()
    page.get_by_role("button", name="Cancel", exact=True).click()
    page.wait_for_selector(".job-view .state[data-state=cancelled]")


def test_a_batch_is_followed_over_a_restart_of_the_service(opened, service):
    watched = opened(service, "page/#view=batches")
    watched.expected += ["ERR_", "Failed to load resource"]
    page = watched.page
    page.get_by_label("generic-compressor-blade").check()
    screen(page, {"Name": "over a restart"}, points=40)
    page.wait_for_selector(".job-view")
    service.kill()
    page.locator("#banner").wait_for()
    service.start()
    page.locator("#banner").wait_for(state="hidden")
    page.wait_for_selector(DONE)
    rows(watched, 6)


def test_a_reader_sees_batches_and_is_told_why_none_can_be_started(opened, tmp_path):
    database = open_database(tmp_path, None)
    keys = {
        role: KeyStore(database).create(f"{role.value} desk", role)[1] for role in (Role.read, Role.submit)
    }
    database.close()
    service = ServedProcess(
        tmp_path, free_port(), {"auth": "on", "engine_workers": "1", "drain_s": "0"}
    ).start()
    try:
        for role, key in keys.items():
            page = opened(service, go=False).page
            page.add_init_script(f"sessionStorage.setItem('rubscreen.key', '{key}')")
            page.goto(f"{service.url}/page/#view=batches")
            page.get_by_text("There are none yet.").wait_for()
            assert page.locator(".order button.primary").is_enabled() == (role is Role.submit)
            why = page.locator(".order .warning:visible").all_inner_texts()
            assert len(why) == (role is Role.read)
            assert all("“read desk”" in text and "role submit" in text for text in why)
    finally:
        service.kill()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_it_can_be_read_and_used_by_other_means(opened, service, first, pictures: Path, theme):
    watched = batches(opened, service, color_scheme=theme)
    page = watched.page
    assert watched.violations() == []
    page.get_by_role("button", name="the first").click()
    page.wait_for_selector(".small-map img")
    page.get_by_text("1 blade not screened", exact=True).click()
    assert watched.violations() == []
    page.set_viewport_size({"width": 800, "height": 1000})
    page.screenshot(path=pictures / f"batches-{theme}-800.png", full_page=True)
