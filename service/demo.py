"""The demonstration: a real service in its own process, asked over HTTP to screen two real blades."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import httpx
import numpy as np
from rich.console import Console

from sdm_core.blade import EXAMPLES, Blade, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import RubscreenError
from service.answerer import Answerer
from service.client import Client
from service.commands.outputs import progress_bar, terminal
from service.commands.tables import ranking_table
from service.screening.report_files import write_report
from service.screening.screen import ScreeningReport, screen
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers

READY_WITHIN_S = 60.0
# A service that answers, but that it is not ready, rarely becomes so.
PATIENCE_S = 5.0
STOPPED_WITHIN_S = 15.0


def demonstrate(
    out: str | Path,
    *,
    map_shape: tuple[int, int] = (200, 200),
    ke_liner: float = 9000.0,
    console: Console | None = None,
) -> ScreeningReport:
    """Screen the shipped blades through a service started for it, and write the report into `out`.

    Raises
    ------
    RubscreenError
        When the service does not come up; with the end of its log.
    """
    console = console or terminal()
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    with running_service(out / "service.log") as url:
        console.print(f"service ready at {url} after {time.perf_counter() - began:.1f} s")
        blades = [example_blade(name) for name in EXAMPLES]
        # trust_env=False: a proxy set for the outside has no business with the loopback.
        http = httpx.Client(trust_env=False, timeout=300.0)
        with Client(url, http=http) as client, progress_bar("screening over HTTP") as progress:
            answerer = TimedMaps(client)
            report = screen(
                blades,
                None,
                answerer,
                ke_liner=ke_liner,
                map_shape=map_shape,
                sweep_policy="exact",
                progress=progress,
            )
    console.print(ranking_table(report))
    for line in key_lines(report, answerer.seconds):
        console.print(line)
    written = write_report(out, report)
    console.print(f"{len(written)} files in {out}: {', '.join(path.name for path in written)}")
    console.print(f"service stopped; {time.perf_counter() - began:.1f} s in all")
    return report


def key_lines(report: ScreeningReport, map_seconds: list[float]) -> list[str]:
    """What to take away: safest, worst, what was verified, how long the maps took."""
    safest, riskiest = report.results[0], report.results[-1]
    points = safest.map.stable.size
    verified = np.mean([row.verified_share for row in report.results])
    safe = "none" if safest.worst is None else f"{safest.worst.ke:,.0f} N/m"
    bound = f" below {safest.ke_max:,.0f} N/m" if safest.worst is None else ""
    lines = [f"[bold]Safest[/bold]   {safest.blade.name}, {safest.contact_name}: smallest K_e {safe}{bound}"]
    if riskiest.worst is not None:
        tip = riskiest.worst
        lines.append(
            f"[bold]Worst[/bold]    {riskiest.blade.name}, {riskiest.contact_name}: {tip.ke:,.0f} N/m at "
            f"{tip.speed_rpm:,.0f} rpm ({tip.speed_hz:.1f} Hz, ratio {tip.speed_ratio:.3f}), "
            f"chatter {tip.chatter_hz:.0f} Hz, {tip.lobes_per_revolution:.1f} wear lobes a revolution"
        )
    exact = [row.worst for row in report.results if row.worst is not None]
    proven = sum(tip.proven for tip in exact)
    lines.append(
        f"[bold]Verified[/bold] {proven} of {len(exact)} smallest K_e proven by the exact core; "
        f"{verified:.1%} of the maps' points answered by it, the rest by {report.model or 'no surrogate'}"
    )
    lines.append(
        f"[bold]Maps[/bold]     {len(map_seconds)} of {points:,} points, over HTTP: "
        f"{np.median(map_seconds):.2f} s each (median), {max(map_seconds):.2f} s at most"
    )
    return lines


class TimedMaps:
    """An answerer that notes how long each map took, in `seconds`."""

    def __init__(self, inner: Answerer) -> None:
        self._inner = inner
        self.seconds: list[float] = []

    def points(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> PointAnswers:
        """As the inner one."""
        return self._inner.points(blade, contact, speed_hz, ke, policy, alpha)

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> BoundaryAnswers:
        """As the inner one."""
        return self._inner.boundary(blade, contact, speed_hz, ke_max, policy, alpha)

    def sensitivities(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> SensitivityAnswers:
        """As the inner one."""
        return self._inner.sensitivities(blade, contact, speed_hz, ke_max, policy, alpha)

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> MapAnswers:
        """As the inner one, timed."""
        began = time.perf_counter()
        answers = self._inner.map(blade, contact, speed_hz, ke, policy, alpha)
        self.seconds.append(time.perf_counter() - began)
        return answers


@contextmanager
def running_service(log: Path) -> Iterator[str]:
    """A service on a free loopback port, ready, with data of its own; stopped again whatever happens.

    Yields
    ------
    Its URL.
    """
    port = _free_port()
    # Neither the user's data nor keys: both go with the demonstration.
    others = ("RUBSCREEN_DATABASE_URL", "RUBSCREEN_AUTH")
    environment = {name: value for name, value in os.environ.items() if name not in others}
    environment["RUBSCREEN_DRAIN_S"] = "0"  # nobody else asks it
    with (
        _terminating(),
        log.open("wb") as sink,
        tempfile.TemporaryDirectory(prefix="rubscreen-demo-") as data,
    ):
        command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port), "--data", data]
        # A session of its own: Ctrl-C reaches this process alone, which then stops the service.
        process = subprocess.Popen(
            command, stdout=sink, stderr=subprocess.STDOUT, start_new_session=True, env=environment
        )
        try:
            url = f"http://127.0.0.1:{port}"
            _wait_until_ready(url, process, log)
            yield url
        finally:
            process.terminate()
            try:
                process.wait(STOPPED_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _wait_until_ready(url: str, process: subprocess.Popen[bytes], log: Path) -> None:
    began, refused_since, said = time.monotonic(), np.inf, ""
    with httpx.Client(base_url=url, trust_env=False, timeout=5.0) as http:
        while process.poll() is None and time.monotonic() < min(
            began + READY_WITHIN_S, refused_since + PATIENCE_S
        ):
            try:
                answer = http.get("/readyz")
            except httpx.TransportError:
                pass
            else:
                if answer.status_code == 200:
                    return
                refused_since, said = min(refused_since, time.monotonic()), answer.json()["detail"]
            time.sleep(0.1)
    if said:
        raise RubscreenError(f"the service is not ready: {said}")
    why = "ended" if process.poll() is not None else f"did not answer within {READY_WITHIN_S:g} s"
    tail = log.read_text(errors="replace")[-1500:].strip()
    raise RubscreenError(f"the service {why}; the end of {log}:\n{tail}")


@contextmanager
def _terminating() -> Iterator[None]:
    """SIGTERM as an exception, so that the service is stopped then too."""

    def leave(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    if threading.current_thread() is not threading.main_thread():
        yield  # Only the main thread may set handlers.
        return
    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
