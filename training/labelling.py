"""Labels from the exact core, in parallel."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed

import numpy as np
from threadpoolctl import threadpool_limits

from sdm_core.contact import Segment
from sdm_core.errors import RubscreenError
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade
from training.cases import CaseBatch

KAPPA_MAX = 4.0
_CHUNK = 512

Progress = Callable[[int, int], None]


class LabelAuditFailed(RubscreenError):
    """Two exact methods disagree: a defect of the core, never to be trained on."""


def critical_kappa(cases: CaseBatch, *, workers: int = 2, progress: Progress | None = None) -> np.ndarray:
    """κ of the first crossing of each case, infinite where there is none up to `KAPPA_MAX`.

    Closed form, every label proven by the root count on both sides.

    Parameters
    ----------
    cases
        Neighbouring cases with the same modes share one sweep.
    workers
        Processes.

    Raises
    ------
    LabelAuditFailed
        When the closed form and the root count disagree.
    """
    starts = range(0, len(cases), _CHUNK)
    chunks = [cases[i : i + _CHUNK] for i in starts]
    out = np.empty(len(cases))
    done = 0
    if workers <= 1:
        for start, chunk in zip(starts, chunks, strict=True):
            out[start : start + len(chunk)] = _label_chunk(chunk)
            done += len(chunk)
            if progress is not None:
                progress(done, len(cases))
        return out
    context = multiprocessing.get_context("spawn")  # a forked torch or BLAS may hang
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        jobs = {pool.submit(_label_chunk, chunk): start for start, chunk in zip(starts, chunks, strict=True)}
        for job in as_completed(jobs):
            labels = job.result()
            out[jobs[job] : jobs[job] + len(labels)] = labels
            done += len(labels)
            if progress is not None:
                progress(done, len(cases))
    return out


def _label_chunk(cases: CaseBatch) -> np.ndarray:
    with threadpool_limits(1):
        return _labels(cases)


def _labels(cases: CaseBatch) -> np.ndarray:
    scale = cases.stiffness_scale
    found = permanent_crossings([_problem(cases, i) for i in range(len(cases))], KAPPA_MAX * scale)
    for i, crossings in enumerate(found):
        if not crossings.proven:
            raise LabelAuditFailed(
                f"closed form says {crossings.ke[:1]} N/m, the root count contradicts, in {cases[i : i + 1]}"
            )
    return np.array([c.ke[0] / s if len(c.ke) else np.inf for c, s in zip(found, scale, strict=True)])


def _problem(cases: CaseBatch, i: int) -> RubbingBlade:
    receptance = cases.receptance(i)
    return RubbingBlade(
        receptance.omega,
        receptance.damping_ratio,
        receptance.factor.T,
        float(cases.speed_hz[i]),
        0.0,
        None,
        (Segment(1.0, True),),
    )
