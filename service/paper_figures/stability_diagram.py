"""[SBL] Fig. 5: the stability diagram with contact at the leading edge, and its two test points."""

from __future__ import annotations

from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import StabilitySolution, stability
from service.paper_figures.lobes import Lobes, exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, Mark, newtons, percent
from service.paper_figures.study import PAPER_KE_MAX, Study, ke_axis, least_ke_of_modes

STABLE_POINT, UNSTABLE_POINT = 2e3, 2e4


def stability_diagram(study: Study) -> LobeFigure:
    """Grey lobes of all the blade's modes, with centrifugal effects.

    The paper does not say at which speed its test points lie: here, in the middle of the widest stretch
    of speeds at which the upper one is unstable.
    """
    low, high = study.ratios
    f1, covered = study.first_frequency_hz, study.covered
    contact = study.leading_edge
    top = ke_axis([least_ke_of_modes(study.blade, contact)])
    speed = speed_grid([(study.blade, contact)], f1, (low, high), top, also=(covered,))
    lobes = exact_lobes("boundary", study.blade, contact, speed, f1, top)
    at, chosen = _test_speed(lobes, low, covered)
    points = {ke: _asked(study, at, ke) for ke in (STABLE_POINT, UNSTABLE_POINT)}
    least = lobes.least(low, covered)
    nowhere = (
        f"no K_e up to {newtons(top)} is unstable"
        if least is None
        else f"the least unstable K_e is {newtons(least[0])} at Ω/f₁ = {least[1]:.3f}"
    )
    below = _claim(points[STABLE_POINT], STABLE_POINT, at, True)
    above = _claim(points[UNSTABLE_POINT], UNSTABLE_POINT, at, False)
    spread = Claim(
        f"K_e up to {newtons(PAPER_KE_MAX)} holds unstable configurations",
        f"{nowhere}; {percent(lobes.share(low, covered))} of the diagram up to {newtons(top)} is unstable",
        least is not None and least[0] < PAPER_KE_MAX,
    )
    return LobeFigure(
        number=5,
        title="Stability diagram, contact at the leading edge",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=(lobes,),
        claims=(below, above, spread),
        notes=(f"test points {chosen}, verdicts by the exact characteristic equation",),
        extrapolated_from=covered if covered < high else None,
        shaded=True,
        marks=tuple(
            Mark(at, ke, found.stable, f"{ke:.0e} N/m: {_word(found)}".replace("e+0", "e"))
            for ke, found in points.items()
        ),
    )


def _test_speed(lobes: Lobes, low: float, high: float) -> tuple[float, str]:
    stretches = lobes.stretches(UNSTABLE_POINT, low, high)
    if not stretches:
        middle = 0.5 * (low + high)
        return middle, "at mid-range, for the upper one is unstable nowhere"
    a, b = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    return 0.5 * (a + b), "in the widest stretch of speeds that destabilises the upper one"


def _asked(study: Study, ratio: float, ke: float) -> StabilitySolution:
    speed = ratio * study.first_frequency_hz
    return stability(RubbingBlade.from_blade(study.blade, study.leading_edge, speed, ke))


def _claim(found: StabilitySolution, ke: float, ratio: float, stable_there: bool) -> Claim:
    return Claim(
        f"K_e = {newtons(ke)} is {'stable' if stable_there else 'unstable'} at the test point",
        f"K_e = {newtons(ke)} is {_word(found)} at Ω/f₁ = {ratio:.3f}, |μ| = {found.spectral_radius:.4f}",
        None if found.stable is None else found.stable is stable_there,
    )


def _word(found: StabilitySolution) -> str:
    return "not decided" if found.stable is None else "stable" if found.stable else "unstable"
