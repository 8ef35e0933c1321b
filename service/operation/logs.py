"""One form of log line for everything the process says, with the request's id in it."""

from __future__ import annotations

import json
import logging
import logging.config
import sys
from collections.abc import Mapping
from typing import Any, Literal, TextIO

import structlog
from structlog.typing import EventDict, Processor, WrappedLogger

LogFormat = Literal["auto", "json", "text"]

# Loggers of the service and of the libraries it runs on. Some of the latter bring handlers of their own.
OURS = "rubscreen"
LIBRARIES = {"uvicorn": "INFO", "dbos": "WARNING", "distributed": "WARNING"}


class Fields(dict[str, Any]):
    """A message that is fields alone; as text it is one line of JSON."""

    def __str__(self) -> str:
        return json.dumps(self)


def configure(level: str, form: LogFormat = "auto", stream: TextIO | None = None) -> None:
    """Send the service's loggers to standard error, unless the host program sends them somewhere.

    Parameters
    ----------
    level
        Of the loggers under ``rubscreen``.
    form
        Lines of JSON, or text; "auto" is text on a terminal.
    """
    logger = logging.getLogger(OURS)
    logger.setLevel(level)
    if not logger.handlers and not logging.getLogger().handlers:
        logger.addHandler(_handler(form, stream or sys.stderr))


def configure_process(level: str, form: LogFormat = "auto", stream: TextIO | None = None) -> None:
    """Send whatever this process logs to standard error in one form; for a process that is the service.

    Handlers that libraries brought are replaced, or two forms would be mixed; one that finds a handler on its
    logger adds none later. Each has a handler of its own: distributed silences the one on its logger while a
    cluster runs.
    """
    logging.getLogger().handlers = [_handler(form, stream or sys.stderr)]
    logging.getLogger().setLevel(logging.WARNING)
    for name, least in ({OURS: level} | LIBRARIES).items():
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [_handler(form, stream or sys.stderr)], False
        logger.setLevel(least)
    for name in ("uvicorn.error", "uvicorn.access"):
        logging.getLogger(name).handlers = []
        logging.getLogger(name).setLevel(logging.NOTSET)  # as the logger above it says
    logging.captureWarnings(True)


def bound(**fields: Any) -> Any:
    """A block in which every line logged carries `fields`, in threads started from it too.

    Examples
    --------
    >>> with bound(request_id="a1"):
    ...     structlog.contextvars.get_contextvars()
    {'request_id': 'a1'}
    """
    return structlog.contextvars.bound_contextvars(**fields)


def carried() -> dict[str, Any]:
    """What lines logged here carry, for work done later and elsewhere on behalf of the same request."""
    return structlog.contextvars.get_contextvars()


def _handler(form: LogFormat, stream: TextIO) -> logging.Handler:
    handler = logging.StreamHandler(stream)
    as_text = form == "text" or (form == "auto" and stream.isatty())
    handler.setFormatter(_formatter(as_text, stream.isatty()))
    return handler


def _formatter(as_text: bool, colors: bool) -> logging.Formatter:
    last: list[Processor]
    if as_text:
        # A traceback may take lines; a message may not. Neither may show local variables: they hold keys.
        plain = structlog.dev.plain_traceback
        console = structlog.dev.ConsoleRenderer(
            colors=colors, pad_event_to=0, timestamp_key="time", exception_formatter=plain
        )
        last = [_one_line, console]
    else:
        last = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer(default=str)]
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=[
            structlog.stdlib.add_log_level,
            structlog.stdlib.add_logger_name,
            structlog.stdlib.ExtraAdder(),
            structlog.contextvars.merge_contextvars,
            structlog.processors.TimeStamper("iso", utc=True, key="time"),
            _with_fields,
        ],
        processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last],
    )


def _with_fields(logger: WrappedLogger, name: str, event: EventDict) -> EventDict:
    """The message's own fields beside the others, and the most telling ones first."""
    record: logging.LogRecord = event["_record"]
    event.pop("color_message", None)  # uvicorn's message once more, for its own formatter
    if isinstance(record.msg, Mapping):
        event.update({"event": "request", **record.msg})
    first = ("time", "level", "event", "logger", "request_id")
    ordered = {key: event[key] for key in first if key in event}
    return ordered | {key: value for key, value in event.items() if key not in first}


def _one_line(logger: WrappedLogger, name: str, event: EventDict) -> EventDict:
    return {key: _escaped(value) for key, value in event.items()}


def _escaped(value: Any) -> Any:
    if not isinstance(value, str) or value.isprintable():
        return value
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in value)
