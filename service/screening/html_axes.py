"""Axes of a small chart as SVG: sharp on screen and paper, a few kilobytes each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from service.screening.html_page import data_uri
from service.screening.html_png import indexed_png

PIXELATED = "image-rendering:pixelated"
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 10.0, 40.0, 38.0


@dataclass
class Chart:
    """A chart of rotor speed in Hz against K_e in N/m, filled piece by piece.

    Parameters
    ----------
    title
        Above it.
    speed_hz, ke_max
        Ends of the axes.
    first_frequency_hz
        Of the blade at rest, for Ω/f₁ along the top.
    width, height
        In the units of the drawing; it is scaled to the page.
    """

    title: str
    speed_hz: tuple[float, float]
    ke_max: float
    first_frequency_hz: float
    width: float = 420.0
    height: float = 262.0
    _inside: list[str] = field(default_factory=list)
    _key: list[str] = field(default_factory=list)

    def raster(self, shades: np.ndarray, palette: Sequence[tuple[int, int, int]]) -> None:
        """Cells of a map, shades (rows, columns) as places in the palette, the lowest K_e first."""
        rows, columns = shades.shape
        low, high = self.speed_hz
        # The first and last cells are centred on the ends of the axes.
        wide, tall = (high - low) / (columns - 1), self.ke_max / (rows - 1)
        x, y = self._x(low - wide / 2), self._y(self.ke_max + tall / 2)
        right, bottom = self._x(high + wide / 2), self._y(-tall / 2)
        self._inside.append(
            f'<image x="{x:.2f}" y="{y:.2f}" width="{right - x:.2f}" height="{bottom - y:.2f}" '
            f'preserveAspectRatio="none" style="{PIXELATED}" '
            f'href="{data_uri(indexed_png(shades[::-1], palette))}"/>'
        )

    def line(self, speed_hz: np.ndarray, ke: np.ndarray, *, colour: str = "#000", dash: str = "") -> None:
        """A line, broken where K_e is NaN."""
        parts: list[str] = []
        last = ""
        for x, y in zip(self._x(speed_hz), self._y(np.minimum(ke, 3 * self.ke_max)), strict=True):
            if not np.isfinite(y):
                last = ""
                continue
            point = f"{x:.1f} {y:.1f}"
            if point != last:
                parts.append(f"{'L' if last else 'M'}{point}")
            last = point
        if parts:
            dashed = f' stroke-dasharray="{dash}"' if dash else ""
            self._inside.append(
                f'<path d="{"".join(parts)}" fill="none" stroke="{colour}" stroke-width="1"{dashed}/>'
            )

    def level(self, ke: float) -> None:
        """A line across, for the liner."""
        ends = np.array(self.speed_hz)
        self.line(ends, np.array([ke, ke]), dash="7 3 1.5 3")
        self.key("K_e of the liner", dash="7 3 1.5 3")

    def pointer(self, speed_hz: float, ke: float) -> None:
        """A triangle just under a point."""
        x, y = float(self._x(speed_hz)), float(self._y(ke)) + 3
        self._inside.append(f'<path d="M{x:.1f} {y:.1f}l5 8h-10z" fill="#000"/>')

    def key(self, said: str, *, colour: str = "#000", dash: str = "", fill: str = "") -> None:
        """An entry under the chart: a line, or a filled box."""
        place = len(self._key)
        x, y = _LEFT + (place % 3) * 122, self.height + 8 + (place // 3) * 15
        if fill:
            mark = f'<rect x="{x}" y="{y - 5}" width="20" height="9" fill="{fill}" stroke="#000"/>'
        else:
            dashed = f' stroke-dasharray="{dash}"' if dash else ""
            mark = f'<path d="M{x} {y}h20" stroke="{colour}" stroke-width="1.4"{dashed}/>'
        self._key.append(mark + svg_text(said, x + 25, y + 3.5, size=10))

    @property
    def svg(self) -> str:
        """The chart."""
        below = 15 * -(-len(self._key) // 3) + 4
        left, top, wide, tall = self._frame
        pieces = [
            f'<svg viewBox="0 0 {self.width:g} {self.height + below:g}" role="img" '
            f'aria-label="{escape(self.title)}" font-family="DejaVu Sans, Arial, sans-serif">',
            svg_text(self.title, self.width / 2, 13, size=11.5, anchor="middle", weight="600"),
            # A drawing of its own, which cuts off what leaves it.
            f'<svg x="{left}" y="{top}" width="{wide}" height="{tall}" '
            f'viewBox="{left} {top} {wide} {tall}">{"".join(self._inside)}</svg>',
            f'<rect x="{left}" y="{top}" width="{wide}" height="{tall}" fill="none" stroke="#000"/>',
            *self._ticks(),
            *self._key,
            "</svg>",
        ]
        return "".join(pieces)

    @property
    def _frame(self) -> tuple[float, float, float, float]:
        return _LEFT, _TOP, self.width - _LEFT - _RIGHT, self.height - _TOP - _BOTTOM

    def _x(self, speed_hz: np.ndarray | float) -> np.ndarray:
        left, _, wide, _ = self._frame
        low, high = self.speed_hz
        return left + (np.asarray(speed_hz) - low) / (high - low) * wide

    def _y(self, ke: np.ndarray | float) -> np.ndarray:
        _, top, _, tall = self._frame
        return top + tall * (1 - np.asarray(ke) / self.ke_max)

    def _ticks(self) -> list[str]:
        left, top, wide, tall = self._frame
        bottom, out = top + tall, []
        for speed in round_steps(*self.speed_hz, 6):
            x = float(self._x(speed))
            out.append(f'<path d="M{x:.1f} {bottom}v4" stroke="#000"/>')
            out.append(svg_text(f"{speed:g}", x, bottom + 14, anchor="middle"))
        f1 = self.first_frequency_hz
        for ratio in round_steps(self.speed_hz[0] / f1, self.speed_hz[1] / f1, 6):
            x = float(self._x(ratio * f1))
            out.append(f'<path d="M{x:.1f} {top}v-4" stroke="#000"/>')
            out.append(svg_text(f"{ratio:g}", x, top - 6, anchor="middle", size=9))
        power = int(np.floor(np.log10(self.ke_max)))
        for ke in round_steps(0.0, self.ke_max, 5):
            y = float(self._y(ke))
            out.append(f'<path d="M{left} {y:.1f}h-4" stroke="#000"/>')
            out.append(svg_text(f"{ke / 10.0**power:.3g}", left - 7, y + 3.5, anchor="end"))
        out.append(svg_text("Ω [Hz]", left + wide / 2, self.height - 9, anchor="middle", size=11))
        out.append(svg_text("Ω/f₁", left - 8, top - 6, anchor="end", size=9))
        middle = top + tall / 2
        unit = f"K_e [10^{power} N/m]" if power else "K_e [N/m]"
        out.append(
            f'<g transform="translate(13 {middle:.1f}) rotate(-90)">'
            f"{svg_text(unit, 0, 0, anchor='middle', size=11)}</g>"
        )
        return out


def round_steps(low: float, high: float, about: int) -> list[float]:
    """Round numbers from `low` to `high`, about so many.

    Examples
    --------
    >>> round_steps(0.0, 25000.0, 5)
    [0.0, 5000.0, 10000.0, 15000.0, 20000.0, 25000.0]
    """
    rough = (high - low) / about
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * min((1.0, 2.0, 5.0, 10.0), key=lambda each: abs(np.log(each * power / rough)))
    first, last = int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9))
    return [round(float(i * step), 12) for i in range(first, last + 1)]


def svg_text(
    said: str, x: float, y: float, *, size: float = 10, anchor: str = "start", weight: str = "normal"
) -> str:
    """Text at a point, escaped, the index of K_e and powers of ten set as such."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" text-anchor="{anchor}" '
        f'font-weight="{weight}">{_indices(escape(said))}</text>'
    )


def _indices(escaped: str) -> str:
    """K_e with its index lowered and 10^4 with its power raised."""
    lowered = escaped.replace("K_e", 'K<tspan dy="3" font-size="75%">e</tspan><tspan dy="-3">&#8203;</tspan>')
    head, power, rest = lowered.partition("10^")
    if not power:
        return lowered
    digits, gap, tail = rest.partition(" ")
    return f'{head}10<tspan dy="-4" font-size="75%">{digits}</tspan><tspan dy="4">&#8203;</tspan>{gap}{tail}'
