"""Designs side by side."""

from __future__ import annotations

import pytest

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke

LE = ContactConfiguration.at("LE")


@pytest.fixture
def compared(service, opened):
    """Rotor 37 and the generic blade, each with its leading edge in contact."""
    page = opened(service)
    page.drawn()
    page.page.click("text=Leading edge (LE)")
    page.page.click("nav >> text=Compare")
    page.page.select_option(".compare select >> nth=0", label="generic-compressor-blade")
    page.page.select_option(".compare select >> nth=1", label="leading edge")
    page.page.click("text=Add to the comparison")
    page.until("document.querySelector('.compare .verdict').innerText.includes('Safest')", 60.0)
    return page


def test_the_safer_of_two_blades_is_named_with_what_both_stand(compared, pictures):
    compared.until("document.querySelectorAll('.compare .halves tbody tr').length > 0")
    compared.until("document.querySelector('.compare .key').innerText.includes('both stable')")
    compared.page.screenshot(path=pictures / "compare.png", full_page=True)
    told = compared.text(".compare .verdict")
    assert "Safest: generic-compressor-blade · LE (stays stable at 15,000 N/m at every speed)" in told
    assert "Least safe: nasa-rotor-37 · LE (chatters at 15,000 N/m in 55.5 % of its speeds)" in told
    table = compared.text(".compare table")
    for name in ("nasa_rotor_37", "generic_compressor_blade"):
        blade = example_blade(name)
        low, high = 0.3 * blade.design_speed_hz, 1.05 * blade.design_speed_hz
        (worst,) = least_critical_ke(blade, LE, low, high, 2.5e4, count=1)
        assert f"{worst.ke:,.0f}" in table and f"{worst.speed_rpm:,.0f}" in table


def test_what_to_change_names_amplitude_frequency_and_damping(compared):
    compared.until("document.querySelectorAll('.compare .halves tbody tr').length >= 3")
    rows = [row.inner_text() for row in compared.page.locator(".compare .halves tbody tr").all()]
    assert [row.split("\t")[0].strip() for row in rows[:3]] == [
        "amplitude of mode 1 at LE",
        "frequency of mode 1",
        "damping of mode 1",
    ]
    # K_e goes with ω²/φ² and with damping.
    assert [round(float(row.split("\t")[2].replace("−", "-"))) for row in rows[:3]] == [-2, 2, 1]
    # 18,000 N/m from 8,158 N/m takes 2.2 times the damping.
    assert "+119 %" in rows[2] or "+120 %" in rows[2]


def test_a_design_kept_in_the_explorer_is_compared_with_what_became_of_it(service, opened):
    page = opened(service)
    page.drawn()
    page.page.click("text=Keep for comparison")
    page.slide("damping", 0.5)
    page.drawn()
    page.page.click("nav >> text=Compare")
    page.until("document.querySelector('.compare .verdict').innerText.includes('Safest')", 60.0)
    assert "Safest: nasa-rotor-37 · LE + TE · damping × 3.162" in page.text(".compare .verdict")
    page.until("document.querySelector('.compare .key').innerText.includes('both stable')")
    # More damping never makes this blade less stable.
    assert "design 1 stable, design 2 not: 0 %" in page.text(".compare .key")
    page.page.click("[aria-label^='Remove'] >> nth=1")
    page.until("document.querySelector('.compare .verdict').innerText.includes('One design so far')")
