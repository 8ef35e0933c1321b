"""Leading against trailing edge: the least K_e with each tip node alone in contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.mode_lobes import nearest_mode
from sdm_core.assessment.single_mode import floors_over_speed
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import SEARCH_MARGIN, CriticalSpeed, check_range, least_critical_ke
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number

# So many times `ke_max` a node is followed, so that a ratio can be given where an edge is safe.
FOLLOWED_UP_TO = 16.0
# Edges whose least K_e differ by less are called equal: a tip is known to 1e-4.
_EQUAL = 1e-3
# Lobes refined to find the deepest: a grid ranks them to a percent only.
_LOBES = 400


@dataclass(frozen=True)
class NodeAlone:
    """One tip node alone in contact, with unit weight.

    Attributes
    ----------
    node
        Its name.
    tip
        Deepest lobe over the range; None where there is none below `searched_ke`.
    mode
        Number of the mode that owns it, counted from 1; None without a tip.
    searched_ke
        Largest K_e looked at, N/m.
    mode_floor_ke
        2ξ(1 + ξ)ω²/φ² of every mode alone at this node, least over the range, N/m; infinite where the mode
        does not move it. Empty where contact is not permanent.
    """

    node: str
    tip: CriticalSpeed | None
    mode: int | None
    searched_ke: float
    mode_floor_ke: tuple[float, ...]


@dataclass(frozen=True)
class EdgeComparison:
    """Every tip node by itself, leading to trailing edge.

    Attributes
    ----------
    nodes
        In the order of the blade.
    """

    nodes: tuple[NodeAlone, ...]

    @property
    def leading(self) -> NodeAlone:
        """The first node."""
        return self.nodes[0]

    @property
    def trailing(self) -> NodeAlone:
        """The last node."""
        return self.nodes[-1]

    @property
    def trailing_over_leading(self) -> float | None:
        """Least K_e at the trailing edge over that at the leading edge; None unless both are known."""
        if self.leading.tip is None or self.trailing.tip is None:
            return None
        return self.trailing.tip.ke / self.leading.tip.ke

    @property
    def mode_ratios(self) -> tuple[float, ...]:
        """The same ratio mode by mode, of the floors: (φ_LE/φ_TE)², but for stiffening."""
        pairs = zip(self.leading.mode_floor_ke, self.trailing.mode_floor_ke, strict=True)
        return tuple(te / le if np.isfinite(le) else np.nan for le, te in pairs)

    @property
    def safer(self) -> str | None:
        """Name of the edge node with the larger least K_e, ``equal``, or None where neither is known."""
        le, te = self.leading, self.trailing
        if le.tip is None and te.tip is None:
            return None
        if le.tip is None or te.tip is None:
            known, other = (te, le) if le.tip is None else (le, te)
            assert known.tip is not None
            return other.node if known.tip.ke <= other.searched_ke else None
        if abs(np.log(te.tip.ke / le.tip.ke)) < _EQUAL:
            return "equal"
        return te.node if te.tip.ke > le.tip.ke else le.node


def edge_comparison(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke_max: float,
) -> EdgeComparison:
    """The least K_e over a range of speeds with each tip node alone.

    Parameters
    ----------
    contact
        Arcs or engagement are taken from here; its weights are not.
    speed_range_hz
        Hz.
    ke_max
        N/m. In permanent contact a node that is safe up to there is followed to its lowest floor, at most
        `FOLLOWED_UP_TO` times as far.

    Raises
    ------
    InvalidInput
        For a blade with one tip node, an unusable range or stiffness, or more lobes than can be followed.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = edge_comparison(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), (200.0, 300.0), 2.5e4
    ... )
    >>> found.safer
    'TE'
    """
    check_blade_and_contact(blade, contact)
    check_range(*speed_range_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    if len(blade.tip_nodes) < 2:
        raise InvalidInput("tip_nodes", list(blade.tip_nodes), "give two or more, to compare edges")
    alone = []
    for node in blade.tip_nodes:
        there = ContactConfiguration.at(node, arcs=contact.arcs, engagement=contact.engagement)
        floors: tuple[float, ...] = ()
        reach = ke_max
        if there.permanent:
            over_speed = floors_over_speed(blade, there, speed_range_hz)[1]
            floors = tuple(over_speed.min(axis=0).tolist())
            lowest = float(over_speed.max(axis=0).min()) * SEARCH_MARGIN
            reach = float(np.clip(lowest, ke_max, FOLLOWED_UP_TO * ke_max))
        tips = least_critical_ke(blade, there, *speed_range_hz, reach, count=_LOBES)
        tip = tips[0] if tips else None
        alone.append(NodeAlone(node, tip, _owner(blade, tip), reach, floors))
    return EdgeComparison(tuple(alone))


def _owner(blade: Blade, tip: CriticalSpeed | None) -> int | None:
    if tip is None:
        return None
    natural = blade.at_speeds(np.array([tip.speed_hz]))[0][0] / (2 * np.pi)
    return nearest_mode(natural, tip.chatter_hz)
