"""``python -m benchmarks.jobs.night``: a thousand blades as one job: time, memory, share verified.

The textbook method is timed on some points of the same maps, drawn at random, and extrapolated to all.
"""

from __future__ import annotations

import argparse
import shutil
import time
from pathlib import Path

import httpx
import numpy as np

from benchmarks.jobs.following import submit, until_over
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch, variants
from benchmarks.textbook import spectral_radius
from sdm_core.blade import blade_from_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from service.speeds import operating_range


def textbook_seconds(count: int, points: int, seed: int = 1) -> float:
    """Mean time of one point of the maps by the textbook method."""
    rng, spent = np.random.default_rng(seed), 0.0
    documents = variants(count)
    for _ in range(points):
        blade = blade_from_dict(documents[rng.integers(count)])
        contact = ContactConfiguration.at(str(rng.choice(["LE", "TE"])))
        low, high = operating_range(blade)
        speed_hz, ke = float(rng.uniform(low, high)), float(rng.uniform(0.0, 2.5e4))
        began = time.perf_counter()
        p = RubbingBlade.from_blade(blade, contact, speed_hz, ke)
        spectral_radius(p.omega, p.damping_ratio, p.contact_matrix, speed_hz, ke)
        spent += time.perf_counter() - began
    return spent / points


def main() -> None:
    """Measure, and say so."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blades", type=int, default=1000)
    parser.add_argument("--grid", type=int, default=64)
    parser.add_argument("--folder", type=Path, default=Path("out/night"))
    asked = parser.parse_args()
    shutil.rmtree(asked.folder, ignore_errors=True)
    memory: list[tuple[int, float, float]] = []
    with ServiceProcess(asked.folder, min_free_bytes=0, max_body_bytes=2**26) as service:
        began = time.monotonic()
        job = submit(service.url, batch(asked.blades, asked.grid), "night")
        accepted = time.monotonic() - began

        def look(document: dict) -> None:
            workers = sum(worker.memory_info().rss for worker in service.workers())
            memory.append((document["progress"]["done"], service.memory_bytes() / 2**20, workers / 2**20))

        document = until_over(service.url, job, 7200.0, look)
        seconds = time.monotonic() - began
        headers = {"Accept": "text/csv"}
        lines = httpx.get(f"{service.url}/v1/screenings/{job}/results", headers=headers, timeout=60.0)
        table = [line.split('"') for line in lines.text.splitlines()]
        rows = httpx.get(f"{service.url}/v1/screenings/{job}/results?limit=1000", timeout=60.0).json()
        shares = [row["verified_share"] for row in rows["results"]]
        if rows["next"]:
            more = httpx.get(service.url + rows["next"], timeout=60.0).json()
            shares += [row["verified_share"] for row in more["results"]]
    stored = sum(path.stat().st_size for path in (asked.folder / "jobs" / job).rglob("*") if path.is_file())
    points = asked.blades * 2 * asked.grid**2
    print(f"{document['state']}: {asked.blades} blades x 2 x {asked.grid}^2 = {points:,} points")
    print(f"{seconds:.0f} s, accepted after {accepted:.1f} s: {asked.blades / seconds:.2f} blades a second")
    print(f"verified {np.mean(shares):.2%} of {len(table) - 1} maps; {stored / 2**20:.1f} MiB stored")
    for share in (0.05, 0.25, 0.5, 0.75, 1.0):
        done, service_mib, workers_mib = min(memory, key=lambda m: abs(m[0] - share * asked.blades))
        print(f"  at {done:4d} blades: service {service_mib:.0f} MiB, workers {workers_mib:.0f} MiB")
    each = textbook_seconds(asked.blades, 200)
    print(
        f"textbook: {each * 1e3:.1f} ms a point, {each * points / 3600:.1f} h of one core for the maps alone"
    )


if __name__ == "__main__":
    main()
