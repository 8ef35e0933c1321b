"""Progress bars for large questions and for jobs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from service.client import conversations
from service.client.job_conversations import Watch
from service.client.job_status import JobStatus


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


@contextmanager
def job_bar(title: str = "", console: Console | None = None) -> Iterator[Watch]:
    """A bar on stderr, to be given to `wait` as `progress`: blades, stage, time left as the service has it.

    Examples
    --------
    >>> with job_bar("first stage") as progress:
    ...     pass  # client.wait(job.id, progress)
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=console or Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(title), total=None, left="")

        def show(job: JobStatus) -> None:
            left = job.progress.remaining_s
            bar.update(
                task,
                completed=job.progress.done,
                total=job.progress.total or None,
                description=escape(f"{title or job.name or job.kind}: {job.in_words}"),
                left="" if left is None else f"{left:,.0f} s left",
            )

        yield show
