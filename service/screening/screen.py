"""Screening of blades and contacts: the smallest destabilising K_e of each, and where ([SBL] section 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import CriticalSpeed, lobe_grid
from sdm_core.validation import KE_LIMIT, number
from service.answerer import Answerer
from service.screening.sweep import Progress, searched, through_tips
from service.speeds import SpeedRange, evenly_spaced, operating_range
from training.answers import EXACT, BoundaryAnswers, MapAnswers

# [SBL] section 4: K_e up to 2.5e4 N/m covers the cutting forces seen in experiments.
KE_MAX = 2.5e4
# With smooth engagement the exact core answers every point of a map, at some hundredths of a second each.
MAP_SHAPE, MAP_SHAPE_SMOOTH = (100, 100), (50, 50)
STABLE, UNSTABLE, UNDECIDED = "stable", "unstable at some speed", "not decided"
VERDICTS = (STABLE, UNSTABLE, UNDECIDED)
USUAL_CONTACTS = ("LE", "TE", "both")


@dataclass(frozen=True)
class ScreeningResult:
    """One blade under one contact.

    Attributes
    ----------
    blade
        The blade.
    contact_name, contact
        Its name in tables, and its nodes, weights and arcs.
    speed_range_hz
        Rotor speeds searched, Hz.
    critical_speeds
        Tips of the deepest lobes by the exact core, smallest K_e first; empty when no K_e up to
        `ke_max` destabilises the blade.
    ke_max, ke_liner
        Largest K_e looked at, and the liner's (None: not given), N/m.
    unstable_share
        Share of the map (speed × K_e in [0, ke_max]) that is unstable.
    verified_share
        Share of the map's points answered by the exact core.
    boundary
        Over the range and at the tips, up to somewhat above `ke_max`, so that no lobe below it is missed.
    map
        Verdicts over the range, up to `ke_max`.
    """

    blade: Blade = field(repr=False)
    contact_name: str
    contact: ContactConfiguration
    speed_range_hz: tuple[float, float]
    critical_speeds: tuple[CriticalSpeed, ...]
    ke_max: float
    ke_liner: float | None
    unstable_share: float
    verified_share: float
    boundary: BoundaryAnswers = field(repr=False)
    map: MapAnswers = field(repr=False)

    @property
    def worst(self) -> CriticalSpeed | None:
        """Where the smallest K_e destabilises the blade; None when there is none below `ke_max`."""
        return self.critical_speeds[0] if self.critical_speeds else None

    @property
    def proven(self) -> bool:
        """False where the exact core answered without proof, at a tip or in the sweep."""
        swept = self.boundary.error_estimate[self.boundary.source == EXACT]
        return bool(np.isfinite(swept).all()) and all(tip.proven for tip in self.critical_speeds)

    @property
    def verdict(self) -> str | None:
        """`STABLE`, `UNSTABLE` or `UNDECIDED` against the liner's K_e; None when no liner is given."""
        if self.ke_liner is None:
            return None
        if self.worst is not None and self.worst.proven and self.worst.ke <= self.ke_liner:
            return UNSTABLE
        return STABLE if self.proven and self._nothing_up_to(self.ke_liner) else UNDECIDED

    def _nothing_up_to(self, ke: float) -> bool:
        return self.worst is None or self.worst.ke > ke

    @property
    def margin(self) -> float | None:
        """Smallest destabilising K_e over the liner's, minus 1; None without a liner or a crossing."""
        if self.ke_liner is None or self.worst is None:
            return None
        return self.worst.ke / self.ke_liner - 1.0

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON, without the map."""
        return {
            "blade": self.blade.name,
            "contact_name": self.contact_name,
            "contact": self.contact.to_dict(),
            "speed_range_hz": list(self.speed_range_hz),
            "smallest_unstable_ke": None if self.worst is None else self.worst.ke,
            "critical_speeds": [asdict(tip) for tip in self.critical_speeds],
            "ke_max": self.ke_max,
            "ke_liner": self.ke_liner,
            "proven": self.proven,
            "verdict": self.verdict,
            "margin": self.margin,
            "unstable_share": self.unstable_share,
            "verified_share": self.verified_share,
        }


@dataclass(frozen=True)
class ScreeningReport:
    """Every blade under every contact, safest first.

    Attributes
    ----------
    results
        Sorted by the smallest destabilising K_e, largest (safest) first; those with none below
        `ke_max` lead, the smaller unstable share breaking ties.
    model, solver
        Identifier of the surrogate (None: none used) and name of the exact method.
    """

    results: tuple[ScreeningResult, ...]
    model: str | None
    solver: str

    def to_dict(self) -> dict[str, Any]:
        """The report as JSON."""
        return {
            "schema": "rubscreen/screening/1",
            "order": "safest first",
            "model": self.model,
            "solver": self.solver,
            "results": [{"rank": i, **row.to_dict()} for i, row in enumerate(self.results, 1)],
        }


def default_contacts(blade: Blade) -> dict[str, ContactConfiguration]:
    """Leading edge, trailing edge, and both with weight 1 on each ([SBL] section 5.1)."""
    first, last = blade.tip_nodes[0], blade.tip_nodes[-1]
    if first == last:
        return {first: ContactConfiguration.at(first)}
    leading, trailing, both = USUAL_CONTACTS
    return {
        leading: ContactConfiguration.at(first),
        trailing: ContactConfiguration.at(last),
        both: ContactConfiguration.at(first, last),
    }


def screen(
    blades: Sequence[Blade],
    contacts: Mapping[str, ContactConfiguration] | None,
    answerer: Answerer,
    *,
    speed_range: SpeedRange | None = None,
    ke_max: float = KE_MAX,
    ke_liner: float | None = None,
    map_shape: tuple[int, int] | None = None,
    policy: str = "auto",
    sweep_policy: str | None = None,
    alpha: float | None = None,
    progress: Progress | None = None,
) -> ScreeningReport:
    """Screen every blade under every contact.

    Parameters
    ----------
    blades
        At least one.
    contacts
        By name; None is leading edge, trailing edge and both.
    answerer
        What answers: a Screener in this process, or a Client of a running service.
    speed_range
        None is `operating_range` of each blade.
    ke_max, ke_liner
        Largest K_e looked at and the liner's, N/m.
    map_shape
        Speeds and stiffnesses of each map; None is 100 × 100, or 50 × 50 with smooth engagement.
    policy
        Of the maps. Lobe tips are exact whatever it is.
    sweep_policy
        Of the sweep over speeds that finds the lobes, and that charts draw; None is `policy`.
    alpha
        Rate of unstable designs called stable that "auto" must keep; None is the model's default.
    progress
        Called with (done, total, what is next); may raise to stop the work.

    Raises
    ------
    InvalidInput
        For unusable arguments, naming field, value and remedy.
    """
    if not blades:
        raise InvalidInput("blades", "[]", "give at least one blade")
    ke_max = number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    if ke_liner is not None:
        number("ke_liner", ke_liner, 0.0, ke_max, "N/m (ke_max)", open_low=True)
    jobs = [
        (blade, name, contact, _range(blade, speed_range))
        for blade in blades
        for name, contact in (contacts or default_contacts(blade)).items()
    ]
    for blade, _, contact, _ in jobs:
        contact.weight_vector(blade.tip_nodes)
    results = []
    for i, (blade, name, contact, speeds) in enumerate(jobs):
        if progress is not None:
            progress(i, len(jobs), f"{blade.name}, {name}")
        columns, rows = map_shape or (MAP_SHAPE_SMOOTH if contact.smooth else MAP_SHAPE)
        speed_hz = evenly_spaced(*speeds, columns)
        sweep = lobe_grid(blade, contact, speed_hz, ke_max)
        boundary, tips = searched(
            answerer, blade, contact, sweep, ke_max, sweep_policy or policy, alpha=alpha
        )
        boundary = through_tips(answerer, blade, contact, boundary, tips)
        ke = np.linspace(0.0, ke_max, rows)
        verdicts = answerer.map(blade, contact, speed_hz, ke, policy=policy, alpha=alpha)
        shares = verdicts.unstable_share, verdicts.exact_share
        results.append(
            ScreeningResult(blade, name, contact, speeds, tips, ke_max, ke_liner, *shares, boundary, verdicts)
        )
    if progress is not None:
        progress(len(jobs), len(jobs), "done")
    ranked = tuple(sorted(results, key=risk))
    return ScreeningReport(ranked, results[0].map.model, results[0].boundary.solver)


def _range(blade: Blade, speed_range: SpeedRange | None) -> tuple[float, float]:
    return operating_range(blade) if speed_range is None else speed_range.for_blade(blade)


def risk(result: ScreeningResult) -> tuple[float, float]:
    """Safest first, as a key for sorting: largest least K_e, then the smaller unstable share."""
    smallest = np.inf if result.worst is None else result.worst.ke
    return -smallest, result.unstable_share
