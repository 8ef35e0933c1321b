"""A 200 × 200 map of rotor 37 by REST, beside the textbook method on a sample of the same points."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.textbook import spectral_radius
from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from service.client import Client
from service.demo import running_service

SIDE = 200


def table(sample: int = 60) -> Table:
    """Times side by side in one run; the ratio is what counts."""
    blade = example_blade("nasa_rotor_37")
    contact = ContactConfiguration.at("LE", "TE")
    speed = np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], SIDE)  # type: ignore[index]
    ke = np.linspace(0.0, 2.5e4, SIDE)
    out = Table(title=f"{SIDE} × {SIDE} map of rotor 37, both edges in contact")
    for column in ("what", "time", "answered exactly", "ratio to the textbook method"):
        out.add_column(column)

    rng = np.random.default_rng(1)
    picks = rng.integers(0, SIDE, (sample, 2))
    textbook, exact = [], []
    with threadpool_limits(1):
        for i, j in picks:
            problem = RubbingBlade.from_blade(blade, contact, speed[i], ke[j])
            start = time.perf_counter()
            textbook.append(
                spectral_radius(problem.omega, problem.damping_ratio, problem.contact_matrix, speed[i], ke[j])
            )
            exact.append(time.perf_counter() - start)
    whole = float(np.median(exact)) * SIDE**2
    out.add_row(f"textbook, N = 60, from {sample} points", f"{whole:.0f} s", "", "1")

    with TemporaryDirectory() as folder, running_service(Path(folder) / "service.log") as url:
        client = Client(url, timeout=300.0)
        client.map(blade, contact, speed[:2], ke[:2])  # the first request pays for the imports
        for policy in ("auto", "surrogate", "exact"):
            times = []
            for _ in range(3):
                start = time.perf_counter()
                found = client.map(blade, contact, speed, ke, policy)
                times.append(time.perf_counter() - start)
            took = float(np.median(times))
            out.add_row(
                f"REST, {policy}", f"{took:.2f} s", f"{found.exact_share:.2%}", f"{whole / took:,.0f}"
            )
    return out
