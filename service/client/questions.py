"""The questions a client asks: how each is written, divided into parts, read and put together again."""

from __future__ import annotations

import io
import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import chain
from typing import Any, ClassVar, Generic, Self, TypeVar

import httpx
import numpy as np

from sdm_core.blade import Blade, blade_to_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile
from service.client.message import Message, document_of
from service.client.problem import ServiceProblem
from service.rest import replies
from service.rest.forms import npz_replies
from service.rest.forms.media_types import JSON, NPZ
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers

Json = dict[str, Any]
Answers = TypeVar("Answers", PointAnswers, BoundaryAnswers, SensitivityAnswers, MapAnswers)
# From here on a binary body is worth it: a question of 2,000 points is 80 kB of JSON, parsed in 10 ms.
BULK_POINTS = 2_000
_ENTRY = re.compile(r"(?P<array>speed_hz|ke)\[(?P<entry>\d+)\]")


@dataclass(frozen=True)
class Question(ABC, Generic[Answers]):
    """A question, whole or a part of one.

    Attributes
    ----------
    speed_hz
        Rotor speeds, Hz, shape (m,).
    first
        Where a part's first speed and first stiffness stand in the whole.
    """

    path: ClassVar[str]
    most: ClassVar[int]
    """Points or speeds that one request asks for at most, well below the service's own limits."""

    blade: Blade
    contact: ContactConfiguration
    speed_hz: np.ndarray
    policy: str
    alpha: float | None
    first: dict[str, int] = field(default_factory=dict, kw_only=True)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the answers."""
        return self.speed_hz.shape

    @property
    def size(self) -> int:
        """Answers asked for."""
        return int(np.prod(self.shape))

    def parts(self, most: int | None = None) -> list[Self]:
        """Questions of at most so many answers that ask for the same, in order; None is the class's."""
        most = self.most if most is None else most
        halves = self.halves() if self.size > most else None
        return [self] if halves is None else [part for half in halves for part in half.parts(most)]

    def halves(self) -> tuple[Self, Self] | None:
        """Two questions that ask for the same; None where it cannot be divided."""
        if any(array.ndim != 1 for array in self._arrays().values()):
            return None  # no question the service takes: it says why
        return self._halved(self._rows())

    def _rows(self) -> tuple[str, ...]:
        """The arrays that are divided together."""
        return ("speed_hz",)

    def _halved(self, names: tuple[str, ...]) -> tuple[Self, Self] | None:
        lengths = {len(getattr(self, name)) for name in names}
        middle = max(lengths) // 2
        if len(lengths) > 1 or not middle:
            return None
        low: Json = {name: getattr(self, name)[:middle] for name in names}
        high: Json = {name: getattr(self, name)[middle:] for name in names}
        moved = self.first | {name: self.first.get(name, 0) + middle for name in names}
        return replace(self, **low), replace(self, **high, first=moved)

    def placed(self, problem: ServiceProblem) -> ServiceProblem:
        """A problem with a part's entry as one with the whole's."""
        found = _ENTRY.fullmatch(str(problem.problem.get("field", "")))
        before = self.first.get(found["array"], 0) if found else 0
        if found is None or not before:
            return problem
        where = f"{found['array']}[{int(found['entry']) + before}]"
        said = str(problem.problem.get("detail", "")).replace(problem.problem["field"], where, 1)
        return ServiceProblem(problem.problem | {"field": where, "detail": said})

    def message(self, bulk: bool = True) -> Message:
        """The request; `bulk` where the service may be sent npz."""
        binary = bulk and self.size >= BULK_POINTS
        body = self._to_npz() if binary else replies.to_json(self._rest() | self._arrays())
        return Message("POST", self.path, body, NPZ if binary else JSON, self._accepted(binary))

    def _accepted(self, binary: bool) -> str:
        return NPZ if binary else JSON

    def _rest(self) -> Json:
        said = {"blade": blade_to_dict(self.blade), "contact": self.contact.to_dict(), "policy": self.policy}
        return said if self.alpha is None else said | {"alpha": self.alpha}

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"speed_hz": self.speed_hz}

    def _to_npz(self) -> bytes:
        buffer = io.BytesIO()
        rest = np.array(replies.to_json(self._rest()).decode())
        np.savez(buffer, allow_pickle=False, question=rest, **self._arrays())
        return buffer.getvalue()

    def read(self, response: httpx.Response) -> Answers:
        """The answers in a reply.

        Raises
        ------
        ServiceProblem
            When it is not one of the service.
        """
        try:
            found = self._from(response, response.headers.get("content-type", "").startswith(NPZ))
        except (DamagedFile, ValueError, KeyError, TypeError, AttributeError):
            raise ServiceProblem.foreign(response) from None
        if found.source.shape != self.shape:
            raise ServiceProblem.foreign(response)
        return found

    @abstractmethod
    def _from(self, response: httpx.Response, npz: bool) -> Answers: ...

    def joined(self, parts: Sequence[Answers]) -> Answers:
        """The answers of the `parts` as those of the whole: their arrays one after the other."""
        first = parts[0]
        if len(parts) == 1:
            return first
        found: Json = {}
        for name in (column.name for column in fields(first)):
            values = [getattr(part, name) for part in parts]
            if isinstance(values[0], np.ndarray):
                found[name] = np.concatenate(values)
            elif name == "unstable_ke":
                found[name] = tuple(chain.from_iterable(values))
        return replace(first, **found)


@dataclass(frozen=True)
class Points(Question[PointAnswers]):
    """Verdicts at points (speed_hz[i], ke[i])."""

    path = "/v1/stability"
    most = 100_000

    ke: np.ndarray

    def _rows(self) -> tuple[str, ...]:
        return ("speed_hz", "ke")

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"speed_hz": self.speed_hz, "ke": self.ke}

    def _from(self, response: httpx.Response, npz: bool) -> PointAnswers:
        if npz:
            return npz_replies.points_from_npz(response.content, self.speed_hz, self.ke)
        return replies.points_from_dict(document_of(response), self.speed_hz, self.ke)


@dataclass(frozen=True)
class Boundary(Question[BoundaryAnswers]):
    """The first crossing at each speed."""

    path = "/v1/boundary"
    most = 5_000

    ke_max: float

    def _rest(self) -> Json:
        return super()._rest() | {"ke_max": self.ke_max}

    def _accepted(self, binary: bool) -> str:
        return JSON

    def _from(self, response: httpx.Response, npz: bool) -> BoundaryAnswers:
        return replies.boundary_from_dict(document_of(response), self.speed_hz, self.ke_max)


@dataclass(frozen=True)
class Sensitivities(Question[SensitivityAnswers]):
    """What moves the first crossing at each speed."""

    path = "/v1/sensitivities"
    most = 2_000

    ke_max: float

    def _rest(self) -> Json:
        return super()._rest() | {"ke_max": self.ke_max}

    def _from(self, response: httpx.Response, npz: bool) -> SensitivityAnswers:
        if npz:
            return npz_replies.sensitivities_from_npz(response.content, self.speed_hz, self.ke_max)
        return replies.sensitivities_from_dict(document_of(response), self.speed_hz, self.ke_max)


@dataclass(frozen=True)
class Map(Question[MapAnswers]):
    """Verdicts on the grid of speeds (a,) and stiffnesses (b,)."""

    path = "/v1/map"
    most = 100_000

    ke: np.ndarray

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows go with `ke`, columns with `speed_hz`."""
        return (*self.ke.shape, *self.speed_hz.shape)

    def _rows(self) -> tuple[str, ...]:
        # By speed as long as there are two: in permanent contact the exact core solves a column at once.
        return ("speed_hz",) if len(self.speed_hz) > 1 else ("ke",)

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"speed_hz": self.speed_hz, "ke": self.ke}

    def _accepted(self, binary: bool) -> str:
        return NPZ  # which the service has always had for maps

    def _from(self, response: httpx.Response, npz: bool) -> MapAnswers:
        return replies.map_from_npz(response.content)

    def joined(self, parts: Sequence[MapAnswers]) -> MapAnswers:
        """The blocks side by side, a column's own blocks on top of each other."""
        if len(parts) == 1:
            return parts[0]
        names = ("stable", "unstable_probability", "source", "reason")
        columns: list[list[MapAnswers]] = []
        for part in parts:
            if columns and sum(len(block.ke) for block in columns[-1]) < len(self.ke):
                columns[-1].append(part)
            else:
                columns.append([part])
        found: Json = {
            name: np.hstack([np.vstack([getattr(block, name) for block in column]) for column in columns])
            for name in names
        }
        return replace(parts[0], speed_hz=self.speed_hz, ke=self.ke, **found)
