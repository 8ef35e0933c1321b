"""[SBL] Fig. 7: semi-discretization with N = 40, 60 and 80 steps, beside the exact boundary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sdm_core.blade import Blade
from service.paper_figures.fixed_steps import fixed_step_lobes, parts_of
from service.paper_figures.lobes import Lobes, exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, percent
from service.paper_figures.study import Study, at_rest, ke_axis, least_ke_of_modes, with_modes

STEPS = (40, 60, 80)
# [SBL] 4.2: N = 40 will do above this Ω/f₁, and N = 60 for all below.
ENOUGH_FROM = 0.25
SUPERIMPOSED = 0.05
"""Relative error of a lobe's least K_e up to which two lines are taken to lie on each other."""
_EVEN_SPEEDS = 200


@dataclass(frozen=True)
class LobeErrors:
    """How far one diagram's lobes are from another's.

    Attributes
    ----------
    ratio
        Ω/f₁ of the deepest point of each of the other's lobes, falling, shape (k,).
    error
        Relative error of the least K_e there: above 0 where this diagram calls unstable K_e stable; infinite
        where it sees no lobe.
    """

    ratio: np.ndarray
    error: np.ndarray

    def worst(self, low: float, high: float) -> tuple[float, float]:
        """(error, Ω/f₁) of largest size from `low` to `high`; (0, low) where there is no lobe."""
        at = np.flatnonzero((self.ratio >= low) & (self.ratio <= high))
        if not len(at):
            return 0.0, low
        i = at[np.argmax(np.abs(self.error[at]))]
        return float(self.error[i]), float(self.ratio[i])

    def superimposed_from(self) -> float | None:
        """The least Ω/f₁ from which on every lobe agrees within `SUPERIMPOSED`; None where none does."""
        wrong = np.flatnonzero(np.abs(self.error) > SUPERIMPOSED)
        kept = self.ratio[: wrong[0]] if len(wrong) else self.ratio
        return float(kept[-1]) if len(kept) else None


def time_convergence_blade(study: Study) -> Blade:
    """What the figure is drawn for: the first two modes ([SBL] keeps no more), at rest."""
    return with_modes(at_rest(study.blade), study.first_two)


def time_convergence_parts(study: Study) -> int:
    """How often `time_convergence` says that some of it is done."""
    return len(STEPS) * parts_of(_grid(study)[0])


def time_convergence(study: Study, done: Callable[[], None] = lambda: None) -> LobeFigure:
    """Lines of N = 40, 60, 80 and the exact one, without centrifugal effects, contact at the leading edge."""
    low, high = study.ratios
    f1, blade, contact = study.first_frequency_hz, time_convergence_blade(study), study.leading_edge
    speed, top = _grid(study)
    exact = exact_lobes("exact", blade, contact, speed, f1, top)
    # The scheme is slow, the exact boundary is not: its line is drawn through more speeds.
    fine = speed_grid([(blade, contact)], f1, (low, high), top)
    finer = exact_lobes("exact", blade, contact, fine, f1, top)
    schemes = {n: fixed_step_lobes(f"N = {n}", n, blade, contact, speed, f1, top, done) for n in STEPS}
    errors = {n: lobe_errors(found, exact) for n, found in schemes.items()}
    wrong = {
        n: {
            "unstable_called_stable": exact.share_not_in(found, low, high),
            "stable_called_unstable": found.share_not_in(exact, low, high),
        }
        for n, found in schemes.items()
    }
    return LobeFigure(
        number=7,
        title="Time convergence of semi-discretization, first two modes, without centrifugal effects",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=(*schemes.values(), finer),
        claims=(_fast_enough(errors[40], high), _converged(errors[60], wrong[60], low, high)),
        notes=(
            f"averaged scheme (Eqs. 7–14); a least K_e more than {percent(SUPERIMPOSED)} wrong counts as off",
            _against_80(schemes, low, high),
        ),
        numbers={
            "steps": [
                {
                    "N": n,
                    **wrong[n],
                    "lobe_ratio": errors[n].ratio,
                    "lobe_ke_error": errors[n].error,
                    "superimposed_from_ratio": errors[n].superimposed_from(),
                }
                for n in STEPS
            ]
        },
    )


def lobe_errors(found: Lobes, exact: Lobes) -> LobeErrors:
    """The least K_e of each of the exact lobes against what the other diagram has there, on the same speeds.

    A lobe reaches from one rise of the exact boundary to the next: to the highest point, or the first stable
    speed, on either side of its tip.
    """
    here, there = exact.first_ke, found.first_ke
    walled = np.r_[np.inf, here, np.inf]
    tips = np.flatnonzero(np.isfinite(here) & (here < walled[:-2]) & (here <= walled[2:]))
    # The highest point between neighbouring tips parts them.
    parts = [int(a) + int(np.argmax(here[a : b + 1])) for a, b in pairwise(tips.tolist())]
    starts, ends = [0, *parts], [*parts, len(here) - 1]
    least = np.array([there[a : b + 1].min() for a, b in zip(starts, ends, strict=True)] if len(tips) else [])
    falling = tips[::-1]
    return LobeErrors(exact.ratio[falling], least[::-1] / here[falling] - 1)


def _grid(study: Study) -> tuple[np.ndarray, float]:
    blade, contact = time_convergence_blade(study), study.leading_edge
    top = ke_axis([least_ke_of_modes(blade, contact)])
    grid = speed_grid(
        [(blade, contact)],
        study.first_frequency_hz,
        study.ratios,
        top,
        also=(ENOUGH_FROM,),
        even=_EVEN_SPEEDS,
    )
    return grid, top


def _fast_enough(errors: LobeErrors, high: float) -> Claim:
    error, at = errors.worst(ENOUGH_FROM, high)
    return Claim(
        f"N = 40 is enough above Ω/f₁ = {ENOUGH_FROM}",
        f"above Ω/f₁ = {ENOUGH_FROM}, at worst, N = 40 {_off(error, at)}",
        abs(error) <= SUPERIMPOSED,
    )


def _converged(errors: LobeErrors, wrong: dict[str, float], low: float, high: float) -> Claim:
    error, at = errors.worst(low, high)
    since = errors.superimposed_from()
    missed, false = wrong["unstable_called_stable"], wrong["stable_called_unstable"]
    side = "unsafe" if missed > false else "safe"
    areas = f"{percent(missed)} of the diagram is unstable but called stable, {percent(false)} the reverse"
    if abs(error) <= SUPERIMPOSED:
        said = f"N = 60 is right to {percent(abs(error))} on every lobe; {areas}"
    else:
        off = int((np.abs(errors.error) > SUPERIMPOSED).sum())
        where = "" if since is None else f", all below Ω/f₁ = {since:.3f}"
        said = (
            f"N = 60 is off by more than {percent(SUPERIMPOSED)} on {off} of {len(errors.error)} lobes"
            f"{where}, on the {side} side: {areas}; at worst it {_off(error, at)}"
        )
    return Claim("N = 60 is converged at every speed", said, abs(error) <= SUPERIMPOSED)


def _against_80(schemes: dict[int, Lobes], low: float, high: float) -> str:
    apart = sum(
        a.share_not_in(b, low, high) for a, b in ((schemes[60], schemes[80]), (schemes[80], schemes[60]))
    )
    return f"N = 60 and N = 80 disagree on {percent(apart)} of the diagram"


def _off(error: float, ratio: float) -> str:
    if np.isinf(error):
        return f"does not see the lobe at {ratio:.3f} below the top of the diagram"
    return f"puts the lobe at {ratio:.3f} {percent(abs(error))} too {'high' if error >= 0 else 'low'} in K_e"
