"""[SBL] Fig. 13: lobes of the first bending mode alone against those of the first torsion mode alone."""

from __future__ import annotations

from service.paper_figures.lobes import Lobes, exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, newtons
from service.paper_figures.study import Study, ke_axis, least_ke_of_modes, with_modes

# A lobe's width is taken at this multiple of its own least K_e.
_WIDTH_AT = 2.0


def bending_and_torsion(study: Study) -> LobeFigure:
    """Each mode alone, with centrifugal effects, contact at the leading edge."""
    low, high = study.ratios
    f1, covered, contact = study.first_frequency_hz, study.covered, study.leading_edge
    blades = {
        f"first torsion (mode {study.torsion + 1})": with_modes(study.blade, [study.torsion]),
        f"first bending (mode {study.bending + 1})": with_modes(study.blade, [study.bending]),
    }
    top = ke_axis([least_ke_of_modes(blade, contact) for blade in blades.values()])
    speed = speed_grid([(blade, contact) for blade in blades.values()], f1, (low, high), top, also=(covered,))
    torsion, bending = (exact_lobes(label, blade, contact, speed, f1, top) for label, blade in blades.items())
    return LobeFigure(
        number=13,
        title="First bending mode alone against first torsion mode alone, contact at the leading edge",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=(torsion, bending),
        claims=(
            _earlier(bending, torsion, low, covered),
            _wider(bending, torsion, low, covered),
            _at_low_speed(bending, torsion, low, covered),
        ),
        notes=(study.named_by,),
        extrapolated_from=covered if covered < high else None,
    )


def _earlier(bending: Lobes, torsion: Lobes, low: float, high: float) -> Claim:
    paper = "bending lobes arise at smaller K_e than torsion lobes"
    b, t = bending.least(low, high), torsion.least(low, high)
    if b is None and t is None:
        return Claim(paper, "neither mode alone becomes unstable below the axis' top", None)
    said = ", ".join(
        f"{name} {'none up to ' + newtons(bending.ke_max) if found is None else newtons(found[0])}"
        for name, found in (("bending", b), ("torsion", t))
    )
    least = [float("inf") if found is None else found[0] for found in (b, t)]
    return Claim(paper, f"least unstable K_e: {said}", least[0] < least[1])


def _wider(bending: Lobes, torsion: Lobes, low: float, high: float) -> Claim:
    paper = "bending lobes are wider than torsion lobes"
    widths = [_widest(lobes, low, high) for lobes in (bending, torsion)]
    if widths[0] is None or widths[1] is None:
        return Claim(paper, "a lobe's width at twice its least K_e is known for one of them only", None)
    return Claim(
        paper,
        f"widest lobe at twice its least K_e: bending {widths[0]:.3f}, torsion {widths[1]:.3f} in Ω/f₁",
        widths[0] > widths[1],
    )


def _widest(lobes: Lobes, low: float, high: float) -> float | None:
    least = lobes.least(low, high)
    if least is None or _WIDTH_AT * least[0] > lobes.ke_max:
        return None
    # A lobe that an end of the range cuts is not as wide as it looks.
    whole = [
        b - a
        for a, b in lobes.stretches(_WIDTH_AT * least[0], low, high)
        if a > lobes.ratio[lobes.ratio >= low][0] and b < lobes.ratio[lobes.ratio <= high][-1]
    ]
    return max(whole) if whole else None


def _at_low_speed(bending: Lobes, torsion: Lobes, low: float, high: float) -> Claim:
    paper = "bending instability reaches very low speeds, torsion instability does not"
    b, t = bending.lowest_unstable(low, high), torsion.lowest_unstable(low, high)
    if b is None and t is None:
        return Claim(paper, "neither mode alone becomes unstable below the axis' top", None)
    said = ", ".join(
        f"{name} {'at no speed' if found is None else f'from Ω/f₁ = {found:.3f}'}"
        for name, found in (("bending", b), ("torsion", t))
    )
    lowest = [float("inf") if found is None else found for found in (b, t)]
    # One lobe of torsion more than bending at the lower end is no difference.
    return Claim(paper, f"unstable speeds begin: {said}", lowest[0] < low * 1.1 and lowest[1] > 2 * lowest[0])
