"""What imported modal data are checked for: scale of the shapes, frequencies, course over speed."""

from __future__ import annotations

import numpy as np

from sdm_core.blade.exchange.checks.findings import Finding, Findings, warning
from sdm_core.blade.exchange.checks.matrices import LARGEST_FALL
from sdm_core.blade.exchange.checks.plausibility import suspicious_frequency
from sdm_core.blade.matrix_model import Matrix
from sdm_core.blade.modal import Blade
from sdm_core.errors import InvalidInput

# Largest tip amplitudes of blades from 10 g to 50 kg, kg^-1/2, with room.
AMPLITUDES = (0.05, 100.0)
LARGEST_DEFECT = 1e-3


def check_blade(blade: Blade, *, units: str) -> Findings:
    """Check a blade's modal data (the blade itself refuses what is no blade)."""
    found: list[Finding] = []
    first = blade.states[0]
    shapes = [
        s for s in (first.mode_shape, first.mode_shape_radial, first.mode_shape_tangential) if s is not None
    ]
    largest = np.abs(first.mode_shape).max(axis=1)
    figures: dict[str, float | int | str | tuple[float, ...]] = {
        "modes": blade.mode_count,
        "tip_nodes": len(blade.tip_nodes),
        "speeds_hz": tuple(state.speed_hz for state in blade.states),
        "frequency_hz": tuple(first.frequency_hz.tolist()),
        "largest_amplitude": tuple(largest.tolist()),
    }
    over_all = np.max([np.abs(s).max(axis=1) for s in shapes], axis=0)
    if np.allclose(over_all, 1.0, rtol=0, atol=1e-4):
        found.append(
            warning(
                "mode_shape",
                "the largest amplitude of every mode is 1",
                "these shapes look scaled to unit amplitude: give mass-normalised ones (kg^-1/2)",
            )
        )
    scale = float(over_all.max())
    if scale == 0.0:
        raise InvalidInput("mode_shape", "all zero", "give the amplitudes of the tip nodes")
    low, high = AMPLITUDES
    if blade.mass_kg is not None:
        # φᵀMφ = 1: somewhere the amplitude reaches 1/√m, and near the tip a few times that.
        low, high = 0.2 * blade.mass_kg**-0.5, 50 * blade.mass_kg**-0.5
    if not low <= scale <= high:
        in_tonnes = low <= scale * 1e3**-0.5 <= high
        found.append(
            warning(
                "mode_shape",
                f"largest amplitude {scale:.4g} kg^-1/2, expected {low:.2g} to {high:.2g}",
                'amplitudes in t^-1/2? then give units="mm-t-s"'
                if in_tonnes and units == "SI"
                else "are the shapes mass-normalised, in kg^-1/2?",
            )
        )
    found += suspicious_frequency(float(first.frequency_hz.min()), blade.mass_kg or 0.0)
    lowest = [float(state.frequency_hz.min()) for state in blade.states]
    if lowest[-1] < (1 - LARGEST_FALL) * lowest[0]:
        found.append(
            warning(
                "states",
                f"the first frequency falls from {lowest[0]:.5g} to {lowest[-1]:.5g} Hz",
                "rotation stiffens a blade: are the speeds exchanged?",
            )
        )
    return Findings(tuple(found), figures)


def mass_normalisation(where: str, shapes: np.ndarray, mass: Matrix) -> Findings:
    """φᵀMφ = I where the mass is at hand.

    Parameters
    ----------
    where
        What the shapes are called.
    shapes
        Shape (N, n).
    mass
        Shape (N, N), in the units of the shapes.

    Examples
    --------
    >>> mass_normalisation("PHI", np.eye(2), np.diag([1.0, 4.0])).warnings[0].what
    'modal masses 1 to 4, the largest product of two modes 0'
    """
    products = shapes.T @ (mass @ shapes)
    modal = np.diag(products)
    cross = float(np.abs(products - np.diag(modal)).max(initial=0.0))
    figures: dict[str, float | int | str | tuple[float, ...]] = {
        f"modal_masses_of_{where}": tuple(modal.tolist()),
        f"largest_cross_product_of_{where}": cross,
    }
    if np.abs(modal - 1).max(initial=0.0) <= LARGEST_DEFECT and cross <= LARGEST_DEFECT:
        return Findings((), figures)
    what = (
        f"modal masses {modal.min():.4g} to {modal.max():.4g}, the largest product of two modes {cross:.2g}"
    )
    remedy = "the shapes are not mass-normalised with this mass: rubscreen computes its own from K and M"
    return Findings((warning(where, what, remedy),), figures)
