"""Files that are whole or not there at all, and what goes to the terminal."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from sdm_core.errors import InvalidInput
from service.rest.replies import to_json

STDOUT = "-"


def console_beside(json_path: str | None) -> Console:
    """Where tables go: stdout, or stderr when stdout carries the JSON."""
    return terminal(stderr=json_path == STDOUT)


def terminal(*, stderr: bool = False) -> Console:
    """A console that leaves lines whole; without a terminal, wide enough for every table."""
    made = Console(stderr=stderr, soft_wrap=True)
    if not made.is_terminal and "COLUMNS" not in os.environ:
        made.width = 120
    return made


def check_writable(**paths: str | None) -> None:
    """Refuse outputs that cannot be written, before any work is done.

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
            if Path(path).is_dir():
                raise IsADirectoryError(0, "it is a folder")
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            if not os.access(Path(path).parent, os.W_OK):
                raise PermissionError(0, "permission denied")


def write_bytes(option: str, path: str | Path, content: bytes) -> None:
    """Write beside `path`, then rename onto it."""
    target = Path(path)
    with _named(option, str(path)):
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
        raise InvalidInput(option, path, f"give a path that can be written ({error.strerror})") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


ShowProgress = Callable[[int, int, str], None]


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[ShowProgress]:
    """A bar on stderr, fed by (done, total, what is next)."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet) as bar:
        task = bar.add_task(title, total=None)

        def show(done: int, total: int, text: str) -> None:
            bar.update(task, completed=done, total=total, description=f"{title}: {text}")

        yield show
