"""The comparison as a table, in the terminal and in docs/baselines.md."""

from __future__ import annotations

import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch
from rich.console import Group
from rich.table import Table
from sklearn.exceptions import ConvergenceWarning
from threadpoolctl import threadpool_limits

from benchmarks.baselines.comparison import Measured, Method, measured
from benchmarks.baselines.entries import SIZES, Entry, blocks
from benchmarks.baselines.figures import SHARES
from benchmarks.baselines.ours import Shipped
from benchmarks.baselines.samples import Labels, Trial
from training.contact_class import ARCS, PERMANENT, in_words
from training.registry import SHIPPED

POINTS = 20_000
COLUMNS = (
    "",
    "inputs",
    "labels",
    "wrong / near",
    "false stable / near",
    "false unstable / near",
    "to verify",
    "boundary error: median / 99 %",
    "fit, s",
    "MB",
    "s for 10,000",
)
CAPTION = (
    "wrong: share of wrong verdicts, nothing verified; false stable, false unstable: how many once the least "
    "certain points are verified; near: those within 25 % of the boundary; to verify: least share that "
    "proves a false-stable rate below 1e-3 with 95 % confidence; boundary error: of the first crossing, "
    "relative; s: CPU seconds, one thread; MB: peak memory on top of data and libraries"
)
_BEGIN, _END = "<!-- measured -->", "<!-- end of what is measured -->"


@dataclass(frozen=True)
class Comparison:
    """Lines of one class of contact by block."""

    trial: Trial
    lines: dict[str, list[Measured]] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """What is asked."""
        t = self.trial
        return (
            f"{in_words(t.contact)}: {len(t):,} points ({t.near.sum():,} within 25 % of the boundary), "
            f"the least certain {t.share:.0%} verified"
        )


def compared(models: Path = SHIPPED, largest: int = SIZES[-1], points: int = POINTS) -> list[Comparison]:
    """Draw, label and measure; each class of contact in a process of its own, every method on one thread."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(comparison, contact, models, largest, points) for contact in (PERMANENT, ARCS)]
        return [job.result() for job in jobs]


def comparison(contact: str, models: Path, largest: int, points: int) -> Comparison:
    """One class of contact."""
    torch.set_num_threads(1)
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        every = blocks(models)
        labels, trial = Labels.drawn(contact, largest, 1), Trial.drawn(contact, points, 1)
        found = Comparison(trial)
        for block in every:
            lines = found.lines.setdefault(block.title, [])
            for entry in block.entries:
                lines += measurements(entry, labels, trial)
    return found


def measurements(entry: Entry, labels: Labels, trial: Trial) -> list[Measured]:
    """Lines of an entry, the form left behind last."""

    def line(method: Method, size: int) -> Measured:
        found = measured(method, labels.first(size), trial)
        if isinstance(method, Shipped):
            found = replace(found, labels=method.labels)
        print(in_words(trial.contact), "|", " | ".join(cells(found)), file=sys.stderr, flush=True)
        return found

    if entry.other is None:
        return [line(entry.method, size) for size in entry.sizes]
    at = entry.sizes[1]
    forms = [(line(method, at), method) for method in (entry.method, entry.other)]
    (better, method), (worse, _) = sorted(forms, key=lambda form: form[0].figures.alone.rate)
    return [*(better if size == at else line(method, size) for size in entry.sizes), worse]


def table(models: Path = SHIPPED) -> Group:
    """One table a class of contact."""
    return rendered(compared(models))


def rendered(comparisons: list[Comparison]) -> Group:
    """For the terminal."""
    out = []
    for one in comparisons:
        of_class = Table(title=one.title, caption=CAPTION)
        for i, column in enumerate(COLUMNS):
            of_class.add_column(column, justify="left" if i < 2 else "right", no_wrap=not i)
        for title, lines in one.lines.items():
            of_class.add_section()
            of_class.add_row(title, style="bold")
            for line in lines:
                of_class.add_row(*cells(line))
        out.append(of_class)
    return Group(*out)


def markdown(comparisons: list[Comparison]) -> str:
    """For the documentation."""
    out = []
    for one in comparisons:
        out += [f"**{one.title[0].upper()}{one.title[1:]}**", ""]
        out += [f"| {' | '.join(COLUMNS)} |", "|---|---|" + "---:|" * (len(COLUMNS) - 2)]
        for lines in one.lines.values():
            out += [f"| {' | '.join(cells(line))} |" for line in lines]
        out.append("")
    return "\n".join([*out, CAPTION[0].upper() + CAPTION[1:] + "."])


def write(comparisons: list[Comparison], path: Path) -> None:
    """Put the tables between the marks of a document; what stands before and after them stays."""
    text = path.read_text(encoding="utf-8")
    before, _, rest = text.partition(_BEGIN)
    after = rest.partition(_END)[2]
    path.write_text(f"{before}{_BEGIN}\n\n{markdown(comparisons)}\n\n{_END}{after}", encoding="utf-8")


def cells(line: Measured) -> tuple[str, ...]:
    """A line of the table."""
    found = line.figures
    return (
        line.method,
        line.inputs,
        f"{line.labels:,}",
        f"{found.alone.rate:.2%} / {found.alone_near.rate:.1%}",
        f"{found.helped.false_stable:,} / {found.helped_near.false_stable:,}",
        f"{found.helped.false_unstable:,} / {found.helped_near.false_unstable:,}",
        f"{found.to_verify:.2%}" if found.to_verify <= 1 else f"> {SHARES[0]:.0%}",
        f"{_error(found.median_boundary_error)} / {_error(found.p99_boundary_error)}",
        f"{line.fit_s:.1f}".replace("nan", "-"),
        f"{line.memory / 2**20:,.0f}".replace("nan", "-"),
        f"{line.ten_thousand_s:.2f}",
    )


def _error(error: float) -> str:
    if error > 10.0:
        return "missed" if np.isinf(error) else "> 1,000%"
    return f"{error:.3%}" if error < 0.01 else f"{error:.0%}"
