"""Where a job's files are, under the data folder.

jobs/ID/request.json          what was asked, the model's identifier included
jobs/ID/blades.jsonl          one blade or profile a line (screenings)
jobs/ID/chunks/NNNNNN-SHA.npz results as they come, named by their checksum (screenings, simulations)
jobs/ID/results.parquet       the ranking, once it is complete (screenings)
jobs/ID/log.jsonl             what was begun and what was stored, when
uploads/ID/                   files sent ahead
scratch/                      what the workers of this machine put aside; dask clears it up
"""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sdm_core.errors import DamagedFile
from service.jobs.durable_files import INCOMING, REMOVED, make_folder_durably, remove_folder

REQUEST, LOG = "request.json", "log.jsonl"
SCRATCH = "scratch"
# A folder with this file in it may be deleted when no row names the job. One without is never deleted for
# want of a row: the folder may only have been given another database.
_UNLISTED = ".unlisted"
_ID = re.compile(r"[0-9a-f]{32}")
# What a killed process leaves half made is swept away after this time, s.
_LEFT_OVER_S = 3600.0


class JobFolder:
    """The files of one job."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def chunks(self) -> Path:
        """Where results are stored as they come."""
        return self.path / "chunks"

    def request(self) -> dict[str, Any]:
        """What was asked.

        Raises
        ------
        DamagedFile
            When it cannot be read.
        """
        try:
            return json.loads((self.path / REQUEST).read_bytes())
        except (OSError, ValueError) as error:
            remedy = f"restore it from a backup, or send the request again ({error})"
            raise DamagedFile("job", str(self.path / REQUEST), remedy) from None

    def note(self, **entry: Any) -> None:
        """A line in the job's log; a full disk costs the line."""
        line = json.dumps({"at": datetime.now(UTC).isoformat(timespec="milliseconds"), **entry})
        try:
            with (self.path / LOG).open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError:
            pass

    def notes(self) -> list[dict[str, Any]]:
        """The log; a line cut off by a kill or a full disk is left out."""
        try:
            lines = (self.path / LOG).read_text(encoding="utf-8").splitlines()
        except OSError:
            return []
        out = []
        for line in lines:
            try:
                out.append(json.loads(line))
            except ValueError:
                continue
        return out


class JobFolders:
    """The folders of every job, and the uploads, under the data folder."""

    def __init__(self, data_folder: Path) -> None:
        self.jobs, self.uploads = data_folder / "jobs", data_folder / "uploads"
        for folder in (self.jobs, self.uploads):
            folder.mkdir(parents=True, exist_ok=True)

    def of(self, job_id: str) -> JobFolder:
        """The folder of a job, there or not."""
        return JobFolder(self.jobs / job_id)

    def make(self, job_id: str, fill: Any) -> JobFolder:
        """A new job's folder, whole or not at all and marked; `fill` writes into the path it is given."""

        def filled(path: Path) -> None:
            fill(path)
            (path / _UNLISTED).touch()

        make_folder_durably(self.jobs / job_id, filled)
        return self.of(job_id)

    def mark(self, job_id: str) -> None:
        """Let a job's folder be deleted later, should its row be gone then."""
        with suppress(FileNotFoundError):
            (self.jobs / job_id / _UNLISTED).touch()

    def unmark(self, job_id: str) -> None:
        """The job has a row."""
        (self.jobs / job_id / _UNLISTED).unlink(missing_ok=True)

    def remove(self, job_id: str) -> None:
        """Take a job's files away."""
        remove_folder(self.jobs / job_id)

    def sweep(self) -> None:
        """Remove what killed processes left half made or half removed."""
        before = time.time() - _LEFT_OVER_S
        for folder in (self.jobs, self.uploads):
            for path in folder.iterdir():
                if path.name.startswith(REMOVED) or (path.name.startswith(INCOMING) and _older(path, before)):
                    shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)

    def sweep_marked(self, known: Callable[[list[str]], set[str]]) -> None:
        """Remove folders that were marked a while ago and whose job has no row.

        Parameters
        ----------
        known
            Those of some jobs that have one.
        """
        before = time.time() - _LEFT_OVER_S
        marked = [
            path.name
            for path in self.jobs.iterdir()
            if _ID.fullmatch(path.name) and _older(path / _UNLISTED, before)
        ]
        there = known(marked)
        for job_id in marked:
            self.unmark(job_id) if job_id in there else self.remove(job_id)


def _older(path: Path, before: float) -> bool:
    """Whether it was last changed before; not when it is gone."""
    try:
        return path.stat().st_mtime < before
    except FileNotFoundError:
        return False
