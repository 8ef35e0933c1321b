"""Where a job's files are, under the data folder.

jobs/ID/request.json          what was asked, the model's identifier included
jobs/ID/blades.jsonl          one blade or profile a line (screenings)
jobs/ID/chunks/NNNNNN-SHA.npz results as they come, named by their checksum (screenings)
jobs/ID/results.parquet       the ranking, once it is complete (screenings)
jobs/ID/log.jsonl             what was begun and what was stored, when
uploads/ID/                   files sent ahead
"""

from __future__ import annotations

import json
import shutil
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sdm_core.errors import DamagedFile
from service.jobs.durable_files import INCOMING, REMOVED, make_folder_durably, remove_folder

REQUEST, LOG = "request.json", "log.jsonl"
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
        """A new job's folder, whole or not at all; `fill` writes into the path it is given."""
        make_folder_durably(self.jobs / job_id, fill)
        return self.of(job_id)

    def remove(self, job_id: str) -> None:
        """Take a job's files away."""
        remove_folder(self.jobs / job_id)

    def sweep(self) -> None:
        """Remove what killed processes left half made or half removed."""
        before = time.time() - _LEFT_OVER_S
        for folder in (self.jobs, self.uploads):
            for path in folder.iterdir():
                if path.name.startswith(REMOVED) or (
                    path.name.startswith(INCOMING) and path.stat().st_mtime < before
                ):
                    shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)
