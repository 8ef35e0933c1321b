"""The run of a training: a process is started, listened to, and ended when it has to be."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from sdm_core.errors import InvalidInput
from service.jobs.control import Control
from service.jobs.durable_files import check_room
from service.jobs.errors import NoRoom
from service.jobs.job_folder import JobFolder
from service.jobs.training.process import RESULT

_LISTEN_S, _PATIENCE_S, _LAST_LINES = 0.5, 10.0, 5


class TrainingFailed(InvalidInput):
    """The training ended without a model."""


class TrainingKind:
    """Runs training jobs.

    Parameters
    ----------
    models_folder
        Where models go, and labels beside them.
    served_folder
        Where the service keeps its exact answers; None where it does not.
    reserve_bytes
        Room to leave on the disk.
    """

    def __init__(self, models_folder: Path, served_folder: Path | None, reserve_bytes: int = 0) -> None:
        self._models, self._served, self._reserve = models_folder, served_folder, reserve_bytes

    def run(self, folder: JobFolder, control: Control) -> None:
        """Train; after a kill, from the labels that are there.

        Raises
        ------
        InvalidInput
            What the training failed of.
        Cancelled, HandedBack
            As `Control.check`.
        """
        while not (folder.path / RESULT).is_file():
            control.until(self._room)
            fault = self._once(folder, control)
            if fault is not None and self._room() is None:
                raise fault
        control.report(stage="", now=True)

    def _once(self, folder: JobFolder, control: Control) -> InvalidInput | None:
        """One process; what went wrong, if anything."""
        command = [sys.executable, "-m", "service.jobs.training.process", str(folder.path)]
        command += [str(self._models), str(self._served or ""), str(os.getpid())]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        said: queue.SimpleQueue[str] = queue.SimpleQueue()
        complaints: list[str] = []
        listeners = [
            threading.Thread(target=_listen, args=(process.stdout, said.put), daemon=True),
            threading.Thread(target=_listen, args=(process.stderr, complaints.append), daemon=True),
        ]
        for listener in listeners:
            listener.start()
        fault: InvalidInput | None = None
        try:
            while True:
                ended = process.poll() is not None
                if ended:
                    for listener in listeners:
                        listener.join(_PATIENCE_S)
                fault = _heard(said, control) or fault
                if ended:
                    break
                control.sleep(_LISTEN_S)
        finally:
            _end(process)
        if process.returncode == 0:
            return None
        found = " ".join(complaints[-_LAST_LINES:]).strip()[-300:] or f"exit status {process.returncode}"
        return fault or TrainingFailed("training", found, "retry the job: it goes on from the labels kept")

    def _room(self) -> str | None:
        place = self._models if self._models.is_dir() else self._models.parent
        try:
            check_room(place, 0, self._reserve)
        except NoRoom as full:
            return f"room on the disk: {full}"
        return None


def _listen(stream: Any, tell: Any) -> None:
    for line in stream:
        tell(line)


def _heard(said: queue.SimpleQueue[str], control: Control) -> InvalidInput | None:
    """Pass on how far it is; the error it told of, if any."""
    fault = None
    while not said.empty():
        try:
            told = json.loads(said.get())
        except ValueError:
            continue
        if "error" in told:
            fault = TrainingFailed(**told["error"])
        elif "stage" in told:
            stage = f"{told['stage']} {told['remark']}".strip()[:200]
            control.report(done=int(told["done"]), total=int(told["of"]), stage=stage)
    return fault


def _end(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
