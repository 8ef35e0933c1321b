"""Explicit central differences in time and cells in angle: the method, and what its steps must satisfy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.time_domain.liner.abradable_liner import Bars
from sdm_core.time_domain.liner.tip_modes import TipModes

DEFAULT_CELLS = 2000
"""Two per millimetre on a rotor of 0.6 m, and 100 a wave at the twentieth engine order."""
LEAST_STEPS_PER_CELL = 4
MOST_CELLS, MOST_STEPS = 1_000_000, 20_000_000
_PHASE_PER_STEP = 0.1  # rad of the fastest mode: its period is then wrong by (ωh)²/24 = 4e-4
_CONTACT_PHASE_PER_STEP = 0.2  # rad of the tip's masses on an elastic bar
_STABLE_PHASE = 2.0  # rad: beyond it a mode grows without any force


class Scheme(NamedTuple):
    """The coefficients of one step, as the kernel takes them.

        x_{n+1} = carry · x_n − drag · x_{n−1} − push · (V_c + μ s V_t)(F_{n−1} + F_{n+1})/2

    Attributes
    ----------
    step
        h, s.
    steps_per_cell
        Steps in one cell.
    carry, drag, push
        (2 − ω²h²)/(1 + ξωh), (1 − ξωh)/(1 + ξωh), h²/(1 + ξωh); each of shape (n,).
    loss
        2ξω, 1/s, shape (n,).
    """

    step: float
    steps_per_cell: int
    carry: np.ndarray
    drag: np.ndarray
    push: np.ndarray
    loss: np.ndarray


@dataclass(frozen=True)
class CentralDifferences:
    """Central differences with prediction and correction of contact, constant whole steps per revolution.

        (x_{n+1} − 2x_n + x_{n−1})/h² + 2ξΛ(x_{n+1} − x_{n−1})/2h + Λ²x_n = −V_c (F_{n−1} + F_{n+1})/2

    is solved with F_{n+1} = 0 first (prediction); then the forces F_{n+1} of the bars are found that belong
    to the displacements u_{n+1} they correct. Free motion is of second order in h and stable for ω h < 2. The
    mean of the forces around t_n is of second order too; with F_{n+1} alone, the usual choice, a bar of
    stiffness k would damp like a dashpot kh, more than most blades do. On an elastic bar the work over the
    step is that of a potential, (u²_{n+1} − u²_{n−1})k/4, so that contact neither feeds the motion nor limits
    h; jumps of the force, where a bar yields or a cell ends, leave errors of first order there.

    A bar that is unloaded within its cell loses what it held: cells of finite length damp, like a tip of
    finite thickness does, by (AE/L − K_e)(1 − 1/s)/(4Ω · cells), N s/m, with s steps a cell
    (`cell_damping_ratio`). It vanishes with many cells, and with one step a cell.

    Parameters
    ----------
    cells
        Angular cells of the casing.
    steps_per_cell
        s; chosen where left out: at least four, ω_max h ≤ 0.1, and the same for the tip on the bars, ≤ 0.2.
    samples_per_revolution
        Least number of instants kept of each revolution; whole steps apart, so that there may be more.

    Raises
    ------
    InvalidInput
        For numbers out of range.
    """

    cells: int = DEFAULT_CELLS
    steps_per_cell: int | None = None
    samples_per_revolution: int = 500

    def __post_init__(self) -> None:
        _whole("cells", self.cells, 4, MOST_CELLS)
        if self.steps_per_cell is not None:
            _whole("steps_per_cell", self.steps_per_cell, 1, 100_000)
        _whole("samples_per_revolution", self.samples_per_revolution, 8, MOST_STEPS)

    def steps_in_a_cell(self, modes: TipModes, bars: Bars, speed_hz: float) -> int:
        """s, chosen or as given.

        Raises
        ------
        InvalidInput
            When the steps given are too long for the fastest mode.
        TooMuchWork
            When the steps needed are too many.
        """
        per_cell = 1.0 / (speed_hz * self.cells)
        fastest = float(modes.omega.max())
        if self.steps_per_cell is not None:
            if fastest * per_cell / self.steps_per_cell >= _STABLE_PHASE:
                least = int(np.floor(fastest / (_STABLE_PHASE * speed_hz))) + 1
                raise InvalidInput(
                    "steps_per_cell",
                    self.steps_per_cell,
                    f"unstable with a mode at {fastest / (2 * np.pi):.6g} Hz and {speed_hz:.6g} revolutions "
                    f"a second: at least {least} steps a revolution are needed, that is steps_per_cell = "
                    f"{-(-least // self.cells)} with {self.cells} cells, or leave it out",
                )
            found = self.steps_per_cell
        else:
            on_bars = np.sqrt((bars.elastic * (modes.contact**2)).sum())  # at least the largest frequency
            phase = max(fastest / _PHASE_PER_STEP, on_bars / _CONTACT_PHASE_PER_STEP)
            found = max(LEAST_STEPS_PER_CELL, int(np.ceil(phase * per_cell)))
        if found * self.cells > MOST_STEPS:
            raise TooMuchWork(
                "steps_per_cell",
                f"{found} with {self.cells} cells",
                f"at most {MOST_STEPS} steps a revolution are taken: raise the speed, leave out high modes, "
                "take fewer cells or a softer liner",
            )
        return found

    def scheme(self, modes: TipModes, bars: Bars, speed_hz: float) -> Scheme:
        """The coefficients of a step."""
        inside = self.steps_in_a_cell(modes, bars, speed_hz)
        h = 1.0 / (speed_hz * self.cells * inside)
        braked = modes.damping_ratio * modes.omega * h
        return Scheme(
            h,
            inside,
            (2 - (modes.omega * h) ** 2) / (1 + braked),
            (1 - braked) / (1 + braked),
            h**2 / (1 + braked),
            2 * modes.damping_ratio * modes.omega,
        )

    def steps_per_sample(self, scheme: Scheme) -> int:
        """The largest divisor of the steps of a revolution that keeps enough samples."""
        steps = self.cells * scheme.steps_per_cell
        most = max(1, steps // self.samples_per_revolution)
        return next(every for every in range(most, 0, -1) if steps % every == 0)

    def cell_damping_ratio(self, modes: TipModes, bars: Bars, scheme: Scheme) -> np.ndarray:
        """What cells of finite length add to each ξ in kept contact, shape (n,).

        Over a cell that takes the time Δ the tip moves by vΔ. Outwards the force follows with K_e, inwards
        with AE/L: on average (AE/L − K_e)vΔ/2 less than with K_e, half of the time, hence a damping of
        (AE/L − K_e)Δ/4, in s steps of it 1 − 1/s.
        """
        soft = bars.elastic * bars.plastic / (bars.elastic + bars.plastic)
        time = scheme.step * (scheme.steps_per_cell - 1)
        return (modes.contact**2 @ ((bars.elastic - soft) * time / 4)) / (2 * modes.omega)


def _whole(field: str, value: Any, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise InvalidInput(field, value, f"give a whole number from {low} to {high}")
