"""Models that differ from the shipped one by a known amount: made in no time."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch

from training.contact_class import PERMANENT
from training.reference_space import NAME
from training.registry import Model, load_model, write_model
from training.surrogate import Surrogate

Json = dict[str, Any]


def _counts(points: int, stable: int, false_stable: int, unstable: int, false_unstable: int) -> Json:
    return {
        "points": points,
        "answered_stable": stable,
        "false_stable": false_stable,
        "answered_unstable": unstable,
        "false_unstable": false_unstable,
    }


STATED = {
    "auto": _counts(20_000, 10_026, 0, 9_733, 0),
    "auto_hard": _counts(1_074, 477, 0, 372, 0),
    "alone": _counts(20_000, 10_140, 2, 9_860, 4),
    "alone_hard": _counts(1_074, 583, 2, 491, 4),
    "alpha": 5e-4,
    "distribution": NAME,
    "median_boundary_error": 9.13e-5,
    "p99_boundary_error": 0.0251,
}
"""Held-out figures of a good model, so that tests of the gate do not hang on those of the shipped one."""


def nearby(
    folder: Path,
    factor: float = 1.0,
    *,
    card: Callable[[Json], Json] = lambda card: card,
    certificates: Callable[[tuple], Any] = lambda found: found,
    figures: Json | None = STATED,
) -> Model:
    """The shipped model with every boundary at `factor` times its K_e, as if its labels had been so.

    Its card and certificate are those of permanent contact, with `figures` as the held-out ones (None: those
    of the shipped card) and 1.2335 % verified, but for `card` and `certificates`.
    """
    shipped = load_model()
    network = copy.deepcopy(shipped.surrogate.network)
    with torch.no_grad():
        network.last.bias[0] += float(torch.log10(torch.tensor(factor, dtype=torch.float64)))
    surrogate = Surrogate(network, shipped.surrogate.architecture)
    evaluation = shipped.card["evaluation"][PERMANENT] if figures is None else figures
    said = copy.deepcopy(shipped.card | {"evaluation": evaluation})
    said = card(said | {"made": f"boundaries times {factor:g}"})
    (permanent,) = (c for c in shipped.certificates if c.contact == PERMANENT)
    if figures is not None:
        lines = tuple(replace(line, verified_share=0.012335) for line in permanent.table)
        permanent = replace(permanent, table=lines)
    return write_model(surrogate, shipped.design_space, certificates((permanent,)), said, folder)


def with_lines(**changes: Callable[[Any], Any]) -> Callable[[tuple], tuple]:
    """Certificates whose every line has these attributes made anew from their old values."""

    def changed(certificates: tuple) -> tuple:
        return tuple(
            replace(
                certificate,
                table=tuple(
                    replace(line, **{name: make(getattr(line, name)) for name, make in changes.items()})
                    for line in certificate.table
                ),
            )
            for certificate in certificates
        )

    return changed
