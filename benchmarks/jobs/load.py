"""``python -m benchmarks.jobs.load``: requests a second and latency of one service process under wrk.

One point, a hundred points, a map of 64 × 64; a bare FastAPI endpoint that answers a constant; all of it
again beside a running screening; a thousand open connections; clients that send a byte a second.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np

from benchmarks.jobs.following import submit
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch, variants

BARE = """
import sys, uvicorn
from fastapi import FastAPI, Request
app = FastAPI()
@app.post("/v1/stability")
async def answer(request: Request):
    await request.body()
    return {"stable": [True]}
uvicorn.run(app, host="127.0.0.1", port=int(sys.argv[1]), log_level="error")
"""
_UNITS = {"us": 1e-3, "ms": 1.0, "s": 1e3, "m": 6e4}


@dataclass(frozen=True)
class Load:
    """What wrk measured; times in ms."""

    per_second: float
    p50_ms: float
    p99_ms: float
    failed: int


def questions() -> dict[str, tuple[str, dict]]:
    """Path and body of each kind of request, all of one blade."""
    blade = variants(1)[0]
    contact = {"weights": {"LE": 1.0}}
    rng = np.random.default_rng(5)
    hundred = {"speed_hz": rng.uniform(90, 300, 100).tolist(), "ke": rng.uniform(0, 2.5e4, 100).tolist()}
    grid = {"speed_hz": np.linspace(90, 300, 64).tolist(), "ke": np.linspace(0, 2.5e4, 64).tolist()}
    asked = {"blade": blade, "contact": contact}
    return {
        "1 point": ("/v1/stability", {**asked, "speed_hz": [200.0], "ke": [5000.0]}),
        "100 points": ("/v1/stability", {**asked, **hundred}),
        "map 64 x 64": ("/v1/map", {**asked, **grid}),
    }


def wrk(url: str, path: str, body: dict, scratch: Path, connections: int, seconds: int) -> Load:
    """Load a path for some seconds."""
    script = scratch / "post.lua"
    (scratch / "body.json").write_text(json.dumps(body))
    script.write_text(
        'wrk.method = "POST"\nwrk.headers["Content-Type"] = "application/json"\n'
        f'local f = io.open("{scratch / "body.json"}")\nwrk.body = f:read("*a")\n'
    )
    command = ["wrk", "-t1", f"-c{connections}", f"-d{seconds}s", "--latency", "--timeout", "60s"]
    said = subprocess.run(
        [*command, "-s", str(script), url + path], check=True, capture_output=True, text=True
    ).stdout
    failed = sum(
        int(n) for n in re.findall(r"(?:Non-2xx or 3xx responses:|connect|read|write|timeout) (\d+)", said)
    )
    times = {p: float(v) * _UNITS[u] for p, v, u in re.findall(r"(50|99)%\s+([\d.]+)(us|ms|s|m)\b", said)}
    rate = re.search(r"Requests/sec:\s+([\d.]+)", said)
    assert rate is not None, said
    return Load(float(rate[1]), times["50"], times["99"], failed)


@contextmanager
def bare_endpoint() -> Iterator[str]:
    """FastAPI that reads a body and answers a constant."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen([sys.executable, "-c", BARE, str(port)])
    try:
        url = f"http://127.0.0.1:{port}"
        for _ in range(200):
            try:
                httpx.post(f"{url}/v1/stability", content=b"{}")
                break
            except httpx.HTTPError:
                time.sleep(0.1)
        yield url
    finally:
        process.kill()
        process.wait()


def thousand_connections(url: str, body: dict) -> tuple[int, float]:
    """Connections that were held open and answered, and the time one more request takes beside them, ms."""
    host, _, port = url.removeprefix("http://").partition(":")
    content = json.dumps(body).encode()
    head = f"POST /v1/stability HTTP/1.1\r\nHost: {host}\r\nContent-Length: {len(content)}\r\n\r\n".encode()
    held = [socket.create_connection((host, int(port)), timeout=60.0) for _ in range(1000)]
    began = time.perf_counter()
    status = httpx.post(f"{url}/v1/stability", json=body, timeout=60.0).status_code
    beside = (time.perf_counter() - began) * 1e3
    assert status == 200
    answered = 0
    for connection in held:
        connection.sendall(head + content)
        answered += connection.recv(65536).startswith(b"HTTP/1.1 200")
    for connection in held:
        connection.close()
    return answered, beside


def slow_clients(url: str, body: dict, count: int = 200, seconds: float = 10.0) -> tuple[float, float]:
    """Median and largest time of a request, ms, beside clients that send a byte a second."""
    host, _, port = url.removeprefix("http://").partition(":")
    slow = [socket.create_connection((host, int(port)), timeout=60.0) for _ in range(count)]
    for connection in slow:
        connection.sendall(b"POST /v1/stability HTTP/1.1\r\nHost: x\r\nContent-Length: 5000\r\n\r\n")
    took, end, next_byte = [], time.monotonic() + seconds, time.monotonic()
    with httpx.Client(base_url=url, timeout=60.0) as client:
        while time.monotonic() < end:
            if time.monotonic() > next_byte:
                next_byte += 1.0
                for connection in slow:
                    connection.sendall(b" ")
            began = time.perf_counter()
            assert client.post("/v1/stability", json=body).status_code == 200
            took.append((time.perf_counter() - began) * 1e3)
    for connection in slow:
        connection.close()
    return float(np.median(took)), float(np.max(took))


def measured(url: str, scratch: Path, seconds: int, what: str) -> None:
    """A line for each kind of request."""
    for name, (path, body) in questions().items():
        found = wrk(url, path, body, scratch, 8, seconds)
        print(
            f"{what:<22} {name:<12} {found.per_second:8.1f}/s  p50 {found.p50_ms:7.1f} ms  "
            f"p99 {found.p99_ms:7.1f} ms  failed {found.failed}",
            flush=True,
        )


def main() -> None:
    """Measure, and say so."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--folder", type=Path, default=Path("out/load"))
    asked = parser.parse_args()
    shutil.rmtree(asked.folder, ignore_errors=True)
    asked.folder.mkdir(parents=True)
    scratch = asked.folder.resolve()
    one = questions()["1 point"]
    settings = {"min_free_bytes": 0, "max_body_bytes": 2**26, "log_level": "INFO"}
    with bare_endpoint() as bare:
        found = wrk(bare, *one, scratch, 8, asked.seconds)
        print(f"{'bare FastAPI':<22} {'constant':<12} {found.per_second:8.1f}/s  p50 {found.p50_ms:7.1f} ms")
    with ServiceProcess(asked.folder / "data", **settings) as service:
        measured(service.url, scratch, asked.seconds, "alone")
        answered, beside = thousand_connections(service.url, one[1])
        print(f"1,000 open connections: a request beside them {beside:.1f} ms; {answered} answered")
        median, most = slow_clients(service.url, one[1])
        print(f"200 slow clients: median {median:.1f} ms, largest {most:.1f} ms")
        submit(service.url, batch(1000, 64), "load")
        time.sleep(20.0)
        measured(service.url, scratch, asked.seconds, "beside a screening")
        service.kill()


if __name__ == "__main__":
    main()
