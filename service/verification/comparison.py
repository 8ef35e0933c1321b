"""One point, three answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.time_domain.witness import TimeWitness, time_witness
from service.answerer import Answerer
from service.verification.points import Point
from training.answers import PointAnswers

RADIUS_AGREES, CHATTER_AGREES = 1e-5, 1e-3
"""Relative differences of |μ| and of the chatter frequency up to which two answers agree."""

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Verified:
    """What the three said of a point.

    Attributes
    ----------
    exact, witness
        Verdicts of the exact core and of integration in time: None where not decided.
    surrogate
        Verdict of the surrogate alone; None where it does not answer: outside its domain, or there is none.
    served, source, reason
        What policy auto answers, who gave that answer and why.
    radius_exact, radius_witness, error_estimate
        |μ| of both, and the witness's error.
    chatter_exact_hz, chatter_witness_hz
        Of nearly equal multipliers the frequency nearest to the exact core's.
    nearly_equal
        (|μ|, chatter frequency) of multipliers nearly as large as the dominant one, by the witness.
    unanswered
        Why integration in time gave no answer; empty where it did.
    """

    point: Point
    exact: bool | None
    witness: bool | None
    surrogate: bool | None
    served: bool | None
    source: str
    reason: str
    radius_exact: float
    radius_witness: float
    error_estimate: float
    chatter_exact_hz: float
    chatter_witness_hz: float
    nearly_equal: tuple[tuple[float, float], ...]
    unanswered: str = ""

    @property
    def radius_difference(self) -> float:
        """Relative difference of |μ|; NaN where there is no witness."""
        return abs(self.radius_witness - self.radius_exact) / self.radius_exact

    @property
    def agrees(self) -> bool:
        """Whether exact core and integration in time say the same."""
        chatter = abs(self.chatter_witness_hz / self.chatter_exact_hz - 1) if self.chatter_exact_hz else 0.0
        return (
            self.exact == self.witness
            and self.radius_difference <= RADIUS_AGREES
            and not chatter > CHATTER_AGREES
        )

    @property
    def served_wrongly(self) -> bool:
        """Whether policy auto gives another verdict than the exact core."""
        return self.exact is not None and self.served is not None and self.served != self.exact

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        out = asdict(self)
        point = out.pop("point")
        return {**point, **out, "agrees": self.agrees, "served_wrongly": self.served_wrongly}


def compared(
    answerer: Answerer,
    blade: Blade,
    contact: ContactConfiguration,
    points: Sequence[Point],
    progress: Progress = lambda done, total, what: None,
) -> list[Verified]:
    """Ask all three about every point.

    Raises
    ------
    InvalidInput
        When blade, contact or a point cannot be used.
    """
    speed = np.array([point.speed_hz for point in points])
    ke = np.array([point.ke for point in points])
    exact = answerer.points(blade, contact, speed, ke, "exact")
    served = answerer.points(blade, contact, speed, ke, "auto")
    found = []
    for i, point in enumerate(points):
        progress(i, len(points), f"{point.kind}, {point.speed_hz:.1f} Hz")
        problem = RubbingBlade.from_blade(blade, contact, point.speed_hz, point.ke)
        said, why = None, ""
        try:
            said = time_witness(problem)
        except TooMuchWork as error:
            why = str(error)
        surrogate = _surrogate(answerer, blade, contact, point)
        found.append(_verified(point, exact, served, i, surrogate, said, why))
    progress(len(points), len(points), "")
    return found


def _surrogate(answerer: Answerer, blade: Blade, contact: ContactConfiguration, point: Point) -> bool | None:
    try:
        found = answerer.points(blade, contact, np.array([point.speed_hz]), np.array([point.ke]), "surrogate")
    except InvalidInput as error:
        if error.field != "policy":
            raise
        return None  # outside its domain
    return _verdict(found.stable[0])


def _verdict(stable: float) -> bool | None:
    return None if np.isnan(stable) else bool(stable)


def _verified(
    point: Point,
    exact: PointAnswers,
    served: PointAnswers,
    i: int,
    surrogate: bool | None,
    said: TimeWitness | None,
    why: str,
) -> Verified:
    chatter = float(exact.chatter_hz[i])
    heard = float("nan")
    if said is not None:
        frequencies = [said.chatter_hz, *(hz for _, hz in said.nearly_equal)]
        heard = min(frequencies, key=lambda hz: abs(hz - chatter)) if np.isfinite(chatter) else frequencies[0]
    return Verified(
        point,
        _verdict(exact.stable[i]),
        None if said is None else said.stable,
        surrogate,
        _verdict(served.stable[i]),
        str(served.source[i]),
        str(served.reason[i]),
        float(exact.spectral_radius[i]),
        float("nan") if said is None else said.spectral_radius,
        float("nan") if said is None else said.error_estimate,
        chatter,
        heard,
        () if said is None else said.nearly_equal,
        why,
    )
