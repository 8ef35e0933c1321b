"""[SBL] Fig. 14: how the leading edge vibrates over rotor speed, with the lobes of Fig. 13 over it."""

from __future__ import annotations

import numpy as np

from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from service.paper_figures.lobes import Lobes, exact_lobes
from service.paper_figures.map_figure import Line, MapFigure
from service.paper_figures.paper_figure import Claim, newtons, percent
from service.paper_figures.rubbing import ASSUMED, KE, REVOLUTIONS, Rubs
from service.paper_figures.study import Study, ke_axis, least_ke_of_modes, with_modes

_DECADES = 3.0
_ABOUT = 0.05  # of a mode's frequency: what vibrates this near it is counted to the mode
_NOTHING_ABOVE = 5.0  # [SBL] 5.2, in f₁
_FAINT = 0.1
_LOBE_HEIGHT = 0.7  # of f₁: lobes hang from the mode's line, the deeper the longer


def response_spectrum(study: Study, rubs: Rubs) -> MapFigure:
    """Contact at both edges, spectra of the leading edge over the last revolutions."""
    spectra = SpectrumMap.of_sweep(rubs.both_edges)
    f1 = study.first_frequency_hz
    ratio, amplitude = spectra.speed_hz / f1, 1e3 * spectra.amplitude_m
    bending = with_modes(study.blade, [study.bending])
    top = ke_axis([least_ke_of_modes(bending, study.leading_edge)])
    lobes = exact_lobes("first bending", bending, study.leading_edge, spectra.speed_hz, f1, top)
    lines = []
    for mode, name, dash in ((study.bending, "first bending", "--"), (study.torsion, "first torsion", "-")):
        height = spectra.natural_hz[:, mode] / f1
        lines.append(Line(f"{name} mode", ratio, height, "#2a6fbb", dash))
    lines.append(
        Line(
            "its lobes (Fig. 13), hanging from it",
            ratio,
            _hung(lobes, spectra, study),
            "#c8501e",
        )
    )
    return MapFigure(
        number=14,
        title=f"Displacement of the leading edge over {REVOLUTIONS} revolutions, contact at both edges",
        blade=study.blade.name,
        claims=_claims(study, spectra, amplitude, lobes),
        notes=(ASSUMED, "amplitude over the last 20 revolutions, Hann's window"),
        ratio=ratio,
        height=spectra.frequency_hz / f1,
        shade=amplitude.T,
        height_name=r"frequency / $f_1$ at rest  [-]",
        shade_name="amplitude [mm]",
        darkest=float(amplitude.max()),
        decades=_DECADES,
        lines=tuple(lines),
        extrapolated_from=study.covered,
        summary={"largest_amplitude_mm": float(amplitude.max())},
    )


def _hung(lobes: Lobes, spectra: SpectrumMap, study: Study) -> np.ndarray:
    first = np.minimum(lobes.first_ke, lobes.ke_max)
    depth = _LOBE_HEIGHT * (1 - first / lobes.ke_max)
    line = spectra.natural_hz[:, study.bending] / study.first_frequency_hz
    return np.where(np.isfinite(lobes.first_ke), line - depth, np.nan)


def _about(spectra: SpectrumMap, amplitude: np.ndarray, mode: int) -> np.ndarray:
    """Largest amplitude about a mode's frequency at each speed, mm, shape (m,)."""
    near = np.abs(spectra.frequency_hz[None] / spectra.natural_hz[:, [mode]] - 1) <= _ABOUT
    return np.where(near, amplitude, 0.0).max(axis=1)


def _claims(study: Study, spectra: SpectrumMap, amplitude: np.ndarray, lobes: Lobes) -> tuple[Claim, ...]:
    bending, torsion = (_about(spectra, amplitude, mode) for mode in (study.bending, study.torsion))
    peak = float(amplitude.max())
    high = spectra.frequency_hz > _NOTHING_ABOVE * study.first_frequency_hz
    above = float(amplitude[:, high].max()) if high.any() else 0.0
    unstable = np.array([any(low <= KE for low, _ in found) for found in lobes.unstable_ke])
    strong = bending >= np.quantile(bending, 0.9)
    return (
        Claim(
            "peaks stand at the first bending and the first torsion mode, the higher ones at bending",
            f"largest amplitude about first bending {bending.max():.2g} mm, about first torsion "
            f"{torsion.max():.2g} mm, of {peak:.2g} mm in all",
            bool(bending.max() > torsion.max()) and max(bending.max(), torsion.max()) > 0.5 * peak,
        ),
        Claim(
            "no significant amplitude above five times the first frequency",
            f"above 5 f₁ at most {percent(above / peak)} of the largest amplitude",
            above < _FAINT * peak,
        ),
        _aligned(strong, unstable, bending),
    )


def _aligned(strong: np.ndarray, unstable: np.ndarray, bending: np.ndarray) -> Claim:
    paper = "the peaks of the first bending mode stand where its lobes are"
    if not unstable.any() or unstable.all():
        where = "nowhere" if not unstable.any() else "everywhere"
        return Claim(paper, f"first bending alone is unstable {where} at {newtons(KE)}", None)
    inside, outside = float(strong[unstable].mean()), float(strong[~unstable].mean())
    ratio = float(np.median(bending[unstable]) / np.median(bending[~unstable]))
    return Claim(
        paper,
        f"of speeds inside its lobes at {newtons(KE)} {percent(inside)} are among the tenth with the "
        f"strongest bending, of those outside {percent(outside)}; in the middle amplitudes inside are "
        f"{ratio:.2g} times those outside",
        inside > outside and ratio > 1,
    )
