"""One figure of the paper drawn for one blade, and what it says beside the paper."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.paper_figures.lobes import Lobes

AGREES, DIFFERS, NOT_COMPARABLE = "agrees", "differs", "cannot be compared"


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, held against the numbers of a figure.

    Attributes
    ----------
    paper
        What the paper says, in short.
    here
        What the figure shows, with its numbers.
    holds
        Whether the two agree; None where the figure cannot tell.
    """

    paper: str
    here: str
    holds: bool | None

    @property
    def verdict(self) -> str:
        """`AGREES`, `DIFFERS` or `NOT_COMPARABLE`."""
        return NOT_COMPARABLE if self.holds is None else AGREES if self.holds else DIFFERS

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"paper": self.paper, "here": self.here, "verdict": self.verdict}


@dataclass(frozen=True)
class Mark:
    """A point on the diagram, with its verdict."""

    ratio: float
    ke: float
    stable: bool | None
    label: str


@dataclass(frozen=True, kw_only=True)
class PaperFigure:
    """A figure ready to be drawn: what every kind of figure has.

    Attributes
    ----------
    number
        Of the figure in [SBL].
    title
        What is drawn.
    blade
        Name of the blade.
    claims
        Statements of the paper held against it.
    notes
        What the reader must know about how it was drawn.
    numbers
        Further figures, as JSON.
    """

    number: int
    title: str
    blade: str
    claims: tuple[Claim, ...]
    notes: tuple[str, ...] = ()
    numbers: dict[str, Any] = field(default_factory=dict)

    @property
    def agrees(self) -> str:
        """One line: what agrees with the paper."""
        return _line([claim.here for claim in self.claims if claim.holds], len(self.claims))

    @property
    def differs(self) -> str:
        """One line: what does not, or cannot be compared."""
        rest = [
            f"{claim.here} ({'not comparable; ' if claim.holds is None else ''}the paper: {claim.paper})"
            for claim in self.claims
            if not claim.holds
        ]
        return _line(rest, len(self.claims))

    def to_dict(self) -> dict[str, Any]:
        """The figure's numbers as JSON."""
        return {
            "figure": self.number,
            "title": self.title,
            "blade": self.blade,
            **self._drawn(),
            "claims": [claim.to_dict() for claim in self.claims],
            "agrees": self.agrees,
            "differs": self.differs,
            "notes": list(self.notes),
            **self.numbers,
        }

    def _drawn(self) -> dict[str, Any]:
        """What is drawn, as JSON."""
        return {}


@dataclass(frozen=True, kw_only=True)
class LobeFigure(PaperFigure):
    """Boundaries over Ω/f₁ and K_e.

    Attributes
    ----------
    curves
        Drawn as lines, or the one of a shaded diagram filled.
    extrapolated_from
        Ω/f₁ beyond which the modal data are extrapolated; None where they are not.
    shaded
        Fill the unstable side of the curve.
    marks
        Points on the diagram.
    """

    first_frequency_hz: float
    ratios: tuple[float, float]
    curves: tuple[Lobes, ...]
    extrapolated_from: float | None = None
    shaded: bool = False
    marks: tuple[Mark, ...] = ()

    @property
    def ke_max(self) -> float:
        """Top of the K_e axis, N/m."""
        return self.curves[0].ke_max

    def _drawn(self) -> dict[str, Any]:
        low, high = self.ratios
        return {
            "first_frequency_hz": self.first_frequency_hz,
            "speed_ratio": [low, high],
            "extrapolated_from_ratio": self.extrapolated_from,
            "ke_max": self.ke_max,
            "curves": [_curve(curve, low, self.extrapolated_from or high) for curve in self.curves],
            "points": [
                {"speed_ratio": m.ratio, "ke": m.ke, "stable": m.stable, "said": m.label} for m in self.marks
            ],
        }


def percent(share: float) -> str:
    """A share as text, its digits fit to its size.

    Examples
    --------
    >>> percent(0.3652), percent(0.00042), percent(0.0), percent(3.2)
    ('37 %', '0.042 %', '0 %', '320 %')
    """
    return f"{float(f'{100 * share:.2g}'):g} %"


def newtons(ke: float) -> str:
    """A stiffness as text.

    Examples
    --------
    >>> newtons(7725.4)
    '7,725 N/m'
    """
    return f"{ke:,.0f} N/m"


def _line(said: list[str], compared: int) -> str:
    none = f"Nothing, of {compared} statement{'s' if compared > 1 else ''} compared"
    line = "; ".join(said) if said else none
    return f"{line[0].upper()}{line[1:]}."


def _curve(curve: Lobes, low: float, high: float) -> dict[str, Any]:
    least = curve.least(low, high)
    return {
        "label": curve.label,
        "measured_over_ratio": [low, high],
        "unstable_share": curve.share(low, high),
        "least_ke": None if least is None else least[0],
        "least_ke_at_ratio": None if least is None else least[1],
        "speed_ratio": np.round(curve.ratio, 6),
        "unstable_ke": [
            [[round(ke, 1) for ke in interval] for interval in found] for found in curve.unstable_ke
        ],
    }
