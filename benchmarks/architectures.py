"""Networks side by side: same features, labels, loss and epochs; one for both classes of contact, or two."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch
from rich.table import Table
from torch import Tensor, nn

from training.cases import MODES, CaseBatch
from training.contact_class import ARCS, PERMANENT
from training.design_space import DesignSpace
from training.features import MODE_FEATURES, feature_count
from training.fit import FitSettings, Prepared, train_network
from training.labelling import critical_kappa
from training.learn_then_test import binomial_p_value
from training.reference_space import reference_sample
from training.seeds import seed_for
from training.space_filling import space_filling
from training.surrogate import Architecture, BoundaryNetwork, PredictedBoundary, Surrogate

SPEEDS_EACH = {PERMANENT: 6, ARCS: 2}


class Plain(nn.Module):
    """Layers one after the other, nothing added up and nothing normed."""

    mean: Tensor
    scale: Tensor

    def __init__(self, width: int, layers: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(feature_count()))
        self.register_buffer("scale", torch.ones(feature_count()))
        sizes = [feature_count(), *[width] * layers]
        self.body = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(sizes))
        self.last = nn.Linear(width, 2)

    def forward(self, inputs: Tensor) -> tuple[Tensor, Tensor]:
        x = (inputs - self.mean) / self.scale
        for layer in self.body:
            x = nn.functional.silu(layer(x))
        correction, log_spread = self.last(x).unbind(dim=1)
        return correction, torch.clamp(log_spread - 3.0, -9.0, 1.0)


class Attention(nn.Module):
    """Modes as a set of five tokens, each with its own features, its correlations and those of the case."""

    mean: Tensor
    scale: Tensor

    def __init__(self, width: int, layers: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(feature_count()))
        self.register_buffer("scale", torch.ones(feature_count()))
        own, pairs = len(MODE_FEATURES), MODES * (MODES - 1) // 2
        self.case_size = feature_count() - MODES * own - pairs
        self.first = nn.Linear(own + MODES + self.case_size, width)
        self.place = nn.Parameter(0.02 * torch.randn(MODES, width))
        layer = nn.TransformerEncoderLayer(
            width, 4, 2 * width, dropout=0.0, activation="gelu", batch_first=True, norm_first=True
        )
        self.body = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)
        self.norm = nn.LayerNorm(width)
        self.last = nn.Linear(width, 2)
        self.lower = torch.tril_indices(MODES, MODES, offset=-1)

    def forward(self, inputs: Tensor) -> tuple[Tensor, Tensor]:
        x = (inputs - self.mean) / self.scale
        own, pairs, case = x.split([MODES * len(MODE_FEATURES), self.lower.shape[1], self.case_size], dim=1)
        across = x.new_zeros(len(x), MODES, MODES)
        across[:, self.lower[0], self.lower[1]] = pairs
        across = across + across.transpose(1, 2)
        of_mode = own.view(len(x), len(MODE_FEATURES), MODES).transpose(1, 2)
        tokens = torch.cat([of_mode, across, case[:, None, :].expand(-1, MODES, -1)], dim=2)
        felt = self.body(self.first(tokens) + self.place)
        correction, log_spread = self.last(self.norm(felt[:, 0])).unbind(dim=1)
        return correction, torch.clamp(log_spread - 3.0, -9.0, 1.0)


def _residual(width: int, blocks: int) -> nn.Module:
    return BoundaryNetwork(Architecture(width, blocks))


CHOICES: dict[str, tuple[bool, Callable[[], nn.Module]]] = {
    "plain, 5 layers of 256": (False, lambda: Plain(256, 5)),
    "residual, 3 blocks of 192": (False, lambda: _residual(192, 3)),
    "residual, 4 blocks of 256": (False, lambda: _residual(256, 4)),
    "attention over modes, 3 layers of 64": (False, lambda: Attention(64, 3)),
    "residual, 3 blocks of 192, two networks": (True, lambda: _residual(192, 3)),
}


@dataclass(frozen=True)
class Data:
    """Labelled cases to train on, and unseen points of the reference space, by class of contact."""

    train: dict[str, tuple[CaseBatch, np.ndarray]]
    unseen: dict[str, tuple[CaseBatch, np.ndarray, np.ndarray]]

    @classmethod
    def made(cls, cases: int, points: int, workers: int = 2) -> Data:
        """Drawn and labelled: `cases` to train on and `points` unseen of each class."""
        space, train, unseen = DesignSpace(), {}, {}
        for contact, each in SPEEDS_EACH.items():
            batch = space_filling(space, cases // each, each, seed_for("architectures", 1), contact)
            train[contact] = batch, critical_kappa(batch, workers=workers)
            sample = reference_sample(points, seed_for("architectures, unseen", 1), contact)
            kappa = critical_kappa(sample.cases, workers=workers)
            unseen[contact] = sample.cases, sample.ke, kappa
        return cls(train, unseen)


def table(cases: int = 98_304, points: int = 30_000, epochs: int = 15, data: Data | None = None) -> Table:
    """One line an architecture and class of contact."""
    data = data or Data.made(cases, points)
    out = Table(
        title=f"{len(data.train)} × {len(data.train[ARCS][1]):,} labels, {epochs} epochs; "
        f"{points:,} unseen points of the reference space each, the surrogate alone",
        caption="to verify: least share of points, the least certain first, that proves a false-stable rate "
        "below 1e-3 with 95 % confidence on these points",
    )
    for column in ("network", "parameters", "s an epoch", "contact"):
        out.add_column(column, justify="left" if column in ("network", "contact") else "right")
    for column in ("median error", "p99 error", "wrong", "to verify"):
        out.add_column(column, justify="right")
    for name, (apart, make) in CHOICES.items():
        lines = _lines(name, apart, make, data, epochs)
        for line in lines:
            out.add_row(*line)
            print(" | ".join(line), flush=True)
        out.add_section()
    return out


def _lines(
    name: str, apart: bool, make: Callable[[], nn.Module], data: Data, epochs: int
) -> list[tuple[str, ...]]:
    settings = replace(FitSettings(), epochs=epochs)
    groups = [[c] for c in data.train] if apart else [list(data.train)]
    lines = []
    for group in groups:
        cases = CaseBatch.concatenate([data.train[c][0] for c in group])
        kappa = np.concatenate([data.train[c][1] for c in group])
        prepared = Prepared.of(cases, kappa, DesignSpace(), torch.device("cpu"))
        torch.manual_seed(1)
        network = make()
        network.mean.copy_(prepared.inputs.mean(dim=0))  # type: ignore[operator]
        network.scale.copy_(prepared.inputs.std(dim=0).clamp(min=1e-3))  # type: ignore[operator]
        start = time.perf_counter()
        train_network(network, prepared, settings, seed=1)
        took = (time.perf_counter() - start) / epochs
        surrogate = Surrogate(network, Architecture())  # type: ignore[arg-type]
        size = sum(p.numel() for p in network.parameters())
        for contact in group:
            found = figures(surrogate.boundary(data.unseen[contact][0]), *data.unseen[contact])
            lines.append((name, f"{size:,}", f"{took:.1f}", contact, *found))
    return lines


def figures(
    boundary: PredictedBoundary, cases: CaseBatch, ke: np.ndarray, kappa: np.ndarray
) -> tuple[str, str, str, str]:
    """Median and 99th percentile of the boundary error, share of wrong verdicts, share to verify."""
    critical = kappa * cases.stiffness_scale
    error = np.abs(10.0**boundary.log_ke / critical - 1)
    error = np.where(np.isinf(critical), 0.0, error)
    unstable, score = ke > critical, boundary.score(ke)
    wrong = (score > 0) != unstable
    order = np.argsort(np.abs(score))
    share = np.nan
    for candidate in np.arange(0.0, 0.3, 0.0025):
        kept = order[int(candidate * len(order)) :]
        stable = kept[score[kept] < 0]
        if binomial_p_value(int(unstable[stable].sum()), len(stable), 1e-3) <= 0.05:
            share = candidate
            break
    median, p99 = np.quantile(error, [0.5, 0.99], method="higher")
    return f"{median:.3%}", f"{p99:.2%}", f"{wrong.mean():.3%}", f"{share:.2%}"
