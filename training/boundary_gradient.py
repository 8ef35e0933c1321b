"""Design gradients of the predicted boundary: the surrogate differentiated, features and lobes included."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from torch import Tensor

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.sensitivity import Gradient
from training.cases import ARCS, MODES, CaseBatch, order_of_modes
from training.features import MODE_FEATURES, CaseTensors, Features, features
from training.surrogate import Surrogate

_BATCH = 4096
_LOBES = ("log_nearest_lobe", "log_other_lobe", "log_flip")
_SAME_LOBE = 1e-5  # of log10 K_e, in single precision
_LN10 = float(np.log(10.0))

Slopes = dict[str, np.ndarray]


@dataclass(frozen=True)
class PredictedGradients:
    """The surrogate's first crossing at m speeds, and its derivatives.

    Attributes
    ----------
    critical_ke
        N/m, shape (m,).
    gradients
        Derivatives of each with respect to the modal data there, modes in the blade's own order; its own `ke`
        is NaN.
    learned_share
        How much of the gradient the network adds to that of the exact lobe it corrects: the ratio of their
        lengths, relative changes of frequencies, damping and speed taken; shape (m,). The error
        of a gradient grows with it (decision 15).
    lobe_gap
        log10 of the next lowest lobe over the lowest, shape (m,). Where two are equally low the boundary has
        a kink, and its gradient jumps.
    """

    critical_ke: np.ndarray
    gradients: tuple[Gradient, ...]
    learned_share: np.ndarray
    lobe_gap: np.ndarray


def boundary_gradients(
    surrogate: Surrogate, blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray
) -> PredictedGradients:
    """Predicted critical K_e and its derivatives at all speeds at once, by automatic differentiation.

        log10 K_e = baseline − log10 max_j(G_jj/ω_j²) + correction

    Baseline and features are differentiated too: a lobe is the root of an equation, whose last Newton step
    carries the derivatives of the implicit function (`training.features`, `training.arc_lobes`).

    Parameters
    ----------
    blade, contact
        Inside the surrogate's domain. Arcs that touch are one arc to a `CaseBatch`; here they stay apart,
        since each edge has a derivative of its own.
    speed_hz
        Shape (m,).
    """
    cases = CaseBatch.from_blade(blade, contact, speed_hz)
    order = order_of_modes(blade.at_speeds(speed_hz)[0])
    arcs = np.zeros((0, 2)) if contact.permanent else np.array(contact.arcs, dtype=float)
    ke, gradients, share, gap = [], [], [], []
    for start in range(0, len(cases), _BATCH):
        batch = cases[start : start + _BATCH]
        tensors = CaseTensors.of(batch)
        if len(arcs):
            tensors = replace(tensors, arcs=_padded(arcs, len(batch)))
        value, of_lobe, learned, found = _slopes(surrogate, tensors)
        total = {name: of_lobe[name] + learned[name] for name in of_lobe}
        share.append(_length(learned, batch) / _length(total, batch))
        gap.append(_lobe_gap(found))
        ke.append(value)
        for k in range(len(batch)):
            of_case = {name: _LN10 * value[k] * slope[k] for name, slope in total.items()}
            gradients.append(_gradient(of_case, order[start + k], len(arcs)))
    return PredictedGradients(
        np.concatenate(ke), tuple(gradients), np.concatenate(share), np.concatenate(gap)
    )


def _slopes(surrogate: Surrogate, cases: CaseTensors) -> tuple[np.ndarray, Slopes, Slopes, Features]:
    """K_e, N/m; the derivatives of log10 K_e by tensor, of the lobe and of its correction; features."""
    names = [f.name for f in fields(cases)]
    leaves = [getattr(cases, name).requires_grad_() for name in names]
    found = features(cases)
    compliance = torch.diagonal(cases.contact_matrix, dim1=1, dim2=2) / cases.omega**2
    log_lobe = found.baseline - torch.log10(compliance.amax(dim=1))
    correction, _ = surrogate.correction(found)
    ke = 10.0 ** (log_lobe + correction).detach().numpy()

    def slopes(of: Tensor) -> Slopes:
        # A case depends on its own tensors alone, so the sum has the derivatives of each; a lobe in permanent
        # contact does not depend on arcs.
        found = torch.autograd.grad(of.sum(), leaves, retain_graph=True, allow_unused=True)
        return {
            name: np.zeros(leaf.shape) if by is None else by.numpy()
            for name, leaf, by in zip(names, leaves, found, strict=True)
        }

    return ke, slopes(log_lobe), slopes(correction), found


def _lobe_gap(found: Features) -> np.ndarray:
    """How far the next lowest lobe of any mode lies above the lowest, in log10 K_e, shape (m,)."""
    by_mode = found.inputs.detach().numpy()[:, : MODES * len(MODE_FEATURES)]
    by_mode = by_mode.reshape(-1, len(MODE_FEATURES), MODES)
    lobes = by_mode[:, [MODE_FEATURES.index(name) for name in _LOBES]].reshape(len(by_mode), -1)
    above = lobes - lobes.min(axis=1, keepdims=True)
    # With arcs one lobe may have been found from two guesses.
    return np.where(above > _SAME_LOBE, above, np.inf).min(axis=1)


def _length(slopes: Slopes, cases: CaseBatch) -> np.ndarray:
    """Length of the vector of derivatives by relative changes of Λ, ξ and Ω, shape (m,)."""
    relative = [
        slopes["omega"] * cases.omega,
        slopes["damping_ratio"] * cases.damping_ratio,
        (slopes["speed_hz"] * cases.speed_hz)[:, None],
    ]
    return np.linalg.norm(np.concatenate(relative, axis=1), axis=1)


def _padded(arcs: np.ndarray, count: int) -> Tensor:
    """At least four arcs for each of `count` cases, start and end alike where there is none."""
    out = torch.zeros((count, max(ARCS, len(arcs)), 2), dtype=torch.float64)
    out[:, : len(arcs)] = torch.from_numpy(arcs)
    return out


def _gradient(slopes: Slopes, order: np.ndarray, arcs: int) -> Gradient:
    """Derivatives by the padded tensors of one case as those of its own modes, in the blade's order."""
    n, place = len(order), np.argsort(order)
    matrix = 0.5 * (slopes["contact_matrix"] + slopes["contact_matrix"].T)[:n, :n]
    return Gradient(
        slopes["omega"][:n][place],
        slopes["damping_ratio"][:n][place],
        matrix[np.ix_(place, place)],
        np.asarray(slopes["speed_hz"]),
        np.asarray(np.nan),
        slopes["arcs"][:arcs],
    )
