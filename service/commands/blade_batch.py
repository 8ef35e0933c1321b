"""Blades from files and whole folders: blade files read, profiles built."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sdm_core.blade import EXAMPLES, Blade
from sdm_core.blade.build_batch import build_each
from sdm_core.blade.profile import SCHEMA as PROFILE_SCHEMA
from sdm_core.blade.profile import BladeProfile, read_profile
from sdm_core.errors import InvalidInput, RubscreenError
from sdm_core.json_file import read_json
from service.commands.inputs import blade_from
from service.screening.batch import Failure

SUFFIX = ".json"

Progress = Callable[[int, int, str], None]


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
            raise InvalidInput("BLADE", text, f"give a folder that holds blade or profile files (*{SUFFIX})")
        ignored += beside
        for path in inside:
            files.setdefault(_identity(path), path)
    return BladePaths(tuple(files.values()), tuple(ignored), len(texts) == 1 and not folders)


def load_blades(paths: BladePaths, progress: Progress = lambda *_: None) -> LoadedBlades:
    """Read every file and build every profile; one that cannot be is a failure, unless it was named alone.

    Profiles are built on all cores.

    Raises
    ------
    RubscreenError
        What is wrong with a file that was named alone.
    """
    found: dict[str, Blade | RubscreenError] = {}
    profiles: dict[str, BladeProfile] = {}
    for i, text in enumerate(paths.files):
        progress(i, len(paths.files), Path(text).name)
        try:
            if Path(text).exists() and schema_of(Path(text)) == PROFILE_SCHEMA:
                profiles[text] = read_profile(text)
            else:
                found[text] = blade_from(text)
        except RubscreenError as error:
            found[text] = error
    if profiles:

        def built(done: int, total: int, name: str) -> None:
            progress(done, total, f"built {name}")

        progress(0, len(profiles), "building profiles")
        for text, made in zip(profiles, build_each(list(profiles.values()), progress=built), strict=True):
            found[text] = made if isinstance(made, RubscreenError) else made.blade
    blades, sources, failures = [], [], []
    for text in paths.files:
        blade = found[text]
        if isinstance(blade, Blade):
            blades.append(blade)
            sources.append(text)
        elif paths.alone:
            raise blade
        else:
            failures.append(Failure.of(text, blade))
    progress(len(paths.files), len(paths.files), "read")
    return LoadedBlades(tuple(blades), tuple(sources), tuple(failures), paths.ignored)


def schema_of(path: Path) -> str | None:
    """The ``schema`` a JSON file names; None where there is none to be read, which the reader will say."""
    try:
        data = read_json(path, "file")
    except InvalidInput:
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
