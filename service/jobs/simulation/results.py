"""What there is of a simulation: its stored speeds, put together."""

from __future__ import annotations

import zipfile

import numpy as np

from sdm_core.errors import DamagedFile
from service.jobs.chunk_store import ChunkStore
from service.jobs.errors import NotSimulated
from service.jobs.job_folder import JobFolder
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome
from service.simulation.response import Response
from service.simulation.simulated_speeds import SimulatedSpeeds, npz_arrays, npz_bytes

LOBES = 999_999
"""Number under which the exact lobes are stored, which are found last."""


def whole_chunks(folder: JobFolder) -> set[int]:
    """Numbers of the chunks of speeds that are whole; others are taken away."""
    return ChunkStore(folder.chunks).verified() - {LOBES}


def has_lobes(folder: JobFolder) -> bool:
    """Whether the lobes are stored."""
    return LOBES in ChunkStore(folder.chunks).numbers()


def lobes_content(lobes_hz: np.ndarray) -> bytes:
    """As they are stored."""
    return npz_bytes({"lobes_hz": lobes_hz})


def order_of(folder: JobFolder) -> SimulationOrder:
    """What was asked; raises `DamagedFile`."""
    return SimulationOrder.from_dict(folder.request())


def outcome_of(folder: JobFolder) -> SimulationOutcome:
    """All that is stored, by rising speed.

    Raises
    ------
    NotSimulated
        While there is nothing.
    DamagedFile
        Where a chunk is not whole, or gone.
    """
    order, lobes = order_of(folder), np.zeros((0, 2))
    parts: list[SimulatedSpeeds] = []
    response: Response | None = None
    for number, content in ChunkStore(folder.chunks).each():
        try:
            arrays = npz_arrays(content)
            if number == LOBES:
                lobes = arrays["lobes_hz"]
                continue
            parts.append(SimulatedSpeeds.from_arrays(arrays))
            response = Response.from_arrays(arrays)
        except (KeyError, ValueError, OSError, zipfile.BadZipFile) as error:
            remedy = f"it is of another version ({error}): send the request again"
            raise DamagedFile("chunk", f"{number} of {folder.path.name}", remedy) from None
    if not parts:
        raise NotSimulated("id", folder.path.name, "no speed of it is simulated yet: wait for it")
    return SimulationOutcome(order, SimulatedSpeeds.joined(parts), response, lobes)
