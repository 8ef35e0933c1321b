"""Every request has an id and one line in the log."""

from __future__ import annotations

import json
import logging
import re
import time

import pytest


@pytest.fixture
def lines(caplog):
    caplog.set_level(logging.INFO, "rubscreen.access")

    def read() -> list[dict]:
        deadline = time.monotonic() + 5.0  # a line is written after its answer has gone out
        while not (found := [r for r in caplog.records if r.name == "rubscreen.access"]):
            assert time.monotonic() < deadline, "no line"
            time.sleep(0.01)
        return [json.loads(r.getMessage()) for r in found]

    return read


def test_an_id_that_is_given_is_kept(http):
    assert http.get("/healthz", headers={"X-Request-Id": "job-7_a.2"}).headers["x-request-id"] == "job-7_a.2"


@pytest.mark.parametrize("given", ["", "a b", "x" * 129, "é".encode(), 'a"b'])
def test_an_id_that_could_break_a_log_is_replaced(http, given):
    answer = http.get("/healthz", headers={"X-Request-Id": given})
    assert re.fullmatch("[0-9a-f]{32}", answer.headers["x-request-id"])


def test_answers_have_ids_of_their_own(http):
    assert http.get("/healthz").headers["x-request-id"] != http.get("/healthz").headers["x-request-id"]


def test_a_request_is_one_line_of_json(http, question, lines):
    answer = http.post("/v1/stability", json=question())
    (line,) = lines()
    assert (line["method"], line["path"], line["status"]) == ("POST", "/v1/stability", 200)
    assert line["bytes"] == len(answer.content)
    assert line["request_id"] == answer.headers["x-request-id"]
    assert line["ms"] > 0


def test_a_line_break_in_a_path_stays_inside_its_line(http, lines, caplog):
    http.get("/v1/%0A%7B%22status%22:200%7D")
    (line,) = lines()
    assert line["status"] == 404
    assert "\n" not in caplog.records[-1].getMessage()
