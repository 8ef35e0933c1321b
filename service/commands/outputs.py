"""Files that are whole or not there at all, and what goes to the terminal."""

from __future__ import annotations

import json
import os
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from sdm_core.errors import InvalidInput
from service.rest.replies import to_json

STDOUT = "-"
PROGRESS_EVERY_S = 10.0


def console_beside(json_path: str | None) -> Console:
    """Where tables go: stdout, or stderr when stdout carries the JSON."""
    return terminal(stderr=json_path == STDOUT)


def terminal(*, stderr: bool = False) -> Console:
    """A console that leaves lines whole; without a terminal, wide enough for every table."""
    made = Console(stderr=stderr, soft_wrap=True)
    if not made.is_terminal and "COLUMNS" not in os.environ:
        made.width = 120
    return made


def check_writable(*, inputs: Sequence[str] = (), **paths: str | None) -> None:
    """Refuse outputs that cannot be written, or that would cost a file still needed, before any work.

    Parameters
    ----------
    inputs
        Blades as typed; those that are files are not to be overwritten.

    Raises
    ------
    InvalidInput
        Naming the option (the keyword with dashes before it), the path and the remedy.
    """
    for option, path in paths.items():
        if path is None or (path == STDOUT and option == "json"):
            continue
        if path == STDOUT:
            raise InvalidInput(f"--{option}", path, "give a file: only --json can go to stdout")
        with _named(f"--{option}", path):
            if _written_in_place(path):
                place = Path(path)
            else:
                place = Path(path).resolve().parent
                place.mkdir(parents=True, exist_ok=True)
            if not os.access(place, os.W_OK):
                raise PermissionError(0, "permission denied")
    _check_distinct(inputs, {f"--{option}": path for option, path in paths.items() if path is not None})


def _check_distinct(inputs: Sequence[str], outputs: dict[str, str]) -> None:
    taken = {Path(text).resolve(): "the blade file read" for text in inputs if Path(text).exists()}
    for option, path in outputs.items():
        if path == STDOUT or _written_in_place(path):
            continue
        target = Path(path).resolve()
        twin = next((name for name in taken if name == target or _same_file(name, target)), None)
        if twin is not None:
            raise InvalidInput(option, path, f"give another path: this one is also {taken[twin]}")
        taken[target] = f"that of {option}"


def _same_file(one: Path, other: Path) -> bool:
    """True of hard links too, and of names that differ by case where the file system sees none."""
    return one.exists() and other.exists() and one.samefile(other)


def _written_in_place(path: str | Path) -> bool:
    """True of devices, pipes, and the open files under /dev and /proc: what a rename would replace.

    Raises
    ------
    OSError
        When it is a folder, or anything else that takes no file's content.
    """
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return False
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(0, "it is a folder")
    if stat.S_ISCHR(mode) or stat.S_ISFIFO(mode):
        return True
    if not stat.S_ISREG(mode):
        raise OSError(0, "it is not a plain file")
    return Path(path).is_absolute() and Path(path).parts[1] in ("dev", "proc")


def write_bytes(option: str, path: str | Path, content: bytes) -> None:
    """Write beside `path`, or beside what it links to, then rename; devices and pipes take it directly."""
    with _named(option, str(path)):
        if _written_in_place(path):
            with open(path, "wb") as device:
                device.write(content)
            return
        target = Path(path).resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(name, 0o666 & ~_umask())
            os.replace(name, target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def write_json(path: str, document: dict[str, Any], *, indent: bool = False) -> None:
    """As JSON, NaN as null; ``-`` is stdout."""
    content = to_json(document)
    if indent:
        content = json.dumps(json.loads(content), indent=1).encode()
    if path == STDOUT:
        sys.stdout.write(content.decode() + "\n")
    else:
        write_bytes("--json", path, content + b"\n")


@contextmanager
def _named(option: str, path: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InvalidInput(
            option, path, f"give a path that can be written ({error.strerror or error})"
        ) from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


ShowProgress = Callable[[int, int, str], None]


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[ShowProgress]:
    """A bar on stderr, fed by (done, total, what is next); where nobody watches, a line now and then."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    if not quiet and not console.is_terminal:  # a log file: rich would leave an empty line, and no progress
        yield _progress_lines(title)
        return
    with Progress(*columns, console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task(title, total=None)

        def show(done: int, total: int, text: str) -> None:
            bar.update(task, completed=done, total=total, description=f"{title}: {text}")

        yield show


def _progress_lines(title: str) -> ShowProgress:
    """Says on stderr how far long work is, at most every `PROGRESS_EVERY_S`."""
    started = said = time.monotonic()

    def show(done: int, total: int, text: str) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said >= PROGRESS_EVERY_S:
            said = now
            print(f"{title}: {text} {done} of {total}, {now - started:.0f} s", file=sys.stderr, flush=True)

    return show
