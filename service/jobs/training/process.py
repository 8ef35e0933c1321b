"""One training in a process of its own: ``python -m service.jobs.training.process`` with the job's folder.

It tells how far it is in lines of JSON on standard output, writes ``result.json`` at the end, and leaves when
the service that started it has gone. Labels are kept as they come, so the next process goes on from them.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from sdm_core.errors import InvalidInput
from sdm_core.parallel import leave_with
from service.jobs.durable_files import write_durably
from service.jobs.training.request import TrainingRequest

RESULT = "result.json"
_NICE = 10


def main(folder: Path, models_folder: Path, served_folder: Path | None, parent: int) -> int:
    """Train as the folder's request says; the exit status."""
    leave_with(parent)
    if hasattr(os, "nice"):
        os.nice(_NICE)  # behind what answers people
    from training.certificate import CalibrationFailed
    from training.pipeline import train

    request = TrainingRequest.from_dict(json.loads((folder / "request.json").read_bytes()))
    try:
        made = train(
            models_folder,
            request.settings(),
            served_folder=served_folder if request.with_served else None,
            activate=request.promote,
            progress=lambda stage, done, of, remark: _tell(stage=stage, done=done, of=of, remark=remark),
        )
    except InvalidInput as error:
        _tell(error={"field": error.field, "value": error.value, "remedy": error.remedy})
        return 1
    except CalibrationFailed as error:
        _tell(
            error={"field": "training", "value": str(error), "remedy": "give it more cases, epochs or points"}
        )
        return 1
    result = {
        "model": made.model.id,
        "promoted": request.promote and not made.refused,
        "refused": list(made.refused),
        "seconds": made.seconds,
        "evaluation": {contact: found.to_dict() for contact, found in made.evaluations.items()},
    }
    write_durably(folder / RESULT, json.dumps(result, indent=1).encode())
    return 0


def _tell(**said: Any) -> None:
    print(json.dumps(said), flush=True)


if __name__ == "__main__":
    given, models, served, started_by = sys.argv[1:]
    sys.exit(main(Path(given), Path(models), Path(served) if served else None, int(started_by)))
