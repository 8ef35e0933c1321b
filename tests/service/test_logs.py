"""Every line of the log has one form, whoever wrote it, and says which request it belongs to."""

from __future__ import annotations

import io
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import datetime

import httpx
import pytest
from distributed.utils import silence_logging_cmgr

from service.app import create_app
from service.operation import logs

NAMES = ("", "rubscreen", "uvicorn", "uvicorn.error", "uvicorn.access", "dbos", "distributed")


@pytest.fixture
def stream() -> Iterator[io.StringIO]:
    """Where the log goes; loggers are as before afterwards."""
    before = {name: logging.getLogger(name) for name in NAMES}
    kept = {name: (log.handlers[:], log.level, log.propagate) for name, log in before.items()}
    yield io.StringIO()
    for name, (handlers, level, propagate) in kept.items():
        log = before[name]
        log.handlers, log.propagate = handlers, propagate
        log.setLevel(level)
    logging.captureWarnings(False)


def lines(stream: io.StringIO) -> list[dict]:
    return [json.loads(line) for line in stream.getvalue().splitlines()]


@pytest.mark.parametrize("name", ["rubscreen.service", "uvicorn.error", "dbos", "distributed.scheduler"])
def test_a_line_is_json_with_time_level_event_and_logger_whoever_wrote_it(stream, name):
    logs.configure_process("INFO", "json", stream)
    logging.getLogger(name).warning("lost %d of %d", 2, 7, extra={"blade": "rotor"})
    (line,) = lines(stream)
    assert abs(datetime.fromisoformat(line.pop("time")).timestamp() - time.time()) < 60
    assert line == {"level": "warning", "event": "lost 2 of 7", "logger": name, "blade": "rotor"}


def test_handlers_that_libraries_brought_write_no_second_line(stream):
    brought = io.StringIO()
    logging.getLogger("dbos").addHandler(logging.StreamHandler(brought))
    logs.configure_process("INFO", "json", stream)
    logging.getLogger("dbos").error("once")
    assert [line["event"] for line in lines(stream)] == ["once"] and not brought.getvalue()


def test_a_library_that_silences_its_own_handler_silences_nobody_else(stream):
    logs.configure_process("INFO", "json", stream)
    with silence_logging_cmgr(logging.CRITICAL):  # as distributed does while a cluster runs
        logging.getLogger("distributed").warning("chatter")
        logging.getLogger("rubscreen.service").info("heard")
        logging.getLogger("uvicorn.error").info("heard too")
    assert [line["event"] for line in lines(stream)] == ["heard", "heard too"]


@pytest.mark.parametrize("form", ["json", "text"])
@pytest.mark.parametrize("cut", ["\n", "\r", "\x1b[31m", "\u2028", "\x85"])
def test_nothing_in_a_message_starts_a_line_or_colours_one(stream, form, cut):
    logs.configure_process("INFO", form, stream)
    logging.getLogger("rubscreen.access").info(logs.Fields(path=f"/a{cut}b", status=404))
    logging.getLogger("rubscreen.service").info("of %s", f"x{cut}y", extra={"blade": f"u{cut}v"})
    written = stream.getvalue()
    assert written.count("\n") == 2 and cut not in written.replace("\n", "", 2)
    assert len(written.splitlines()) == 2


@pytest.mark.parametrize("form", ["json", "text"])
def test_a_fault_shows_where_it_happened_and_no_variable(stream, form):
    logs.configure_process("INFO", form, stream)
    secret = "rub_1_do_not_show"
    try:
        int(secret[:0])
    except ValueError:
        logging.getLogger("rubscreen.service").exception("failed")
    assert "ValueError" in stream.getvalue() and "test_logs.py" in stream.getvalue()
    assert secret not in stream.getvalue()


def test_a_host_program_that_logs_already_is_left_alone(stream):
    handler = logging.NullHandler()
    logging.getLogger("rubscreen").addHandler(handler)
    logs.configure("INFO", "json", stream)
    assert logging.getLogger("rubscreen").handlers == [handler]


def test_what_is_logged_while_a_request_is_computed_carries_its_id(stream, serving, screener, question):
    class Talking(type(screener)):
        def points(self, *asked):
            logging.getLogger("rubscreen.training").warning("computing")
            return super().points(*asked)

    logs.configure_process("INFO", "json", stream)
    app, form = create_app(screener=Talking()), {"log_config": None, "log_level": "info"}
    with serving(app, **form) as url, httpx.Client(timeout=20.0) as http:
        for name in ("one", "two"):
            sent = {"X-Request-Id": name}
            assert http.post(f"{url}/v1/stability", json=question(), headers=sent).status_code == 200
    computing = [line for line in lines(stream) if line["event"] == "computing"]
    assert [line["request_id"] for line in computing] == ["one", "two"]
    requests = [line for line in lines(stream) if line["event"] == "request"]
    assert [(r["request_id"], r["path"], r["status"]) for r in requests] == [
        ("one", "/v1/stability", 200),
        ("two", "/v1/stability", 200),
    ]
    outside = [line for line in lines(stream) if line["logger"].startswith("uvicorn")]
    assert outside and not any("request_id" in line for line in outside)


def test_the_served_process_writes_json_where_nobody_sits_before_a_terminal(tmp_path):
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port), "--data", str(tmp_path)]
    environment = os.environ | {"RUBSCREEN_DRAIN_S": "0"}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
    try:
        deadline = time.monotonic() + 60.0
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=30.0) as http:
            while time.monotonic() < deadline:
                try:
                    http.get("/v1/%0Anothing", headers={"X-Request-Id": "seen"})
                    break
                except httpx.TransportError:
                    time.sleep(0.1)
        process.send_signal(signal.SIGTERM)
        _, written = process.communicate(timeout=30.0)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    found = [json.loads(line) for line in written.decode().splitlines()]
    assert {"uvicorn.error", "rubscreen.access"} <= {line["logger"] for line in found}
    (request,) = [line for line in found if line.get("request_id") == "seen"]
    assert (request["path"], request["status"], request["level"]) == ("/v1/\nnothing", 404, "info")
