"""How fast the surrogate alone is on one thread, beside the rate of a large matrix product."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import torch
from rich.table import Table
from threadpoolctl import threadpool_limits

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from training.calibration import CLASSES
from training.contact_class import PERMANENT, in_words
from training.features import CaseTensors, features
from training.reference_space import reference_sample
from training.registry import load_model
from training.screening import Screener
from training.seeds import seed_for

CASES, SIDE = 16_384, 200
ARCS_OF_MAP = [[0.0, 0.25], [0.5, 0.75]]


def table() -> Table:
    """Rows by class of contact."""
    model = load_model()
    surrogate, screener = model.surrogate, Screener(model)
    network = surrogate.network
    weights = sum(p.numel() for p in network.parameters() if p.ndim == 2)
    out = Table(title=f"model {model.id}: {weights:,} multiplications and additions a case, one thread")
    for column in (
        "contact",
        "what",
        "µs a case",
        "cases a second",
        "verdicts a second",
        "share of matrix rate",
    ):
        out.add_column(column, justify="left" if column in ("contact", "what") else "right")
    blade = example_blade("nasa_rotor_37")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1), torch.inference_mode():
            rate = _matrix_rate()
            out.caption = f"matrix product of 2048 × 2048 singles: {rate / 1e9:.1f} Gflop/s"
            for contact in CLASSES:
                cases = reference_sample(CASES, seed_for("speed", 1), contact).cases
                tensors = CaseTensors.of(cases)
                found = features(tensors)
                took = _seconds(lambda i=found.inputs: network(i))  # type: ignore[misc]
                share = f"{2 * weights * CASES / took / rate:.0%}"
                rows = (
                    ("features", _seconds(lambda t=tensors: features(t)), ""),  # type: ignore[misc]
                    ("network", took, share),
                    ("whole boundary", _seconds(lambda c=cases: surrogate.boundary(c)), ""),  # type: ignore[misc]
                )
                for what, seconds, part in rows:
                    each = f"{1e6 * seconds / CASES:.1f}"
                    out.add_row(in_words(contact), what, each, f"{CASES / seconds:,.0f}", "", part)
                held = ContactConfiguration.at("LE", arcs=None if contact == PERMANENT else ARCS_OF_MAP)
                speed = np.linspace(60.0, 300.0, SIDE)
                ke = np.linspace(0.0, 2.5e4, SIDE)
                seconds = _seconds(lambda h=held, s=speed, k=ke: screener.map(blade, h, s, k, "surrogate"))  # type: ignore[misc]
                points = f"{SIDE**2 / seconds:,.0f}"
                out.add_row("", f"map of {SIDE} × {SIDE}", "", f"{SIDE / seconds:,.0f}", points, "")
                out.add_section()
    finally:
        torch.set_num_threads(before)
    return out


def _seconds(run: Callable[[], object], repeats: int = 7) -> float:
    times = []
    for _ in range(repeats + 1):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return float(np.median(times[1:]))


def _matrix_rate(size: int = 2048) -> float:
    """Operations a second of a large matrix product."""
    a = torch.randn(size, size)
    return 2 * size**3 / _seconds(lambda: a @ a)
