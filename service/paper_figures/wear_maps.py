"""[SBL] Figs. 11 and 12: the liner worn with contact at the trailing edge, and at the leading edge."""

from __future__ import annotations

import numpy as np

from sdm_core.time_domain.liner.wear_map import WearMap
from service.paper_figures.contact_location import SIGNIFICANT
from service.paper_figures.map_figure import MapFigure
from service.paper_figures.paper_figure import Claim, percent
from service.paper_figures.rubbing import ANGLES, ASSUMED, REVOLUTIONS, Rubs
from service.paper_figures.study import Study

_NEAR = 0.02  # in Ω/f₁: what the paper reads off at a speed is looked for this far about it
_MOSTLY = 0.95
_READ_OFF = ((0.37, 4), (0.14, 7))
"""[SBL] 5.1: main lobes with contact at the leading edge, at Ω/f₁."""


def wear_maps(study: Study, rubs: Rubs) -> tuple[MapFigure, MapFigure]:
    """Fig. 11 and Fig. 12, shaded alike."""
    trailing, leading = (
        WearMap.of_sweep(sweep, angles=ANGLES) for sweep in (rubs.trailing_edge, rubs.leading_edge)
    )
    darkest = 1e3 * float(np.quantile([trailing.deepest_m, leading.deepest_m], 0.98))
    eleven = _figure(11, "trailing edge", study, trailing, darkest, _trailing_claims(trailing))
    twelve = _figure(12, "leading edge", study, leading, darkest, _leading_claims(leading, trailing))
    return eleven, twelve


def _figure(
    number: int, edge: str, study: Study, wear: WearMap, darkest: float, claims: tuple[Claim, ...]
) -> MapFigure:
    return MapFigure(
        number=number,
        title=f"Wear of the liner after {REVOLUTIONS} revolutions, contact at the {edge}",
        blade=study.blade.name,
        claims=claims,
        notes=(
            ASSUMED,
            "the casing is nearest at 0 and half a turn; both maps of a blade have one scale of grey",
            "two casing lobes excite even engine orders alone: wear is deep where one of them meets a "
            "natural frequency, and follows the yield force of the liner more than K_e (decision 23)",
            *_through(wear),
        ),
        ratio=wear.speed_ratio,
        height=wear.angle_rad / (2 * np.pi),
        shade=1e3 * wear.worn_m.T,
        height_name="place round the casing [revolutions]",
        shade_name="depth removed [mm]",
        darkest=darkest,
        extrapolated_from=study.covered,
        summary={
            "deepest_mm_median": 1e3 * float(np.median(wear.deepest_m)),
            "deepest_mm_largest": 1e3 * float(wear.deepest_m.max()),
            "unevenness_over_speed": wear.unevenness,
            "main_lobes": main_lobes(wear.worn_m),
            "worn_through_at_ratio": wear.speed_ratio[wear.worn_through],
        },
    )


def _through(wear: WearMap) -> tuple[str, ...]:
    many = int(wear.worn_through.sum())
    return () if not many else (f"the liner was worn through at {many} of {len(wear.speed_ratio)} speeds",)


def main_lobes(worn_m: np.ndarray) -> np.ndarray:
    """Strongest harmonic of each worn profile, that of the casing's grooves among them, shape (m,)."""
    return 1 + np.abs(np.fft.rfft(worn_m, axis=1))[:, 1:].argmax(axis=1)


def _varies_mm(wear: WearMap) -> float:
    """Standard deviation of the depth over speeds, root mean square over angles, mm."""
    return 1e3 * float(np.sqrt(wear.worn_m.var(axis=0).mean()))


def _trailing_claims(wear: WearMap) -> tuple[Claim, ...]:
    share = float((main_lobes(wear.worn_m) == 2).mean())
    return (
        Claim(
            "at the trailing edge two main lobes are worn at all speeds",
            f"two grooves are the strongest harmonic at {percent(share)} of the speeds",
            share >= _MOSTLY,
        ),
    )


def _leading_claims(leading: WearMap, trailing: WearMap) -> tuple[Claim, ...]:
    deeper = float(np.median(leading.deepest_m) / np.median(trailing.deepest_m))
    peak = float(leading.deepest_m.max() / trailing.deepest_m.max())
    moves, moves_less = _varies_mm(leading), _varies_mm(trailing)
    return (
        Claim(
            "wear is much deeper with contact at the leading edge",
            f"deepest wear at the leading edge {deeper:.2g} times that at the trailing edge in the middle of "
            f"the speeds, {peak:.2g} times at the worst ({1e3 * leading.deepest_m.max():.2g} against "
            f"{1e3 * trailing.deepest_m.max():.2g} mm)",
            deeper > SIGNIFICANT and peak > SIGNIFICANT,
        ),
        Claim(
            "the profile depends on the speed at the leading edge, and hardly at the trailing edge",
            f"over speeds the depth varies by {moves:.2g} mm at the leading edge, {moves_less:.2g} mm at the "
            "trailing edge (root mean square)",
            moves > SIGNIFICANT * moves_less,
        ),
        *(_lobes_near(leading, ratio, many) for ratio, many in _READ_OFF),
    )


def _lobes_near(wear: WearMap, ratio: float, many: int) -> Claim:
    near = np.abs(wear.speed_ratio - ratio) <= _NEAR
    found, often = np.unique(main_lobes(wear.worn_m[near]), return_counts=True)
    said = ", ".join(
        f"{count} ({percent(times / near.sum())})" for count, times in zip(found, often, strict=True)
    )
    return Claim(
        f"{many} main lobes are worn near Ω/f₁ = {ratio:g}",
        f"within {_NEAR:g} of Ω/f₁ = {ratio:g} the strongest harmonics are {said} of the speeds",
        bool((found == many).any()),
    )
