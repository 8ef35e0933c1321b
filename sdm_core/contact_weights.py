"""Weights of contact nodes by quadrature along the chord: K_e per node against stiffness per length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson
from scipy.interpolate import CubicSpline

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.validation import KE_LIMIT, number

RULES = ("trapezoid", "simpson")
# Points of the Gauss rule for the length of each piece of the spline through the tip nodes.
_GAUSS = 8


@dataclass(frozen=True)
class ChordWeights:
    """Quadrature weights of the tip nodes along the tip line.

    A liner of stiffness k′ per length of the tip acts on node i with k′ℓ_i, where ℓ_i is the node's
    quadrature length. Weights have mean 1, so that K_e stays a stiffness per node:

        K_e w_i = k′ ℓ_i,   w_i = r ℓ_i/L,   K_e = k′ L/r,   Σ K_e w_i = k′ L,

    and with unit weights on the same nodes the stiffness in all is the same.

    Attributes
    ----------
    nodes
        Names of the r nodes in contact, leading to trailing edge.
    arc_m
        Their places along the tip line, from the first, m, shape (r,).
    share_m
        ℓ, m, shape (r,); adds up to `length_m`.
    rule
        One of `RULES`.
    """

    nodes: tuple[str, ...]
    arc_m: np.ndarray
    share_m: np.ndarray
    rule: str

    @property
    def length_m(self) -> float:
        """L, m."""
        return float(self.arc_m[-1])

    @property
    def weights(self) -> Mapping[str, float]:
        """w by node, mean 1."""
        scaled = len(self.nodes) * self.share_m / self.length_m
        return dict(zip(self.nodes, scaled.tolist(), strict=True))

    def ke_per_node(self, ke_per_length: float) -> float:
        """K_e in N/m from k′ in N/m per m of tip, K_e = k′L/r."""
        number("ke_per_length", ke_per_length, 0.0, KE_LIMIT, "N/m per m")
        return ke_per_length * self.length_m / len(self.nodes)

    def ke_per_length(self, ke_per_node: float) -> float:
        """k′ in N/m per m of tip from K_e in N/m, k′ = K_e r/L."""
        number("ke_per_node", ke_per_node, 0.0, KE_LIMIT, "N/m")
        return ke_per_node * len(self.nodes) / self.length_m

    def contact(
        self,
        arcs: Sequence[Sequence[float]] | None = None,
        engagement: FourierEngagement | None = None,
    ) -> ContactConfiguration:
        """Contact with these weights.

        Raises
        ------
        InvalidInput
            When a weight is negative, as Simpson's rule on very uneven nodes can have it.
        """
        for node, weight in self.weights.items():
            if weight < 0:
                raise InvalidInput(
                    f"contact.weights.{node}", weight, "the nodes are too uneven for simpson: use trapezoid"
                )
        return ContactConfiguration(self.weights, arcs, engagement)

    def described(self, ke_per_node: float) -> str:
        """A K_e with its conversion, in words."""
        r, per_length = len(self.nodes), self.ke_per_length(ke_per_node)
        return (
            f"K_e = {ke_per_node:,.6g} N/m per node on {r} nodes over {1e3 * self.length_m:.4g} mm of tip is "
            f"k′ = K_e·{r}/L = {per_length:,.6g} N/m per m, {r * ke_per_node:,.6g} N/m in all "
            f"({self.rule} weights, mean 1)"
        )


def chord_weights(blade: Blade, rule: str = "trapezoid", nodes: Sequence[str] | None = None) -> ChordWeights:
    """Quadrature weights from the arc length along the tip line in space.

    The tip line is the cubic spline through the nodes (r, θ, z); with smooth mode shapes the boundary
    then converges as nodes are added, with the second order of the trapezoid or the fourth of Simpson.

    Parameters
    ----------
    rule
        ``trapezoid`` or ``simpson`` (on uneven nodes too; needs three nodes).
    nodes
        Nodes in contact, in the blade's order; None is all of them.

    Raises
    ------
    InvalidInput
        For fewer than two nodes, a blade without the place of its tip nodes, or an unknown rule.

    Examples
    --------
    >>> from sdm_core.blade import ModalState
    >>> state = ModalState(0.0, [100.0], [[1.0, 1.0, 1.0]])
    >>> place = dict(tip_radius_m=[0.3] * 3, tip_z_m=[0.0, 0.01, 0.02], tip_theta_rad=[0.0] * 3)
    >>> weights = chord_weights(Blade("b", ("LE", "MC", "TE"), 1e-3, [state], **place))
    >>> {node: round(w, 6) for node, w in weights.weights.items()}
    {'LE': 0.75, 'MC': 1.5, 'TE': 0.75}
    """
    if rule not in RULES:
        raise InvalidInput("rule", rule, f"give one of {', '.join(RULES)}")
    names = tuple(blade.tip_nodes if nodes is None else nodes)
    at = _in_order(blade, names)
    fewest = 2 if rule == "trapezoid" else 3
    if len(at) < fewest:
        raise InvalidInput(
            "nodes",
            list(names),
            f"give at least {fewest}: a quadrature along the chord needs a length. With one node give its "
            "weight in a ContactConfiguration",
        )
    arc = arc_length(_tip_points(blade)[at])
    return ChordWeights(names, arc, _shares(arc, rule), rule)


def arc_length(points_m: np.ndarray) -> np.ndarray:
    """Length along the cubic spline through points, from the first to each, m, shape (r,).

    Parameters
    ----------
    points_m
        x, y, z, shape (r, 3).

    Examples
    --------
    >>> arc_length(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]))
    array([0., 5.])
    """
    step = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    if (step == 0).any():
        i = int(np.argmin(step))
        raise InvalidInput(
            f"tip_z_m[{i + 1}]", "the place of its neighbour", "give every node a place of its own"
        )
    knots = np.r_[0.0, np.cumsum(step)]
    if len(knots) == 2:
        return knots
    speed = CubicSpline(knots, points_m).derivative()
    x, w = np.polynomial.legendre.leggauss(_GAUSS)
    at = knots[:-1, None] + 0.5 * step[:, None] * (x + 1)
    lengths = 0.5 * step * (np.linalg.norm(speed(at), axis=2) @ w)
    return np.r_[0.0, np.cumsum(lengths)]


def _tip_points(blade: Blade) -> np.ndarray:
    """x, y, z of the tip nodes, m, shape (r, 3)."""
    for field in ("tip_radius_m", "tip_theta_rad", "tip_z_m"):
        if getattr(blade, field) is None:
            raise InvalidInput(
                field,
                "missing",
                "add it to the blade: lengths along the chord need r, θ and z of every tip node",
            )
    radius, theta, z = (np.array(v) for v in (blade.tip_radius_m, blade.tip_theta_rad, blade.tip_z_m))
    return np.stack((radius * np.cos(theta), radius * np.sin(theta), z), axis=1)


def _in_order(blade: Blade, names: tuple[str, ...]) -> list[int]:
    at = []
    for i, name in enumerate(names):
        if name not in blade.tip_nodes:
            raise InvalidInput(
                f"nodes[{i}]", name, f"name a tip node of the blade: {', '.join(blade.tip_nodes)}"
            )
        at.append(blade.tip_nodes.index(name))
        if i and at[i] <= at[i - 1]:
            raise InvalidInput(f"nodes[{i}]", name, "name each node once, leading to trailing edge")
    return at


def _shares(arc_m: np.ndarray, rule: str) -> np.ndarray:
    if rule == "trapezoid":
        step = np.diff(arc_m)
        share = np.zeros(len(arc_m))
        share[:-1] += 0.5 * step
        share[1:] += 0.5 * step
        return share
    # A rule is linear: its weights are its values on unit vectors.
    return np.array([float(simpson(unit, x=arc_m)) for unit in np.eye(len(arc_m))])
