"""`rubscreen serve`: the REST service."""

from __future__ import annotations

import errno
import logging
import os
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.admission import settled
from service.commands.options import DataOption

if TYPE_CHECKING:
    from service.settings import Settings


def run(
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0 for every network.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 for any free one.")] = 8000,
    models: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Answer from the active model of this folder instead of the shipped one.",
            show_default=False,
        ),
    ] = None,
    keep_answers: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Keep exact answers here, for `rubscreen train --with-served FOLDER`.",
            show_default=False,
        ),
    ] = None,
    data: DataOption = None,
    open_to_all: Annotated[
        bool, typer.Option("--open", help="Ask for no keys, though other machines can reach the address.")
    ] = False,
) -> None:
    """Run the REST service until it is interrupted. Its settings are RUBSCREEN_... environment variables.

    On an address that other machines can reach it asks for keys: see `rubscreen keys`.
    """
    import uvicorn

    from service.app import create_app
    from service.commands.outputs import check_writable
    from service.operation import logs
    from service.operation.draining import Draining, DrainingServer
    from service.rest.job_desk import preflight

    settings = settings_from(models, keep_answers, data)
    if settings.served_answers_folder is not None:
        check_writable(**{"keep-answers": f"{settings.served_answers_folder}/served"})
    listening = _listening(host, port)
    settings = settled(settings, host, listening.getsockname()[0], open_to_all=open_to_all)
    with listening_or_closed(listening):
        preflight(settings)
    logs.configure_process(settings.log_level, settings.log_format)
    draining = Draining()
    app = create_app(settings, draining=draining)
    shown = f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{listening.getsockname()[1]}"
    typer.echo(
        f"rubscreen: listening on {shown}\n  {shown}/docs    try it in a browser\n  {shown}/readyz  ready?"
    )
    typer.echo("  stop with Ctrl-C")
    config = uvicorn.Config(
        app,
        log_config=None,  # lines of its own form would be mixed with ours
        access_log=False,
        timeout_graceful_shutdown=settings.shutdown_s,
    )
    with listening:
        DrainingServer(config, draining, settings.drain_s).run(sockets=[listening])
    _leave_none_behind()


@contextmanager
def listening_or_closed(listening: socket.socket) -> Iterator[None]:
    """Close the socket where the block fails."""
    try:
        yield
    except BaseException:
        listening.close()
        raise


def _leave_none_behind() -> None:
    """End the process though a thread of the queue still waits for a database that has gone."""
    if any(not thread.daemon and thread is not threading.main_thread() for thread in threading.enumerate()):
        logging.getLogger("rubscreen.service").warning("a thread does not stop: it is left")
        logging.shutdown()
        sys.stdout.flush()
        os._exit(0)


def settings_from(
    models: str | None = None,
    keep_answers: str | None = None,
    data: str | None = None,
    database_url: str | None = None,
) -> Settings:
    """The settings of the environment, and folders over theirs; with a data folder in any case.

    Raises
    ------
    InvalidInput
        Naming the environment variable that cannot be used.
    """
    from service.environment import settings_of_environment
    from service.settings import default_data_folder

    folders = {"models_folder": models, "served_answers_folder": keep_answers, "data_folder": data}
    given: dict[str, Any] = {name: Path(folder) for name, folder in folders.items() if folder is not None}
    if database_url is not None:
        given["database_url"] = database_url
    settings = settings_of_environment(**given)
    if settings.data_folder is None:
        settings = settings.model_copy(update={"data_folder": default_data_folder()})
    return settings


def _listening(host: str, port: int) -> socket.socket:
    """A bound socket, so that a port in use is refused before anything is loaded."""
    from sdm_core.errors import InvalidInput

    if not 0 <= port <= 65535:
        raise InvalidInput("--port", port, "give a port from 0 to 65535")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # Named TCP, or asyncio does not send small packets at once, and every answer waits 40 ms for the client's
    # delayed acknowledgement.
    listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        if error.errno in (errno.EADDRINUSE, errno.EACCES) and not isinstance(error, socket.gaierror):
            raise InvalidInput("--port", port, f"give a free port ({error.strerror})") from None
        remedy = f"give an address of this machine ({error.strerror or error})"
        raise InvalidInput("--host", host, remedy) from None
    return listening
