"""Models that differ from the shipped one by a known amount: made in no time."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch

from training.registry import Model, load_model, write_model
from training.surrogate import Surrogate

Json = dict[str, Any]


def nearby(
    folder: Path,
    factor: float = 1.0,
    *,
    card: Callable[[Json], Json] = lambda card: card,
    certificates: Callable[[tuple], Any] = lambda found: found,
) -> Model:
    """The shipped model with every boundary at `factor` times its K_e, as if its labels had been so.

    Its card and certificate say what the shipped ones say, but for `card` and `certificates`.
    """
    shipped = load_model()
    network = copy.deepcopy(shipped.surrogate.network)
    with torch.no_grad():
        network.last.bias[0] += float(torch.log10(torch.tensor(factor, dtype=torch.float64)))
    surrogate = Surrogate(network, shipped.surrogate.architecture)
    said = card(copy.deepcopy(shipped.card) | {"made": f"boundaries times {factor:g}"})
    return write_model(surrogate, shipped.design_space, certificates(shipped.certificates), said, folder)


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
