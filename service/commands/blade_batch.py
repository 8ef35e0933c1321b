"""Blades from files and whole folders, each read by what its file holds."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sdm_core.blade import EXAMPLES, Blade, read_blade
from sdm_core.blade.blade_file import LARGEST_FILE_BYTES
from sdm_core.errors import InvalidInput, RubscreenError
from service.commands.inputs import blade_from
from service.screening.batch import Failure

SUFFIX = ".json"

Progress = Callable[[int, int, str], None]
Tell = Callable[[str], None]
Detector = Callable[[Path, str | None], bool]
"""Whether a loader is for this file, from its path and the ``schema`` it names (None: none to be read)."""
Loader = Callable[[Path, Tell], Blade]
"""A blade from a file; it may tell what it is at, for loaders that take minutes."""


@dataclass(frozen=True)
class LoadedBlades:
    """What was found at the paths given.

    Attributes
    ----------
    blades, sources
        Blades in the order given, folders by file name, and the file (or example) each comes from.
    failures
        Files that hold no usable blade.
    ignored
        What lies in the folders beside files that end in ``.json``.
    """

    blades: tuple[Blade, ...]
    sources: tuple[str, ...]
    failures: tuple[Failure, ...] = ()
    ignored: tuple[str, ...] = ()

    @property
    def with_sources(self) -> tuple[tuple[Blade, str], ...]:
        """Each blade with its source."""
        return tuple(zip(self.blades, self.sources, strict=True))


@dataclass(frozen=True)
class BladePaths:
    """Arguments as typed, folders opened.

    Attributes
    ----------
    files
        Examples by name and files, none twice.
    ignored
        As of `LoadedBlades`.
    alone
        One file or example was named, and no folder: what is wrong with it is an error.
    """

    files: tuple[str, ...]
    ignored: tuple[str, ...]
    alone: bool


def blade_paths(texts: Sequence[str]) -> BladePaths:
    """Examples, files and folders as typed.

    Raises
    ------
    InvalidInput
        For a name that is neither, a file that is not there, or a folder without any ``.json``.
    """
    files: dict[str, str] = {}
    ignored: list[str] = []
    folders = [text for text in texts if Path(text).is_dir()]
    for text in texts:
        if text not in folders:
            if len(texts) > 1 and text not in EXAMPLES and not Path(text).exists():
                # A slip of the keyboard, not a blade that failed: nothing is screened without it.
                raise InvalidInput(
                    "BLADE", text, f"give a blade file, a folder or one of {', '.join(EXAMPLES)}"
                )
            files.setdefault(_identity(text), text)
            continue
        inside, beside = _opened(text)
        if not inside:
            raise InvalidInput("BLADE", text, f"give a folder that holds blade files (*{SUFFIX})")
        ignored += beside
        for path in inside:
            files.setdefault(_identity(path), path)
    return BladePaths(tuple(files.values()), tuple(ignored), len(texts) == 1 and not folders)


def load_blades(paths: BladePaths, progress: Progress = lambda *_: None) -> LoadedBlades:
    """Read every file; one that cannot be read is a failure, unless it was named alone.

    Raises
    ------
    RubscreenError
        What is wrong with a file that was named alone.
    """
    blades, sources, failures = [], [], []
    for i, text in enumerate(paths.files):

        def tell(what: str, i: int = i, name: str = Path(text).name) -> None:
            progress(i, len(paths.files), f"{name}: {what}" if what else name)

        tell("")
        try:
            blades.append(_loaded(text, tell))
            sources.append(text)
        except RubscreenError as error:
            if paths.alone:
                raise
            failures.append(Failure.of(text, error))
    progress(len(paths.files), len(paths.files), "read")
    return LoadedBlades(tuple(blades), tuple(sources), tuple(failures), paths.ignored)


def has_schema(name: str) -> Detector:
    """A detector of files that name a schema."""
    return lambda path, schema: schema == name


def _loaded(text: str, tell: Tell) -> Blade:
    if text in EXAMPLES and not Path(text).exists():
        return blade_from(text)
    path = Path(text)
    schema = schema_of(path)
    for detector, loader in LOADERS:
        if detector(path, schema):
            return loader(path, tell)
    return blade_from(text)


def schema_of(path: Path) -> str | None:
    """The ``schema`` a JSON file names; None where there is none to be read, which the loader will say."""
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            return None
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    schema = data.get("schema") if isinstance(data, dict) else None
    return schema if isinstance(schema, str) else None


def _opened(folder: str) -> tuple[list[str], list[str]]:
    """Blade files of a folder and what lies beside them, both sorted; hidden files are not looked at."""
    try:
        entries = sorted(path for path in Path(folder).iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise InvalidInput("BLADE", folder, f"give a folder that can be read ({error.strerror})") from None
    inside = [str(path) for path in entries if path.suffix.lower() == SUFFIX and not path.is_dir()]
    beside = [f"{path}/" if path.is_dir() else str(path) for path in entries if str(path) not in inside]
    return inside, beside


def _identity(text: str) -> str:
    return str(Path(text).resolve()) if Path(text).exists() else text


def _read_blade(path: Path, _: Tell) -> Blade:
    return read_blade(path)


# Asked in this order; whatever none is for is taken for a blade file, whose reader says what is wrong.
LOADERS: tuple[tuple[Detector, Loader], ...] = ((has_schema("rubscreen/blade/1"), _read_blade),)
