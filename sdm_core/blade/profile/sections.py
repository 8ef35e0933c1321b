"""A blade as a stack of sections on surfaces of revolution, hub to tip, and the solid between them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator, make_interp_spline

from sdm_core.blade.profile.aerofoil import area_centroid
from sdm_core.errors import DamagedFile, InvalidInput

COLUMNS = ("section", "point", "z_m", "r_m", "theta_1_rad", "theta_2_rad")
LARGEST_FILE_BYTES = 64 * 2**20
_FEWEST_POINTS = 5
# Points to which every section is brought along its chord: more than any mesh has nodes there.
_COMMON_POINTS = 201


@dataclass(frozen=True)
class SectionTable:
    """Sections of a blade in cylindrical coordinates about the rotor's axis z, downstream.

    Parameters
    ----------
    sides
        Hub to tip, each section as (z, r, θ) of its two sides from leading to trailing edge, m and
        rad, shape (2, points, 3); the number of points may differ between sections.

    Raises
    ------
    InvalidInput
        Naming the section and the point.
    """

    sides: tuple[np.ndarray, ...]

    def __init__(self, sides: Sequence[np.ndarray]) -> None:
        checked = tuple(_checked(i, np.array(side, dtype=float)) for i, side in enumerate(sides))
        if len(checked) < 2:
            raise InvalidInput("sections", f"{len(checked)} sections", "give at least two, hub to tip")
        for i in range(1, len(checked)):
            if checked[i][..., 1].mean() <= checked[i - 1][..., 1].mean():
                raise InvalidInput(
                    f"sections[{i}].r_m",
                    float(checked[i][..., 1].mean()),
                    "order the sections from hub to tip: its mean radius is not above that of the one before",
                )
        object.__setattr__(self, "sides", checked)

    def stacked_on_centroids(self) -> SectionTable:
        """The sections turned and shifted so that their centroids lie on one radial line at z of the hub's.

        For section coordinates that say nothing of their place on the rotor.
        """
        first = _centroid(self.sides[0])
        return SectionTable([side - _zr0theta(_centroid(side) - first) for side in self.sides])

    def solid(self, edge_cut: float = 0.0) -> BladeSolid:
        """The solid through the sections, both edges cut by a share of the camber line's length.

        Cut edges are blunt, so that elements there keep a thickness.
        """
        return BladeSolid.through(self, edge_cut)


@dataclass(frozen=True)
class BladeSolid:
    """Smooth map from (chord, span, thickness) to the solid: 0 ≤ s ≤ 1, 0 ≤ h ≤ 1, −1 ≤ t ≤ 1.

    Along the chord each section is known at common fractions of its camber line's length; across the
    span splines (cubic, of lower order where there are fewer than four sections) pass through all of
    them; through the thickness it is linear in (z, r, θ).

    Attributes
    ----------
    height
        Mean span fraction of each section, shape (sections,).
    points
        (z, r, θ) at [section, side, chord point], shape (sections, 2, points, 3).
    """

    height: np.ndarray
    points: np.ndarray

    @classmethod
    def through(cls, table: SectionTable, edge_cut: float) -> BladeSolid:
        if not 0.0 <= edge_cut <= 0.2:
            raise InvalidInput("edge_cut", edge_cut, "give a share of the chord from 0 to 0.2")
        s = np.linspace(edge_cut, 1 - edge_cut, _COMMON_POINTS)
        points = np.array([PchipInterpolator(_along(side), side, axis=1)(s) for side in table.sides])
        middle = _cartesian(points.mean(axis=1))  # of both sides
        step = np.linalg.norm(np.diff(middle, axis=0), axis=2).mean(axis=1)
        height = np.concatenate(([0.0], np.cumsum(step)))
        return cls(height / height[-1], points)

    def positions(self, s: np.ndarray, h: np.ndarray, t: np.ndarray) -> np.ndarray:
        """x, y, z in m at every combination, shape (len(s), len(h), len(t), 3)."""
        along = np.linspace(0.0, 1.0, self.points.shape[2])
        at_s = make_interp_spline(along, self.points, k=3, axis=2)(s)  # (sections, 2, s, 3)
        order = min(3, len(self.height) - 1)
        at_sh = make_interp_spline(self.height, at_s, k=order, axis=0)(h)  # (h, 2, s, 3)
        share = 0.5 * (1.0 + t)
        zrtheta = at_sh[:, 0, :, None] * (1 - share[:, None]) + at_sh[:, 1, :, None] * share[:, None]
        return _cartesian(zrtheta.transpose(1, 0, 2, 3))


def read_sections(path: str | Path) -> SectionTable:
    """Read a table of sections: CSV with the columns `COLUMNS`, one row a point.

    Points of a section share z and r; θ of the two sides is given at each. Sections count from the
    hub, points from the leading edge.

    Raises
    ------
    InvalidInput
        When there is no such file, or naming the row and column that cannot be used.
    DamagedFile
        When it is not such a table.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise InvalidInput("section table", str(path), "give a file under 64 MiB")
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(csv.reader(file))
    except OSError as error:
        raise InvalidInput("section table", str(path), f"give a readable file ({error.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise DamagedFile("section table", str(path), "it is not CSV text") from None
    header = tuple(name.strip() for name in lines[0]) if lines else ()
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise DamagedFile(
            "section table", str(path), f"its first line lacks the columns {', '.join(missing)}"
        )
    at = [header.index(name) for name in COLUMNS]
    rows = [
        _row(path, i, line, at) for i, line in enumerate(lines[1:], 2) if any(cell.strip() for cell in line)
    ]
    if not rows:
        raise DamagedFile("section table", str(path), "it holds no points")
    table = np.array(rows)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    sides = []
    for number in np.unique(table[:, 0]):
        _, point, z, r, theta_1, theta_2 = table[table[:, 0] == number].T
        if (np.diff(point) == 0).any():
            twice = point[:-1][np.diff(point) == 0][0]
            raise InvalidInput(
                f"{path.name}: section {number:g}", f"point {twice:g} twice", "number the points of a section"
            )
        sides.append(np.stack([np.stack((z, r, theta), axis=1) for theta in (theta_1, theta_2)]))
    try:
        return SectionTable(sides)
    except InvalidInput as error:
        raise InvalidInput(f"{path.name}: {error.field}", error.value, error.remedy) from None


def _row(path: Path, number: int, line: list[str], at: list[int]) -> list[float]:
    if len(line) <= max(at):
        raise DamagedFile("section table", str(path), f"line {number} has {len(line)} columns: it is cut off")
    values = []
    for name, column in zip(COLUMNS, at, strict=True):
        try:
            value = float(line[column])
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise InvalidInput(f"{path.name}: line {number}, {name}", line[column], "give a finite number")
        values.append(value)
    return values


def _checked(i: int, side: np.ndarray) -> np.ndarray:
    field = f"sections[{i}]"
    if side.ndim != 3 or side.shape[0] != 2 or side.shape[2] != 3 or side.shape[1] < _FEWEST_POINTS:
        raise InvalidInput(
            field, f"shape {side.shape}", f"give two sides of at least {_FEWEST_POINTS} points (z, r, theta)"
        )
    if not np.isfinite(side).all():
        raise InvalidInput(field, "a number that is not finite", "give finite coordinates")
    if (side[..., 1] <= 0).any():
        raise InvalidInput(f"{field}.r_m", float(side[..., 1].min()), "give radii above 0")
    if np.abs(side[..., :2]).max() > 10.0:
        raise InvalidInput(field, float(np.abs(side[..., :2]).max()), "give coordinates in m, not mm")
    step = np.linalg.norm(np.diff(_cartesian(side.mean(axis=0)), axis=0), axis=1)
    if (step <= 0).any():
        raise InvalidInput(
            f"{field}, point {int(np.argmin(step)) + 1}",
            "the place of the point before",
            "give every point a place of its own, leading to trailing edge",
        )
    side.setflags(write=False)
    return side


def _along(side: np.ndarray) -> np.ndarray:
    """Fraction of the camber line's length at each point, shape (points,)."""
    step = np.linalg.norm(np.diff(_cartesian(side.mean(axis=0)), axis=0), axis=1)
    length = np.concatenate(([0.0], np.cumsum(step)))
    return length / length[-1]


def _centroid(side: np.ndarray) -> np.ndarray:
    """(z, θ) of the section's area centroid, on the cylinder of its mean radius."""
    radius = side[..., 1].mean()
    outline = np.concatenate((side[0], side[1][::-1]))
    z, along = area_centroid(np.stack((outline[:, 0], radius * outline[:, 2]), axis=1))
    return np.array([z, along / radius])


def _zr0theta(shift: np.ndarray) -> np.ndarray:
    return np.array([shift[0], 0.0, shift[1]])


def _cartesian(zrtheta: np.ndarray) -> np.ndarray:
    z, r, theta = np.moveaxis(zrtheta, -1, 0)
    return np.stack((r * np.cos(theta), r * np.sin(theta), z), axis=-1)
