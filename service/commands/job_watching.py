"""A job of a service watched from the terminal, and jobs as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from service.client import JobStatus
from service.commands.outputs import progress_bar

if TYPE_CHECKING:
    from service.client.job_conversations import Watch

INTERRUPTED = 130


def watched(wait: Callable[[str, Watch], JobStatus], job_id: str, command: str, url: str) -> JobStatus:
    """Wait for the end of a job with a bar; Ctrl-C leaves the job alone.

    Parameters
    ----------
    wait
        `Client.wait` or `Client.wait_training`.
    command
        What watches it again, e.g. ``batch``.

    Raises
    ------
    JobNotDone, ServiceProblem
    """
    try:
        with progress_bar(f"{command} {job_id[:8]}") as show:

            def told(job: JobStatus) -> None:
                left = job.progress.remaining_s
                remark = "" if left is None else f", {_span(left)} left"
                show(job.progress.done, job.progress.total, f"{job.in_words}{remark}")

            return wait(job_id, told)
    except KeyboardInterrupt:
        typer.echo(
            f"rubscreen: the job goes on; watch it again: rubscreen {command} watch {job_id} --url {url}",
            err=True,
        )
        raise typer.Exit(INTERRUPTED) from None


def jobs_table(jobs: Iterable[JobStatus]) -> Table:
    """One row a job."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("id", "name", "state", "done", "created, UTC", "took", "priority", "owner"):
        right = heading in ("done", "took", "priority")
        table.add_column(heading, no_wrap=heading == "id", justify="right" if right else "left")
    for job in jobs:
        said = job.progress
        table.add_row(
            job.id,
            Text(job.name or "-"),
            job.state.value,
            f"{said.done} of {said.total}" if said.total else "-",
            f"{job.created_at:%Y-%m-%d %H:%M}",
            _took(job),
            str(job.priority),
            Text(job.owner or "-"),
        )
    return table


def job_lines(job: JobStatus) -> list[str]:
    """A job in words."""
    said = job.progress
    lines = [f"{job.kind} {job.id}{f' ({job.name})' if job.name else ''}: {job.state.value}"]
    if job.waiting_for is not None:
        lines.append(f"  waiting for {job.waiting_for}; it goes on by itself")
    elif said.stage:
        lines.append(f"  {said.stage}")
    if said.total:
        left = "" if said.remaining_s is None else f", {_span(said.remaining_s)} left"
        lines.append(f"  {said.done} of {said.total} ({said.share:.0%}){left}")
    if job.not_screened:
        many = "1 blade" if job.not_screened == 1 else f"{job.not_screened} blades"
        lines.append(f"  {many} could not be screened")
    if job.fault is not None:
        lines.append(f"  {job.fault.field} = {job.fault.value}: {job.fault.remedy}")
    return [
        " ".join(line.split()) if i == 0 else "  " + " ".join(line.split()) for i, line in enumerate(lines)
    ]


def _took(job: JobStatus) -> str:
    if job.started_at is None or job.finished_at is None:
        return "-"
    return _span((job.finished_at - job.started_at).total_seconds())


def _span(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
