"""A folder of a hundred profiles screened by one command: from shapes to a ranked report."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

from rich.table import Table

from benchmarks.blade_family import write_family

FOLDER, REPORT = Path("out/bench/profiles"), Path("out/bench/profiles.html")
RESULTS = Path("out/bench/profiles_report.json")
BLADES = 100


def table() -> Table:
    """Write the profiles, run `rubscreen screen`, and tell what came of them."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    write_family(FOLDER, BLADES)
    command = [sys.executable, "-m", "service.cli", "screen", str(FOLDER), "--ke-liner", "9000"]
    started = time.perf_counter()
    done = subprocess.run([*command, "--html", str(REPORT), "--json", str(RESULTS)], check=False)
    seconds = time.perf_counter() - started
    report = json.loads(RESULTS.read_text())
    out = Table(title=f"{BLADES} profiles, shape to verdict, one command", title_justify="left")
    for heading in ("exit code", "minutes", "blades screened", "failures", "report MB", "peak GiB"):
        out.add_column(heading, justify="right")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    out.add_row(
        str(done.returncode),
        f"{seconds / 60:.1f}",
        str(len(report["blades"])),
        str(len(report["failures"])),
        f"{REPORT.stat().st_size / 1e6:.1f}",
        f"{peak:.2f}",
    )
    out.caption = "\n".join(f"{each['source']}: {each['reason']}" for each in report["failures"])
    return out
