"""[SBL] Fig. 6: stable and unstable responses by integration in time, at two speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import StabilitySolution, stability
from sdm_core.time_domain.fitted_growth import FittedGrowth, fitted_growth
from sdm_core.time_domain.motion import Motion, held_node, integrated
from service.paper_figures.history_figure import History, HistoryFigure, Panel
from service.paper_figures.lobes import exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim
from service.paper_figures.stability_diagram import STABLE_POINT, UNSTABLE_POINT
from service.paper_figures.study import PAPER_KE_MAX, Study, ke_axis, least_ke_of_modes

HELD_M = 2e-3
REVOLUTIONS = 30
_SAMPLES = 40  # a vibration of the fastest mode
_AGREES = 1e-3  # of the growth read off the response with ln |μ|, per revolution


@dataclass(frozen=True)
class _Response:
    ratio: float
    ke: float
    exact: StabilitySolution
    motion: Motion
    fit: FittedGrowth

    @property
    def said(self) -> str:
        return (
            f"{self.ke:,.0f} N/m at Ω/f₁ = {self.ratio:.3f}: growth {self.fit.growth_per_revolution:+.5f} a "
            f"revolution (multiplier {self.exact.growth_per_revolution:+.5f}), "
            f"{self.fit.frequency_hz:.1f} Hz ({self.exact.chatter_hz:.1f})"
        )


def responses(study: Study) -> HistoryFigure:
    """The leading edge held at 2 mm until t = 0, then 30 revolutions at two speeds and two K_e each.

    The paper does not name its speeds. Here: of the stretches of speeds at which the upper K_e is unstable
    the two widest, in their middle, the one that grows faster first. Where the paper's upper K_e is unstable
    nowhere, it is raised with the axis of Fig. 5.
    """
    top = ke_axis([least_ke_of_modes(study.blade, study.leading_edge)])
    upper = UNSTABLE_POINT * top / PAPER_KE_MAX
    points = (STABLE_POINT, upper)
    speeds = _speeds(study, upper, top)
    found = {(ratio, ke): _response(study, ratio, ke) for ratio in speeds for ke in points}
    speeds.sort(key=lambda ratio: -found[ratio, upper].exact.growth_per_revolution)
    panels = tuple(
        Panel(
            f"({letter}) $\\Omega/f_1$ = {ratio:.3f}",
            tuple(_history(study, found[ratio, ke]) for ke in points),
        )
        for letter, ratio in zip("ab", speeds, strict=False)
    )
    return HistoryFigure(
        number=6,
        title=f"Response to a leading edge held at {1e3 * HELD_M:g} mm, {REVOLUTIONS} revolutions",
        blade=study.blade.name,
        claims=_claims(speeds, upper, found),
        notes=(
            "delay equation integrated in time by an explicit Runge-Kutta method of order 8 with an error of "
            "1e-10 a step, method of steps",
            "before t = 0 the blade is held by a force at the leading edge alone (the paper's static mode)",
            "dashed: the envelope that the dominant multiplier predicts, laid through the last revolutions",
            *(
                ()
                if upper == UNSTABLE_POINT
                else (f"upper K_e raised from {UNSTABLE_POINT:g} N/m with the axis",)
            ),
        ),
        panels=panels,
        numbers={
            "responses": [
                {
                    "speed_ratio": r.ratio,
                    "ke": r.ke,
                    "stable": r.exact.stable,
                    "growth_fitted": r.fit.growth_per_revolution,
                    "growth_uncertainty": r.fit.growth_uncertainty,
                    "growth_of_multiplier": r.exact.growth_per_revolution,
                    "frequency_fitted_hz": r.fit.frequency_hz,
                    "chatter_hz": r.exact.chatter_hz,
                }
                for r in found.values()
            ]
        },
    )


def _speeds(study: Study, upper: float, top: float) -> list[float]:
    """Ω/f₁ of the two panels."""
    low, high = study.ratios[0], study.covered
    contact = study.leading_edge
    grid = speed_grid([(study.blade, contact)], study.first_frequency_hz, (low, high), top)
    stretches = exact_lobes("", study.blade, contact, grid, study.first_frequency_hz, top).stretches(
        upper, low, high
    )
    widest = sorted(stretches, key=lambda stretch: stretch[0] - stretch[1])[:2]
    middles = [0.5 * (a + b) for a, b in widest]
    spare = [low + share * (high - low) for share in (0.9, 0.6)]
    return (middles + spare)[:2]


def _response(study: Study, ratio: float, ke: float) -> _Response:
    speed = ratio * study.first_frequency_hz
    problem = RubbingBlade.from_blade(study.blade, study.leading_edge, speed, ke)
    omega, shape = study.blade.at_speeds(np.array([speed]))
    motion = integrated(problem, held_node(omega[0], shape[0][:, 0], HELD_M), REVOLUTIONS)
    return _Response(ratio, ke, stability(problem), motion, fitted_growth(motion))


def _history(study: Study, found: _Response) -> History:
    problem = found.motion.problem
    fastest = problem.omega.max() / (2 * np.pi) * problem.tau
    times = np.linspace(0.0, found.motion.duration, 1 + int(_SAMPLES * fastest) * REVOLUTIONS)
    _, shape = study.blade.at_speeds(np.array([problem.speed_hz]))
    displacement = found.motion.displacement(times, shape[0][:, :1])[:, 0]
    stable = bool(found.exact.stable)
    label = f"$K_e$ = {found.ke:,.0f} N/m, {'stable' if stable else 'unstable'}, " + (
        f"$\\ln|\\mu|$ = {found.exact.growth_per_revolution:+.4f}"
    )
    return History(label, stable, times / problem.tau, displacement, found.exact.growth_per_revolution)


def _claims(
    speeds: list[float], upper: float, found: dict[tuple[float, float], _Response]
) -> tuple[Claim, ...]:
    settled = all(found[ratio, STABLE_POINT].exact.stable for ratio in speeds)
    grown = all(found[ratio, upper].exact.stable is False for ratio in speeds)
    first, second = (found[ratio, upper] for ratio in speeds)
    off = max(
        abs(r.fit.growth_per_revolution - r.exact.growth_per_revolution) - r.fit.growth_uncertainty
        for r in found.values()
    )
    largest = max(abs(r.fit.growth_per_revolution - r.exact.growth_per_revolution) for r in found.values())
    quicker = first.fit.growth_per_revolution > second.fit.growth_per_revolution
    larger = first.exact.spectral_radius > second.exact.spectral_radius
    return (
        Claim(
            "stable and unstable points of the diagram are reproduced by integration in time",
            "; ".join(found[key].said for key in sorted(found)),
            settled
            and grown
            and all((r.fit.growth_per_revolution < 0) == bool(r.exact.stable) for r in found.values()),
        ),
        Claim(
            "the response whose multiplier is larger diverges faster",
            f"at Ω/f₁ = {first.ratio:.3f} |μ| = {first.exact.spectral_radius:.4f} and the response grows "
            f"{first.fit.growth_per_revolution:+.4f} a revolution, at {second.ratio:.3f} "
            f"{second.exact.spectral_radius:.4f} and {second.fit.growth_per_revolution:+.4f}; growths read "
            f"off the responses are those of the multipliers within {largest:.0e}",
            quicker == larger and off < _AGREES,
        ),
    )
