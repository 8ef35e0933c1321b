"""Fitting the classifier: one flat loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from training.cases import CaseBatch
from training.design_space import DesignSpace
from training.device import chosen_device
from training.features import CaseTensors, features
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

Progress = Callable[[int, int, float], None]
_AT_ONCE = 16_384  # cases whose features are computed together
_AVERAGE = 0.005  # weight of a step in the running average of the weights


@dataclass(frozen=True)
class FitSettings:
    """Settings of the loop.

    Attributes
    ----------
    architecture
        Of the network.
    epochs, batch, learning_rate, weight_decay
        Of AdamW with one cycle.
    device
        ``auto`` is a GPU when there is one.
    """

    architecture: Architecture = field(default_factory=Architecture)
    epochs: int = 40
    batch: int = 1024
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    device: str = "auto"

    def to_dict(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)


def boundary_loss(middle: Tensor, log_spread: Tensor, log_kappa: Tensor, reach: Tensor) -> Tensor:
    """Mean cross-entropy of the classifier over K_e, in closed form.

    A classifier logistic((log κ − m)/s), asked at K_e spread evenly in log about a known first
    crossing y, has in the limit of many points the likelihood of a logistic density at y. Cases
    without a crossing (infinite) are censored: stable up to `reach`, log10 κ.
    """
    censored = torch.isinf(log_kappa)
    z = (torch.where(censored, reach, log_kappa) - middle) * torch.exp(-log_spread)
    seen = log_spread + torch.nn.functional.softplus(z) + torch.nn.functional.softplus(-z)
    unseen = torch.nn.functional.softplus(z)
    return torch.where(censored, unseen, seen).mean()


@dataclass(frozen=True)
class Prepared:
    """Labelled cases as the loop wants them, on one device; shape (m, f) and (m,).

    Cases whose label is not a number are left out.
    """

    inputs: Tensor
    baseline: Tensor
    log_kappa: Tensor
    reach: Tensor

    @classmethod
    def of(cls, cases: CaseBatch, kappa: np.ndarray, space: DesignSpace, device: torch.device) -> Prepared:
        """Features of all cases."""
        known = np.flatnonzero(~np.isnan(kappa))
        parts = []
        with torch.no_grad():
            for i in range(0, len(known), _AT_ONCE):
                parts.append(features(CaseTensors.of(cases[known[i : i + _AT_ONCE]], device)))
        limit = np.where(cases.permanent, space.largest_kappa, space.largest_kappa_with_arcs)[known]
        return cls(
            torch.cat([part.inputs for part in parts]),
            torch.cat([part.baseline for part in parts]),
            torch.from_numpy(np.log10(kappa[known])).to(device),
            torch.from_numpy(np.log10(limit)).to(device),
        )

    def __len__(self) -> int:
        return len(self.log_kappa)


def fit(
    cases: CaseBatch,
    kappa: np.ndarray,
    settings: FitSettings,
    *,
    seed: int,
    space: DesignSpace | None = None,
    progress: Progress | None = None,
) -> Surrogate:
    """Fit a surrogate to exact first crossings.

    The result depends on data, settings, seed, device and the number of torch threads alone.

    Parameters
    ----------
    cases, kappa
        Cases and κ of their first crossings (infinite: none, NaN: not known), m each.
    space
        Says up to which κ crossings were looked for.
    progress
        Called with (epoch, epochs, loss).
    """
    device = chosen_device(settings.device)
    data = Prepared.of(cases, kappa, space or DesignSpace(), device)
    torch.manual_seed(seed)
    network = BoundaryNetwork(settings.architecture)
    network.mean.copy_(data.inputs.mean(dim=0))
    network.scale.copy_(data.inputs.std(dim=0).clamp(min=1e-3))
    train_network(network.to(device), data, settings, seed=seed, progress=progress)
    return Surrogate(network.cpu(), settings.architecture)


def train_network(
    network: torch.nn.Module,
    data: Prepared,
    settings: FitSettings,
    *,
    seed: int,
    progress: Progress | None = None,
) -> None:
    """Train in place any network from inputs (m, f) to correction and log spread (m,); averaged weights."""
    device = data.inputs.device
    torch.use_deterministic_algorithms(True)
    batch = min(settings.batch, len(data))
    batches = len(data) // batch
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser,
        settings.learning_rate,
        total_steps=settings.epochs * batches,
        pct_start=0.08,
        final_div_factor=1e3,
    )
    generator = torch.Generator().manual_seed(seed)
    weights: list[Tensor] = [p for p in network.parameters() if p.requires_grad]
    average = [p.detach().clone() for p in weights]
    step = 0
    network.train()
    for epoch in range(settings.epochs):
        order = torch.randperm(len(data), generator=generator).to(device)
        total = torch.zeros((), device=device, dtype=torch.float64)
        for i in range(batches):
            rows = order[i * batch : (i + 1) * batch]
            correction, log_spread = network(data.inputs[rows])
            # In double: the correction is often smaller than a single rounds log κ.
            middle = data.baseline[rows] + correction
            loss = boundary_loss(middle, log_spread, data.log_kappa[rows], data.reach[rows])
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(weights, 1.0)
            optimiser.step()
            schedule.step()
            total += loss.detach()
            step += 1
            # The first weights are chance and must have left the average by the end of a short run.
            share = max(_AVERAGE, 1.0 / (1 + step))
            with torch.no_grad():
                torch._foreach_lerp_(average, weights, share)
        mean = float(total) / batches
        if not math.isfinite(mean):
            raise FloatingPointError(f"the loss of epoch {epoch + 1} is {mean}")
        if progress is not None:
            progress(epoch + 1, settings.epochs, mean)
    with torch.no_grad():
        for p, value in zip(weights, average, strict=True):
            p.copy_(value)
    network.eval()
