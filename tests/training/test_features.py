"""Features: exact single-mode lobes, and invariance to everything that has no physical meaning."""

import numpy as np
import pytest
import torch
from named_problems import AT_TIP, one_mode

from sdm_core.boundary import boundary
from training.cases import MODES, CaseBatch
from training.features import (
    HARMONICS,
    MODE_FEATURES,
    PHASE_FEATURES,
    CaseTensors,
    engagement,
    feature_count,
    feature_names,
    single_mode_lobes,
)
from training.features import features as features_of
from training.reference_space import reference_sample


def features(cases: CaseBatch):
    return features_of(CaseTensors.of(cases))


def case(omega, damping, shape, speed, arcs=None) -> CaseBatch:
    engaged = None if arcs is None else arcs[None]
    return CaseBatch.from_arrays(
        np.array([omega]), np.array(damping), np.array([shape]), np.array([speed]), engaged
    )


@pytest.fixture
def random_case():
    rng = np.random.default_rng(8)
    omega = np.cumprod([100.0, 2.2, 1.5, 1.3])
    return omega, np.full(4, 2e-3) * rng.uniform(0.8, 1.2, 4), rng.normal(size=(3, 4)), 6.3


def test_names_and_numbers_of_features_agree():
    assert len(feature_names()) == feature_count()
    assert set(PHASE_FEATURES) <= set(MODE_FEATURES)


@pytest.mark.parametrize("speed", [0.06, 0.113, 0.2, 0.31, 0.47, 0.71])
def test_lowest_single_mode_lobe_is_the_exact_boundary_of_one_mode(speed):
    xi = 3e-3
    near, other = single_mode_lobes(
        torch.tensor([[xi]], dtype=torch.float64), torch.tensor([[2 * np.pi / speed]], dtype=torch.float64)
    )
    exact = boundary(one_mode(xi), AT_TIP, np.array([speed]), 1e3).critical_ke[0] / (2 * np.pi) ** 2
    assert 10 ** near.log_kappa.item() == pytest.approx(exact, rel=1e-9)
    assert other.log_kappa.item() >= near.log_kappa.item()


def test_features_do_not_depend_on_signs_orders_nodes_or_units(random_case):
    omega, damping, shape, speed = random_case
    rng = np.random.default_rng(1)
    reference = features(case(omega, damping, shape, speed))
    order = rng.permutation(4)
    split = np.vstack([shape[[2, 0]], shape[1:2] * 0.6, shape[1:2] * 0.8])  # 0.36 + 0.64 of one node
    variants = {
        "signs": case(omega, damping, shape * [1, -1, -1, 1], speed),
        "mode order": case(omega[order], damping[order], shape[:, order], speed),
        "nodes": case(omega, damping, split, speed),
        "units": case(7 * omega, damping, 40 * shape, 7 * speed),
    }
    for name, variant in variants.items():
        found = features(variant)
        torch.testing.assert_close(found.inputs, reference.inputs, rtol=1e-5, atol=1e-5, msg=name)
        torch.testing.assert_close(found.baseline, reference.baseline, rtol=1e-9, atol=1e-9)


def test_features_do_not_depend_on_where_round_the_casing_counting_starts(random_case):
    omega, damping, shape, speed = random_case
    arcs = np.array([[0.05, 0.3], [0.5, 0.6], [0.7, 0.95]])
    turned = np.array([[0.0, 0.15], [0.25, 0.5], [0.7, 0.8], [0.9, 1.0]])  # by 0.2, across the start
    found = [features(case(omega, damping, shape, speed, a)) for a in (arcs, turned)]
    torch.testing.assert_close(found[0].inputs, found[1].inputs, rtol=1e-5, atol=1e-5)


def test_engagement_is_its_mean_and_the_moduli_of_its_harmonics():
    arcs = np.array([[0.1, 0.35], [0.5, 0.9]])
    theta = (np.arange(1_000_000) + 0.5) / 1e6
    gamma = sum(((a <= theta) & (theta < b)).astype(float) for a, b in arcs)
    exact = np.abs(np.fft.rfft(gamma)[1 : HARMONICS + 1]) / len(gamma)
    share, harmonics = engagement(torch.tensor(arcs)[None])
    assert share.item() == pytest.approx(0.65)
    np.testing.assert_allclose(harmonics[0].numpy(), exact, atol=3e-6)
    _, none = engagement(torch.tensor([[[0.0, 1.0]]], dtype=torch.float64))
    assert none.abs().max() < 1e-9


def test_arcs_all_round_are_permanent_contact(random_case):
    omega, damping, shape, speed = random_case
    whole = features(case(omega, damping, shape, speed))
    parts = features(case(omega, damping, shape, speed, np.array([[0.0, 0.4], [0.4, 1.0]])))
    torch.testing.assert_close(parts.inputs, whole.inputs, rtol=1e-5, atol=1e-5)


def test_a_mode_that_the_contact_cannot_reach_changes_nothing(random_case):
    omega, damping, shape, speed = random_case
    blind = np.hstack([shape, np.zeros((3, 1))])
    without = features(case(omega, damping, shape, speed))
    extra = features(case(np.r_[omega, 900.0], np.r_[damping, 2e-3], blind, speed))
    torch.testing.assert_close(extra.baseline, without.baseline)
    torch.testing.assert_close(extra.inputs, without.inputs)


def test_features_are_finite_over_the_reference_space():
    found = features(reference_sample(300, seed=4).cases)
    assert torch.isfinite(found.inputs).all()
    assert torch.isfinite(found.baseline).all()


def test_cases_keep_the_first_five_modes_and_count_all():
    omega = np.arange(1.0, 8.0)[::-1]
    found = case(omega, np.full(7, 1e-3), np.ones((1, 7)), 0.3)
    assert found.mode_count[0] == 7
    np.testing.assert_array_equal(found.omega[0], np.arange(1.0, MODES + 1))


def test_each_feature_of_a_single_mode_is_what_its_name_says():
    xi, speed = 3e-3, 0.23
    found = features(case([2 * np.pi], [xi], [[1.0]], speed))
    of_mode = {name: found.inputs[0, feature_names().index(f"{name}_0")].item() for name in MODE_FEATURES}
    exact = boundary(one_mode(xi), AT_TIP, np.array([speed]), 1e3)
    chatter_ratio = exact.chatter_hz[0]
    phase = 2 * np.pi / speed
    u = (chatter_ratio**2 - 1) / (2 * xi * chatter_ratio)
    assert of_mode["sin_phase"] == pytest.approx(np.sin(phase), abs=1e-6)
    assert of_mode["cos_phase"] == pytest.approx(np.cos(phase), abs=1e-6)
    assert of_mode["log_decay"] == pytest.approx(np.log10(xi * phase), abs=1e-6)
    lobe = np.log10(exact.critical_ke[0] / (2 * np.pi) ** 2)
    assert of_mode["log_nearest_lobe"] == pytest.approx(lobe, abs=1e-6)
    assert found.baseline.item() == pytest.approx(lobe, abs=1e-9)
    assert of_mode["place_on_nearest_lobe"] == pytest.approx(np.arctan(u) * 4 / np.pi - 1, abs=1e-5)
    assert of_mode["log_other_lobe"] > of_mode["log_nearest_lobe"]
    assert of_mode["faintness"] == of_mode["log_frequency"] == 0.0
    assert of_mode["log_damping"] == pytest.approx(np.log10(xi), abs=1e-6)
