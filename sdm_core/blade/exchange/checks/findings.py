"""What an import found: said with every model, as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

NOTE = "note"
WARNING = "warning"
SEVERITIES = (NOTE, WARNING)


@dataclass(frozen=True)
class Finding:
    """One thing an import noticed.

    What would make the blade wrong or unusable is no finding but an `InvalidInput`.

    Parameters
    ----------
    severity
        ``note`` (done or seen on the way) or ``warning`` (look at it before trusting the blade).
    field
        What it is about (``states[1].stiffness``, ``units``).
    what
        What was found.
    remedy
        What to do about it; empty for a note.
    """

    severity: str
    field: str
    what: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.severity}: {self.field}: {self.what}" + (f"; {self.remedy}" if self.remedy else "")


@dataclass(frozen=True)
class Findings:
    """All an import noticed, and the figures it measured.

    Parameters
    ----------
    items
        In the order they were found.
    figures
        Measured quantities by name, the unit at the end of the name (``total_mass_kg``).

    Examples
    --------
    >>> found = Findings((Finding("warning", "units", "f1 = 28 Hz"),), {"size": 12})
    >>> [str(item) for item in found.warnings], found.figures["size"]
    (['warning: units: f1 = 28 Hz'], 12)
    """

    items: tuple[Finding, ...] = ()
    figures: Mapping[str, float | int | str | tuple[float, ...]] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What to look at before trusting the blade."""
        return tuple(item for item in self.items if item.severity == WARNING)

    def __add__(self, other: Findings) -> Findings:
        return Findings(self.items + other.items, {**self.figures, **other.figures})

    def lines(self) -> list[str]:
        """The report as text, figures first."""
        shown = [f"{name} = {_shown(value)}" for name, value in self.figures.items()]
        return shown + [str(item) for item in self.items]


def note(where: str, what: str) -> Finding:
    """Something done or seen on the way."""
    return Finding(NOTE, where, what)


def warning(where: str, what: str, remedy: str) -> Finding:
    """Something to look at before trusting the blade."""
    return Finding(WARNING, where, what, remedy)


def _shown(value: float | int | str | Sequence[float]) -> str:
    if isinstance(value, str | int):
        return str(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    return ", ".join(f"{x:.6g}" for x in value)
