"""Maps refined at the boundary only, against verdicts at points they never asked for."""

import numpy as np
import pytest
from named_problems import benchmark_blade

from sdm_core.adaptive_map import adaptive_map
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput


def wrong_share(contact: ContactConfiguration, low: float, high: float, ke_max: float, tolerance: float):
    blade = benchmark_blade()
    found = adaptive_map(blade, contact, low, high, ke_max, tolerance=tolerance)
    rng = np.random.default_rng(1)
    speed, ke = rng.uniform(low, high, 400), rng.uniform(0, ke_max, 400)
    truth = verdicts(blade, contact, speed, ke)
    return found, (found.stable(speed, ke) != truth)[~np.isnan(truth)].mean()


def test_the_map_of_edges_gives_the_verdicts_between_its_speeds():
    found, wrong = wrong_share(ContactConfiguration.at("tip"), 0.12, 0.45, 3.9, 0.01)
    assert found.within <= 0.01
    assert wrong < 0.01
    assert len(found.boundary.speed_hz) < 2000


def test_a_finer_tolerance_asks_for_more_speeds_and_errs_less():
    contact = ContactConfiguration.at("tip")
    coarse, many = wrong_share(contact, 0.12, 0.45, 3.9, 0.3)
    fine, few = wrong_share(contact, 0.12, 0.45, 3.9, 0.001)
    assert len(fine.boundary.speed_hz) > len(coarse.boundary.speed_hz)
    assert few <= many and fine.within <= 0.001


def test_with_arcs_too():
    contact = ContactConfiguration({"tip": 1.0}, [[0.0, 0.25], [0.5, 0.75]])
    found, wrong = wrong_share(contact, 0.3, 0.45, 3.9, 0.05)
    assert wrong < 0.02 and np.diff(found.boundary.speed_hz).min() > 0


def test_bad_ranges_are_refused():
    contact = ContactConfiguration.at("tip")
    with pytest.raises(InvalidInput, match="low_hz"):
        adaptive_map(benchmark_blade(), contact, 0.4, 0.2, 1.0)
    with pytest.raises(InvalidInput, match="tolerance"):
        adaptive_map(benchmark_blade(), contact, 0.2, 0.4, 1.0, tolerance=0.0)
    with pytest.raises(InvalidInput, match="ke_max"):
        adaptive_map(benchmark_blade(), contact, 0.2, 0.4, float("nan"))


def test_points_outside_the_map_are_refused_not_called_stable():
    found = adaptive_map(benchmark_blade(), ContactConfiguration.at("tip"), 0.3, 0.4, 2.0)
    for speed, ke, field in (
        (0.35, 2.1, "ke"),
        (0.2, 1.0, "speed_hz"),
        (0.35, float("nan"), "ke"),
        (float("nan"), 1.0, "speed_hz"),
        (0.35, -1.0, "ke"),
    ):
        with pytest.raises(InvalidInput, match=field):
            found.stable(speed, ke)
    with pytest.raises(InvalidInput, match="ke"):
        found.stable([0.35, 0.36], [1.0, 1.0, 1.0])


UNUSABLE = [(0.0, 0.4), (-5.0, 0.4), (0.2, float("inf")), ("x", 0.4), (0.3, 0.3 + 1e-9)]


@pytest.mark.parametrize("low, high", UNUSABLE)
def test_an_unusable_range_of_speeds_is_refused(low, high):
    with pytest.raises(InvalidInput, match=r"low_hz|high_hz"):
        adaptive_map(benchmark_blade(), ContactConfiguration.at("tip"), low, high, 1.0)
