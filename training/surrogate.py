"""The classifier: probability that a case is unstable at a K_e, monotone in log K_e."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from training.cases import CaseBatch
from training.features import CaseTensors, Features, feature_count, features

_BATCH = 16_384


@dataclass(frozen=True)
class Architecture:
    """What is needed to rebuild the network.

    Attributes
    ----------
    width, blocks
        Size of the residual network.
    """

    width: int = 192
    blocks: int = 3

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class PredictedBoundary:
    """First crossing of each case as the surrogate sees it.

    Attributes
    ----------
    log_ke
        log10 of the critical K_e in N/m, shape (m,).
    spread
        Scale s of the logistic distribution of log10 K_e, shape (m,).
    log_reach
        log10 of the K_e up to which the design space goes, N/m, shape (m,); infinite where not said.
    """

    log_ke: np.ndarray
    spread: np.ndarray
    log_reach: np.ndarray | float = np.inf

    def unstable_probability(self, ke: np.ndarray) -> np.ndarray:
        """P(unstable) = logistic((log10 K_e − log10 K_critical)/s), shape (m,)."""
        return 1.0 / (1.0 + np.exp(-np.clip(self.score(ke), -60, 60)))

    def score(self, ke: np.ndarray) -> np.ndarray:
        """Distance to the boundary in spreads, positive above it, shape (m,)."""
        with np.errstate(divide="ignore"):
            return (np.log10(ke) - self.log_ke) / self.spread


class _Block(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.inner = nn.Linear(width, width)
        self.outer = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        return x + self.outer(nn.functional.silu(self.inner(self.norm(x))))


class BoundaryNetwork(nn.Module):
    """Residual network from features to (correction of the baseline, log spread).

    The unstable probability at K_e is logistic((log κ − baseline − correction)/spread): monotone
    in log K_e by construction, and its zero is the boundary.
    """

    mean: Tensor
    scale: Tensor

    def __init__(self, architecture: Architecture) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(feature_count()))
        self.register_buffer("scale", torch.ones(feature_count()))
        self.first = nn.Linear(feature_count(), architecture.width)
        self.body = nn.ModuleList(_Block(architecture.width) for _ in range(architecture.blocks))
        self.norm = nn.LayerNorm(architecture.width)
        self.last = nn.Linear(architecture.width, 2)

    def forward(self, inputs: Tensor) -> tuple[Tensor, Tensor]:
        x = self.first((inputs - self.mean) / self.scale)
        for block in self.body:
            x = block(x)
        correction, log_spread = self.last(self.norm(x)).unbind(dim=1)
        return correction, torch.clamp(log_spread - 3.0, -9.0, 1.0)


class Surrogate:
    """A trained network applied to cases."""

    def __init__(self, network: BoundaryNetwork, architecture: Architecture) -> None:
        self.network = network.eval()
        self.architecture = architecture

    def boundary(self, cases: CaseBatch) -> PredictedBoundary:
        """First crossing of each case, all K_e at once."""
        log_kappa, spread = [], []
        with torch.inference_mode():
            for i in range(0, len(cases), _BATCH):
                found = features(CaseTensors.of(cases[i : i + _BATCH]))
                correction, log_spread = self.correction(found)
                log_kappa.append((found.baseline + correction).numpy())
                spread.append(torch.exp(log_spread).double().numpy())
        log_scale = np.log10(cases.stiffness_scale)
        return PredictedBoundary(np.concatenate(log_kappa) + log_scale, np.concatenate(spread))

    def correction(self, found: Features) -> tuple[Tensor, Tensor]:
        """What is added to the baseline of cases, and the log spread, by their features; shape (m,) each."""
        correction, log_spread = self.network(found.inputs)
        return correction.double(), log_spread
