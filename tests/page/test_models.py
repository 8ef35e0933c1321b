"""Models in the browser: what the active one promises, what was found about it, and its exchange."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from nearby_models import nearby
from served_process import ServedProcess, free_port

from sdm_core.blade import blade_to_dict, example_blade
from service.audit.tally import Promise, Tally
from service.records import audits
from service.records.database import open_database
from service.records.keys import KeyStore
from service.roles import Role
from training.activation import FIRST, SHIPPED, activate, active_id

SHIPPED_ID = active_id(SHIPPED)
CARD = json.loads((SHIPPED / SHIPPED_ID / "card.json").read_text())


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> tuple[Path, str]:
    """A data folder with the shipped model, active, and a worse one, of which an alarm is on record."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copytree(SHIPPED / SHIPPED_ID, folder / "models" / SHIPPED_ID)
    activate(SHIPPED_ID, folder / "models", FIRST, expected=None)
    worse = nearby(folder / "models", 1.4, figures=None).id
    database = open_database(folder, None)
    audits.add(database, {Promise(worse, "permanent", 5e-4): Tally(answered_stable=1000, false_stable=60)})
    database.close()
    return folder, worse


@pytest.fixture(scope="module")
def service(data) -> Iterator[ServedProcess]:
    settings = {"engine_workers": "1", "models_poll_s": "0.1", "audit_share_of_time": "1.0", "drain_s": "0"}
    process = ServedProcess(data[0], free_port(), settings).start()
    yield process
    process.kill()


def models(opened, service: ServedProcess, **context):
    """The page with its view of models."""
    watched = opened(service, "page/#view=models", **context)
    watched.page.wait_for_selector(".models-table")
    return watched


def panel(page, name: str):
    return page.get_by_role("region", name=name, exact=True)


def test_the_active_model_is_told_in_words_and_figures(opened, service, pictures):
    page = models(opened, service).page
    assert page.get_by_role("heading", name=f"The model that answers, {SHIPPED_ID}").is_visible()
    made = panel(page, "What it was made of").inner_text()
    assert "245,760 labels" in made and "3 residual blocks of 192 units" in made and "calibrated by" in made
    assert "1.3 to 6" in made and "0.045 to 0.9" in made
    promised = panel(page, "Certificate").locator("tbody tr").all_inner_texts()
    assert len(promised) == sum(len(one["table"]) for one in CARD["certificates"])
    assert promised[3].split("\t") == ["0.05 %", "1.17 %", "10", "100,210", "0", "0 %"]
    tables = panel(page, "Evaluation").locator("table")
    assert tables.count() == 2 and "Permanent contact" in tables.first.locator("caption").inner_text()
    arcs = tables.nth(1).locator("tbody tr").all_inner_texts()
    assert "8 of 12,363" in arcs[2] and "0.0647 %" in arcs[2] and "6 of 675" in arcs[3]
    page.screenshot(path=pictures / "models.png", full_page=True)


def test_the_learning_curve_is_that_of_the_card(opened, service, tmp_path):
    page = models(opened, service).page
    page.wait_for_selector(".plot .scatterlayer .trace >> nth=1", state="attached")
    with page.expect_download() as download:
        page.get_by_role("button", name="Learning curve: save the figures as CSV").click()
    download.value.save_as(tmp_path / "curve.csv")
    _, *rows = csv.reader((tmp_path / "curve.csv").read_text().splitlines())
    found = {(contact, int(labels)): float(share) for contact, labels, share in rows}
    for one in CARD["dataset"]["rounds"]:
        for contact, share in one["verified_share"].items():
            assert found.pop((contact, one["labels"])) == share
    certified = {one["contact"]: one["table"][3]["verified_share"] for one in CARD["certificates"]}
    assert found == {(contact, CARD["dataset"]["labels"]): share for contact, share in certified.items()}


def test_audits_are_counted_while_one_looks_and_an_alarm_of_another_model_is_shown_there(
    opened, service, data
):
    page = models(opened, service).page
    audit = panel(page, "Audit")
    blade = blade_to_dict(example_blade("nasa_rotor_37"))
    question = {
        "blade": blade,
        "contact": {"weights": {"LE": 1.0}},
        "speed_hz": [150.0, 220.0],
        "ke": [500.0, 600.0],
    }
    for _ in range(4):
        assert httpx.post(f"{service.url}/v1/stability", json=question, trust_env=False).status_code == 200
    audit.get_by_role("table").wait_for()
    assert "No alarm: 0 of" in audit.inner_text() and "permanent contact" in audit.inner_text()
    page.get_by_role("button", name=f"Look at {data[1]}").click()
    audit.get_by_role("alert").wait_for()
    assert "Alarm: more of the answers" in audit.get_by_role("alert").inner_text()
    assert "60" in audit.locator("tbody td").all_inner_texts() and "alarm since" in audit.inner_text()


def test_a_worse_model_is_refused_with_reasons_forced_only_apart_from_that_and_rolled_back(
    opened, service, data, pictures
):
    watched = opened(service, "page/#view=models")
    watched.expected.append("409")
    page, worse = watched.page, data[1]
    page.get_by_role("button", name=f"Make {worse} the active model").click()
    dialog = page.get_by_role("dialog")
    assert "in place of" in dialog.inner_text() and SHIPPED_ID in dialog.inner_text()
    assert dialog.get_by_role("button", name="Leave everything as it is").evaluate(
        "b => b === document.activeElement"
    )
    dialog.get_by_role("button", name="Check it, and make it active").click()
    dialog.get_by_role("alert").wait_for()
    reasons = dialog.get_by_role("alert").get_by_role("listitem").all_inner_texts()
    assert any("arcs of contact" in reason for reason in reasons) and len(reasons) >= 2
    page.screenshot(path=pictures / "models-refused.png")
    forced = dialog.get_by_role("button", name="Make it active by force")
    assert forced.is_disabled() and active_id(data[0] / "models") == SHIPPED_ID
    dialog.get_by_label("I have read why it is worse").check()
    forced.click()
    dialog.get_by_text(f"{worse} is the active model now, after {SHIPPED_ID}.").wait_for()
    dialog.get_by_role("button", name="Close").click()
    assert active_id(data[0] / "models") == worse
    page.get_by_role("heading", name=f"The model that answers, {worse}").wait_for()
    history = panel(page, "History")
    assert "promoted by force" in history.inner_text() and reasons[0] in history.inner_text()
    watched.until(f"document.getElementById('about').textContent.includes('{worse}')")
    page.get_by_role("button", name="Roll back…").click()
    dialog.get_by_role("button", name="Roll back", exact=True).click()
    dialog.get_by_text(f"{SHIPPED_ID} is the active model now, after {worse}.").wait_for()
    dialog.get_by_role("button", name="Close").click()
    assert "rolled back" in history.locator("tbody tr").first.inner_text()
    assert active_id(data[0] / "models") == SHIPPED_ID


def test_who_may_not_exchange_models_is_not_offered_it(opened, tmp_path):
    database = open_database(tmp_path, None)
    key = KeyStore(database).create("design office", Role.submit)[1]
    database.close()
    service = ServedProcess(
        tmp_path, free_port(), {"auth": "on", "engine_workers": "1", "drain_s": "0"}
    ).start()
    try:
        page = opened(service, go=False).page
        page.add_init_script(f"sessionStorage.setItem('rubscreen.key', '{key}')")
        page.goto(f"{service.url}/page/#view=models")
        page.get_by_text("Exchanging the model takes a key of role admin.").wait_for()
        assert page.get_by_role("button", name="Roll back…").count() == 0
    finally:
        service.kill()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_it_can_be_read_and_used_by_other_means(opened, service, data, pictures, theme):
    watched = models(opened, service, color_scheme=theme)
    page = watched.page
    page.wait_for_selector(".plot .scatterlayer .trace", state="attached")
    page.get_by_role("button", name=f"Look at {data[1]}").click()
    panel(page, "Audit").get_by_role("alert").wait_for()

    assert watched.violations() == []
    page.set_viewport_size({"width": 800, "height": 1000})
    page.screenshot(path=pictures / f"models-{theme}-800.png", full_page=True)
    page.get_by_role("button", name=f"Make {data[1]} the active model").click()
    assert watched.violations() == []
