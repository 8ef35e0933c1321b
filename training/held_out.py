"""The held-out figures of a model card, by class of contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from training.contact_class import PERMANENT

# As in a card: with verification and without, and the same on the points near the boundary.
GROUPS = {
    "auto": "auto",
    "auto_hard": "auto, near the boundary",
    "alone": "surrogate alone",
    "alone_hard": "surrogate alone, near the boundary",
}
MISTAKES = {"false_stable": "answered_stable", "false_unstable": "answered_unstable"}


@dataclass(frozen=True)
class Counted:
    """So many wrong among so many answers."""

    wrong: int
    answered: int

    def __str__(self) -> str:
        return f"{self.wrong} of {self.answered:,}"


@dataclass(frozen=True)
class HeldOut:
    """Figures of one class of contact, as far as a card states them.

    Attributes
    ----------
    distribution, points
        What they were counted on.
    alpha
        Rate under which `auto` was counted; None where the card does not say.
    counts
        By group and mistake, e.g. ``("alone", "false_stable")``.
    boundary_error
        Relative error of the first crossing by quantile: 0.5 and 0.99.
    """

    distribution: str | None
    points: int
    alpha: float | None
    counts: dict[tuple[str, str], Counted]
    boundary_error: dict[float, float]

    @property
    def absent(self) -> tuple[str, ...]:
        """Counts that a card ought to state and does not, in words."""
        wanted = [(group, mistake) for group in GROUPS for mistake in MISTAKES]
        return tuple(_named(*key) for key in wanted if key not in self.counts)


def held_out(card: Mapping[str, Any]) -> dict[str, HeldOut]:
    """By class of contact; a card that does not name the class speaks of permanent contact."""
    evaluation = card.get("evaluation")
    if not isinstance(evaluation, Mapping):
        return {}
    if "auto" in evaluation or "alone" in evaluation:
        return {PERMANENT: _read(evaluation)}
    for_all = {key: value for key, value in evaluation.items() if not isinstance(value, Mapping)}
    return {
        contact: _read({**for_all, **figures})
        for contact, figures in evaluation.items()
        if isinstance(figures, Mapping)
    }


def _named(group: str, mistake: str) -> str:
    return f"{mistake.replace('_', ' ')}, {GROUPS[group]}"


def _read(figures: Mapping[str, Any]) -> HeldOut:
    counts = {}
    for group in GROUPS:
        found = figures.get(group)
        for mistake, answered in MISTAKES.items():
            if isinstance(found, Mapping) and mistake in found and answered in found:
                counts[group, mistake] = Counted(int(found[mistake]), int(found[answered]))
    quantiles = {0.5: "median_boundary_error", 0.99: "p99_boundary_error"}
    errors = {q: float(figures[name]) for q, name in quantiles.items() if figures.get(name) is not None}
    alone = figures.get("alone")
    points = int(alone.get("points", 0)) if isinstance(alone, Mapping) else 0
    return HeldOut(figures.get("distribution"), points, figures.get("alpha"), counts, errors)
