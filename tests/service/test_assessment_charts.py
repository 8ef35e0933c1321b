"""Charts of an assessment show what it holds; what they look like is for eyes."""

from __future__ import annotations

import io
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from sdm_core.assessment import assess
from sdm_core.assessment.clearance import clearance_use
from sdm_core.assessment.mode_lobes import mode_boundaries
from sdm_core.assessment.robust import robust_at_speeds
from sdm_core.assessment.robust_band import robust_band
from sdm_core.blade import example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from service.screening.assessment_charts import campbell_png, clearance_png, mode_lobes_png, robust_png

LE, SPAN, KE_MAX = ContactConfiguration.at("LE"), (180.0, 300.0), 2.5e4
SPEEDS = np.linspace(*SPAN, 120)
BAND_GREY, UNSTABLE_GREY = 0.82, 0.86


@pytest.fixture(scope="module")
def found():
    return assess(example_blade("nasa_rotor_37"), LE, SPAN, ke_liner=9e3, cold_clearance_m=4e-4, robust=False)


@pytest.fixture(scope="module")
def full():
    return boundary(example_blade("nasa_rotor_37"), LE, SPEEDS, KE_MAX, truncation=False)


def pixels(png: bytes) -> np.ndarray:
    return matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]


def share(png: bytes, grey: float) -> float:
    return float(np.mean(np.all(np.abs(pixels(png) - grey) < 0.005, axis=-1)))


def test_every_chart_is_wide_enough_for_print(found, full):
    blade = found.blade
    band = robust_band(blade, LE, SPEEDS[::6], KE_MAX)
    charts = (
        campbell_png(found),
        mode_lobes_png(found, full, mode_boundaries(blade, LE, SPEEDS, KE_MAX)),
        clearance_png(found.clearance, blade.name, found.kinds),
        robust_png(band, blade.name, full),
    )
    for png in charts:
        height, width, _ = pixels(png).shape
        assert width >= 2000
        assert height >= 1400


def test_lobes_are_drawn_in_the_campbell_diagram_where_there_are_some(found):
    none = replace(found, campbell=replace(found.campbell, lobe_points=()))
    assert np.count_nonzero(pixels(campbell_png(found)) < 0.1) > np.count_nonzero(
        pixels(campbell_png(none)) < 0.1
    )


def test_grey_is_what_the_whole_blade_has_unstable(found, full):
    none = replace(full, critical_ke=np.full(len(SPEEDS), np.nan))
    everything = replace(full, critical_ke=np.zeros(len(SPEEDS)))
    empty, some, whole = (
        share(mode_lobes_png(found, f, {}), UNSTABLE_GREY) for f in (none, full, everything)
    )
    covered = np.mean(1 - np.nan_to_num(full.critical_ke, nan=KE_MAX) / KE_MAX)
    assert (some - empty) / (whole - empty) == pytest.approx(covered, abs=0.03)


def test_the_band_of_uncertain_damping_is_filled_and_its_verdict_named(found, full):
    blade = found.blade
    band = robust_band(blade, LE, SPEEDS[::6], KE_MAX)
    narrow = replace(band, lowest_damped=band.lowest)
    assert (
        share(robust_png(band, "b", full), BAND_GREY) > 0.1 > share(robust_png(narrow, "b", full), BAND_GREY)
    )
    verdict = robust_at_speeds(blade, LE, [241.0], KE_MAX, ke_liner=9e3)
    with_verdict = robust_png(band, "b", full, verdict, ke_liner=9e3)
    assert np.count_nonzero(pixels(with_verdict) < 0.1) > np.count_nonzero(
        pixels(robust_png(band, "b", full)) < 0.1
    )


def test_a_tip_that_cuts_in_and_untwists_is_drawn_too(found):
    states = [
        replace(
            s,
            tip_growth_m=np.linspace(3e-4, 6e-4, 9) * (s.speed_hz / 280) ** 2,
            untwist_rad=1e-4 * s.speed_hz,
        )
        for s in found.blade.states
    ]
    use = clearance_use(replace(found.blade, states=states), SPAN, 4e-4)
    assert (use.running_clearance_m < 0).any()
    assert clearance_png(use, "b") != clearance_png(found.clearance, "b")


def test_without_a_cold_clearance_there_is_nothing_to_draw(found):
    with pytest.raises(InvalidInput, match="cold clearance"):
        clearance_png(clearance_use(found.blade, SPAN), "b")
