"""How soon an audit finds out a model that breaks its promise, and that it leaves a good one alone."""

from __future__ import annotations

import copy
import time
from dataclasses import replace

import numpy as np
import torch
from rich.console import Group
from rich.table import Table

from service.audit.auditor import Auditor
from service.audit.tally import FALSE_ALARM, Tally
from training.audit_evidence import log_evidence
from training.contact_class import ARCS, PERMANENT
from training.reference_space import reference_points
from training.registry import Model, load_model
from training.screening import Screener
from training.surrogate import Surrogate

ANSWERS, PATHS, HORIZON = 2_000, 100_000, 100_000
RATES = ((5e-4, (2, 5, 20, 100, 200)), (1e-4, (5, 20, 100, 500)))


def table() -> Group:
    """Both tables."""
    return Group(_models(), _simulated())


def _models() -> Table:
    shown = Table(title=f"Models audited on the reference space, up to {ANSWERS} answers or the alarm")
    for column in ("model", "contact", "audited", "false stable", "alarm", "audit [ms/answer]"):
        shown.add_column(column, justify="right")
    shipped = load_model()
    for contact in (PERMANENT, ARCS):
        shown.add_row("shipped", contact, *_audited(shipped, contact, seed=43))
    for factor in (1.3, 1.4, 1.5):
        for seed in range(3):
            shown.add_row(f"K_e times {factor:g}", PERMANENT, *_audited(shifted(factor), PERMANENT, seed))
    return shown


def shifted(factor: float) -> Model:
    """The shipped model with every boundary in permanent contact at `factor` times its K_e."""
    shipped = load_model()
    network = copy.deepcopy(shipped.surrogate.network)
    with torch.no_grad():
        network.last.bias[0] += float(np.log10(factor))
    surrogate = Surrogate(network, shipped.surrogate.architecture)
    return replace(shipped, id=f"shifted{factor:g}", surrogate=surrogate)


def _audited(model: Model, contact: str, seed: int) -> tuple[str, ...]:
    auditor = Auditor(1.0, 8)
    screener = Screener(model, on_confident=auditor.draw)
    began, waited, promise, tally = time.perf_counter(), 0, None, Tally()
    for point in reference_points(10 * ANSWERS, seed, contact):
        at = (np.array([point.speed_hz]), np.array([point.ke]))
        told = screener.points(point.blade(), point.contact(), *at).reason[0] == "confident"
        waited += int(told)
        while sum(t.audited for t in auditor.counted.values()) < waited:
            time.sleep(1e-4)
        for promise, tally in auditor.counted.items():  # of one contact there is one
            done = tally.breaks(promise.alpha) or tally.audited >= ANSWERS
        if waited and done:
            break
    auditor.close()
    assert promise is not None
    seconds = time.perf_counter() - began
    alarm = "yes" if tally.breaks(promise.alpha) else "no"
    each = f"{seconds / tally.audited * 1e3:.1f}"
    return f"{tally.audited:,}", f"{tally.false_stable} of {tally.answered_stable:,}", alarm, each


def _simulated() -> Table:
    shown = Table(title="Answers called stable until the alarm, simulated")
    for column in ("certified rate", "true rate", "median", "95 %", "alarm within 100,000"):
        shown.add_column(column, justify="right")
    for alpha, multiples in RATES:
        for times in (1, *multiples):
            until = answers_until_alarm(times * alpha, alpha, PATHS if times == 1 else 4_000, HORIZON, 11)
            quantiles = np.quantile(until, [0.5, 0.95], method="inverted_cdf")
            median, late = ("-" if np.isinf(q) else f"{q:,.0f}" for q in quantiles)
            share = f"{np.isfinite(until).mean():.2%}"
            shown.add_row(f"{alpha:g}", f"{times * alpha:g} = {times} times", median, late, share)
    return shown


def answers_until_alarm(rate: float, alpha: float, paths: int, horizon: int, seed: int) -> np.ndarray:
    """Answers until the alarm, one a path; infinite where there is none within `horizon`.

    Evidence falls between two errors, so that it is looked at when one is made.
    """
    rng, out = np.random.default_rng(seed), np.full(paths, np.inf)
    answers, errors, on = np.zeros(paths, dtype=np.int64), 0, np.arange(paths)
    while len(on):
        errors += 1
        answers[on] += rng.geometric(rate, len(on))
        on = on[answers[on] <= horizon]
        most = _most_answers(errors, alpha, horizon)
        out[on[answers[on] <= most]] = answers[on[answers[on] <= most]]
        on = on[answers[on] > most]
    return out


def _most_answers(errors: int, alpha: float, horizon: int) -> int:
    """Among how many answers so many errors raise the alarm: not more than these."""
    low, high = errors - 1, horizon + 1
    while high - low > 1:
        middle = (low + high) // 2
        alarm = log_evidence(errors, middle, alpha) >= -np.log(FALSE_ALARM)
        low, high = (middle, high) if alarm else (low, middle)
    return low
