"""Design gradients of the boundary: the surrogate's and the service's against the exact core's.

A blade and a speed have one error: of the vector of d ln K_e/d ln p over frequencies, damping, amplitudes and
the rotor speed (modal data frozen), the length of the difference over that of the exact one. Weights and
edges of arcs have their own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from rich.progress import track
from rich.table import Table

from benchmarks.real_blades import parametric_blades
from sdm_core.blade import Blade
from sdm_core.blade_sensitivity import BladeSensitivity, Influence, boundary_sensitivities
from sdm_core.contact import ContactConfiguration
from training.answers import EXACT, SensitivityAnswers
from training.cases import CaseBatch
from training.contact_class import ARCS, PERMANENT
from training.reference_space import reference_points
from training.screening import Screener
from training.seeds import seed_for
from training.space_filling import random_arcs

BLADES = 100
_DESIGN = ("frequency of", "damping of", "amplitude of", "rotor speed, modal data frozen")
_GROUPS = {"gradient": _DESIGN, "weights": ("weight of",), "edges of arcs": ("start of", "end of")}


@dataclass(frozen=True)
class Question:
    """A blade in contact at a speed, and the K_e up to which the surrogate knows it."""

    blade: Blade
    contact: ContactConfiguration
    speed_hz: np.ndarray
    ke_max: float


def of_reference_space(screener: Screener, contact: str, seed: int) -> Iterator[Question]:
    """Points of the reference space, each its own blade."""
    for point in reference_points(1_000_000, seed, contact):
        yield _question(screener, point.blade(), point.contact(), point.speed_hz)


def of_blades(screener: Screener, contact: str, seed: int, blades: Sequence[Blade]) -> Iterator[Question]:
    """Each blade at one speed from 15 % of its largest up, touching at one edge or along the chord."""
    rng = np.random.default_rng(seed)
    for blade in blades:
        nodes = [blade.tip_nodes[:1], blade.tip_nodes[-1:], blade.tip_nodes][int(rng.integers(3))]
        arcs = None
        if contact == ARCS:
            count = int(rng.integers(1, 5))
            arcs = random_arcs(rng, count, rng.uniform(0.05, 0.8), evenness=2.0)[:count].tolist()
        top = blade.speed_range_hz[1]  # type: ignore[index]
        low = max(0.15 * top, 0.06 * blade.first_frequency_hz)
        speed = float(np.exp(rng.uniform(np.log(low), np.log(top))))
        yield _question(screener, blade, ContactConfiguration(dict.fromkeys(nodes, 1.0), arcs), speed)


def _question(screener: Screener, blade: Blade, contact: ContactConfiguration, speed: float) -> Question:
    assert screener.model is not None
    at = np.array([speed])
    reach = screener.model.design_space.largest_ke(CaseBatch.from_blade(blade, contact, at))
    return Question(blade, contact, at, 0.999 * float(reach[0]))


@dataclass(frozen=True)
class Errors:
    """Of many blades under one policy: relative errors of K_e and of each group, and how many were exact."""

    ke: np.ndarray
    groups: dict[str, np.ndarray]
    exact_share: float

    def cells(self) -> tuple[str, ...]:
        """Medians and 90th percentiles."""
        out = [f"{len(self.ke)}", f"{np.median(self.ke):.3%}"]
        for error in self.groups.values():
            known = error[~np.isnan(error)]
            ends = np.quantile(known, [0.5, 0.9]) if len(known) else (np.nan, np.nan)
            out.append(" / ".join(f"{end:.2%}" for end in ends) if len(known) else "")
        out.append(f"{np.max(self.groups['gradient']):.0%}")
        return (*out, f"{self.exact_share:.0%}")


def errors(found: Sequence[SensitivityAnswers], truth: Sequence[BladeSensitivity]) -> Errors:
    """Errors of answers to the same questions; a crossing that was missed is an infinite one."""
    table: dict[str, list[float]] = {name: [] for name in _GROUPS}
    for answers, exact in zip(found, truth, strict=True):
        said = answers.influences(0)
        for name, starts in _GROUPS.items():
            table[name].append(np.inf if said is None else _error(said, exact.influences, starts))
    ke = [abs(a.critical_ke[0] / e.value - 1) for a, e in zip(found, truth, strict=True)]
    exactly = float(np.mean([a.source[0] == EXACT for a in found]))
    return Errors(np.nan_to_num(ke, nan=np.inf), {k: np.array(v) for k, v in table.items()}, exactly)


def _error(said: Sequence[Influence], exact: Sequence[Influence], starts: tuple[str, ...]) -> float:
    a, b = (np.array([i.relative for i in each if i.parameter.startswith(starts)]) for each in (said, exact))
    return float(np.linalg.norm(a - b) / np.linalg.norm(b)) if len(b) else np.nan


def solved(screener: Screener, questions: Iterator[Question]) -> Iterator[tuple[Question, BladeSensitivity]]:
    """Those inside the domain that have a crossing, and its exact derivatives."""
    assert screener.model is not None
    for ask in questions:
        cases = CaseBatch.from_blade(ask.blade, ask.contact, ask.speed_hz)
        if screener.model.design_space.contains(cases)[0]:
            (exact,) = boundary_sensitivities(ask.blade, ask.contact, ask.speed_hz, ask.ke_max)
            if exact.simple:
                yield ask, exact


def measure(screener: Screener, questions: Iterator[Question], count: int, title: str) -> dict[str, Errors]:
    """Errors by policy on the first `count` questions that can be judged."""
    truth: list[BladeSensitivity] = []
    found: dict[str, list[SensitivityAnswers]] = {"surrogate": [], "auto": []}
    asked = islice(solved(screener, questions), count)
    for ask, exact in track(asked, title, count, transient=True):
        truth.append(exact)
        for policy, answers in found.items():
            answers.append(screener.sensitivities(ask.blade, ask.contact, ask.speed_hz, ask.ke_max, policy))
    return {policy: errors(answers, truth) for policy, answers in found.items()}


def seconds_a_gradient(screener: Screener, ask: Question, speeds: int = 100) -> tuple[float, float]:
    """Of the surrogate and of the exact core, at many speeds of one blade."""
    speed = ask.speed_hz * np.linspace(0.9, 1.0, speeds)
    took = []
    for policy in ("surrogate", "exact"):
        began = time.perf_counter()
        screener.sensitivities(ask.blade, ask.contact, speed, ask.ke_max, policy)
        took.append((time.perf_counter() - began) / speeds)
    return took[0], took[1]


def table(
    count: int = BLADES, screener: Screener | None = None, blades: Sequence[Blade] | None = None
) -> Table:
    """The whole measurement; blades of the parametric family are built where none are given."""
    screener = screener or Screener.default()
    blades = blades or parametric_blades(count)
    out = Table(
        title=f"d ln K_e/d ln p against the exact core, model {screener.model_id}: median / 90th percentile"
    )
    columns = ("blades of", "contact", "policy", "blades", "K_e", *_GROUPS, "worst gradient", "exact")
    for column in columns:
        out.add_column(column, justify="left" if column in columns[:3] else "right")
    times = []
    for contact in (PERMANENT, ARCS):
        seed = seed_for(f"gradients, {contact}", 2026)
        sources = {
            "reference space": of_reference_space(screener, contact, seed),
            "parametric family": of_blades(screener, contact, seed, blades),
        }
        for name, questions in sources.items():
            for policy, each in measure(screener, questions, count, f"{name}, {contact}").items():
                out.add_row(name, contact, policy, *each.cells())
        ask = next(of_blades(screener, contact, seed, blades))
        quick, exact = seconds_a_gradient(screener, ask)
        times.append(f"{contact} {1e3 * quick:.2f} and {1e3 * exact:.0f} ms")
    out.caption = (
        f"a gradient of the surrogate and of the exact core, 100 speeds of a blade: {', '.join(times)}"
    )
    return out
