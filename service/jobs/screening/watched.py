"""What is told of the answers in stored chunks: who gave them, and the confident ones for the audit."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from service.jobs.screening.chunk_content import ChunkContent
from service.screening.screen import ScreeningResult
from training.answers import CONFIDENT, SURROGATE
from training.confident_answers import ConfidentAnswers

OnStored = Callable[[bytes], None]
logger = logging.getLogger("rubscreen.jobs")


def watching(count: Callable[[ScreeningResult], None], draw: Callable[[ConfidentAnswers], None]) -> OnStored:
    """What is to be called with each chunk that was stored; a fault of it costs no chunk.

    Parameters
    ----------
    count
        Told of every result.
    draw
        Told of the answers that the surrogate gave unverified under a certificate.
    """

    def watch(content: bytes) -> None:
        try:
            for blade in ChunkContent.from_bytes(content).screened:
                for result in blade.results:
                    count(result)
                    confident = confident_answers(result)
                    if confident is not None and len(confident):
                        draw(confident)
        except Exception:
            logger.exception("a stored chunk is neither counted nor audited")

    return watch


def confident_answers(result: ScreeningResult) -> ConfidentAnswers | None:
    """Of a result's map, what the surrogate answered unverified; None without a certificate."""
    found = result.map
    if found.certificate is None or found.model is None:
        return None
    sure = (found.source == SURROGATE) & (found.reason == CONFIDENT) & np.isfinite(found.stable)
    row, column = np.nonzero(sure)
    return ConfidentAnswers(
        result.blade,
        result.contact,
        found.speed_hz[column],
        found.ke[row],
        found.stable[row, column] == 1.0,
        found.model,
        found.certificate.alpha,
    )
