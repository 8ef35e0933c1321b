"""Fitting: reproducible, monotone, and hopeless without the phase features."""

import numpy as np
import pytest
import torch

from training import fit as fit_module
from training.design_space import DesignSpace
from training.evaluation import evaluate
from training.features import MODE_FEATURES, PHASE_FEATURES, Features, features
from training.fit import FitSettings, boundary_loss, fit
from training.labelling import critical_kappa
from training.reference_space import reference_sample
from training.space_filling import space_filling
from training.surrogate import Architecture, PredictedBoundary
from training.verification_band import VerificationBand

SMALL = FitSettings(architecture=Architecture(width=48, blocks=2), epochs=25, batch=128, learning_rate=4e-3)


@pytest.fixture(scope="module")
def labelled():
    cases = space_filling(DesignSpace(), 600, 3, seed=5)
    return cases, critical_kappa(cases, workers=1)


@pytest.fixture(scope="module")
def unseen():
    cases = reference_sample(400, seed=91).cases
    return cases, critical_kappa(cases, workers=1)


def median_error(surrogate, unseen) -> float:
    cases, kappa = unseen
    found = surrogate.boundary(cases)
    return float(np.median(np.abs(10**found.log_ke / (kappa * cases.stiffness_scale) - 1)))


def without_phases(cases) -> Features:
    """Features blind to the phase 2πf/Ω: lobe and phase inputs gone, the baseline without lobes."""
    found = features(cases)
    blind = [i for i, name in enumerate(MODE_FEATURES) if name in PHASE_FEATURES]
    inputs = found.inputs.clone()
    by_mode = inputs[:, : 5 * len(MODE_FEATURES)].view(len(inputs), len(MODE_FEATURES), 5)
    by_mode[:, blind] = 0.0
    return Features(inputs, torch.zeros_like(found.baseline))


def test_without_phase_features_the_boundary_cannot_be_learnt(labelled, unseen, monkeypatch):
    # DESIGN, fact 6: the same data and network, with and without the phase of each mode.
    informed = median_error(fit(*labelled, SMALL, seed=1), unseen)
    monkeypatch.setattr(fit_module, "features", without_phases)
    monkeypatch.setattr("training.surrogate.features", without_phases)
    blind = median_error(fit(*labelled, SMALL, seed=1), unseen)
    assert informed < 0.06
    assert blind > 10 * informed


def test_the_same_seed_gives_the_same_network(labelled):
    settings = FitSettings(architecture=Architecture(width=16, blocks=1), epochs=2, batch=256)
    first, again = fit(*labelled, settings, seed=3), fit(*labelled, settings, seed=3)
    other = fit(*labelled, settings, seed=4)
    for name, value in first.network.state_dict().items():
        assert torch.equal(value, again.network.state_dict()[name])
    assert not torch.equal(first.network.last.weight, other.network.last.weight)


def test_unstable_probability_rises_with_stiffness_and_is_one_half_at_the_boundary():
    found = PredictedBoundary(np.full(50, 3.0), np.full(50, 0.02))
    ke = np.geomspace(1.0, 1e6, 50)
    probability = found.unstable_probability(ke)
    assert (np.diff(probability) >= 0).all()
    assert found.unstable_probability(np.full(50, 1e3))[0] == pytest.approx(0.5)
    assert found.unstable_probability(np.zeros(50))[0] < 1e-12


def test_loss_of_a_censored_case_falls_as_the_boundary_moves_beyond_reach():
    spread, none = torch.tensor([-2.0]), torch.tensor([float("inf")])
    reach = torch.tensor([0.6])
    losses = [boundary_loss(torch.tensor([m]), spread, none, reach).item() for m in (0.0, 1.0, 2.0)]
    assert losses[0] > losses[1] > losses[2] >= 0


def test_evaluation_counts_what_it_says():
    boundary = PredictedBoundary(np.log10([100.0, 100.0, 100.0, 100.0, 100.0]), np.full(5, 1e-3))
    ke = np.array([50.0, 50.0, 200.0, 200.0, 100.5])
    critical = np.array([100.0, 40.0, 101.0, 300.0, 100.0])
    band = VerificationBand(10.0)
    found = evaluate(boundary, band, np.ones(5, bool), ke, critical, ke > critical, distribution="five")
    assert (found.auto.answered_stable, found.auto.false_stable) == (2, 1)
    assert (found.auto.answered_unstable, found.auto.false_unstable) == (2, 1)
    assert found.auto.exact_share == pytest.approx(0.2)
    assert found.alone.answered_unstable == 3
    assert found.auto_hard.points == 2  # 50 of 40 and 100.5 of 100
    assert found.median_boundary_error == pytest.approx(1 / 101, rel=1e-9)
    outside = evaluate(boundary, band, np.zeros(5, bool), ke, critical, ke > critical, distribution="five")
    assert outside.auto.exact_share == 1.0
