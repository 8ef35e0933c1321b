"""Lobes of one mode under arcs of contact: the exact core's, to many digits, with derivatives."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sdm_core.floquet.arc_boundary import arc_crossings
from training.contact_class import ARCS
from training.features import CaseTensors, features
from training.labelling import critical_kappa
from training.reference_space import reference_sample


@pytest.fixture(scope="module")
def single_modes():
    """Blades of one mode in random arcs, and all their crossings up to κ = 1."""
    cases = reference_sample(250, 5, ARCS).cases
    cases = cases[cases.mode_count == 1]
    crossings = [arc_crossings(cases.problem(i), s) for i, s in enumerate(cases.stiffness_scale)]
    there = np.array([len(found.ke) > 0 for found in crossings])
    return cases[there], [found for found in crossings if len(found.ke)]


def test_baseline_of_a_single_mode_is_its_exact_first_crossing(single_modes):
    cases, crossings = single_modes
    exact = np.array([found.ke[0] for found in crossings]) / cases.stiffness_scale
    baseline = 10 ** features(CaseTensors.of(cases)).baseline.numpy()
    assert len(cases) > 40
    np.testing.assert_allclose(baseline, exact, rtol=1e-5)


def test_flips_at_half_the_rotor_speed_are_among_them(single_modes):
    cases, crossings = single_modes
    half = [
        abs(found.frequency_hz[0] / speed % 1.0 - 0.5) < 1e-6
        for found, speed in zip(crossings, cases.speed_hz, strict=True)
    ]
    assert sum(half) >= 5


@pytest.mark.parametrize("name", ["omega", "damping_ratio", "speed_hz", "arcs"])
def test_baseline_has_the_derivatives_of_its_differences(name, single_modes):
    cases = CaseTensors.of(single_modes[0])
    given = getattr(cases, name)
    moved = torch.zeros_like(given)
    moved.view(len(given), -1)[:, 0] = 1e-6 if name == "arcs" else 1e-6 * given.view(len(given), -1)[:, 0]
    variable = given.clone().requires_grad_()
    features(replace(cases, **{name: variable})).baseline.sum().backward()
    analytic = (variable.grad * moved).view(len(given), -1)[:, 0]
    with torch.no_grad():
        above, below = (features(replace(cases, **{name: given + s * moved})).baseline for s in (1, -1))
    numeric = 0.5 * (above - below)
    close = torch.isclose(analytic, numeric, rtol=1e-4, atol=1e-10)
    assert close.float().mean() > 0.97  # a case may lie where two lobes are equally low


def test_labels_with_arcs_are_first_crossings_of_the_exact_core():
    cases = reference_sample(60, 6, ARCS).cases
    kappa = critical_kappa(cases, workers=1)
    for i, scale in enumerate(cases.stiffness_scale):
        found = arc_crossings(cases.problem(i), 1.5 * scale)
        first = found.ke[0] / scale if len(found.ke) else np.inf
        assert kappa[i] == pytest.approx(first, rel=3e-4), i
