"""[SBL] Fig. 10: contact at the leading edge against contact at the trailing edge."""

from __future__ import annotations

import numpy as np

from sdm_core.contact import ContactConfiguration
from service.paper_figures.lobes import Lobes, exact_lobes, speed_grid
from service.paper_figures.paper_figure import Claim, LobeFigure, newtons, percent
from service.paper_figures.study import Study, ke_axis, least_ke_of_modes

# How much larger the paper's "significantly larger" is at least.
SIGNIFICANT = 1.2


def contact_location(study: Study) -> LobeFigure:
    """All modes, with centrifugal effects."""
    low, high = study.ratios
    f1, covered = study.first_frequency_hz, study.covered
    contacts = {"trailing edge": study.trailing_edge, "leading edge": study.leading_edge}
    top = ke_axis([least_ke_of_modes(study.blade, contact) for contact in contacts.values()])
    speed = speed_grid(
        [(study.blade, contact) for contact in contacts.values()], f1, (low, high), top, also=(covered,)
    )
    curves = {
        name: exact_lobes(name, study.blade, contact, speed, f1, top) for name, contact in contacts.items()
    }
    shares = {name: curve.share(low, covered) for name, curve in curves.items()}
    soft = {name: flexibility(study, contact) for name, contact in contacts.items()}
    return LobeFigure(
        number=10,
        title="Leading edge against trailing edge",
        blade=study.blade.name,
        first_frequency_hz=f1,
        ratios=(low, high),
        curves=tuple(curves.values()),
        claims=(_worse_edge(curves, shares, low, covered), _stiffer_is_safer(shares, soft)),
        extrapolated_from=covered if covered < high else None,
        numbers={"unstable_share": shares, "flexibility_m_per_N": soft},
    )


def flexibility(study: Study, contact: ContactConfiguration) -> float:
    """Static displacement of the contact node per force at it, from the modes at rest: Σ G_jj/ω_j², m/N."""
    state = study.blade.states[0]
    moved = state.mode_shape**2 @ contact.weight_vector(study.blade.tip_nodes)
    return float((moved / (2 * np.pi * state.frequency_hz) ** 2).sum())


def _worse_edge(curves: dict[str, Lobes], shares: dict[str, float], low: float, covered: float) -> Claim:
    paper = "the unstable domain is significantly larger with contact at the leading edge"
    worse, other = sorted(shares, key=shares.__getitem__, reverse=True)
    if shares[worse] == 0:
        return Claim(paper, "nothing is unstable with contact at either edge", None)
    first = "; ".join(
        f"{name} first unstable from {newtons(found[0])} at Ω/f₁ = {found[1]:.3f}"
        for name, found in ((name, curve.least(low, covered)) for name, curve in curves.items())
        if found is not None
    )
    times = (
        "while nothing is at the other"
        if shares[other] == 0
        else f"{shares[worse] / shares[other]:.2g} times that at the {other} ({percent(shares[other])})"
    )
    said = f"the unstable share at the {worse} is {percent(shares[worse])}, {times}; {first}"
    larger = shares["leading edge"] > SIGNIFICANT * shares["trailing edge"]
    return Claim(paper, said, larger)


def _stiffer_is_safer(shares: dict[str, float], soft: dict[str, float]) -> Claim:
    paper = "the stiffer edge has the larger stable domain"
    stiff, compliant = sorted(soft, key=soft.__getitem__)
    said = (
        f"the {stiff} is {soft[compliant] / soft[stiff]:.2g} times as stiff statically in the contact "
        f"direction and has the {'smaller' if shares[stiff] < shares[compliant] else 'larger'} unstable share"
    )
    holds = None if shares[stiff] == shares[compliant] else shares[stiff] < shares[compliant]
    return Claim(paper, said, holds)
