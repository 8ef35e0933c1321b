"""Everything a rubbing expert asks of one blade and one contact, in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from sdm_core.assessment.campbell import DEFAULT_ORDERS, CampbellDiagram, campbell_diagram
from sdm_core.assessment.clearance import ClearanceUse, clearance_use
from sdm_core.assessment.edges import EdgeComparison, edge_comparison
from sdm_core.assessment.margins import Margins, OperatingPoint, margins
from sdm_core.assessment.mode_kind import FEWEST_NODES, ModeKind, mode_kinds
from sdm_core.assessment.mode_lobes import LobeOwner, ModeLobes, lobe_owners, mode_lobes
from sdm_core.assessment.plain_data import plain
from sdm_core.assessment.robust import RobustVerdict, robust_at_speeds, robust_over_range
from sdm_core.assessment.uncertain_blade import Uncertainty
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import CriticalSpeed, check_range, least_critical_ke
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number

KE_MAX = 2.5e4
"""Up to where K_e is looked at unless told otherwise, N/m: it covers the cutting forces seen in
experiments ([SBL] section 4)."""
MOST_TIPS = 400

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Assessment:
    """One blade under one contact, over one range of rotor speeds.

    Attributes
    ----------
    blade, contact
        What was assessed.
    speed_range_hz, ke_max, ke_liner
        Hz; largest K_e looked at, N/m; the liner's, None where not given.
    tips
        Tips of all lobes, deepest first.
    owners
        The mode that owns each.
    campbell, modes, kinds, clearance
        As their modules tell; no kinds for a blade with fewer than three tip nodes.
    edges
        Every tip node alone; None for a blade with one.
    margins
        Against the liner; None without one.
    robust_range, robust_points
        With uncertain data over the range, and at the operating points; None where left out, the
        second also without points.
    missing
        What the blade or the question does not give, and what could therefore not be told, in words.
    """

    blade: Blade
    contact: ContactConfiguration
    speed_range_hz: tuple[float, float]
    ke_max: float
    ke_liner: float | None
    tips: tuple[CriticalSpeed, ...]
    owners: tuple[LobeOwner, ...]
    campbell: CampbellDiagram
    modes: tuple[ModeLobes, ...]
    kinds: tuple[ModeKind, ...]
    clearance: ClearanceUse
    edges: EdgeComparison | None
    margins: Margins | None
    robust_range: RobustVerdict | None
    robust_points: RobustVerdict | None
    missing: tuple[str, ...]

    @property
    def worst(self) -> CriticalSpeed | None:
        """Deepest lobe; None where there is none below `ke_max`."""
        return self.tips[0] if self.tips else None

    def to_dict(self) -> dict[str, Any]:
        """The assessment as JSON: SI units and Hz, what is infinite or unknown as null."""
        return {
            "schema": "rubscreen/assessment/1",
            "blade": self.blade.name,
            "contact": self.contact.to_dict(),
            "speed_range_hz": list(self.speed_range_hz),
            "ke_max": self.ke_max,
            "ke_liner": self.ke_liner,
            "worst": plain(self.worst),
            "lobes": [plain(owner) for owner in self.owners],
            "campbell": plain(self.campbell),
            "modes": [_with(m, "critical_ke") for m in self.modes],
            "kinds": [_with(kind, "described") for kind in self.kinds],
            "clearance": _with(
                self.clearance, "touching_tip_m", "touching_coordinate", "first_to_touch", "tightest"
            ),
            "edges": _with(self.edges, "safer", "trailing_over_leading", "mode_ratios"),
            "margins": plain(self.margins),
            "robust_range": _robust(self.robust_range),
            "robust_points": _robust(self.robust_points),
            "missing": list(self.missing),
        }


def assess(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    *,
    ke_liner: float | None = None,
    ke_max: float | None = None,
    cold_clearance_m: float | Sequence[float] | None = None,
    engine_orders: Sequence[int] = DEFAULT_ORDERS,
    points: Sequence[OperatingPoint] = (),
    uncertainty: Uncertainty | None = None,
    robust: bool = True,
    progress: Progress | None = None,
) -> Assessment:
    """Campbell diagram, lobes by mode, mode kinds, clearance, edges, margins and the robust verdict.

    Parameters
    ----------
    speed_range_hz
        Operating range, Hz.
    ke_liner
        Of the liner, N/m; without it there are no margins and no verdicts.
    ke_max
        Largest K_e looked at, N/m; None is `KE_MAX`, or twice the liner's where that is more.
    cold_clearance_m
        Gap at rest, one number or one a tip node, m.
    engine_orders
        For the Campbell diagram.
    points
        Operating points with their share of running time, inside the range.
    uncertainty
        None: damping × 0.5 to 2, frequencies ± 3 %, mode by mode.
    robust
        False leaves out the robust verdicts, which take most of the time.
    progress
        Called with what is being worked on, parts done, and their number.

    Raises
    ------
    InvalidInput
        Naming the field, the value and the remedy.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = assess(
    ...     example_blade("generic_compressor_blade"),
    ...     ContactConfiguration.at("LE"),
    ...     (60.0, 200.0),
    ...     ke_liner=9000.0,
    ...     robust=False,
    ... )
    >>> found.margins.unstable
    ()
    """
    check_blade_and_contact(blade, contact)
    low, high = speed_range_hz
    check_range(low, high)
    span = (float(low), float(high))
    if ke_liner is not None:
        number("ke_liner", ke_liner, 0.0, KE_LIMIT, "N/m", open_low=True)
    if ke_max is None:
        ke_max = KE_MAX if ke_liner is None else max(KE_MAX, 2 * ke_liner)
    number("ke_max", ke_max, ke_liner or 0.0, KE_LIMIT, "N/m", open_low=ke_liner is None)
    parts = 6 + int(robust) + int(robust and bool(points))
    done = 0

    def begin(what: str) -> None:
        nonlocal done
        if progress is not None:
            progress(what, done, parts)
        done += 1

    begin("lobes over the range of speeds")
    tips = least_critical_ke(blade, contact, *span, ke_max, count=MOST_TIPS)
    owners = lobe_owners(blade, contact, tips, ke_max)
    begin("Campbell diagram and mode kinds")
    campbell = campbell_diagram(blade, span, engine_orders=engine_orders, tips=tips)
    named = len(blade.tip_nodes) >= FEWEST_NODES
    kinds = mode_kinds(blade, blade.design_speed_hz) if named else ()
    begin("lobes of each mode alone")
    modes = mode_lobes(blade, contact, span, ke_max)
    begin("clearance")
    clearance = clearance_use(blade, span, cold_clearance_m)
    begin("each tip node alone")
    edges = edge_comparison(blade, contact, span, ke_max) if len(blade.tip_nodes) > 1 else None
    begin("margins against the liner")
    against = None
    if ke_liner is not None:
        against = margins(blade, contact, span, ke_liner, ke_max=ke_max, points=points)
    over_range = at_points = None
    if robust:
        how: dict[str, Any] = {"uncertainty": uncertainty, "ke_liner": ke_liner}
        begin("worst case over the range")
        over_range = robust_over_range(blade, contact, span, ke_max, **how)
        if points:
            begin("worst case at the operating points")
            at_points = robust_at_speeds(blade, contact, [p.speed_hz for p in points], ke_max, **how)
    missing = [*clearance.missing]
    for kind in kinds:
        missing += [kind.approximate] if kind.approximate and kind.approximate not in missing else []
    if not named:
        missing.append("tip_nodes: fewer than three, modes are not named bending or torsion")
    if edges is None:
        missing.append("tip_nodes: only one, edges cannot be compared")
    if ke_liner is None:
        missing.append("ke_liner: no margins and no verdict")
    if not contact.permanent:
        missing.append("contact varies round the casing: no closed-form floors and no proven bound")
    return Assessment(
        blade,
        contact,
        span,
        float(ke_max),
        ke_liner,
        tips,
        owners,
        campbell,
        modes,
        kinds,
        clearance,
        edges,
        against,
        over_range,
        at_points,
        tuple(missing),
    )


def _with(found: Any, *properties: str) -> dict[str, Any] | None:
    """An answer's fields and some of its properties; None for none."""
    if found is None:
        return None
    return plain(found) | {name: plain(getattr(found, name)) for name in properties}


def _robust(found: RobustVerdict | None) -> dict[str, Any] | None:
    if found is None:
        return None
    cases = {name: _with(getattr(found, name), "described") for name in ("nominal", "worst", "best")}
    return plain(found) | cases | {"described": found.described}
