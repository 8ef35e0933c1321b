"""Jobs from outside: handed in, watched, and compared by their files."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

OVER = ("done", "failed", "cancelled")


def submit(url: str, question: dict[str, Any], key: str, path: str = "/v1/screenings") -> str:
    """Hand a job in; its identifier."""
    headers = {"Idempotency-Key": key}
    reply = httpx.post(url + path, json=question, headers=headers, timeout=120.0)
    reply.raise_for_status()
    return reply.json()["id"]


def state_of(url: str, job: str, path: str = "/v1/screenings") -> dict[str, Any]:
    """The job document."""
    reply = httpx.get(f"{url}{path}/{job}", timeout=30.0)
    reply.raise_for_status()
    return reply.json()


def until_over(
    url: str,
    job: str,
    patience_s: float,
    look: Callable[[dict[str, Any]], None] | None = None,
    path: str = "/v1/screenings",
) -> dict[str, Any]:
    """Wait for the end of a job; `look` sees it on the way."""
    end = time.monotonic() + patience_s
    while True:
        document = state_of(url, job, path)
        if look is not None:
            look(document)
        if document["state"] in OVER:
            return document
        if time.monotonic() > end:
            raise TimeoutError(json.dumps(document))
        time.sleep(0.5)


def content_of(data: Path, job: str) -> dict[str, str]:
    """SHA-256 of every result file of a job, by name."""
    folder = data / "jobs" / job
    files = [*sorted((folder / "chunks").iterdir()), *folder.glob("results.parquet")]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def computed_after_stored(data: Path, job: str) -> list[int]:
    """Chunks that were begun again though they had been stored."""
    stored: set[int] = set()
    wrong = []
    for note in notes_of(data, job):
        if note["event"] == "stored":
            stored.add(note["chunk"])
        elif note["event"] == "submitted" and note["chunk"] in stored:
            wrong.append(note["chunk"])
    return wrong


def notes_of(data: Path, job: str) -> list[dict[str, Any]]:
    """The job's log; a kill may have cut its last line."""
    out = []
    for line in (data / "jobs" / job / "log.jsonl").read_text().splitlines():
        try:
            out.append(json.loads(line))
        except ValueError:
            continue
    return out
