"""A progress bar for large questions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from service.client import conversations


@contextmanager
def progress_bar(title: str, console: Console | None = None) -> Iterator[conversations.Progress]:
    """A bar on stderr, to be given as `progress`; away again when the block ends.

    Examples
    --------
    >>> with progress_bar("points") as progress:
    ...     progress(100_000, 1_000_000)
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console or Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)

        def show(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield show
