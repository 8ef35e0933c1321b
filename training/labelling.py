"""Labels from the exact core, in parallel: first crossings of cases, verdicts of points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from sdm_core.errors import RubscreenError
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.parallel import shared
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from training.arc_labels import crossings_by_verdicts
from training.cases import CaseBatch
from training.design_space import DesignSpace
from training.features import CaseTensors, features

_CHUNK = 512
_ABOVE_FIRST = 1.05

Progress = Callable[[int, int], None]
_Call = tuple[Callable[..., np.ndarray], tuple[Any, ...]]


class LabelAuditFailed(RubscreenError):
    """Two exact methods disagree: a defect of the core, never to be trained on."""


def critical_kappa(
    cases: CaseBatch,
    space: DesignSpace | None = None,
    *,
    workers: int = 2,
    progress: Progress | None = None,
) -> np.ndarray:
    """κ of the first crossing of each case, infinite where there is none up to the space's largest κ.

    In permanent contact by the closed form, every label proven by the root count on both sides; with arcs
    by verdicts about the guess of the features' baseline (`crossings_by_verdicts`), NaN where one of them
    was not decided.

    Parameters
    ----------
    cases
        Neighbouring cases in permanent contact with the same modes share one sweep.
    workers
        Processes.

    Raises
    ------
    LabelAuditFailed
        When the closed form and the root count disagree.
    """
    space = space or DesignSpace()
    out = np.empty(len(cases))
    permanent = cases.permanent
    jobs = [
        (label, rows[i : i + _CHUNK], limit)
        for label, rows, limit in (
            (_with_arcs, np.flatnonzero(~permanent), space.largest_kappa_with_arcs),
            (_permanent, np.flatnonzero(permanent), space.largest_kappa),
        )
        for i in range(0, len(rows), _CHUNK)
    ]
    calls = [(label, (cases[rows], limit)) for label, rows, limit in jobs]
    done = 0
    for i, labels in shared(_run, calls, workers):
        out[jobs[i][1]] = labels
        done += len(labels)
        if progress is not None:
            progress(done, len(cases))
    return out


def point_verdicts(
    cases: CaseBatch, ke: np.ndarray, *, workers: int = 2, progress: Progress | None = None
) -> np.ndarray:
    """1.0 stable, 0.0 unstable, NaN not decided, at one K_e (N/m) of each case; shape (m,).

    By counting multipliers outside the unit circle: an eighth of the cost of a first crossing.
    """
    out = np.empty(len(cases))
    rows = [np.arange(i, min(i + _CHUNK, len(cases))) for i in range(0, len(cases), _CHUNK)]
    done = 0
    for i, found in shared(_run, [(_verdicts, (cases[r], ke[r])) for r in rows], workers):
        out[rows[i]] = found
        done += len(found)
        if progress is not None:
            progress(done, len(cases))
    return out


def truth(
    cases: CaseBatch, ke: np.ndarray, *, workers: int = 2, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Exact first crossings, N/m, and which points (case, K_e in N/m) are unstable; shape (m,) each.

    In permanent contact the first crossing decides. With arcs stability may return above it, so that every
    point gets a verdict of its own; one that is not decided counts as unstable.
    """
    critical = critical_kappa(cases, workers=workers, progress=progress) * cases.stiffness_scale
    unstable, arcs = ke > critical, ~cases.permanent
    if arcs.any():
        unstable[arcs] = point_verdicts(cases[arcs], ke[arcs], workers=workers) != 1.0
    return critical, unstable


def _run(call: _Call) -> np.ndarray:
    solve, args = call
    with threadpool_limits(1):
        return solve(*args)


def _permanent(cases: CaseBatch, largest_kappa: float) -> np.ndarray:
    scale = cases.stiffness_scale
    problems = [cases.problem(i) for i in range(len(cases))]
    found = permanent_crossings(problems, largest_kappa * scale)
    # One of tens of thousands is not proven for a crossing far above the first, which is all a label needs.
    doubtful = [i for i, crossings in enumerate(found) if not crossings.proven]
    for i in doubtful:
        near = _ABOVE_FIRST * found[i].ke[0] if len(found[i].ke) else largest_kappa * scale[i]
        found[i] = permanent_crossings([problems[i]], np.array([near]))[0]
        if not found[i].proven:
            raise LabelAuditFailed(
                f"closed form says {found[i].ke[:1]} N/m, the root count contradicts, in {cases[i : i + 1]}"
            )
    return np.array([c.ke[0] / s if len(c.ke) else np.inf for c, s in zip(found, scale, strict=True)])


def _with_arcs(cases: CaseBatch, largest_kappa: float) -> np.ndarray:
    guess = features(CaseTensors.of(cases)).baseline.numpy()
    problems = [cases.problem(i) for i in range(len(cases))]
    return crossings_by_verdicts(problems, guess, cases.stiffness_scale, largest_kappa)


def _verdicts(cases: CaseBatch, ke: np.ndarray) -> np.ndarray:
    problems = [cases.problem(i).with_ke(float(k)) for i, k in enumerate(ke)]
    return batch_multipliers(problems, dominant=False, workers=1).stable
