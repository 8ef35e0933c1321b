"""Every figure of every example blade, in the order of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from sdm_core.blade import EXAMPLES, example_blade
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke
from service.paper_figures import rubbing
from service.paper_figures.bending_and_torsion import bending_and_torsion
from service.paper_figures.centrifugal_stiffening import centrifugal_stiffening
from service.paper_figures.contact_location import contact_location
from service.paper_figures.modal_convergence import modal_convergence
from service.paper_figures.paper_figure import PaperFigure, newtons
from service.paper_figures.response_spectrum import response_spectrum
from service.paper_figures.responses import responses
from service.paper_figures.rubbing import Rubs
from service.paper_figures.stability_diagram import stability_diagram
from service.paper_figures.study import Study, study_of
from service.paper_figures.time_convergence import time_convergence, time_convergence_parts
from service.paper_figures.wear_maps import wear_maps

Progress = Callable[[int, int, str], None]

_LOOKED_UP_TO = 1e6  # N/m, for the least K_e in the other direction


@dataclass(frozen=True)
class BladeFigures:
    """The figures of one blade.

    Attributes
    ----------
    study
        What was drawn.
    about
        Sentences on the blade and how it differs from the paper's.
    figures
        By rising number.
    """

    study: Study
    about: tuple[str, ...]
    figures: tuple[PaperFigure, ...]


def example_studies(direction: str | None = None) -> list[Study]:
    """The shipped blades, in their own direction or in another they know.

    Raises
    ------
    InvalidInput
        For a direction that a blade does not give.
    """
    blades = [example_blade(name) for name in EXAMPLES]
    return [study_of(blade if direction is None else blade.in_direction(direction)) for blade in blades]


def all_figures(studies: list[Study], progress: Progress = lambda *_: None) -> Iterator[BladeFigures]:
    """Figures of one blade after the other; `progress` hears (done, total, what is next)."""
    quick = (stability_diagram, responses, modal_convergence, centrifugal_stiffening, contact_location)
    parts = [time_convergence_parts(study) for study in studies]
    total = sum(parts) + len(studies) * (len(quick) + 1 + 3 * rubbing.SPEEDS)
    count = 0
    for study in studies:
        name = study.blade.name

        def done(what: str = "Fig. 7", name: str = name) -> None:
            nonlocal count
            count += 1
            progress(count, total, f"{name}, {what}")

        figures: list[PaperFigure] = []
        for draw in (*quick, bending_and_torsion):
            figures.append(draw(study))
            done(f"Fig. {figures[-1].number}")
        figures.append(time_convergence(study, done))
        rubs = Rubs(study, partial(done, "Figs. 11, 12 and 14"))
        figures += [*wear_maps(study, rubs), response_spectrum(study, rubs)]
        yield BladeFigures(study, about(study), tuple(sorted(figures, key=lambda figure: figure.number)))


def about(study: Study) -> tuple[str, ...]:
    """What the blade is, and which direction its amplitudes are in."""
    blade, f1 = study.blade, study.first_frequency_hz
    frequencies = ", ".join(f"{f:.0f}" for f in blade.states[0].frequency_hz)
    damping = np.unique(blade.damping_ratio)
    ratio = f"{damping[0]:g}" if len(damping) == 1 else f"{damping[0]:g} to {damping[-1]:g}"
    said = [
        f"{blade.mode_count} modes, at rest {frequencies} Hz, damping ratio {ratio}; modal data up to "
        f"Ω/f₁ = {study.covered:.3f} ({study.covered * f1:.0f} Hz)."
    ]
    return (*said, _direction(study))


def _direction(study: Study) -> str:
    blade = study.blade
    here = f"Amplitudes drawn: {blade.direction.replace('_', '-')}; the paper keeps radial displacements."
    if blade.direction == "radial":
        return here.split(";")[0] + ", as in the paper."
    try:
        radial = blade.in_direction("radial")
    except InvalidInput:
        return f"{here} This blade's file does not give them."
    own, other = (blade.states[0].mode_shape, radial.states[0].mode_shape)
    if np.allclose(own, other, rtol=1e-3, atol=1e-3):
        return f"{here} On this cylindrical casing the two are the same."
    low, high = study.ratios[0] * study.first_frequency_hz, study.covered * study.first_frequency_hz
    least = [
        least_critical_ke(b, study.leading_edge, low, high, _LOOKED_UP_TO, count=1) for b in (blade, radial)
    ]
    words = [newtons(tips[0].ke) if tips else f"none up to {newtons(_LOOKED_UP_TO)}" for tips in least]
    return (
        f"{here} That matters: the least unstable K_e at the leading edge is {words[0]} as drawn and "
        f"{words[1]} with radial amplitudes."
    )
