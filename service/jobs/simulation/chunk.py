"""Some speeds of a simulation, computed in a worker process: bytes in, bytes out."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput, NotConverged
from service.jobs.modesty import be_modest
from service.jobs.wanted import while_wanted
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome, each_speed
from service.simulation.response import Response
from service.simulation.simulated_speeds import SimulatedSpeeds

CHUNK_STEPS, MOST_PER_CHUNK = 10_000_000, 32
"""Steps computed and stored together: some seconds of one core."""


def speeds_per_chunk(order: SimulationOrder) -> int:
    """Speeds computed and stored together."""
    each = order.steps * len(order.nodes) / len(order.speed_hz)
    return int(np.clip(CHUNK_STEPS / each, 1, MOST_PER_CHUNK))


def chunks_of(request: Mapping[str, Any]) -> Iterator[tuple[int, list[float]]]:
    """(number, speeds) of every chunk of a job's request."""
    together, speeds = request["speeds_per_chunk"], request["speed_hz"]
    for number, first in enumerate(range(0, len(speeds), together)):
        yield number, speeds[first : first + together]


def chunk_payload(request: Mapping[str, Any], speed_hz: list[float]) -> bytes:
    """What `compute_chunk` is given."""
    return json.dumps({"request": request, "speed_hz": speed_hz}).encode()


def compute_in_worker(payload: bytes) -> bytes:
    """As `compute_chunk`, in a process for that alone: behind what answers people.

    Raises
    ------
    Cancelled
        When nobody waits for it any more.
    """
    be_modest()
    with while_wanted():
        return compute_chunk(payload)


def compute_chunk(payload: bytes) -> bytes:
    """Simulate the speeds of a chunk.

    Returns
    -------
    A `SimulationOutcome` of these speeds as an npz file.

    Raises
    ------
    InvalidInput
        Where the contact forces of a speed do not converge.
    Cancelled
        When the surrounding `interruptible` block wants it to stop.
    """
    asked = json.loads(payload)
    order = SimulationOrder.from_dict(asked["request"])
    parts: list[SimulatedSpeeds] = []
    response: Response | None = None
    try:
        for part, its_response in each_speed(order.at(asked["speed_hz"]), workers=1):
            parts.append(part)
            response = its_response
    except NotConverged as error:
        raise InvalidInput("cells", order.cells, f"{error}: give another number of cells") from None
    none = np.zeros((0, 2))
    return SimulationOutcome(order, SimulatedSpeeds.joined(parts), response, none).to_npz()
