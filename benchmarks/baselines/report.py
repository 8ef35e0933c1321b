"""The comparison as a table, in the terminal and in docs/baselines.md."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import torch
from rich.console import Group
from rich.progress import track
from rich.table import Table
from sklearn.exceptions import ConvergenceWarning
from threadpoolctl import threadpool_limits

from benchmarks.baselines import estimators as own
from benchmarks.baselines.comparison import Measured, Method, measured
from benchmarks.baselines.figures import Wrong
from benchmarks.baselines.inputs import lobes, phases, raw
from benchmarks.baselines.methods import Classification, Regression
from benchmarks.baselines.ours import LobesAlone, OurNetwork, Ours, Shipped
from benchmarks.baselines.samples import Labels, Trial
from benchmarks.baselines.smt_kriging import SmtKpls
from training.contact_class import ARCS, PERMANENT, in_words
from training.registry import SHIPPED, load_model

SIZES = (2_000, 8_000, 32_000)
POINTS = 20_000
COLUMNS = (
    "",
    "inputs",
    "labels",
    "wrong",
    "near",
    "false stable",
    "near",
    "false unstable",
    "near",
    "to verify",
    "boundary error",
    "fit, s",
    "MB",
    "s for 10,000",
)
CAPTION = (
    "wrong: share of wrong verdicts, nothing verified; false stable, false unstable: how many once the least "
    "certain points are verified; near: those within 25 % of the boundary; to verify: least share that "
    "proves a false-stable rate below 1e-3 with 95 % confidence; boundary error: median, of the first "
    "crossing; MB: peak memory on top of data and libraries"
)
_BEGIN, _END = "<!-- measured -->", "<!-- end of what is measured -->"


@dataclass(frozen=True)
class Entry:
    """A method and the numbers of labels it is fitted to."""

    method: Method
    sizes: tuple[int, ...] = SIZES[-1:]


@dataclass(frozen=True)
class Block:
    """Entries that are told the same."""

    title: str
    entries: tuple[Entry, ...]


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


def blocks(models: Path = SHIPPED) -> tuple[Block, ...]:
    """Everything that is compared."""
    forest, spread = own.forest, own.disagreement_of_trees
    model = load_model(folder=models)
    shipped = Shipped(model.surrogate, model.card["dataset"]["labels"])
    return (
        Block(
            "raw inputs",
            (
                Entry(Regression("random forest", "raw", raw, forest, spread), SIZES),
                Entry(
                    Classification("random forest, verdicts", "raw", raw, own.forest_classifier), SIZES[1:2]
                ),
                Entry(Regression("boosted trees", "raw", raw, own.boosted), SIZES[1:2]),
                Entry(Classification("boosted trees, verdicts", "raw", raw, own.boosted_classifier), SIZES),
                Entry(Regression("MLP", "raw", raw, own.mlp), SIZES[1:2]),
                Entry(Classification("MLP, verdicts", "raw", raw, own.mlp_classifier), SIZES),
                Entry(
                    Regression("Gaussian process", "raw", raw, gaussian_process, spread_of_process), SIZES[:2]
                ),
                Entry(Regression("SMT KPLS", "raw", raw, smt_kpls, SmtKpls.spread), SIZES[:1]),
                Entry(OurNetwork("raw", raw)),
            ),
        ),
        Block(
            "our features without the lobes",
            (
                Entry(Regression("random forest", "phases", phases, forest, spread)),
                Entry(Regression("boosted trees", "phases", phases, own.boosted)),
                Entry(Regression("MLP", "phases", phases, own.mlp)),
                Entry(OurNetwork("phases", phases)),
            ),
        ),
        Block(
            "our features, the lowest lobe corrected",
            (
                Entry(LobesAlone(), (0,)),
                Entry(Regression("random forest", "lobes", lobes, forest, spread)),
                Entry(Regression("boosted trees", "lobes", lobes, own.boosted)),
                Entry(Regression("MLP", "lobes", lobes, own.mlp)),
                Entry(
                    Regression("Gaussian process", "lobes", lobes, gaussian_process, spread_of_process),
                    SIZES[:1],
                ),
                Entry(Ours(), SIZES),
                Entry(shipped, (0,)),
            ),
        ),
    )


def gaussian_process(rows: int) -> own.GaussianProcess:
    return own.GaussianProcess()


spread_of_process = own.GaussianProcess.spread


def smt_kpls(rows: int) -> SmtKpls:
    return SmtKpls()


def compared(
    models: Path = SHIPPED, largest: int = SIZES[-1], points: int = POINTS, workers: int = own.THREADS
) -> Iterator[Comparison]:
    """Draw, label and measure, one class of contact after the other."""
    every = blocks(models)
    torch.set_num_threads(own.THREADS)
    for contact in (PERMANENT, ARCS):
        labels, trial = Labels.drawn(contact, largest, workers), Trial.drawn(contact, points, workers)
        found = Comparison(trial)
        todo = [(b.title, e.method, min(n, largest)) for b in every for e in b.entries for n in e.sizes]
        for title, method, size in track(todo, f"baselines, {in_words(contact)}"):
            with threadpool_limits(own.THREADS), warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                line = measured(method, labels.first(size), trial)
            if isinstance(method, Shipped):
                line = replace(line, labels=method.labels)
            found.lines.setdefault(title, []).append(line)
        yield found


def table(models: Path = SHIPPED) -> Group:
    """One table a class of contact."""
    return rendered(list(compared(models)))


def rendered(comparisons: list[Comparison]) -> Group:
    """For the terminal."""
    out = []
    for comparison in comparisons:
        of_class = Table(title=comparison.title, caption=CAPTION)
        for i, column in enumerate(COLUMNS):
            of_class.add_column(column, justify="left" if i < 2 else "right")
        for title, lines in comparison.lines.items():
            of_class.add_section()
            of_class.add_row(title, style="bold")
            for line in lines:
                of_class.add_row(*cells(line))
        out.append(of_class)
    return Group(*out)


def markdown(comparisons: list[Comparison]) -> str:
    """For the documentation."""
    out = []
    for comparison in comparisons:
        out += [f"**{comparison.title[0].upper()}{comparison.title[1:]}**", ""]
        out += [f"| {' | '.join(COLUMNS)} |", "|---|---|" + "---:|" * (len(COLUMNS) - 2)]
        for lines in comparison.lines.values():
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
    found, fitted = line.figures, line.fit_s > 1e-3  # what needs no fit takes microseconds
    return (
        line.method,
        line.inputs,
        f"{line.labels:,}",
        *(_share(wrong) for wrong in (found.alone, found.alone_near)),
        f"{found.helped.false_stable:,}",
        f"{found.helped_near.false_stable:,}",
        f"{found.helped.false_unstable:,}",
        f"{found.helped_near.false_unstable:,}",
        f"{found.to_verify:.3g}".replace("inf", "> 60 %")
        if found.to_verify > 1
        else f"{found.to_verify:.2%}",
        f"{found.median_boundary_error:.2g}".replace("inf", "∞"),
        f"{line.fit_s:.1f}" if fitted else "-",
        f"{line.memory / 2**20:,.0f}" if fitted else "-",
        f"{line.ten_thousand_s:.2f}",
    )


def _share(wrong: Wrong) -> str:
    return f"{wrong.rate:.2%}"
