"""Where the blade touches the casing: which tip nodes, how strongly, and where round it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.validation import WEIGHT_LIMIT, number

Arc = tuple[float, float]


@dataclass(frozen=True)
class Segment:
    """A stretch of the revolution over which the engagement γ is constant.

    Attributes
    ----------
    length
        In revolutions.
    engaged
        True where γ = 1.
    """

    length: float
    engaged: bool


@dataclass(frozen=True)
class ContactConfiguration:
    """Weights of the contact nodes and engagement γ(θ), by arcs or smooth (DESIGN, sections 1 and 5).

    Parameters
    ----------
    weights
        Weight of each contact node by name; K_e times the weight is the stiffness at that node.
        A node left out is not in contact.
    arcs
        Arcs of contact round the casing as (start, end) in revolutions, 0 ≤ start < 1,
        start < end ≤ start + 1, sorted and not overlapping; an arc may run past 1.
        None is permanent contact, where there is no `engagement` either.
    engagement
        Smooth γ(θ); arcs are left out then.

    Raises
    ------
    InvalidInput
        For unusable weights, arcs or engagement, naming field, value and remedy.

    Examples
    --------
    >>> ContactConfiguration({"LE": 1.0}).permanent
    True
    >>> [s.engaged for s in ContactConfiguration({"LE": 1.0}, [(0.0, 0.25)]).segments]
    [True, False]
    """

    weights: Mapping[str, float]
    arcs: tuple[Arc, ...] | None = None
    engagement: FourierEngagement | None = None

    def __init__(
        self,
        weights: Mapping[str, float],
        arcs: Sequence[Sequence[float]] | None = None,
        engagement: FourierEngagement | None = None,
    ) -> None:
        object.__setattr__(self, "weights", _checked_weights(weights))
        object.__setattr__(self, "arcs", None if arcs is None else _checked_arcs(arcs))
        if engagement is not None and not isinstance(engagement, FourierEngagement):
            raise InvalidInput(
                "contact.engagement", engagement, "give a FourierEngagement(mean, cosine, sine)"
            )
        if arcs is not None and engagement is not None:
            raise InvalidInput(
                "contact.engagement", engagement.to_dict(), "give either arcs or engagement, not both"
            )
        object.__setattr__(self, "engagement", engagement)

    @classmethod
    def at(
        cls,
        *nodes: str,
        arcs: Sequence[Sequence[float]] | None = None,
        engagement: FourierEngagement | None = None,
    ) -> ContactConfiguration:
        """Unit weight on each of the named nodes."""
        return cls(dict.fromkeys(nodes, 1.0), arcs, engagement)

    @property
    def permanent(self) -> bool:
        """True when γ = 1 all round the casing."""
        return not self.smooth and all(s.engaged for s in self.segments)

    @property
    def smooth(self) -> bool:
        """True when γ varies smoothly, or is constant and not 1."""
        return self.engagement is not None and not self.engagement.is_one

    @property
    def segments(self) -> tuple[Segment, ...]:
        """One revolution in order, from the start of the first arc; lengths add up to 1.

        None of them where γ is smooth.
        """
        if self.smooth:
            return ()
        if self.arcs is None:
            return (Segment(1.0, True),)
        pieces: list[Segment] = []
        following = [a for a, _ in self.arcs[1:]] + [self.arcs[0][0] + 1.0]
        for (start, end), next_start in zip(self.arcs, following, strict=True):
            pieces.append(Segment(end - start, True))
            if next_start - end > 1e-12:
                pieces.append(Segment(next_start - end, False))
        return tuple(pieces)

    @property
    def engaged_fraction(self) -> float:
        """Share of the circumference in contact: the mean of γ."""
        if self.engagement is not None:
            return self.engagement.mean
        return sum(s.length for s in self.segments if s.engaged)

    def weight_vector(self, tip_nodes: Sequence[str]) -> np.ndarray:
        """Weights in the order of the blade's tip nodes, shape (r,).

        Raises
        ------
        InvalidInput
            When a node is not one of the blade's.
        """
        for node in self.weights:
            if node not in tip_nodes:
                raise InvalidInput(
                    f"contact.weights.{node}",
                    self.weights[node],
                    f"name a tip node of the blade: {', '.join(tip_nodes)}",
                )
        return np.array([self.weights.get(node, 0.0) for node in tip_nodes])

    def to_dict(self) -> dict[str, Any]:
        """The contact as the wire contract writes it."""
        out: dict[str, Any] = {"weights": dict(self.weights)}
        if self.arcs is not None:
            out["arcs"] = [list(a) for a in self.arcs]
        if self.engagement is not None:
            out["engagement"] = self.engagement.to_dict()
        return out

    @classmethod
    def from_dict(cls, data: Any) -> ContactConfiguration:
        """From the wire contract's form; unknown keys are refused."""
        if not isinstance(data, Mapping):
            raise InvalidInput("contact", data, 'give an object such as {"weights": {"LE": 1.0}}')
        for key in data:
            if key not in ("weights", "arcs", "engagement"):
                raise InvalidInput(
                    f"contact.{key}", data[key], "leave it out: weights, arcs and engagement only"
                )
        if "weights" not in data:
            raise InvalidInput("contact.weights", "missing", 'give weights, e.g. {"LE": 1.0}')
        smooth = data.get("engagement")
        engagement = None if smooth is None else FourierEngagement.from_dict(smooth)
        return cls(data["weights"], data.get("arcs"), engagement)


def _checked_weights(weights: Any) -> dict[str, float]:
    field = "contact.weights"
    if not isinstance(weights, Mapping):
        raise InvalidInput(field, weights, 'give weights by node name, e.g. {"LE": 1.0}')
    if not weights:
        raise InvalidInput(field, "{}", "name at least one contact node")
    checked = {str(node): number(f"{field}.{node}", w, 0.0, WEIGHT_LIMIT, "") for node, w in weights.items()}
    if not any(checked.values()):
        raise InvalidInput(field, checked, "give at least one node a weight above 0")
    return checked


def _checked_arcs(arcs: Any) -> tuple[Arc, ...]:
    field = "contact.arcs"
    if isinstance(arcs, str | bytes | Mapping) or not hasattr(arcs, "__len__"):
        raise InvalidInput(field, arcs, "give a list of [start, end] in revolutions")
    if len(arcs) == 0:
        raise InvalidInput(field, "[]", "give at least one arc, or leave arcs out for permanent contact")
    checked: list[Arc] = []
    for i, arc in enumerate(arcs):
        if isinstance(arc, str | bytes | Mapping) or not hasattr(arc, "__len__") or len(arc) != 2:
            raise InvalidInput(f"{field}[{i}]", arc, "give [start, end] in revolutions")
        start = number(f"{field}[{i}][0]", arc[0], 0.0, 1.0, "revolutions")
        if start >= 1.0:
            raise InvalidInput(f"{field}[{i}][0]", start, "start arcs from 0 up to below 1 revolution")
        end = number(f"{field}[{i}][1]", arc[1], start, start + 1.0, "revolutions", open_low=True)
        if checked and start < checked[-1][0]:
            raise InvalidInput(f"{field}[{i}]", list(arc), "sort the arcs by their start")
        if checked and start < checked[-1][1]:
            raise InvalidInput(
                f"{field}[{i}]", list(arc), f"start it at or after {checked[-1][1]:g}, where arc {i - 1} ends"
            )
        checked.append((start, end))
    if checked[-1][1] - 1.0 > checked[0][0] + 1e-12:
        raise InvalidInput(
            f"{field}[{len(checked) - 1}]",
            list(checked[-1]),
            f"end it by {checked[0][0] + 1.0:g}: past 1 it overlaps the first arc",
        )
    return tuple(checked)
