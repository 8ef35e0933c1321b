"""A method measured: every one gets the same labels and points, and as many of them verified."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.baselines.figures import Figures, judged
from benchmarks.baselines.samples import Labels, Trial
from training.cases import CaseBatch


class Fitted(Protocol):
    """What a method has learnt."""

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        """Positive where unstable, the nearer to zero the less certain; shape (m,)."""
        ...

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        """log10 κ of the first crossing, shape (m,)."""
        ...


class Method(Protocol):
    """A surrogate to be fitted."""

    @property
    def name(self) -> str: ...

    @property
    def inputs(self) -> str: ...

    def fit(self, labels: Labels) -> Fitted: ...


@dataclass(frozen=True)
class Measured:
    """A method at a number of labels.

    Attributes
    ----------
    fit_s, ten_thousand_s
        CPU seconds to fit, and to answer 10,000 points.
    memory
        Bytes on top of data and libraries at the peak; with `fit_s` NaN where nothing was fitted.
    """

    method: str
    inputs: str
    labels: int
    figures: Figures
    fit_s: float
    ten_thousand_s: float
    memory: float


def measured(method: Method, labels: Labels, trial: Trial) -> Measured:
    """Fit, answer, judge. Inputs are computed within the time; memory is what came on top at the peak.

    The processor's time counts: every method has one thread, and another program may want the machine.
    """
    with _peak_memory() as memory:
        start = time.process_time()
        fitted = method.fit(labels)
        fit_s = time.process_time() - start
        start = time.process_time()
        score = fitted.score(trial.cases, trial.log_kappa)
        took = time.process_time() - start
    figures = judged(score, fitted.boundary(trial.cases), trial)
    cost = (fit_s, took * 1e4 / len(trial), memory[0])
    if len(labels) == 0:
        cost = (np.nan, cost[1], np.nan)
    return Measured(method.name, method.inputs, len(labels), figures, *cost)


@contextmanager
def _peak_memory() -> Iterator[list[float]]:
    """Most resident memory within the block over that before it, bytes; NaN where there is no Linux /proc."""
    out = [float("nan")]
    reset = Path("/proc/self/clear_refs")
    if not reset.exists():
        yield out
        return
    reset.write_text("5")  # forgets the peak there was
    before = _status("VmRSS")
    yield out
    out[0] = _status("VmHWM") - before


def _status(name: str) -> float:
    line = next(s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith(name))
    return 1024.0 * float(line.split()[1])
