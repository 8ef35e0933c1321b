"""Fitting the classifier: one flat loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from training.cases import CaseBatch
from training.features import features
from training.labelling import KAPPA_MAX
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

Progress = Callable[[int, int, float], None]


@dataclass(frozen=True)
class FitSettings:
    """Settings of the loop.

    Attributes
    ----------
    architecture
        Of the network.
    epochs, batch, learning_rate, weight_decay
        Of AdamW with one cycle.
    """

    architecture: Architecture = field(default_factory=Architecture)
    epochs: int = 40
    batch: int = 1024
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4

    def to_dict(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)


def boundary_loss(middle: Tensor, log_spread: Tensor, log_kappa: Tensor) -> Tensor:
    """Mean cross-entropy of the classifier over K_e, in closed form.

    A classifier logistic((log κ − m)/s), asked at K_e spread evenly in log about a known first
    crossing y, has in the limit of many points the likelihood of a logistic density at y. Cases
    without a crossing up to `KAPPA_MAX` are censored: stable there.
    """
    censored = torch.isinf(log_kappa)
    reach = torch.where(censored, float(np.log10(KAPPA_MAX)), log_kappa)
    z = (reach - middle) * torch.exp(-log_spread)
    seen = log_spread + torch.nn.functional.softplus(z) + torch.nn.functional.softplus(-z)
    unseen = torch.nn.functional.softplus(z)
    return torch.where(censored, unseen, seen).mean()


def fit(
    cases: CaseBatch,
    kappa: np.ndarray,
    settings: FitSettings,
    *,
    seed: int,
    progress: Progress | None = None,
) -> Surrogate:
    """Fit a surrogate to exact first crossings.

    The result depends on data, settings, seed and the number of torch threads alone.

    Parameters
    ----------
    cases, kappa
        Cases and κ of their first crossings (infinite: none), m each.
    progress
        Called with (epoch, epochs, loss).
    """
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    found = features(cases)
    network = BoundaryNetwork(settings.architecture)
    network.mean.copy_(found.inputs.mean(dim=0))
    network.scale.copy_(found.inputs.std(dim=0).clamp(min=1e-3))
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
    )
    steps = settings.epochs * (len(cases) // settings.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.learning_rate, total_steps=steps, pct_start=0.08, final_div_factor=1e3
    )
    inputs = found.inputs
    baseline = found.baseline
    log_kappa = torch.from_numpy(np.log10(kappa))
    generator = torch.Generator().manual_seed(seed)
    average = {name: value.clone() for name, value in network.state_dict().items()}
    network.train()
    for epoch in range(settings.epochs):
        order = torch.randperm(len(cases), generator=generator)
        total = 0.0
        for i in range(0, len(cases) - settings.batch + 1, settings.batch):
            rows = order[i : i + settings.batch]
            correction, log_spread = network(inputs[rows])
            # In double: the correction is often smaller than a single rounds log κ.
            loss = boundary_loss(baseline[rows] + correction, log_spread, log_kappa[rows])
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            total += loss.item()
            with torch.no_grad():
                for name, value in network.state_dict().items():
                    average[name].lerp_(value, 0.005)
        if progress is not None:
            progress(epoch + 1, settings.epochs, total / max(1, len(cases) // settings.batch))
    network.load_state_dict(average)
    return Surrogate(network, settings.architecture)
