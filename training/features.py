"""Physics features: lobe phases, single-mode boundaries, and couplings through G (DESIGN, facts 6-7).

Everything is in torch and smooth in the blade's data, so that a boundary can be differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from training.arc_lobes import Segments, first_flip, lobe_beside_a_flip, lobe_with_arcs
from training.cases import MODES, CaseBatch

_FAINT = 1e-7  # G_jj/ω_j² relative to the largest, below which a mode is invisible
_NO_HARMONIC = 1e-6
_BISECTIONS, _NEWTON_STEPS = 12, 4  # to 0.01 in log u, then to rounding
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
    "log_flip",
    "place_on_nearest_lobe",
    "place_on_other_lobe",
    "compliance_of_others_on_nearest_lobe",
    "compliance_of_others_on_other_lobe",
)
HARMONICS = 6
CASE_FEATURES = (
    "log_speed_ratio",
    "log_engaged_share",
    "engaged_share",
    *(f"engagement_harmonic_{k}" for k in range(1, HARMONICS + 1)),
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
        log10 κ of the lowest lobe of any mode by itself; shape (m,), float64.
    """

    inputs: Tensor
    baseline: Tensor


def feature_count() -> int:
    """f."""
    return len(feature_names())


def feature_names() -> tuple[str, ...]:
    """Names of the inputs, in order."""
    pairs = [f"correlation_{j}{k}" for j in range(MODES) for k in range(j)]
    own = [f"{name}_{j}" for name in MODE_FEATURES for j in range(MODES)]
    return (*own, *pairs, *CASE_FEATURES)


@dataclass(frozen=True)
class CaseTensors:
    """A batch of cases as float64 tensors, for which a boundary has derivatives.

    Attributes
    ----------
    omega, damping_ratio
        Λ in rad/s and ξ, shape (m, 5).
    contact_matrix
        G, kg^-1, shape (m, 5, 5).
    speed_hz
        Ω, Hz, shape (m,).
    arcs
        Starts and ends, revolutions, shape (m, 4, 2); start and end alike where there is no arc.
    """

    omega: Tensor
    damping_ratio: Tensor
    contact_matrix: Tensor
    speed_hz: Tensor
    arcs: Tensor

    @classmethod
    def of(cls, cases: CaseBatch, device: torch.device | str = "cpu") -> CaseTensors:
        """On a device."""

        def tensor(array: np.ndarray) -> Tensor:
            return torch.from_numpy(np.array(array, dtype=float)).to(device)

        return cls(
            tensor(cases.omega),
            tensor(cases.damping_ratio),
            tensor(cases.contact_matrix),
            tensor(cases.speed_hz),
            tensor(np.nan_to_num(cases.arcs, nan=0.0)),
        )


def features(cases: CaseTensors) -> Features:
    """Features of a batch of cases.

    Modes are put in the order of their single-mode boundaries, the most critical first, and given
    the sign that makes their correlation with it positive; of the engagement only the mean and the
    moduli of its harmonics are seen. So the result does not depend on mode signs, on the order of modes
    or nodes, on where round the casing counting starts, or on units.
    """
    omega, xi, contact, speed = cases.omega, cases.damping_ratio, cases.contact_matrix, cases.speed_hz
    strength = torch.diagonal(contact, dim1=1, dim2=2)
    compliance = strength / omega**2
    share = compliance / compliance.amax(dim=1, keepdim=True)
    present = share > _FAINT
    faint = torch.log10(torch.clamp(share, min=_FAINT))
    phase = omega / speed[:, None]
    near, other = single_mode_lobes(xi, phase)

    engaged, harmonics = engagement(cases.arcs)
    near_kappa, other_kappa, flip_kappa = _lobes_of_each_mode(xi, phase, near, other, present, cases.arcs)

    # K of a mode's own lobe, in units of the blade's stiffness scale: log κ_j − log share_j.
    def in_blade_units(log_kappa: Tensor) -> Tensor:
        return torch.where(present, torch.clamp(log_kappa - faint, max=_CEILING), _CEILING)

    own_near, own_other, own_flip = map(in_blade_units, (near_kappa, other_kappa, flip_kappa))
    own = torch.minimum(torch.minimum(own_near, own_other), own_flip)
    order = torch.argsort(own, dim=1, stable=True)

    # Modes that are not there get a strength of one: a derivative through a division by 0 is not a number.
    size = torch.sqrt(torch.where(present, strength, 1.0))
    felt = torch.where(present, compliance, 1.0)
    correlation = contact / (size[:, :, None] * size[:, None, :])
    correlation = torch.where(present[:, :, None] & present[:, None, :], correlation, 0.0)
    columns = [
        faint,
        torch.log10(xi),
        torch.log10(omega / omega[:, :1]),
        torch.sin(phase),
        torch.cos(phase),
        torch.log10(xi * phase),
        own_near,
        own_other,
        own_flip,
        near.place,
        other.place,
        _compliance_of_others(omega, xi, felt, correlation, near.ratio),
        _compliance_of_others(omega, xi, felt, correlation, other.ratio),
    ]
    columns = [torch.where(present, column, _absent(i)) for i, column in enumerate(columns)]
    by_mode = torch.stack(columns, dim=1).gather(2, order[:, None, :].expand(-1, len(columns), -1))

    across = correlation.gather(1, order[:, :, None].expand(-1, -1, MODES))
    across = across.gather(2, order[:, None, :].expand(-1, MODES, -1))
    sign = torch.where(across[:, 0, :] < 0, -1.0, 1.0)
    across = across * sign[:, :, None] * sign[:, None, :]
    pairs = torch.tril_indices(MODES, MODES, offset=-1)
    speed_ratio = torch.log10(2 * np.pi * speed / omega[:, 0])
    of_case = torch.stack([speed_ratio, torch.log10(engaged), engaged], dim=1)
    inputs = torch.cat([by_mode.flatten(1), across[:, pairs[0], pairs[1]], of_case, harmonics], dim=1)
    return Features(inputs.float(), own.amin(dim=1))


def _lobes_of_each_mode(
    xi: Tensor, phase: Tensor, near: Lobes, other: Lobes, present: Tensor, arcs: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """log10 κ of each mode's nearest lobe, the other, and its first flip or pair beside it, each (m, 5).

    With arcs the lobes are those of the mean engagement, followed to where they exactly are.
    """
    length = (arcs[:, :, 1] - arcs[:, :, 0]).sum(dim=1)
    row, mode = torch.nonzero(present & (length < 1.0)[:, None], as_tuple=True)
    found = [near.log_kappa, other.log_kappa, torch.full_like(near.log_kappa, _CEILING)]
    if len(row) == 0:
        return found[0], found[1], found[2]
    segments, xi, phase = Segments.of(arcs[row]), xi[row, mode], phase[row, mode]
    softer = torch.log10(length)[row]
    lobes = [
        lobe_with_arcs(segments, xi, phase, lobe.log_kappa[row, mode] - softer, lobe.ratio[row, mode])[0]
        for lobe in (near, other)
    ]
    flip = first_flip(segments, xi, phase, torch.minimum(*lobes))
    lowest = torch.minimum(torch.minimum(*lobes), flip)
    lobes.append(torch.minimum(flip, lobe_beside_a_flip(segments, xi, phase, lowest)))
    near_kappa, other_kappa, flip = (
        table.index_put((row, mode), torch.clamp(lobe, max=_CEILING))
        for table, lobe in zip(found, lobes, strict=True)
    )
    return near_kappa, other_kappa, flip


def engagement(arcs: Tensor) -> tuple[Tensor, Tensor]:
    """Mean of γ, shape (m,), and moduli of its harmonics 1 to 6, shape (m, 6); from arcs (m, 4, 2).

    γ = Σ_k c_k exp(2πi kθ); an arc from a to b adds (sin(πk(b − a))/πk) exp(−πi k(a + b)) to c_k.
    """
    length, middle = arcs[:, :, 1] - arcs[:, :, 0], 0.5 * (arcs[:, :, 0] + arcs[:, :, 1])
    k = torch.arange(1, HARMONICS + 1, dtype=arcs.dtype, device=arcs.device)[:, None]
    size = torch.sin(np.pi * k * length[:, None, :]) / (np.pi * k)
    turn = 2 * np.pi * k * middle[:, None, :]
    real, imaginary = (size * torch.cos(turn)).sum(dim=2), (size * torch.sin(turn)).sum(dim=2)
    # Not the modulus itself, which has no derivative where a harmonic is not there.
    return length.sum(dim=1), torch.sqrt(real**2 + imaginary**2 + _NO_HARMONIC**2) - _NO_HARMONIC


def _absent(feature: int) -> float:
    """Value of a feature for a mode that is not there."""
    name = MODE_FEATURES[feature]
    if name == "faintness":
        return float(np.log10(_FAINT))
    return _CEILING if name in ("log_nearest_lobe", "log_other_lobe", "log_flip") else 0.0


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
    # Both at once: for one speed the calls cost more than what they compute.
    both = _lobe(xi.repeat(2, 1), phase.repeat(2, 1), torch.cat([below, below + 1]))
    a, b = (
        Lobes(*(column.chunk(2)[i] for column in (both.log_kappa, both.place, both.ratio))) for i in (0, 1)
    )
    swap = b.log_kappa < a.log_kappa

    def pick(choose_b: Tensor) -> Lobes:
        return Lobes(
            torch.where(choose_b, b.log_kappa, a.log_kappa),
            torch.where(choose_b, b.place, a.place),
            torch.where(choose_b, b.ratio, a.ratio),
        )

    return pick(swap), pick(~swap)


def _lobe(xi: Tensor, phase: Tensor, k: Tensor) -> Lobes:
    """The solution u > 0 of phase·x(u) + 2 arctan u = 2πk, bisected in log u, then Newton.

    Bisection has no derivatives; the last Newton step brings those of an implicit function.
    """
    low, high = torch.full_like(phase, -14.0), torch.full_like(phase, 18.0)

    def excess(log_u: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        u = torch.exp(log_u)
        root = torch.sqrt(1 + (xi * u) ** 2)
        return phase * (xi * u + root) + 2 * torch.arctan(u) - 2 * np.pi * k, u, root

    with torch.no_grad():
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            above = excess(middle)[0] > 0
            high, low = torch.where(above, middle, high), torch.where(above, low, middle)
    log_u = 0.5 * (low + high)
    for _ in range(_NEWTON_STEPS):
        value, u, root = excess(log_u.detach())
        slope = phase * xi * u * (1 + xi * u / root) + 2 * u / (1 + u**2)
        log_u = log_u.detach() - value / slope.detach()
    u = torch.exp(log_u)
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
    off = 1 - torch.eye(MODES, dtype=omega.dtype, device=omega.device)
    total = (correlation**2 * off * receptance).sum(dim=2)
    return torch.asinh(total / compliance)
