"""The formats of blades and models of matrices: names, suffixes, and what each holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import InvalidInput

MATRICES, MODAL = "matrices", "modal data"


@dataclass(frozen=True)
class Format:
    """A file format.

    Parameters
    ----------
    name
        How callers name it.
    suffixes
        Endings of file names that mean it.
    title
        In words.
    reads, writes
        ``matrices``, ``modal data`` or both.
    digits
        Significant decimal digits of a number it writes; 17 keep every bit of a double.
    """

    name: str
    suffixes: tuple[str, ...]
    title: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    digits: int = 17


FORMATS = (
    Format("op4", (".op4",), "Nastran OUTPUT4, binary", (MATRICES,), (MATRICES,)),
    Format("op4-ascii", (), "Nastran OUTPUT4, text", (), (MATRICES,)),
    Format("dmig", (".dmig", ".bdf", ".nas", ".pch", ".blk"), "Nastran DMIG", (MATRICES,), (MATRICES,), 11),
    Format("uff", (".uff", ".unv", ".unf"), "universal file, dataset 55", (MODAL,), (MODAL,), 13),
    Format("mat", (".mat",), "MATLAB, version 5 or 7.3", (MATRICES, MODAL), (MATRICES, MODAL)),
    Format("mat7.3", (), "MATLAB, version 7.3", (), (MATRICES, MODAL)),
    Format("mtx", (".mtx", ".mm"), "Matrix Market", (MATRICES,), (MATRICES,)),
    Format("calculix", (".sti", ".mas", ".dof", ".inp"), "CalculiX matrix storage", (MATRICES,), (MATRICES,)),
    Format("csv", (".csv", ".txt", ".tsv"), "table", (MATRICES, MODAL), (MATRICES, MODAL)),
    Format("npz", (".npz",), "NumPy archive", (MATRICES, MODAL), (MATRICES, MODAL)),
    Format("json", (".json",), "blade file", (MODAL,), (MODAL,)),
)


def format_of(path: Path, given: str | None, *, what: str, to_write: bool = False) -> Format:
    """The format of a file, by the given name or its suffix.

    Raises
    ------
    InvalidInput
        For a format or suffix that is not known, or does not hold `what`.

    Examples
    --------
    >>> format_of(Path("k.OP4"), None, what="matrices").name
    'op4'
    """
    able = [f for f in FORMATS if what in (f.writes if to_write else f.reads)]
    names = ", ".join(f.name for f in able)
    if given is not None:
        chosen = [f for f in able if f.name == given]
        if not chosen:
            raise InvalidInput("format", given, f"{what} may be {names}")
        return chosen[0]
    suffix = path.suffix.lower()
    fits = [f for f in FORMATS if suffix in f.suffixes]
    if not fits:
        raise InvalidInput(
            "file", path.name, f"the ending {suffix!r} is not known: give the format, one of {names}"
        )
    if fits[0] not in able:
        raise InvalidInput("file", path.name, f"{fits[0].title} holds no {what} here: give one of {names}")
    return fits[0]
