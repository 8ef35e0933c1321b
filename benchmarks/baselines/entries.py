"""What is compared: methods, what they are told, and to how many labels each is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from benchmarks.baselines import estimators as own
from benchmarks.baselines.comparison import Method
from benchmarks.baselines.inputs import Encoding, lobes, phases, raw
from benchmarks.baselines.methods import Classification, Regression
from benchmarks.baselines.ours import LobesAlone, OurNetwork, Ours, Shipped
from benchmarks.baselines.smt_kriging import SmtKriging

SIZES = (1_000, 5_000, 20_000)
_FEWEST, _LARGEST = SIZES[:1], SIZES[-1:]


@dataclass(frozen=True)
class Entry:
    """A method and the numbers of labels it is fitted to.

    Attributes
    ----------
    other
        The same in its other form, measured at the second number of labels: the form that is wrong less often
        on the very points of the comparison, a choice in its favour, is taken at the other numbers.
    """

    method: Method
    sizes: tuple[int, ...] = _LARGEST
    other: Method | None = None


@dataclass(frozen=True)
class Block:
    """Entries that are told the same."""

    title: str
    entries: tuple[Entry, ...]


def blocks(models: Path) -> tuple[Block, ...]:
    """Everything that is compared; `models` is the folder whose active model counts as the shipped one."""
    generic = (
        Entry(
            _forest("raw", raw),
            SIZES,
            Classification("random forest, verdicts", "raw", raw, own.forest_classifier),
        ),
        Entry(
            _boosted("raw", raw),
            SIZES,
            Classification("boosted trees, verdicts", "raw", raw, own.boosted_classifier),
        ),
        Entry(_mlp("raw", raw), SIZES, Classification("MLP, verdicts", "raw", raw, own.mlp_classifier)),
        Entry(_process("raw", raw), SIZES[:2]),
        Entry(_kriging("raw", raw), (500, *_FEWEST)),
    )
    without_lobes = (
        Entry(_forest("phases", phases)),
        Entry(_boosted("phases", phases)),
        Entry(_mlp("phases", phases)),
        Entry(OurNetwork("phases", phases)),
    )
    with_lobes = (
        Entry(LobesAlone(), (0,)),
        Entry(_forest("lobes", lobes)),
        Entry(_boosted("lobes", lobes)),
        Entry(_mlp("lobes", lobes)),
        Entry(_process("lobes", lobes), _FEWEST),
        Entry(Ours(), SIZES),
        Entry(Shipped(models), (0,)),
    )
    return (
        Block("raw inputs", (*generic, Entry(OurNetwork("raw", raw)))),
        Block("without lobes", without_lobes),
        Block("with lobes", with_lobes),
    )


def _forest(inputs: str, encoding: Encoding) -> Regression:
    return Regression("random forest", inputs, encoding, own.forest, own.disagreement_of_trees)


def _boosted(inputs: str, encoding: Encoding) -> Regression:
    return Regression("boosted trees", inputs, encoding, own.boosted)


def _mlp(inputs: str, encoding: Encoding) -> Regression:
    return Regression("MLP", inputs, encoding, own.mlp)


def _process(inputs: str, encoding: Encoding) -> Regression:
    process = own.GaussianProcess
    return Regression("Gaussian process", inputs, encoding, lambda rows: process(), process.spread)


def _kriging(inputs: str, encoding: Encoding) -> Regression:
    return Regression("SMT kriging", inputs, encoding, lambda rows: SmtKriging(), SmtKriging.spread)
