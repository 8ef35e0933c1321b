"""The same rub at many rotor speeds, on all cores: what wear maps and spectrum maps are made of."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.parallel import available_cores, checked_workers
from sdm_core.time_domain.in_threads import in_threads
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.simulation import run_revolutions
from sdm_core.validation import speeds as checked_speeds

SPECTRUM_LINES, SPECTRUM_REVOLUTIONS = 400, 20

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class SpeedResult:
    """What is kept of one speed.

    Attributes
    ----------
    speed_hz
        Ω, Hz.
    worn_m
        Depth removed, m, shape (r, cells).
    worn_volume_m3
        By the end of each revolution that was simulated, m³.
    peak_m
        Largest |displacement| of each tip node, m, shape (R,).
    force_peak_n
        Largest contact force of each contact node, mean over a sample, N, shape (r,).
    spectrum_m
        Amplitude at the frequencies asked for, m, shape (k,).
    lobes, lobe_amplitude_m
        Of each contact node (`wear_lobes`), shape (r,).
    natural_hz
        Natural frequencies at this speed, Hz, shape (n,).
    cell_damping_ratio
        As in `RubHistory`, shape (n,).
    energy_imbalance
        Of the account, relative to its largest term.
    worn_through
        True where the liner was worn through, which ended the simulation.
    """

    speed_hz: float
    worn_m: np.ndarray
    worn_volume_m3: np.ndarray
    peak_m: np.ndarray
    force_peak_n: np.ndarray
    spectrum_m: np.ndarray
    lobes: np.ndarray
    lobe_amplitude_m: np.ndarray
    natural_hz: np.ndarray
    cell_damping_ratio: np.ndarray
    energy_imbalance: float
    worn_through: bool

    @classmethod
    def of_history(
        cls, history: RubHistory, frequency_hz: np.ndarray, node: str | None, revolutions: int
    ) -> SpeedResult:
        """The part of a simulation that maps need."""
        lobes = history.lobes
        balance = np.abs(history.energy.imbalance_j).max() / max(history.energy.turnover_j, 1e-300)
        return cls(
            history.speed_hz,
            history.worn_m,
            history.worn_volume_m3,
            history.peak_m,
            history.force_n.max(axis=0),
            history.spectrum(frequency_hz, node, revolutions),
            np.array([found.count for found in lobes]),
            np.array([found.amplitude_m for found in lobes]),
            history.omega / (2 * np.pi),
            history.cell_damping_ratio,
            float(balance),
            history.worn_through is not None,
        )


@dataclass(frozen=True)
class SpeedSweep:
    """Simulations at m speeds.

    Attributes
    ----------
    rub
        The problem.
    revolutions
        Simulated at each speed, fewer where the liner was worn through.
    frequency_hz
        Of the spectra, shape (k,).
    node
        Tip node whose spectra they are.
    results
        One a speed, in the order of the speeds.
    cost_s
        Time taken, s.
    """

    rub: LinerRub
    revolutions: int
    frequency_hz: np.ndarray
    node: str
    results: tuple[SpeedResult, ...]
    cost_s: float

    @property
    def speed_hz(self) -> np.ndarray:
        """Shape (m,)."""
        return np.array([found.speed_hz for found in self.results])

    @property
    def worn_through_hz(self) -> np.ndarray:
        """Speeds at which the liner was worn through."""
        return np.array([found.speed_hz for found in self.results if found.worn_through])


def sweep_speeds(
    rub: LinerRub,
    speed_hz: Sequence[float] | np.ndarray,
    revolutions: int = 50,
    method: CentralDifferences | None = None,
    *,
    frequency_hz: np.ndarray | None = None,
    node: str | None = None,
    spectrum_revolutions: int = SPECTRUM_REVOLUTIONS,
    initial: InitialMotion | None = None,
    extrapolate: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> SpeedSweep:
    """Simulate a rub at many speeds; see `speeds_as_they_come` for the parameters.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
    >>> from sdm_core.time_domain.liner.casing import Casing
    >>> rub = LinerRub(
    ...     example_blade("nasa_rotor_37"),
    ...     ("TE",),
    ...     AbradableLiner.from_cutting_stiffness(1e4),
    ...     Casing(0.252, 1e-4, ovalisation_m=2e-4, ovalisation_revolutions=4),
    ... )
    >>> found = sweep_speeds(rub, [200.0, 250.0], 6, CentralDifferences(cells=500))
    >>> [result.worn_m.shape for result in found.results]
    [(1, 500), (1, 500)]
    """
    begun = time.perf_counter()
    speed = checked_speeds("speed_hz", speed_hz)
    frequency = default_frequencies(rub, speed) if frequency_hz is None else np.asarray(frequency_hz)
    found: dict[int, SpeedResult] = {}
    for i, result in speeds_as_they_come(
        rub,
        speed,
        revolutions,
        method,
        frequency_hz=frequency,
        node=node,
        spectrum_revolutions=spectrum_revolutions,
        initial=initial,
        extrapolate=extrapolate,
        workers=workers,
    ):
        found[i] = result
        if progress is not None:
            progress(len(found), len(speed))
    return SpeedSweep(
        rub,
        revolutions,
        frequency,
        rub.nodes[0] if node is None else node,
        tuple(found[i] for i in range(len(speed))),
        time.perf_counter() - begun,
    )


def default_frequencies(rub: LinerRub, speed_hz: np.ndarray) -> np.ndarray:
    """From 0 to a tenth beyond the highest mode, Hz."""
    omega, _ = rub.blade.at_speeds(np.array([speed_hz.max()]), extrapolate=True)
    return np.linspace(0.0, 1.1 * omega.max() / (2 * np.pi), SPECTRUM_LINES)


def speeds_as_they_come(
    rub: LinerRub,
    speed_hz: np.ndarray,
    revolutions: int,
    method: CentralDifferences | None = None,
    *,
    frequency_hz: np.ndarray,
    node: str | None = None,
    spectrum_revolutions: int = SPECTRUM_REVOLUTIONS,
    initial: InitialMotion | None = None,
    extrapolate: bool = False,
    workers: int | None = None,
) -> Generator[tuple[int, SpeedResult], None, None]:
    """(index of the speed, result), in any order.

    In threads: the compiled revolutions do not hold Python's lock, and nothing has to be sent about. A liner
    worn through at one speed is part of the answer, and no reason to stop the others.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).
    frequency_hz
        Evenly spaced, for the spectra, Hz, shape (k,).
    node
        Tip node of the spectra; the first contact node where left out.
    spectrum_revolutions
        Last revolutions, of which the spectra are taken.
    workers
        Threads; one a core where left out.

    Raises
    ------
    InvalidInput
        For unusable numbers; steps too long for the highest mode at the lowest speed are found before
        anything is simulated.
    Cancelled
        Or whatever the surrounding `interruptible` block raises, within a revolution.
    """
    speed = checked_speeds("speed_hz", speed_hz)
    method = CentralDifferences() if method is None else method
    bars = rub.bars(method.cells)
    for one in (speed.min(), speed.max()):
        method.scheme(rub.modes(float(one), extrapolate=extrapolate), bars, float(one))
    _refuse_unseen(method, frequency_hz, float(speed.min()))

    def simulate(one: float) -> SpeedResult:
        history = run_revolutions(rub, one, revolutions, method, initial=initial, extrapolate=extrapolate)
        return SpeedResult.of_history(history, frequency_hz, node, spectrum_revolutions)

    threads = available_cores() if workers is None else checked_workers(workers)
    return in_threads(simulate, [float(one) for one in speed], threads)


def _refuse_unseen(method: CentralDifferences, frequency_hz: np.ndarray, lowest_hz: float) -> None:
    rate = method.samples_per_revolution * lowest_hz
    if frequency_hz[-1] > rate / 2:
        raise InvalidInput(
            "samples_per_revolution",
            method.samples_per_revolution,
            f"frequencies up to {frequency_hz[-1]:g} Hz at {lowest_hz:g} revolutions a second need "
            f"{int(np.ceil(2 * frequency_hz[-1] / lowest_hz))}",
        )
