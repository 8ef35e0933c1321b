"""The conversations about simulations: ordered, and what came of one."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

import numpy as np

from sdm_core.blade import Blade, blade_to_dict
from service.client.conversations import numbers, one
from service.client.job_conversations import SIMULATIONS, job_path, status_of
from service.client.job_status import JobStatus
from service.client.message import Conversation, Message
from service.client.problem import ServiceProblem
from service.rest.forms.media_types import NPZ, PNG
from service.rest.simulation_schemas import SimulationReply

if TYPE_CHECKING:
    from service.simulation.response import Response
    from service.simulation.simulated_speeds import SimulatedSpeeds

Json = dict[str, Any]
CHARTS = ("wear_map", "spectrum", "response", "worn_profile")


@dataclass(frozen=True)
class SimulationResults:
    """What came of a simulation, or what there is of it so far.

    Attributes
    ----------
    complete
        Whether that is all.
    figures
        By speed.
    arrays
        Every array of the npz, by name.
    """

    job: str
    complete: bool
    figures: SimulationReply = field(repr=False)
    arrays: Mapping[str, np.ndarray] = field(repr=False)

    @property
    def speeds(self) -> SimulatedSpeeds:
        """Worn profiles, spectra and figures of every speed."""
        from service.simulation.simulated_speeds import SimulatedSpeeds

        return SimulatedSpeeds.from_arrays(self.arrays)

    @property
    def response(self) -> Response | None:
        """Displacements, forces and energies over time, where there is one speed only."""
        from service.simulation.response import Response

        return Response.from_arrays(self.arrays)


def submitted(
    blade: Blade | Mapping[str, Any],
    speed_hz: Sequence[float] | np.ndarray | float,
    parts: Mapping[str, Any],
    key: str | None,
) -> Conversation[JobStatus]:
    """``POST /v1/simulations``, once for a key however often it is sent; parts that are None are left out."""
    document = blade_to_dict(blade) if isinstance(blade, Blade) else dict(blade)
    asked: Json = {"blade": document, "speed_hz": numbers(speed_hz).tolist()}
    for name, value in parts.items():
        if value is not None:
            asked[name] = _plain(value)
    return status_of(Message.order(SIMULATIONS, asked, key))


def results(job_id: str) -> Conversation[SimulationResults]:
    """``GET /v1/simulations/{id}/results``, figures and arrays."""
    path = f"{job_path(SIMULATIONS, job_id)}/results"
    # First: what is complete before the arrays are asked for is so in the arrays.
    figures = yield from one(Message.get(path), SimulationReply)
    reply = yield Message("GET", path, accept=NPZ)
    try:
        with np.load(io.BytesIO(reply.content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile):
        raise ServiceProblem.foreign(reply) from None
    return SimulationResults(figures.job, figures.complete, figures, arrays)


def chart(job_id: str, name: str, node: str | None) -> Conversation[bytes]:
    """``GET /v1/simulations/{id}/{name}.png``."""
    query = "" if node is None else f"?{urlencode({'node': node})}"
    reply = yield Message("GET", f"{job_path(SIMULATIONS, job_id)}/{name}.png{query}", accept=PNG)
    return reply.content


def _plain(value: Any) -> Any:
    """Constants, friction and names as JSON."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if hasattr(value, "coefficient"):
        return {"coefficient": value.coefficient, "rotation": value.rotation}
    return list(value) if isinstance(value, tuple) else value
