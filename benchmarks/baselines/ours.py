"""Our network and fit beside the others, and what it starts from: the lobes by themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import nn

from benchmarks.baselines.inputs import Encoding, Inputs, lobes
from benchmarks.baselines.samples import Labels
from training.cases import CaseBatch
from training.fit import FitSettings, Prepared, fit, train_network
from training.registry import load_model
from training.surrogate import BoundaryNetwork, Surrogate

_SEED = 2013
_STEPS_AN_EPOCH = 50


def settings(labels: int) -> FitSettings:
    """Those of training, but batches small enough that few labels give as many steps as many do."""
    default = FitSettings(device="cpu")
    return replace(default, batch=min(default.batch, max(16, labels // _STEPS_AN_EPOCH)))


@dataclass(frozen=True)
class Ours:
    """The shipped architecture, features and fit."""

    name: str = "rubscreen"
    inputs: str = "lobes"

    def fit(self, labels: Labels) -> FittedSurrogate:
        surrogate = fit(labels.cases, 10.0**labels.log_kappa, settings(len(labels)), seed=_SEED)
        return FittedSurrogate(surrogate)


@dataclass(frozen=True)
class Shipped:
    """The active model of a folder as it is served; it uses no label of the comparison."""

    models: Path
    name: str = "rubscreen, shipped"
    inputs: str = "lobes"

    def fit(self, labels: Labels) -> FittedSurrogate:
        return FittedSurrogate(load_model(folder=self.models).surrogate)

    @property
    def labels(self) -> int:
        """How many it was trained with, of both classes of contact."""
        return int(load_model(folder=self.models).card["dataset"]["labels"])


@dataclass(frozen=True)
class FittedSurrogate:
    """A surrogate at work."""

    surrogate: Surrogate

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        return self.surrogate.boundary(cases).score(10.0**log_kappa * cases.stiffness_scale)

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        return self.surrogate.boundary(cases).log_ke - np.log10(cases.stiffness_scale)


@dataclass(frozen=True)
class OurNetwork:
    """Our network, loss and fit with other inputs."""

    inputs: str
    encoding: Encoding
    name: str = "our network"

    def fit(self, labels: Labels) -> FittedNetwork:
        given, s = self.encoding(labels.cases), settings(len(labels))
        # Where there is no start, from the mean: the first correction of a network is close to nothing.
        level = float(np.mean(np.minimum(labels.log_kappa, labels.reach) - given.start))
        data = Prepared(
            torch.from_numpy(given.columns).float(),
            torch.from_numpy(given.start + level),
            torch.from_numpy(np.array(labels.log_kappa)),
            torch.full((len(labels),), labels.reach, dtype=torch.float64),
        )
        torch.manual_seed(_SEED)
        network = BoundaryNetwork(s.architecture)
        network.first = nn.Linear(data.inputs.shape[1], s.architecture.width)
        network.mean = data.inputs.mean(dim=0)
        network.scale = data.inputs.std(dim=0).clamp(min=1e-3)
        train_network(network, data, s, seed=_SEED)
        return FittedNetwork(network, self.encoding, level)


@dataclass(frozen=True)
class FittedNetwork:
    """It at work."""

    network: BoundaryNetwork
    encoding: Encoding
    level: float

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        middle, spread = self._answer(cases)
        return (log_kappa - middle) / spread

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        return self._answer(cases)[0]

    def _answer(self, cases: CaseBatch) -> tuple[np.ndarray, np.ndarray]:
        given: Inputs = self.encoding(cases)
        with torch.inference_mode():
            correction, log_spread = self.network(torch.from_numpy(given.columns).float())
        middle = given.start + self.level + correction.double().numpy()
        return middle, torch.exp(log_spread).double().numpy()


@dataclass(frozen=True)
class LobesAlone:
    """The lowest exact lobe of any mode by itself: no network and no label."""

    name: str = "lobes alone"
    inputs: str = "lobes"

    def fit(self, labels: Labels) -> LobesAlone:
        return self

    def score(self, cases: CaseBatch, log_kappa: np.ndarray) -> np.ndarray:
        return log_kappa - self.boundary(cases)

    def boundary(self, cases: CaseBatch) -> np.ndarray:
        return lobes(cases).start
