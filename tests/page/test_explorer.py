"""The explorer as an engineer uses it."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest

from sdm_core.assessment.needed_damping import needed_damping
from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke

ROTOR_37 = example_blade("nasa_rotor_37")
BOTH = ContactConfiguration.at("LE", "TE")
USUAL = (0.3 * ROTOR_37.design_speed_hz, 1.05 * ROTOR_37.design_speed_hz)
MAP = ".plot.map"


def figures(text: str) -> list[float]:
    return [float(found.replace(",", "")) for found in re.findall(r"\d[\d,]*(?:\.\d+)?", text)]


@pytest.fixture
def explorer(service, opened):
    page = opened(service)
    page.drawn()
    return page


def point_of(page, speed_hz: float, ke: float) -> tuple[float, float]:
    """Where on the screen a point of the map is."""
    return tuple(
        page.page.evaluate(
            """([rpm, ke]) => {
              const plot = document.querySelector(".plot.map"), box = plot.getBoundingClientRect();
              const {xaxis, yaxis} = plot._fullLayout;
              return [box.left + xaxis._offset + xaxis.d2p(rpm), box.top + yaxis._offset + yaxis.d2p(ke)];
            }""",
            [60.0 * speed_hz, ke],
        )
    )


def test_the_first_blade_is_answered_as_the_exact_core_answers_it(explorer, pictures):
    explorer.settled()
    explorer.page.screenshot(path=pictures / "explorer.png", full_page=True)
    told = explorer.text(".findings")
    (worst,) = least_critical_ke(ROTOR_37, BOTH, *USUAL, 2.5e4, count=1)
    needed = needed_damping(ROTOR_37, BOTH, USUAL, 1.5e4)
    assert f"Worst speed: {worst.speed_rpm:,.0f} rpm, where {worst.ke:,.0f} N/m is enough" in told
    assert f"mode 1 chatters at {worst.chatter_hz:.1f} Hz" in told
    assert f"ξ = {needed.damping_ratio[0]:.3g}" in told
    assert "✕ chatters" in told


def test_what_the_map_shows_is_what_the_exact_core_says(explorer):
    """Verdicts of the drawn map against the exact boundary drawn on it, away from the boundary."""
    explorer.settled()
    drawn = explorer.page.evaluate(
        """() => {
          const {data} = document.querySelector(".plot.map");
          return {x: data[0].x, y: data[0].y, z: data[0].z, bx: data[1].x, by: data[1].y};
        }"""
    )
    boundary = np.array([np.nan if ke is None else ke for ke in drawn["by"]])
    at = [int(np.argmin(np.abs(np.array(drawn["bx"]) - x))) for x in drawn["x"]]
    z, ke = np.array(drawn["z"]), np.array(drawn["y"])[:, None]
    stable = ((z < 0.3) | (z == 0.8)) & (z != 1.0)
    below = np.isnan(boundary[at]) | (ke < 0.85 * boundary[at])
    # Next to a steep flank the nearest speed of the boundary says little: the deepest of three does.
    safe = below & np.roll(below, 1, axis=1) & np.roll(below, -1, axis=1)
    assert safe.sum() > 10_000
    assert stable[safe].mean() > 0.999


def test_a_slider_brings_another_map_and_another_boundary(explorer):
    explorer.settled()
    before = explorer.text(".findings")
    explorer.slide("damping", 0.5)
    explorer.until(f"!document.querySelector('.findings').innerText.includes({before.splitlines()[-1]!r})")
    explorer.settled()
    told = explorer.text(".findings")
    least = figures(re.search(r"where ([\d,]+) N/m", told)[1])[0]
    was = figures(re.search(r"where ([\d,]+) N/m", before)[1])[0]
    assert "damping × 3.162" in told
    # Of one mode K_e is 2ξ(1 + ξ) times something: more than three times the damping, so much more stiffness.
    assert least / was == pytest.approx(10**0.5, rel=0.02)
    assert explorer.page.evaluate("performance.getEntriesByName('rubscreen: map on screen').length") >= 2


def test_trying_the_damping_that_is_named_makes_the_blade_stable(explorer):
    explorer.page.click("text=Try it")
    explorer.until("document.querySelector('.findings').innerText.includes('✓ stable')")
    explorer.settled()
    assert "is just enough to be stable at 15,000 N/m" in explorer.text(".findings")


def test_the_pointer_reads_verdict_growth_and_frequency(explorer):
    explorer.page.mouse.move(*point_of(explorer, 241.0, 20_000.0))
    explorer.until("document.querySelector('.reading').innerText.includes('exact core')")
    told = explorer.text("section.point")
    assert "✕ unstable" in told and "+" in told and "(mode 2)" in told
    assert figures(told)[0] == pytest.approx(241.0 * 60, rel=2e-3)
    # The other chart shows the same speed.
    assert not explorer.page.evaluate("[...document.querySelectorAll('.hair.vertical')][1].hidden")
    explorer.page.mouse.move(*point_of(explorer, 241.0, 1_000.0))
    explorer.until("document.querySelector('.reading').innerText.includes('✓ stable')")


def test_the_arrow_keys_read_the_map_too_and_enter_chooses(explorer):
    explorer.page.focus(MAP)
    explorer.page.keyboard.press("ArrowUp")
    explorer.until("document.querySelector('#said').textContent.includes('stable')")
    at = explorer.text("section.point h3")
    explorer.page.keyboard.press("Shift+ArrowRight")
    explorer.until(f"document.querySelector('section.point h3').innerText !== {at!r}")
    explorer.page.keyboard.press("Enter")
    explorer.until("document.querySelector('section.point').innerText.includes('chosen')")
    assert explorer.page.is_visible("text=Simulate the rub here")


def test_a_click_chooses_a_point_that_stays_when_the_pointer_leaves(explorer):
    explorer.page.mouse.click(*point_of(explorer, 241.0, 20_000.0))
    explorer.page.mouse.move(5, 5)
    explorer.until("document.querySelector('section.point').innerText.includes('chosen')")
    explorer.until("document.querySelector('.reading').innerText.includes('exact core')")
    assert figures(explorer.text("section.point h3"))[0] == pytest.approx(241.0 * 60, rel=2e-3)


def test_a_chosen_point_is_asked_about_again_when_the_design_changes(explorer):
    explorer.page.mouse.click(*point_of(explorer, 241.0, 12_000.0))
    explorer.page.mouse.move(5, 5)
    explorer.until("document.querySelector('.reading').innerText.includes('✕ unstable')")
    explorer.slide("damping", 0.8)
    explorer.until("document.querySelector('.reading').innerText.includes('✓ stable')")
    explorer.until("document.querySelector('.reading').innerText.includes('exact core')")
    assert "chosen" in explorer.text("section.point")


def test_another_blade_keeps_the_contact(explorer):
    explorer.page.click("text=Trailing edge (TE)")
    explorer.page.select_option("#blade-choice", "generic_compressor_blade")
    explorer.until("document.querySelector('.findings').innerText.includes('generic-compressor-blade · TE')")


def test_a_blade_of_one_state_says_what_that_means(explorer):
    blade = blade_to_dict(ROTOR_37)
    drop(explorer, "one.json", json.dumps(blade | {"states": blade["states"][1:2]}))
    explorer.until("document.querySelector('.controls').innerText.includes('One modal state')")


def test_a_lobe_of_the_table_stands_out_with_its_orders(explorer):
    explorer.page.click("[aria-label='Lobe 1: show on both charts']")
    explorer.until(
        "document.querySelectorAll('figure .note')[1].innerText.includes('between engine orders 10 and 11')"
    )


def test_nodes_and_arcs_are_chosen_on_the_pictures(explorer, pictures):
    explorer.page.click("[data-node=TE]")
    explorer.until("document.querySelector('.findings').innerText.includes('· LE ')")
    ring = explorer.page.locator("svg.ring").bounding_box()
    x, y, r = ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2, 62 / 190 * ring["width"]
    explorer.page.mouse.move(x, y - r)
    explorer.page.mouse.down()
    for angle in np.linspace(0.05, np.pi / 2, 12):
        explorer.page.mouse.move(x + r * np.sin(angle), y - r * np.cos(angle))
    explorer.page.mouse.up()
    explorer.until("document.querySelector('.findings').innerText.includes('LE, 1 arc (25 %)')")
    explorer.settled()
    explorer.page.screenshot(path=pictures / "arcs.png", full_page=True)
    explorer.page.fill("[aria-label='Arc 1 to, degrees']", "-5")
    explorer.page.keyboard.press("Enter")
    assert "ends before it begins" in explorer.text(".ring-and-arcs .problem")
    assert "LE, 1 arc (25 %)" in explorer.text(".findings")


def test_no_node_in_contact_is_told_and_nothing_is_asked(explorer):
    explorer.page.click("[data-node=LE]")
    explorer.page.click("[data-node=TE]")
    assert "No node touches the casing" in explorer.text(".findings [role=alert]")


def test_a_range_that_the_modal_data_do_not_cover_is_refused_at_its_field(explorer):
    explorer.page.fill("label:has-text('to') + input", "30000")
    explorer.page.keyboard.press("Enter")
    assert "stay inside, or add a state" in explorer.text(".controls .problem:visible")
    explorer.page.select_option("#speed-unit", "hz")
    assert figures(explorer.page.input_value("label:has-text('Speeds from') + input")) == [
        pytest.approx(USUAL[0], rel=1e-4)
    ]


def drop(page, name: str, content: str) -> None:
    page.page.evaluate(
        """([name, content]) => {
          const transfer = new DataTransfer();
          transfer.items.add(new File([content], name, {type: "application/json"}));
          const how = {dataTransfer: transfer, bubbles: true, cancelable: true};
          document.body.dispatchEvent(new DragEvent("dragover", how));
          document.body.dispatchEvent(new DragEvent("drop", how));
        }""",
        [name, content],
    )


def test_a_blade_dropped_on_the_page_is_shown(explorer):
    blade = blade_to_dict(example_blade("generic_compressor_blade")) | {"name": "my <b>fan</b> & co"}
    drop(explorer, "fan.json", json.dumps(blade))
    explorer.until("document.querySelector('.findings').innerText.includes('my <b>fan</b> & co')")
    explorer.settled()
    least = least_critical_ke(example_blade("generic_compressor_blade"), BOTH, 60.0, 210.0, 2.5e4, count=1)[0]
    assert f"where {least.ke:,.0f} N/m" in explorer.text(".findings")


NO_BLADES = {
    "hello": "is not JSON",
    '{"schema": "rubscreen/blade/1", "name": "x"}': "blade.tip_nodes = missing",
    '{"schema": "rubscreen/profile/1", "name": "x"}': "the profile needs it",
    "[1, 2]": "give an object",
}


def test_a_file_that_is_no_blade_is_refused_and_nothing_is_lost(explorer, pictures):
    explorer.expected = ["status of 422"]
    before = explorer.text(".findings .design-title")
    for content, told in NO_BLADES.items():
        drop(explorer, "odd.json", content)
        explorer.until(
            f"document.querySelector('.controls [role=alert]').innerText.includes({told!r})", within_s=10.0
        )
        said = explorer.text(".controls [role=alert]")
        assert "cannot be used" in said and "What was shown before stays." in said
        assert explorer.text(".findings .design-title") == before
    explorer.page.screenshot(path=pictures / "bad_file.png")


def test_a_profile_is_built_and_its_thickness_moves_the_map(explorer):
    explorer.page.select_option("#blade-choice", "transonic_profile")
    explorer.until("document.querySelector('.findings').innerText.includes('transonic-example')", 60.0)
    explorer.until("!document.querySelector('.controls').innerText.includes('coarse')", 120.0)
    explorer.settled()
    explorer.slide("Thickness, all sections", 1.05)
    explorer.until("document.querySelector('.sliders + div').innerText.includes('Estimated')", 60.0)
    explorer.settled()
    estimated = figures(re.search(r"where ([\d,]+) N/m", explorer.text(".findings"))[1])[0]
    explorer.until(
        "document.querySelector('.sliders + div').innerText.includes('Built at this shape')", 120.0
    )
    explorer.settled()
    built = figures(re.search(r"where ([\d,]+) N/m", explorer.text(".findings"))[1])[0]
    assert estimated == pytest.approx(built, rel=0.01)


def test_every_chart_is_saved_as_picture_and_as_figures(explorer):
    explorer.settled()
    for title, form in itertools.product(("Stability map", "Campbell diagram"), ("PNG", "SVG", "CSV")):
        with explorer.page.expect_download() as begun:
            explorer.page.click(f"[aria-label^='{title}: save'] >> text={form}")
        content = Path(begun.value.path()).read_bytes()
        assert "nasa-rotor-37_LE_+_TE" in begun.value.suggested_filename
        if form == "PNG":
            assert content.startswith(b"\x89PNG") and len(content) > 10_000
        elif form == "SVG":
            assert b"<svg" in content and b"Rotor speed [rpm]" in content and b"nasa-rotor-37" in content
        else:
            rows = list(csv.DictReader(io.StringIO(content.decode())))
            assert len(rows) == (300 * 150 if title == "Stability map" else 200)
            assert float(rows[0]["speed_hz"]) == pytest.approx(USUAL[0], rel=1e-6)
