"""Physics features: lobe phases, single-mode boundaries, and couplings through G (DESIGN, facts 6-7).

Everything is in torch and smooth in the blade's data, so that a boundary can be differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from training.cases import MODES, CaseBatch

_FAINT = 1e-7  # G_jj/ω_j² relative to the largest, below which a mode is invisible
_CEILING = 4.0  # log10 κ beyond which a lobe is of no interest

MODE_FEATURES = (
    "faintness",
    "log_damping",
    "log_frequency",
    "sin_phase",
    "cos_phase",
    "log_decay",
    "log_nearest_lobe",
    "log_other_lobe",
    "place_on_nearest_lobe",
    "place_on_other_lobe",
    "compliance_of_others_on_nearest_lobe",
    "compliance_of_others_on_other_lobe",
)
# Without these no network learns the lobes (DESIGN, fact 6); named so that a test can leave them out.
PHASE_FEATURES = ("sin_phase", "cos_phase", *MODE_FEATURES[6:])


@dataclass(frozen=True)
class Features:
    """Inputs of the network and what it corrects.

    Attributes
    ----------
    inputs
        Shape (m, f), float32.
    baseline
        log10 κ of the lowest single-mode lobe, corrected for nothing; shape (m,), float64.
    """

    inputs: Tensor
    baseline: Tensor


def feature_count() -> int:
    """f."""
    return MODES * len(MODE_FEATURES) + MODES * (MODES - 1) // 2 + 1


def feature_names() -> tuple[str, ...]:
    """Names of the inputs, in order."""
    pairs = [f"correlation_{j}{k}" for j in range(MODES) for k in range(j)]
    own = [f"{name}_{j}" for name in MODE_FEATURES for j in range(MODES)]
    return (*own, *pairs, "log_speed_ratio")


def features(cases: CaseBatch) -> Features:
    """Features of a batch of cases in permanent contact.

    Modes are put in the order of their single-mode boundaries, the most critical first, and given
    the sign that makes their correlation with it positive: the result does not depend on mode
    signs, on the order of modes or nodes, or on units.
    """
    omega = torch.from_numpy(np.array(cases.omega, dtype=float))
    xi = torch.from_numpy(np.array(cases.damping_ratio, dtype=float))
    contact = torch.from_numpy(np.array(cases.contact_matrix, dtype=float))
    speed = torch.from_numpy(np.array(cases.speed_hz, dtype=float))
    return _features(omega, xi, contact, speed)


def _features(omega: Tensor, xi: Tensor, contact: Tensor, speed: Tensor) -> Features:
    strength = torch.diagonal(contact, dim1=1, dim2=2)
    compliance = strength / omega**2
    share = compliance / compliance.amax(dim=1, keepdim=True)
    present = share > _FAINT
    faint = torch.log10(torch.clamp(share, min=_FAINT))
    phase = omega / speed[:, None]
    near, other = single_mode_lobes(xi, phase)

    # K of a mode's own lobe, in units of the blade's stiffness scale: log κ_j − log share_j.
    own_near = torch.clamp(near.log_kappa - faint, max=_CEILING)
    own_near = torch.where(present, own_near, _CEILING)
    own_other = torch.where(present, torch.clamp(other.log_kappa - faint, max=_CEILING), _CEILING)
    order = torch.argsort(own_near, dim=1, stable=True)

    size = torch.sqrt(torch.clamp(strength, min=1e-300))
    correlation = contact / (size[:, :, None] * size[:, None, :])
    correlation = torch.where(present[:, :, None] & present[:, None, :], correlation, 0.0)
    columns = [
        torch.where(present, faint, float(np.log10(_FAINT))),
        torch.log10(xi),
        torch.log10(omega / omega[:, :1]),
        torch.sin(phase),
        torch.cos(phase),
        torch.log10(xi * phase),
        own_near,
        own_other,
        near.place,
        other.place,
        _compliance_of_others(omega, xi, compliance, correlation, near.ratio),
        _compliance_of_others(omega, xi, compliance, correlation, other.ratio),
    ]
    columns = [torch.where(present, column, _absent(i)) for i, column in enumerate(columns)]
    by_mode = torch.stack(columns, dim=1).gather(2, order[:, None, :].expand(-1, len(columns), -1))

    across = correlation.gather(1, order[:, :, None].expand(-1, -1, MODES))
    across = across.gather(2, order[:, None, :].expand(-1, MODES, -1))
    sign = torch.where(across[:, 0, :] < 0, -1.0, 1.0)
    across = across * sign[:, :, None] * sign[:, None, :]
    pairs = torch.tril_indices(MODES, MODES, offset=-1)
    speed_ratio = torch.log10(2 * np.pi * speed / omega[:, 0])
    inputs = torch.cat([by_mode.flatten(1), across[:, pairs[0], pairs[1]], speed_ratio[:, None]], dim=1)
    return Features(inputs.float(), own_near.amin(dim=1))


def _absent(feature: int) -> float:
    """Value of a feature for a mode that is not there."""
    name = MODE_FEATURES[feature]
    if name == "faintness":
        return float(np.log10(_FAINT))
    return _CEILING if name in ("log_nearest_lobe", "log_other_lobe") else 0.0


@dataclass(frozen=True)
class Lobes:
    """A point of the boundary of each mode on its own.

    Attributes
    ----------
    log_kappa
        log10 of κ_j = K_e G_jj/ω_j², shape (m, 5).
    place
        arctan(u)·4/π − 1: −1 on the stiff flank of the lobe, 0 at its tip, 1 on the far flank.
    ratio
        Chatter frequency over the mode's frequency.
    """

    log_kappa: Tensor
    place: Tensor
    ratio: Tensor


def single_mode_lobes(xi: Tensor, phase: Tensor) -> tuple[Lobes, Lobes]:
    """Boundaries of one mode by itself: its lowest lobe at this speed, and the next lowest.

    With x = ω/ω_j and u = (x² − 1)/(2ξx), κ = ξx(u² + 1)/u, and the phase condition of the closed
    form becomes phase·x + 2 arctan u = 2πk (DESIGN, fact 2, for n = 1).

    Parameters
    ----------
    xi, phase
        ξ_j and 2πf_j/Ω, shape (m, 5).
    """
    tip = torch.sqrt(1 + 2 * xi)  # x at the tip of a lobe, where u is close to 1
    turns = (phase * tip + 2 * torch.arctan((tip**2 - 1) / (2 * xi * tip))) / (2 * np.pi)
    first = torch.floor(phase / (2 * np.pi)) + 1  # smallest k with u > 0
    below = torch.maximum(torch.floor(turns), first)
    a, b = _lobe(xi, phase, below), _lobe(xi, phase, below + 1)
    swap = b.log_kappa < a.log_kappa

    def pick(choose_b: Tensor) -> Lobes:
        return Lobes(
            torch.where(choose_b, b.log_kappa, a.log_kappa),
            torch.where(choose_b, b.place, a.place),
            torch.where(choose_b, b.ratio, a.ratio),
        )

    return pick(swap), pick(~swap)


def _lobe(xi: Tensor, phase: Tensor, k: Tensor) -> Lobes:
    """The solution u > 0 of phase·x(u) + 2 arctan u = 2πk, bisected in log u, then Newton."""
    low, high = torch.full_like(phase, -14.0), torch.full_like(phase, 18.0)

    def excess(log_u: Tensor) -> Tensor:
        u = torch.exp(log_u)
        x = xi * u + torch.sqrt(1 + (xi * u) ** 2)
        return phase * x + 2 * torch.arctan(u) - 2 * np.pi * k

    for _ in range(46):
        middle = 0.5 * (low + high)
        above = excess(middle) > 0
        high, low = torch.where(above, middle, high), torch.where(above, low, middle)
    u = torch.exp(0.5 * (low + high))
    x = xi * u + torch.sqrt(1 + (xi * u) ** 2)
    kappa = xi * x * (u**2 + 1) / u
    place = torch.arctan(u) * 4 / np.pi - 1
    return Lobes(torch.clamp(torch.log10(kappa), max=_CEILING), place, x)


def _compliance_of_others(
    omega: Tensor, xi: Tensor, compliance: Tensor, correlation: Tensor, ratio: Tensor
) -> Tensor:
    """Receptance that the other modes add where mode j touches, at its lobe, over its own static one.

    Σ_k≠j corr_jk² G_kk h_k(ω)/(G_jj/ω_j²), real part, squeezed by asinh; shape (m, 5).
    """
    w = omega * ratio
    r = w[:, :, None] / omega[:, None, :]
    detuning = 1 - r**2
    receptance = compliance[:, None, :] * detuning / (detuning**2 + (2 * xi[:, None, :] * r) ** 2)
    off = 1 - torch.eye(MODES, dtype=omega.dtype)
    total = (correlation**2 * off * receptance).sum(dim=2)
    return torch.asinh(total / torch.clamp(compliance, min=1e-300))
