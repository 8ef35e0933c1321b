"""A service whose screener answers by rule, so that these tests are about the service alone."""

from __future__ import annotations

import copy
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import httpx
import numpy as np
import pytest
import uvicorn
from fastapi import FastAPI

from sdm_core.errors import InvalidInput
from service.app import create_app
from service.rest.question_schemas import (
    BOUNDARY_EXAMPLE,
    MAP_EXAMPLE,
    POINTS_EXAMPLE,
    SENSITIVITIES_EXAMPLE,
)
from service.settings import Settings
from training.answers import BoundaryAnswers, CertificateUsed, MapAnswers, PointAnswers, SensitivityAnswers

EXAMPLES = {
    "/v1/stability": POINTS_EXAMPLE,
    "/v1/boundary": BOUNDARY_EXAMPLE,
    "/v1/sensitivities": SENSITIVITIES_EXAMPLE,
    "/v1/map": MAP_EXAMPLE,
}
CERTIFICATE = CertificateUsed(1e-3, 0.95, "rules/1", 12.0)


@dataclass
class RuleScreener:
    """Unstable from 10 kN/m on, undecided just there; the surrogate's domain ends at 1 MN/m."""

    critical: float = 1e4
    domain_ends: float = 1e6
    model_id: str | None = "rule-1"
    exact_points_limit: int = 1000
    pause: threading.Event = field(default_factory=threading.Event)
    entered: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.pause.set()

    def _origin(self, ke: np.ndarray, policy: str, alpha: float | None) -> dict[str, Any]:
        self.entered.set()
        assert self.pause.wait(20.0)
        outside = ke > self.domain_ends
        if policy == "surrogate" and outside.any():
            raise InvalidInput("ke", float(ke[outside].flat[0]), 'outside the domain: use policy "auto"')
        if alpha not in (None, 1e-3):
            raise InvalidInput("alpha", alpha, "the model is certified for 0.001")
        exact = outside | (policy == "exact")
        reason = np.where(outside, "out_of_domain", "confident")
        return {
            "source": np.where(exact, "exact", "surrogate"),
            "reason": np.where(np.full(ke.shape, policy == "auto"), reason, "requested"),
            "model": self.model_id,
            "solver": "rule",
            "certificate": CERTIFICATE if policy == "auto" else None,
        }

    def _verdict(self, ke: np.ndarray) -> np.ndarray:
        return np.where(ke == self.critical, np.nan, np.where(ke < self.critical, 1.0, 0.0))

    def points(self, blade, contact, speed_hz, ke, policy="auto", alpha=None) -> PointAnswers:
        origin = self._origin(ke, policy, alpha)
        exact = origin["source"] == "exact"
        radius = np.where(exact, ke / self.critical, np.nan)
        return PointAnswers(
            speed_hz=speed_hz,
            ke=ke,
            stable=self._verdict(ke),
            unstable_probability=np.where(exact, np.nan, ke / (ke + self.critical)),
            spectral_radius=radius,
            growth_per_revolution=np.log(np.where(radius > 0, radius, np.nan)),
            chatter_hz=np.where(exact, 3.3 * speed_hz, np.nan),
            error_estimate=np.where(exact, 1e-6, np.nan),
            unstable_multipliers=np.where(exact, 2.0 * (ke > self.critical), np.nan),
            wear_lobes=np.where(exact, 3.3, np.nan),
            **origin,
        )

    def boundary(self, blade, contact, speed_hz, ke_max, policy="auto", alpha=None) -> BoundaryAnswers:
        origin = self._origin(np.full(speed_hz.shape, ke_max), policy, alpha)
        found = ke_max > self.critical
        intervals = (((self.critical, ke_max),) if found else ()) if origin["source"][0] == "exact" else None
        return BoundaryAnswers(
            speed_hz=speed_hz,
            ke_max=ke_max,
            critical_ke=np.full(speed_hz.shape, self.critical if found else np.nan),
            chatter_hz=np.full(speed_hz.shape, np.nan),
            error_estimate=np.full(speed_hz.shape, 1e-3),
            unstable_ke=(intervals,) * len(speed_hz),
            **origin,
        )

    def sensitivities(
        self, blade, contact, speed_hz, ke_max, policy="auto", alpha=None
    ) -> SensitivityAnswers:
        """The critical K_e goes with the square of the first frequency, and with nothing else."""
        origin = self._origin(np.full(speed_hz.shape, ke_max), policy, alpha)
        there = np.where(np.full(len(speed_hz), ke_max > self.critical), 1.0, np.nan)[:, None]
        frequency = blade.at_speeds(speed_hz)[0][:, 0] / (2 * np.pi)
        value = np.column_stack([frequency, np.full(len(speed_hz), blade.damping_ratio[0])])
        return SensitivityAnswers(
            speed_hz=speed_hz,
            ke_max=ke_max,
            critical_ke=self.critical * there[:, 0],
            chatter_hz=np.full(speed_hz.shape, np.nan),
            error_estimate=np.full(speed_hz.shape, 1e-3),
            parameter=("frequency of mode 1", "damping of mode 1"),
            unit=("Hz", ""),
            value=value,
            derivative=there * np.column_stack([2 * self.critical / frequency, 0.0 * frequency]),
            relative=there * np.array([2.0, 0.0]),
            **origin,
        )

    def map(self, blade, contact, speed_hz, ke, policy="auto", alpha=None) -> MapAnswers:
        grid = np.repeat(ke[:, None], len(speed_hz), axis=1)
        origin = self._origin(grid, policy, alpha)
        probability = np.where(origin["source"] == "exact", np.nan, 0.25)
        return MapAnswers(speed_hz, ke, self._verdict(grid), probability, **origin)


@pytest.fixture
def screener() -> RuleScreener:
    return RuleScreener()


@pytest.fixture(scope="session")
def rule_screener() -> type[RuleScreener]:
    return RuleScreener


@pytest.fixture(scope="session")
def shared_address() -> Iterator[str]:
    with listening(create_app(Settings(max_points=1000), screener=RuleScreener())) as url:
        yield url


@pytest.fixture
def http(shared_address: str) -> Iterator[httpx.Client]:
    """A client of a service that takes up to 1000 points and whose rule no test changes."""
    with httpx.Client(base_url=shared_address, timeout=20.0) as client:
        yield client


@pytest.fixture
def question() -> Callable[..., dict[str, Any]]:
    """A good body for a path, with fields replaced (None takes one away)."""

    def asked(path: str = "/v1/stability", **fields: Any) -> dict[str, Any]:
        body = copy.deepcopy(EXAMPLES[path]) | fields
        return {key: value for key, value in body.items() if value is not None}

    return asked


@contextmanager
def listening(app: FastAPI, **options: Any) -> Iterator[str]:
    """The address of `app` on a real socket of the loopback."""
    options = {"log_level": "warning", "access_log": False, "timeout_graceful_shutdown": 5} | options
    server = uvicorn.Server(uvicorn.Config(app, **options))
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=server.run, args=([sock],))
        thread.start()
        try:
            deadline = time.monotonic() + 20.0
            while not server.started:
                assert thread.is_alive() and time.monotonic() < deadline, "the server did not start"
                time.sleep(0.01)
            yield f"http://127.0.0.1:{sock.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(20.0)


@pytest.fixture(scope="session")
def serving() -> Callable[..., Any]:
    return listening


@pytest.fixture
def own_http(screener: RuleScreener) -> Iterator[httpx.Client]:
    """A client of a service of one's own, around `screener`."""
    with listening(create_app(screener=screener)) as url, httpx.Client(base_url=url, timeout=20.0) as client:
        yield client


def assert_problem(response: Any, status: int, field: str) -> dict[str, Any]:
    """The response is a whole problem document about `field`."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert problem["status"] == status
    assert problem["field"] == field, problem
    for member in ("type", "title", "detail", "instance", "value", "remedy"):
        assert problem[member], member
    assert problem["request_id"] == response.headers["x-request-id"]
    return problem


@pytest.fixture
def problem() -> Callable[[Any, int, str], dict[str, Any]]:
    return assert_problem
