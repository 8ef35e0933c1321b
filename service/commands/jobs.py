"""`rubscreen jobs`: the jobs of a service as its database and its data folder have them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from service.commands.options import DatabaseOption, DataOption, JsonOption

if TYPE_CHECKING:
    from pathlib import Path

    from service.jobs.job import Job, State
    from service.jobs.job_folder import JobFolders
    from service.records.jobs import JobRecords
    from service.settings import Settings

app = typer.Typer(
    help="Jobs of the service: list, show, delete old ones. Beside a running service too.",
    no_args_is_help=True,
)

_UNITS_DAYS = {"h": 1 / 24, "d": 1.0, "w": 7.0}


@dataclass(frozen=True)
class _Store:
    """Jobs of a data folder and its database, and where that is."""

    settings: Settings
    data_folder: Path
    records: JobRecords
    folders: JobFolders
    where: str


@app.command(name="list")
def list_jobs(
    state: Annotated[
        str | None,
        typer.Option(metavar="STATE[,STATE...]", help="Only jobs in these states.", show_default=False),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Newest jobs shown, of each kind.")] = 50,
    data: DataOption = None,
    database_url: DatabaseOption = None,
    json: JsonOption = None,
) -> None:
    """List jobs, newest first."""
    from rich.markup import escape
    from rich.table import Table

    from service.commands.outputs import check_writable, console_beside, write_json
    from service.jobs.job import KINDS

    check_writable(json=json)
    states = _states(state)
    with _store(data, database_url) as store:
        found = [job for kind in KINDS for job in store.records.page(kind, states=states, limit=most)]
        where = store.where
    table = Table(title=f"Jobs in {escape(where)}", title_justify="left", title_style="bold")
    for heading in ("id", "kind", "name", "owner", "state", "done", "created, UTC", "over"):
        table.add_column(heading, no_wrap=heading != "name")
    for job in sorted(found, key=lambda job: job.created_at, reverse=True):
        share = f"{job.done} of {job.total}" if job.total else "-"
        who, name = escape(job.owner_name or "-"), escape(job.name or "-")
        at, over = (
            "-" if time is None else f"{time:%Y-%m-%d %H:%M}" for time in (job.created_at, job.finished_at)
        )
        table.add_row(job.id, job.kind, name, who, job.state.value, share, at, over)
    console_beside(json).print(table if found else f"no such jobs in {where}")
    if json:
        write_json(json, {"jobs": [job.to_dict() for job in found]}, indent=True)


@app.command()
def show(
    job: Annotated[str, typer.Argument(metavar="ID", help="Of the job, or how it begins.")],
    data: DataOption = None,
    database_url: DatabaseOption = None,
) -> None:
    """Show a job: its state, what it was asked, what lies in its folder."""
    from service.commands.outputs import STDOUT, write_json

    with _store(data, database_url) as store:
        found = _one(store.records, job)
        folder = store.folders.of(found.id)
        files = [path for path in folder.path.rglob("*") if path.is_file()]
        document = found.to_dict() | {
            "folder": str(folder.path),
            "files": len(files),
            "size_bytes": sum(path.stat().st_size for path in files),
            "request": folder.request() if files else None,
        }
    write_json(STDOUT, document, indent=True)


@app.command()
def prune(
    older_than: Annotated[
        str | None,
        typer.Option(
            metavar="30d",
            help="Delete jobs that have been over for so many h, d or w. Left out: as "
            "RUBSCREEN_KEEP_JOBS_DAYS says.",
            show_default=False,
        ),
    ] = None,
    uploads_older_than: Annotated[
        str | None,
        typer.Option(
            metavar="7d",
            help="Delete uploads that came so long ago. Left out: as RUBSCREEN_KEEP_UPLOADS_DAYS says.",
            show_default=False,
        ),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be deleted.")] = False,
    data: DataOption = None,
    database_url: DatabaseOption = None,
) -> None:
    """Delete jobs that are over, with their results, and uploads. A job under way is never deleted.

    The service does the same by itself every hour. Example: rubscreen jobs prune --older-than 30d --dry-run
    """
    from service.jobs.retention import Keep, Retention, nothing_deleted

    with _store(data, database_url) as store:
        settings = store.settings
        jobs_days = settings.keep_jobs_days if older_than is None else days("--older-than", older_than)
        uploads_days = settings.keep_uploads_days
        if uploads_older_than is not None:
            uploads_days = days("--uploads-older-than", uploads_older_than)
        keep = Keep(jobs_days, uploads_days)
        # The queue's own rows are left to the service: on SQLite only it may open the queue.
        retention = Retention(store.records, store.folders)
        if dry_run:
            old = retention.old(keep)
            for job in old.jobs:
                typer.echo(_line(job))
            typer.echo(f"{len(old.jobs)} jobs and {len(old.uploads)} uploads would be deleted", err=True)
            return
        with nothing_deleted(store.data_folder, wait_s=30.0):
            retention.tidy()
            old, gone = retention.old(keep), 0
            for job in retention.delete(old):
                typer.echo(_line(job))
                gone += 1
    typer.echo(f"{gone} jobs and {len(old.uploads)} uploads deleted", err=True)


def days(option: str, text: str) -> float:
    """The days that ``12h``, ``30d`` or ``4w`` are.

    Raises
    ------
    InvalidInput
        Naming the option.

    Examples
    --------
    >>> days("--older-than", "36h"), days("--older-than", "2w")
    (1.5, 14.0)
    """
    from sdm_core.errors import InvalidInput

    found = re.fullmatch(r"(\d{1,6})([hdw])", text)
    if found is None or int(found[1]) == 0:
        raise InvalidInput(option, text, "give hours, days or weeks, e.g. 12h, 30d or 4w")
    return int(found[1]) * _UNITS_DAYS[found[2]]


def _states(text: str | None) -> tuple[State, ...]:
    from sdm_core.errors import InvalidInput
    from service.jobs.job import State

    names = [] if text is None else [name.strip() for name in text.split(",")]
    known = {state.value: state for state in State}
    if unknown := [name for name in names if name not in known]:
        raise InvalidInput("--state", unknown[0], f"give one or more of {', '.join(known)}")
    return tuple(known[name] for name in names)


def _line(job: Job) -> str:
    over = "" if job.finished_at is None else f"{job.finished_at:%Y-%m-%d %H:%M}"
    return f"{job.id} {job.kind} {job.state.value} since {over} UTC {job.name or ''}".rstrip()


def _one(records: JobRecords, text: str) -> Job:
    from sdm_core.errors import InvalidInput

    found = records.beginning(text) if re.fullmatch(r"[0-9a-f]{1,32}", text) else []
    if len(found) != 1:
        said = "several jobs begin so" if found else "no job begins so"
        raise InvalidInput("ID", text, f"{said}: give an id that `rubscreen jobs list` shows")
    return found[0]


@contextmanager
def _store(data: str | None, database_url: str | None) -> Iterator[_Store]:
    """The jobs of a data folder that is there.

    Raises
    ------
    InvalidInput
        When it is not: a folder made by mistake would show no jobs and say nothing.
    """
    from sdm_core.errors import InvalidInput
    from service.commands.serve import settings_from
    from service.jobs.job_folder import JobFolders
    from service.records.database import open_database
    from service.records.jobs import JobRecords

    settings = settings_from(data=data, database_url=database_url)
    folder = settings.data_folder
    assert folder is not None
    if not (folder / "jobs").is_dir():
        raise InvalidInput(
            "--data", str(folder), "give the data folder of a service: there are no jobs in it"
        )
    database = open_database(folder, settings.database_url)
    try:
        yield _Store(settings, folder, JobRecords(database), JobFolders(folder), database.shown)
    finally:
        database.close()
