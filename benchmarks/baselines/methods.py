"""Generic surrogates: regressors of the boundary, and classifiers told log κ as one more input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from sklearn.feature_selection import VarianceThreshold
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from benchmarks.baselines.inputs import Encoding
from benchmarks.baselines.samples import Labels
from training.cases import CaseBatch

_SEED = 2013
# Verdicts a classifier is shown of each labelled case: anywhere a point may lie, and near the boundary.
_ANYWHERE, _NEAR, _NEAR_WIDTH, _LOWEST = 2, 2, 0.1, -4.0
_BISECTIONS = 14


class Estimator(Protocol):
    """A regressor of scikit-learn's manner, fitted to standardised columns."""

    def fit(self, x: np.ndarray, y: np.ndarray) -> Any: ...

    def predict(self, x: np.ndarray) -> np.ndarray: ...


Spread = Callable[[Any, np.ndarray], np.ndarray]
"""From a fitted estimator and standardised columns: what it thinks it may be wrong by, shape (m,)."""


@dataclass(frozen=True)
class Regression:
    """log10 κ of the first crossing from the inputs; a point is as certain as its distance is in spreads.

    Attributes
    ----------
    make
        A fresh estimator for a number of labels.
    spread
        None takes the same for all.
    """

    name: str
    inputs: str
    encoding: Encoding
    make: Callable[[int], Estimator]
    spread: Spread | None = None

    def fit(self, labels: Labels) -> FittedRegression:
        """A case without a crossing counts as one that has it at the end of the reach."""
        given = self.encoding(labels.cases)
        scaling = make_pipeline(VarianceThreshold(), StandardScaler()).fit(given.columns)
        target = np.minimum(labels.log_kappa, labels.reach) - given.start
        estimator = self.make(len(labels))
        estimator.fit(scaling.transform(given.columns), target)
        return FittedRegression(self, scaling, estimator)


@dataclass(frozen=True)
class FittedRegression:
    """A regressor at work."""

    method: Regression
    scaling: Pipeline
    estimator: Estimator

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        given = self.method.encoding(cases)
        found = self.estimator.predict(self.scaling.transform(given.columns))
        return given.start + np.asarray(found, dtype=float).ravel()

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        given = self.method.encoding(cases)
        columns = self.scaling.transform(given.columns)
        middle = given.start + np.asarray(self.estimator.predict(columns), dtype=float).ravel()
        spread = 1.0 if self.method.spread is None else self.method.spread(self.estimator, columns)
        return (log_kappa - middle) / np.maximum(spread, 1e-9)


@dataclass(frozen=True)
class Classification:
    """The verdict from the inputs and log10 κ above their start; four verdicts a label, all free."""

    name: str
    inputs: str
    encoding: Encoding
    make: Callable[[int], Any]

    def fit(self, labels: Labels) -> FittedClassification:
        given, rng = self.encoding(labels.cases), np.random.default_rng(_SEED)
        m = len(labels)
        crossing = np.minimum(labels.log_kappa, labels.reach)[:, None]
        anywhere = rng.uniform(_LOWEST, labels.reach, (m, _ANYWHERE))
        asked = np.concatenate([anywhere, crossing + _NEAR_WIDTH * rng.normal(size=(m, _NEAR))], axis=1)
        unstable = asked > labels.log_kappa[:, None]
        every = asked.shape[1]
        columns = np.c_[np.repeat(given.columns, every, axis=0), (asked - given.start[:, None]).ravel()]
        scaling = make_pipeline(VarianceThreshold(), StandardScaler()).fit(columns)
        classifier = self.make(len(asked.ravel()))
        classifier.fit(scaling.transform(columns), unstable.ravel())
        return FittedClassification(self, scaling, classifier, labels.reach)


@dataclass(frozen=True)
class FittedClassification:
    """A classifier at work."""

    method: Classification
    scaling: Pipeline
    classifier: Any
    reach: float

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        given = self.method.encoding(cases)
        return self._log_odds(np.c_[given.columns, log_kappa - given.start])

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        """Where the probability is a half, by bisection; a classifier that is not monotone has several."""
        given = self.method.encoding(cases)
        low, high = np.full(len(cases), _LOWEST - 1), np.full(len(cases), self.reach + 1)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            unstable = self._log_odds(np.c_[given.columns, middle - given.start]) > 0
            low, high = np.where(unstable, low, middle), np.where(unstable, middle, high)
        return 0.5 * (low + high)

    def _log_odds(self, columns: np.ndarray) -> np.ndarray:
        p = self.classifier.predict_proba(self.scaling.transform(columns))[:, 1]
        return np.log(np.maximum(p, 1e-300)) - np.log(np.maximum(1 - p, 1e-300))
