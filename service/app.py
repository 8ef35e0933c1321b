"""The application: settings in, FastAPI out."""

from __future__ import annotations

import logging
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TypedDict

from anyio import CancelScope, to_thread
from fastapi import FastAPI
from fastapi_offline import FastAPIOffline

from sdm_core.version import __version__
from service.answerer import Answerer
from service.environment import settings_of_environment, unknown_variables
from service.operation import logs
from service.operation.desk_metrics import DeskMetrics
from service.operation.draining import Draining
from service.operation.metrics import Metrics
from service.operation.tracing import Tracing
from service.page import mounting as page
from service.rest import access_log, errors, gate, openapi
from service.rest.desk import Desk
from service.rest.readiness import Readiness
from service.rest.routes import (
    assessments,
    blades,
    examples,
    health,
    metrics,
    models,
    screenings,
    simulations,
    stability,
    trainings,
    uploads,
)
from service.settings import Settings

logger = logging.getLogger("rubscreen.service")
DESCRIPTION = """Will this blade, rubbing its abradable liner, become unstable: at which rotor speeds, from
which cutting stiffness on? Under `policy: auto` a surrogate answers where it is sure and inside its domain,
the exact core elsewhere; every point says which, and why."""


class State(TypedDict):
    """What the lifespan gives every request."""

    desk: Desk
    readiness: Readiness


def create_app(
    settings: Settings | None = None,
    *,
    screener: Answerer | None = None,
    draining: Draining | None = None,
) -> FastAPI:
    """The service.

    Parameters
    ----------
    settings
        Read from the environment when left out.
    screener
        What answers; left out, the shipped model with the exact core behind it.
    draining
        Set by the server when it is about to stop.

    Raises
    ------
    InvalidInput
        When a setting of the environment cannot be used, or traces are asked for and cannot be sent.
    """
    if settings is None:
        settings = settings_of_environment()
        for warning in unknown_variables(os.environ):  # `rubscreen serve` has said so itself
            logger.warning(warning)
    draining = draining or Draining()
    counts = Metrics()
    tracing = None if settings.otel_endpoint is None else Tracing(settings.otel_endpoint)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[State]:
        logs.configure(settings.log_level, settings.log_format)
        # In a thread: the database and the queue of jobs do not open on the event loop.
        desk = await to_thread.run_sync(Desk.opened, settings, screener, counts, draining.stopping)
        jobs = None if desk.jobs is None else desk.jobs.jobs.records
        state = DeskMetrics(desk.model, desk.work, desk.kept, desk.auditor, lambda: draining.begun, jobs)
        counts.observe(state)
        try:
            yield {"desk": desk, "readiness": Readiness(desk, draining)}
        finally:
            counts.forget(state)
            with CancelScope(shield=True):
                await to_thread.run_sync(desk.close)
                if tracing is not None:
                    await to_thread.run_sync(tracing.close)

    # Not plain FastAPI, whose /docs loads its scripts from the internet.
    app: FastAPI = FastAPIOffline(
        title="rubscreen",
        version=__version__,
        description=DESCRIPTION,
        lifespan=lifespan,
        redirect_slashes=False,
        docs_url="/docs",
        redoc_url=None,
        static_url="/docs/assets",
        swagger_ui_parameters={"validatorUrl": None},
        **({} if tracing is None else {"telemetry": tracing.for_fastapi()}),
    )
    app.include_router(stability.router)
    app.include_router(assessments.router)
    app.include_router(blades.router)
    app.include_router(examples.router)
    app.include_router(models.router)
    app.include_router(screenings.router)
    app.include_router(simulations.router)
    app.include_router(uploads.router)
    app.include_router(trainings.router)
    app.include_router(health.router)
    app.include_router(metrics.router)
    page.install(app)
    errors.install(app)
    openapi.install(app)
    app.add_middleware(gate.Gate)
    app.add_middleware(access_log.AccessLog, metrics=counts, draining=draining, tracing=tracing)
    return app
