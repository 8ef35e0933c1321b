"""[SBL] Fig. 8: lobes of mode 1, of the first two modes, and of all five."""

from __future__ import annotations

from service.paper_figures.lobes import exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, newtons, percent
from service.paper_figures.study import Study, at_rest, ke_axis, least_ke_of_modes, with_modes

MOST_MODES = 5
# Share of the unstable area by which two diagrams may differ and still be said to lie on each other.
SUPERIMPOSED = 0.05


def modal_convergence(study: Study) -> LobeFigure:
    """Without centrifugal effects, contact at the leading edge."""
    low, high = study.ratios
    f1, contact = study.first_frequency_hz, study.leading_edge
    still = at_rest(study.blade)
    count = min(MOST_MODES, still.mode_count)
    blades = {
        "mode 1": with_modes(still, [0]),
        "modes 1 and 2": with_modes(still, range(min(2, count))),
        f"modes 1 to {count}": with_modes(still, range(count)),
    }
    top = ke_axis([least_ke_of_modes(blade, contact) for blade in blades.values()])
    speed = speed_grid([(blade, contact) for blade in blades.values()], f1, (low, high), top)
    one, two, all_of_them = (
        exact_lobes(label, blade, contact, speed, f1, top) for label, blade in blades.items()
    )
    added = two.share_not_in(one, low, high)
    more = all_of_them.share_not_in(two, low, high)
    less = two.share_not_in(all_of_them, low, high)
    whole = all_of_them.share(low, high)
    apart = (more + less) / whole if whole else 0.0
    least_two, least_all = two.least(low, high), all_of_them.least(low, high)
    tips = (
        ""
        if least_two is None or least_all is None
        else f"; least K_e {newtons(least_two[0])} with two, {newtons(least_all[0])} with {count}"
    )
    ratio = added / whole if whole else 0.0
    return LobeFigure(
        number=8,
        title="Modal convergence, contact at the leading edge, without centrifugal effects",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=(one, two, all_of_them),
        claims=(
            Claim(
                "mode 1 alone is not enough: mode 2 adds lobes",
                f"mode 2 adds {percent(added)} of the diagram to the {percent(one.share(low, high))} that is "
                "unstable with mode 1 alone",
                ratio > SUPERIMPOSED,
            ),
            Claim(
                "modes above the second have little influence",
                f"modes 3 to {count} add {percent(more)} of the diagram and take away {percent(less)}, "
                f"{percent(apart)} of all that is unstable{tips}",
                apart <= SUPERIMPOSED,
            ),
        ),
        numbers={"added_by_mode_2": added, "added_above": more, "taken_away_above": less},
    )
