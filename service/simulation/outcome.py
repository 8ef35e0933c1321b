"""A simulation run: every speed integrated in time, with the exact core's verdict on it beside."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.assessment.unstable_speeds import unstable_speeds
from sdm_core.lobe_tips import least_critical_ke
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import StabilitySolution, stabilities
from sdm_core.time_domain.liner.simulation import run_revolutions
from sdm_core.time_domain.liner.speed_sweep import SPECTRUM_REVOLUTIONS, SpeedResult, speeds_as_they_come
from service.simulation.order import SimulationOrder
from service.simulation.response import Response
from service.simulation.simulated_speeds import SimulatedSpeeds, npz_arrays, npz_bytes

Progress = Callable[[int, int], None]
_NEXT_TO = 2e-6  # relative: speeds with no range between them


@dataclass(frozen=True)
class SimulationOutcome:
    """What came of an order.

    Attributes
    ----------
    speeds
        All of them, or those there are so far.
    response
        Where there is one speed only; None otherwise.
    lobes_hz
        Speeds at which the exact core calls permanent contact unstable: edges of each interval over the range
        of many speeds, wherever those simulated lie; Hz, shape (l, 2).
    """

    order: SimulationOrder
    speeds: SimulatedSpeeds
    response: Response | None
    lobes_hz: np.ndarray

    def to_npz(self) -> bytes:
        """All arrays, as one file."""
        response = {} if self.response is None else self.response.arrays()
        return npz_bytes(
            {
                **self.speeds.arrays(),
                "frequency_hz": self.order.frequency_hz,
                "angle_rad": self.speeds.wear_map(self.order).angle_rad,
                "contact_nodes": np.array(self.order.nodes),
                "tip_nodes": np.array(self.order.blade.tip_nodes),
                "lobes_hz": self.lobes_hz,
                **response,
            }
        )

    @classmethod
    def from_npz(cls, order: SimulationOrder, content: bytes) -> SimulationOutcome:
        """From the file of `to_npz`."""
        arrays = npz_arrays(content)
        return cls(
            order, SimulatedSpeeds.from_arrays(arrays), Response.from_arrays(arrays), arrays["lobes_hz"]
        )

    def to_dict(self) -> dict[str, Any]:
        """Figures by speed, as JSON; the fields of the maps are in the npz."""
        found, order = self.speeds, self.order
        whole = {
            "blade": order.blade.name,
            "contact_nodes": list(order.nodes),
            "tip_nodes": list(order.blade.tip_nodes),
            "revolutions": order.revolutions,
            "ke": order.ke,
            "critical_ke_factor": order.rub.liner.critical_ke_factor,
            "cells": order.cells,
        }
        by_speed = {
            "speed_hz": found.speed_hz,
            "wear_lobes": found.lobes,
            "lobe_amplitude_m": found.lobe_amplitude_m,
            "deepest_m": found.worn_m.max(axis=2),
            "worn_volume_m3": np.nanmax(found.worn_volume_m3, axis=1),
            "worn_through": found.worn_through,
            "peak_m": found.peak_m,
            "force_peak_n": found.force_peak_n,
            "strongest_hz": order.frequency_hz[found.spectrum_m.argmax(axis=1)],
            "natural_hz": found.natural_hz,
            "cell_damping_ratio": found.cell_damping_ratio,
            "energy_imbalance": found.energy_imbalance,
            "stable": [None if np.isnan(v) else bool(v) for v in found.stable],
            "growth_per_revolution": found.growth_per_revolution,
            "chatter_hz": found.chatter_hz,
            "unstable_speeds_hz": self.lobes_hz,
        }
        account = None if self.response is None else self.response.account()
        return {**whole, **by_speed, "energy": account}


def simulated(
    order: SimulationOrder, workers: int | None = None, progress: Progress | None = None
) -> SimulationOutcome:
    """Run an order.

    Parameters
    ----------
    workers
        Threads; one a core where left out.
    progress
        Called with what is done and how much there is: revolutions of one speed, speeds of many.

    Raises
    ------
    InvalidInput, NotConverged
        As `speeds_as_they_come`. A liner worn through is part of the answer.
    Cancelled
        Or whatever the surrounding `interruptible` block raises.
    """
    parts: list[SimulatedSpeeds] = []
    response: Response | None = None
    with closing(each_speed(order, workers, progress)) as found:
        for part, its_response in found:
            parts.append(part)
            response = its_response
    return SimulationOutcome(order, SimulatedSpeeds.joined(parts), response, unstable_lobes(order))


def each_speed(
    order: SimulationOrder, workers: int | None = None, progress: Progress | None = None
) -> Generator[tuple[SimulatedSpeeds, Response | None], None, None]:
    """Speeds as they come, each with its response where it is the only one; parameters as `simulated`."""
    verdicts = _verdicts(order)
    if order.single:
        history = run_revolutions(
            order.rub, order.speed_hz[0], order.revolutions, order.method, progress=progress
        )
        result = SpeedResult.of_history(history, order.frequency_hz, None, SPECTRUM_REVOLUTIONS)
        yield SimulatedSpeeds.of(order, result, verdicts[0]), Response.of(history)
        return
    found = speeds_as_they_come(
        order.rub,
        np.array(order.speed_hz),
        order.revolutions,
        order.method,
        frequency_hz=order.frequency_hz,
        workers=workers,
    )
    with closing(found):  # or its threads go on when the caller is interrupted
        for done, (i, result) in enumerate(found):
            yield SimulatedSpeeds.of(order, result, verdicts[i]), None
            if progress is not None:
                progress(done + 1, len(order.speed_hz))


def unstable_lobes(order: SimulationOrder) -> np.ndarray:
    """Intervals of speed at which permanent contact with the liner is unstable, Hz, shape (l, 2)."""
    reach = (order.speed_hz[0], order.speed_hz[-1])
    if reach[0] >= reach[1] * (1 - _NEXT_TO):
        return np.zeros((0, 2))
    ke = order.ke_without_recovery
    tips = least_critical_ke(order.blade, order.contact, *reach, ke)
    deep = [tip.speed_hz for tip in tips]
    found, _ = unstable_speeds(order.blade, order.contact, reach, ke, deep)
    return np.array([(one.low_hz, one.high_hz) for one in found]).reshape(-1, 2)


def _verdicts(order: SimulationOrder) -> list[StabilitySolution]:
    problems = RubbingBlade.at_speeds(order.blade, order.contact, np.array(order.speed_hz))
    return stabilities([problem.with_ke(order.ke_without_recovery) for problem in problems], workers=1)
