"""One chunk of a screening, computed in a worker process: bytes in, bytes out, and no state but the model."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from sdm_core.errors import Cancelled, RubscreenError
from service.jobs.modesty import be_modest
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.checks import check_fit, check_line
from service.jobs.screening.chunk_content import ChunkContent, ScreenedBlade, UnscreenedBlade
from service.jobs.screening.request import ScreeningRequest
from service.jobs.wanted import while_wanted
from service.screening.batch import Failure
from service.screening.screen import screen
from service.settings import Settings
from training.registry import SHIPPED
from training.screening import Screener

logger = logging.getLogger("rubscreen.jobs")


def chunk_payload(request: dict[str, Any], blades: Sequence[BladeLine], limits: dict[str, Any]) -> bytes:
    """What `compute_chunk` is given."""
    return json.dumps(
        {"request": request, "blades": [b.to_dict() for b in blades], "limits": limits}
    ).encode()


def compute_in_worker(payload: bytes) -> bytes:
    """As `compute_chunk`, in a process for that alone: on one thread, and behind what answers people.

    Raises
    ------
    Cancelled
        When nobody waits for it any more.
    """
    be_modest()
    _on_one_thread()
    with while_wanted():
        return compute_chunk(payload)


def compute_chunk(payload: bytes) -> bytes:
    """Screen the blades of a chunk; what is wrong with a blade is noted, and stops none of the others.

    Returns
    -------
    A `ChunkContent` as bytes.

    Raises
    ------
    InvalidInput
        When the model cannot be loaded.
    Cancelled
        When the surrounding `interruptible` block wants it to stop.
    """
    asked = json.loads(payload)
    request = ScreeningRequest.from_dict(asked["request"])
    limits = Settings.model_construct(**asked["limits"])
    screener = _screener(request.models_folder, request.model)
    screened, unscreened = [], []
    for entry in asked["blades"]:
        line = BladeLine(**entry)
        try:
            screened.append(_screened(line, request, screener, limits))
        except Cancelled:  # not a fault of the blade
            raise
        except RubscreenError as error:
            unscreened.append(_unscreened(line, Failure.of(line.source, error).reason))
        except Exception as error:  # a fault of ours with one blade must not cost the others
            logger.exception("blade %s", line.source)
            unscreened.append(_unscreened(line, f"unexpected {type(error).__name__}: {error}"[:300]))
    return ChunkContent(tuple(screened), tuple(unscreened)).to_bytes()


def _screened(
    line: BladeLine, request: ScreeningRequest, screener: Screener, limits: Settings
) -> ScreenedBlade:
    check_line(line, request, limits)
    blade = line.blade()
    if line.profile:  # its modes are known only now
        check_fit(blade, request, limits)
    report = screen(
        [blade],
        request.contacts_of(blade),
        screener,
        speed_range=request.speeds(),
        ke_max=request.ke_max,
        ke_liner=request.ke_liner,
        map_shape=request.map_shape,
        policy=request.policy,
        alpha=request.alpha,
    )
    order = list(request.contacts_of(blade))
    results = sorted(report.results, key=lambda result: order.index(result.contact_name))
    return ScreenedBlade(line.index, line.source, blade, tuple(results))


def _unscreened(line: BladeLine, reason: str) -> UnscreenedBlade:
    return UnscreenedBlade(line.index, line.source, line.name, reason)


@lru_cache(maxsize=2)
def _screener(models_folder: str | None, model: str | None) -> Screener:
    if model is None:
        return Screener(None)
    return Screener.default(SHIPPED if models_folder is None else Path(models_folder), model)


@cache
def _on_one_thread() -> None:
    """Once a process."""
    import torch

    torch.set_num_threads(1)
