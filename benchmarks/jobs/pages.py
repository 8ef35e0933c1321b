"""``python -m benchmarks.jobs.pages FOLDER``: pages of a ranking of 100,000 rows, from a service of its own.

Two jobs of 20,000 blades under five contacts lie in the folder, made without computing: one that is done, and
one that is not and so has chunks alone. Each is paged by a fresh service, whose largest resident memory is
read from the kernel; a folder made before is used again.
"""

from __future__ import annotations

import argparse
import io
import json
import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import httpx
import numpy as np

from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import variants
from sdm_core.contact import ContactConfiguration
from service.jobs.chunk_store import ChunkStore
from service.jobs.job import SCREENING, Job, State
from service.jobs.job_folder import JobFolders
from service.jobs.screening import blade_lines
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.checks import limits_of
from service.jobs.screening.chunk import chunk_payload, compute_chunk
from service.jobs.screening.request import Criteria, ScreeningRequest
from service.jobs.screening.results import write_results
from service.records.database import open_database
from service.records.jobs import JobRecords
from service.settings import Settings
from training.activation import active_id

EACH, GRID = 5, 16
CONTACTS = {
    "LE": ContactConfiguration.at("LE"),
    "TE": ContactConfiguration.at("TE"),
    "both": ContactConfiguration.at("LE", "TE"),
    "mostly LE": ContactConfiguration({"LE": 1.0, "TE": 0.3}),
    "mostly TE": ContactConfiguration({"LE": 0.3, "TE": 1.0}),
}
DONE, PARTIAL = f"{1:032x}", f"{2:032x}"
PAGES = ("?limit=100", "?limit=1000&offset=50000", "?limit=100&contact=TE&offset=5000")


def make(data: Path, blades: int) -> None:
    """The two jobs; every chunk is that of the same blades under other numbers, with other K_e."""
    database = open_database(data)
    folders, records = JobFolders(data), JobRecords(database)
    request = ScreeningRequest(
        contacts=CONTACTS,
        map_shape=(GRID, GRID),
        ke_liner=9000.0,
        criteria=Criteria(least_margin=0.2),
        model=active_id(),
        blades_per_chunk=EACH,
    )
    lines = [BladeLine(i, f"blades[{i}]", document) for i, document in enumerate(variants(EACH))]
    first = compute_chunk(chunk_payload(request.to_dict(), lines, limits_of(Settings())))
    with np.load(io.BytesIO(first)) as npz:
        arrays = {name: npz[name] for name in npz.files}
    meta, rng = json.loads(arrays.pop("content").tobytes()), np.random.default_rng(1)
    # Where a page is made from does not depend on charts: they are in one chunk only, as weight.
    weight = np.frombuffer(first, dtype=np.uint8)

    def fill(folder: Path) -> None:
        store = ChunkStore(folder / "chunks")
        (folder / "request.json").write_text(json.dumps(request.to_dict()))
        (folder / blade_lines.FILE).write_bytes(b"")
        for number in range(blades // EACH):
            for i, entry in enumerate(meta["screened"]):
                entry["index"] = number * EACH + i
                entry["source"] = f"blades[{entry['index']}]"
                for result in entry["results"]:
                    result["row"]["smallest_unstable_ke"] = float(rng.uniform(1e3, 2.5e4))
            content = io.BytesIO()
            text = np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8)
            np.savez_compressed(content, content=text, weight=weight)
            store.put(number, content.getvalue())

    for job_id, state in ((DONE, State.DONE), (PARTIAL, State.CANCELLED)):
        folder = folders.make(job_id, fill)
        if state is State.DONE:
            write_results(folder, request)
        job = Job(job_id, SCREENING, created_at=datetime.now(UTC), total=blades, done=blades)
        records.add(replace(job, state=state, finished_at=datetime.now(UTC)))
        folders.unmark(job_id)
    database.close()


def peak_mib(service: ServiceProcess) -> float:
    """The largest resident memory of the service so far."""
    status = Path(f"/proc/{service.process.pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def measure(data: Path, job: str, name: str) -> None:
    """Print seconds of each page, first and again, and what the memory rose by."""
    quiet = {"min_free_bytes": 0, "run_jobs": 0, "audit_share_of_time": 0}
    with ServiceProcess(data, **quiet) as service, httpx.Client(timeout=600.0) as http:
        base = f"{service.url}/v1/screenings/{job}/results"
        before = peak_mib(service)
        for page in PAGES:
            times = []
            for _ in range(4):
                began = time.perf_counter()
                reply = http.get(base + page)
                times.append(time.perf_counter() - began)
                assert reply.status_code == 200, reply.text
            total = reply.json()["total"]
            print(f"{name:8} {page:36} of {total:6}: first {times[0]:7.3f} s, then {min(times[1:]):7.3f} s")
        print(f"{name:8} memory {before:.0f} MiB, at most {peak_mib(service):.0f} MiB")


def main() -> None:
    """Make the jobs where they are not there yet, and page through both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--blades", type=int, default=20_000)
    asked = parser.parse_args()
    if not (asked.folder / "jobs" / PARTIAL).is_dir():
        make(asked.folder, asked.blades)
    measure(asked.folder, DONE, "done")
    measure(asked.folder, PARTIAL, "partial")


if __name__ == "__main__":
    main()
