"""Labels from the exact core, in parallel."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed

import numpy as np
from threadpoolctl import threadpool_limits

from sdm_core.closed_form import crossings
from sdm_core.errors import RubscreenError
from sdm_core.receptance import Sweep, swept
from sdm_core.root_count import unstable_root_count
from training.cases import CaseBatch

KAPPA_MAX = 4.0
_CHUNK = 512
_AUDIT_EVERY = 16  # every so many labels, the root count must confirm the closed form

Progress = Callable[[int, int], None]


class LabelAuditFailed(RubscreenError):
    """Two exact methods disagree: a defect of the core, never to be trained on."""


def critical_kappa(cases: CaseBatch, *, workers: int = 2, progress: Progress | None = None) -> np.ndarray:
    """κ of the first crossing of each case, infinite where there is none up to `KAPPA_MAX`.

    Closed form; one label in sixteen is audited by the root count on both sides.

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
    out = np.full(len(cases), np.inf)
    sweep: Sweep | None = None
    for i in range(len(cases)):
        ke_max = KAPPA_MAX * scale[i]
        same = i > 0 and all(
            np.array_equal(getattr(cases, name)[i], getattr(cases, name)[i - 1])
            for name in ("omega", "damping_ratio", "contact_matrix")
        )
        if not same:
            receptance = cases.receptance(i)
            sweep = swept(receptance, ke_max)
        found = crossings(receptance, cases.speed_hz[i], ke_max, sweep=sweep, first_only=True)
        if len(found.ke):
            out[i] = found.ke[0] / scale[i]
        if i % _AUDIT_EVERY == 0:
            first = found.ke[0] if len(found.ke) else ke_max
            count = unstable_root_count(receptance, cases.speed_hz[i], first * np.array([1 - 1e-4, 1 + 1e-4]))
            if count[0] != 0 or (len(found.ke) and not count[1] > 0):
                raise LabelAuditFailed(
                    f"closed form says {first:g} N/m, root counts are {count} in {cases[i : i + 1]}"
                )
    return out
