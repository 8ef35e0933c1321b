"""What a surrogate is told of a case: raw quantities, or our features, with their lobes or without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from training.cases import ARCS, MODES, CaseBatch
from training.features import PHASE_FEATURES, CaseTensors, Features, engagement, feature_names, features

_FAINT = 1e-7  # as in training.features: a mode less compliant than this is as good as absent
_AT_ONCE = 16_384
_PHASES = ("sin_phase", "cos_phase")


@dataclass(frozen=True)
class Inputs:
    """Columns a method sees, shape (m, f), and the log10 κ that its answer is added to, shape (m,)."""

    columns: np.ndarray
    start: np.ndarray


Encoding = Callable[[CaseBatch], Inputs]


def raw(cases: CaseBatch) -> Inputs:
    """Dimensionless quantities of blade, speed and engagement, without any physics of lobes.

    log f_j/f_1, log ξ_j, log of G_jj/ω_j² over the largest, correlations G_jk/√(G_jj G_kk), the number of
    modes, log Ω/f_1; lengths of the arcs and gaps, the longest arc first, and mean and harmonics of γ. Padded
    to five modes and four arcs. As in ours, signs of modes and the place where counting round the casing
    starts make no difference: the strongest mode correlates positively with every other.
    """
    compliance = cases.compliance
    share = compliance / compliance.max(axis=1, keepdims=True)
    present = np.arange(MODES) < cases.mode_count[:, None]
    ratio = np.where(present, cases.omega / cases.omega[:, :1], 1.0)
    size = np.sqrt(np.einsum("mjj->mj", cases.contact_matrix))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = cases.contact_matrix / (size[:, :, None] * size[:, None, :])
    correlation = np.nan_to_num(correlation, nan=0.0, posinf=0.0, neginf=0.0)
    rows = np.arange(len(cases))
    sign = np.where(correlation[rows, share.argmax(axis=1)] < 0, -1.0, 1.0)
    correlation = correlation * sign[:, :, None] * sign[:, None, :]
    lower = np.tril_indices(MODES, -1)
    speed_ratio = 2 * np.pi * cases.speed_hz / cases.omega[:, 0]
    columns = [
        np.log10(ratio[:, 1:]),
        np.log10(cases.damping_ratio),
        np.log10(np.maximum(share, _FAINT)),
        correlation[:, lower[0], lower[1]],
        cases.mode_count[:, None],
        np.log10(speed_ratio)[:, None],
        _engagement(cases),
    ]
    return Inputs(np.concatenate(columns, axis=1), np.zeros(len(cases)))


def phases(cases: CaseBatch) -> Inputs:
    """The features of ours but those of lobes: phases 2πf_j/Ω are there, where lobes lie is not.

    One thing stays that lobes decide: which mode comes first.
    """
    return Inputs(_features(cases).inputs.double().numpy()[:, _kept()], np.zeros(len(cases)))


def lobes(cases: CaseBatch) -> Inputs:
    """Every feature of ours, and the lowest lobe as the start that is corrected, as ours does."""
    found = _features(cases)
    return Inputs(found.inputs.double().numpy(), found.baseline.numpy())


def _kept() -> list[int]:
    of_lobes = {name for name in PHASE_FEATURES if name not in _PHASES}
    return [i for i, name in enumerate(feature_names()) if name.rpartition("_")[0] not in of_lobes]


def _features(cases: CaseBatch) -> Features:
    with torch.inference_mode():
        parts = [features(CaseTensors.of(cases[i : i + _AT_ONCE])) for i in range(0, len(cases), _AT_ONCE)]
    return Features(torch.cat([p.inputs for p in parts]), torch.cat([p.baseline for p in parts]))


def _engagement(cases: CaseBatch) -> np.ndarray:
    """Lengths of arcs and of the gaps after them, and the mean and harmonics of γ; shape (m, 2·4 + 8)."""
    start, end = cases.arcs[:, :, 0], cases.arcs[:, :, 1]
    length = np.nan_to_num(end - start)
    last = np.arange(ARCS) == cases.arc_count[:, None] - 1
    after = np.where(last, start[:, :1] + 1.0, np.roll(start, -1, axis=1))
    gap = np.nan_to_num(after - end)
    turned = (length.argmax(axis=1)[:, None] + np.arange(ARCS)) % cases.arc_count[:, None]
    there = np.arange(ARCS) < cases.arc_count[:, None]
    arcs, gaps = (np.where(there, np.take_along_axis(a, turned, axis=1), 0.0) for a in (length, gap))
    mean, harmonics = engagement(torch.from_numpy(np.nan_to_num(cases.arcs)))
    share = mean.numpy()[:, None]
    return np.concatenate([arcs, gaps, share, np.log10(share), harmonics.numpy()], axis=1)
