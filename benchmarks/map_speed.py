"""200 × 200 maps of rotor 37 by REST, beside the exact core and the textbook method."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.textbook import spectral_radius, spectral_radius_with_arcs
from sdm_core.adaptive_map import adaptive_map
from sdm_core.blade import Blade, example_blade
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from service.client import Client
from service.demo import running_service

SIDE = 200
ALPHA = 1e-3
CONTACTS = {
    "permanent contact": ContactConfiguration.at("LE", "TE"),
    "two arcs of contact": ContactConfiguration.at("LE", "TE", arcs=[[0.0, 0.25], [0.5, 0.75]]),
}


def table(sample: int = 40) -> Table:
    """Times side by side in one run; the ratio is what counts."""
    blade = example_blade("nasa_rotor_37")
    speed = np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], SIDE)  # type: ignore[index]
    ke = np.linspace(0.0, 2.5e4, SIDE)
    out = Table(title=f"{SIDE} × {SIDE} map of rotor 37, both edges; auto at a certified rate of {ALPHA:g}")
    for column in ("what", "time", "answered exactly", "wrong verdicts", "ratio to the textbook method"):
        out.add_column(column, justify="left" if column == "what" else "right")
    with TemporaryDirectory() as folder, running_service(Path(folder) / "service.log") as url:
        client = Client(url, timeout=600.0)
        for name, contact in CONTACTS.items():
            out.add_section()
            out.add_row(name, style="bold")
            whole = _textbook(blade, contact, speed, ke, sample)
            out.add_row(f"textbook, N = 60, from {sample} points", f"{whole:.0f} s", "", "", "1")

            rows = _Rows(out, whole)
            grid = [axis.ravel() for axis in np.meshgrid(speed, ke)]
            with threadpool_limits(1):
                rows.add("exact core, every point", partial(_every_point, blade, contact, grid), 1)
                if not contact.permanent:
                    rows.add(
                        "exact core, edges over speed", partial(_edges, blade, contact, speed, ke, grid), 1
                    )
            client.map(blade, contact, speed[:2], ke[:2])  # the first request pays for the imports
            for policy, alpha in (("auto", ALPHA), ("surrogate", None), ("exact", None)):
                share = client.map(blade, contact, speed, ke, policy, alpha).exact_share
                ask = partial(client.map, blade, contact, speed, ke, policy, alpha)
                repeats = 1 if policy == "exact" else 5
                rows.add(f"REST, {policy}", lambda ask=ask: ask().stable, repeats, f"{share:.2%}")
    return out


@dataclass
class _Rows:
    """Rows of one contact; the first one measured is the truth of the others."""

    out: Table
    textbook_s: float
    truth: np.ndarray | None = None

    def add(self, what: str, run: Callable[[], np.ndarray], repeats: int, share: str = "") -> None:
        times = []
        for _ in range(repeats):
            start = time.perf_counter()
            stable = run()
            times.append(time.perf_counter() - start)
        took = float(np.median(times))
        wrong = "" if self.truth is None else f"{int((stable != self.truth).sum())} of {stable.size:,}"
        self.truth = stable if self.truth is None else self.truth
        self.out.add_row(what, f"{took:.3f} s", share, wrong, f"{self.textbook_s / took:,.0f}")


def _every_point(blade: Blade, contact: ContactConfiguration, grid: list[np.ndarray]) -> np.ndarray:
    return verdicts(blade, contact, *grid).reshape(SIDE, SIDE)


def _edges(
    blade: Blade, contact: ContactConfiguration, speed: np.ndarray, ke: np.ndarray, grid: list[np.ndarray]
) -> np.ndarray:
    found = adaptive_map(blade, contact, float(speed[0]), float(speed[-1]), float(ke[-1]))
    return found.stable(*grid).reshape(SIDE, SIDE)


def _textbook(
    blade: Blade, contact: ContactConfiguration, speed: np.ndarray, ke: np.ndarray, sample: int
) -> float:
    """Seconds of the whole map, from the median of points drawn at random."""
    times = []
    with threadpool_limits(1):
        for i, j in np.random.default_rng(1).integers(0, SIDE, (sample, 2)):
            p = RubbingBlade.from_blade(blade, contact, speed[i], ke[j])
            start = time.perf_counter()
            asked = (p.omega, p.damping_ratio, p.contact_matrix, speed[i], ke[j])
            if contact.arcs is None:
                spectral_radius(*asked)
            else:
                spectral_radius_with_arcs(*asked, contact.arcs)
            times.append(time.perf_counter() - start)
    return float(np.median(times)) * SIDE**2
