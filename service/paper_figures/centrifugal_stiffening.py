"""[SBL] Fig. 9: lobes with and without centrifugal effects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.lobe_tips import least_critical_ke
from service.paper_figures.lobes import Lobes, exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, newtons, percent
from service.paper_figures.study import Study, at_rest, ke_axis, least_ke_of_modes

_EVERY_LOBE = 400
# A wide lobe is substantially moved, and a thin one essentially not, where their shifts differ by this.
_MUCH_MORE = 2.0


@dataclass(frozen=True)
class _Tip:
    order: int
    ratio: float
    ke: float


def centrifugal_stiffening(study: Study) -> LobeFigure:
    """All modes, contact at the leading edge."""
    low, high = study.ratios
    f1, contact, covered = study.first_frequency_hz, study.leading_edge, study.covered
    still = at_rest(study.blade)
    top = ke_axis([least_ke_of_modes(study.blade, contact)])
    middle = 0.5 * (low + covered)
    speed = speed_grid(
        [(study.blade, contact), (still, contact)], f1, (low, high), top, also=(middle, covered)
    )
    with_effects = exact_lobes("with centrifugal effects", study.blade, contact, speed, f1, top)
    without = exact_lobes("without", still, contact, speed, f1, top)
    moved = _moved(study, still, top)
    return LobeFigure(
        number=9,
        title="With and without centrifugal effects, contact at the leading edge",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=(with_effects, without),
        claims=(_larger(with_effects, without, middle, covered), _wide_ones_move(moved)),
        extrapolated_from=covered if covered < high else None,
        numbers={
            "first_mode_tips": [
                {
                    "order": a.order,
                    "ratio": [a.ratio, b.ratio],
                    "ke": [a.ke, b.ke],
                }
                for a, b in moved
            ]
        },
    )


def _larger(with_effects: Lobes, without: Lobes, middle: float, covered: float) -> Claim:
    a, b = without.share(middle, covered), with_effects.share(middle, covered)
    if a == b == 0:
        return Claim(
            "stiffening enlarges the stable domain at high speed",
            f"nothing is unstable from Ω/f₁ = {middle:.2f} to {covered:.2f}, with or without",
            None,
        )
    word = "grows" if b < a else "shrinks" if b > a else "stays"
    return Claim(
        "stiffening enlarges the stable domain at high speed",
        f"the stable domain {word} at high speed: from Ω/f₁ = {middle:.2f} to {covered:.2f} "
        f"{percent(a)} is unstable without centrifugal effects, {percent(b)} with",
        b < a,
    )


def _wide_ones_move(moved: list[tuple[_Tip, _Tip]]) -> Claim:
    paper = "wide lobes move and change, thin ones hardly do"
    if len(moved) < 2:
        return Claim(paper, "too few lobes of mode 1 reach below the axis' top to be followed", None)
    (wide, wide_at), (thin, thin_at) = moved[0], moved[-1]
    shift, slight = wide_at.ratio - wide.ratio, thin_at.ratio - thin.ratio
    return Claim(
        paper,
        f"the fastest lobe of mode 1 moves by {shift:+.4f} in Ω/f₁ (tip {newtons(wide.ke)} → "
        f"{newtons(wide_at.ke)}), the slowest by {slight:+.5f} ({newtons(thin.ke)} → {newtons(thin_at.ke)})",
        abs(shift) > _MUCH_MORE * abs(slight),
    )


def _moved(study: Study, still: Blade, top: float) -> list[tuple[_Tip, _Tip]]:
    """Tips of mode 1 without and with centrifugal effects, lobe by lobe, fastest first."""
    before, after = ({tip.order: tip for tip in _tips(study, blade, top)} for blade in (still, study.blade))
    both = sorted(before.keys() & after.keys())
    return [(before[order], after[order]) for order in both]


def _tips(study: Study, blade: Blade, top: float) -> list[_Tip]:
    """Tips of lobes that chatter near mode 1; the order is the whole number of vibrations in a revolution."""
    f1 = study.first_frequency_hz
    low_hz, high_hz = study.ratios[0] * f1, study.covered * f1
    # A lobe cut off by an end of the range has its least point there, which is no tip.
    inside = (low_hz * 1.001, high_hz * 0.999)
    tips = least_critical_ke(
        blade, study.leading_edge, low_hz, high_hz, top, count=_EVERY_LOBE, tolerance=1e-3
    )
    out = []
    for tip in tips:
        frequency = blade.at_speed(tip.speed_hz).frequency_hz
        if np.argmin(np.abs(frequency - tip.chatter_hz)) == 0 and inside[0] < tip.speed_hz < inside[1]:
            out.append(_Tip(int(tip.lobes_per_revolution), tip.speed_ratio, tip.ke))
    return out
