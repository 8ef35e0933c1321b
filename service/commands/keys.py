"""`rubscreen keys`: who may call the service."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import DataOption, JsonOption
from service.roles import Role

if TYPE_CHECKING:
    from service.records.keys import ApiKey, KeyStore

app = typer.Typer(help="API keys of the service: create, list, revoke.", no_args_is_help=True)

_UNITS_S = {"h": 3600.0, "d": 86400.0, "w": 7 * 86400.0}


@app.command()
def create(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the person or the tool that gets it.")],
    role: Annotated[
        Role,
        typer.Option(
            help="read: ask questions, see models, jobs and results; submit: also start jobs and upload; "
            "admin: also exchange models."
        ),
    ],
    expires: Annotated[
        str | None,
        typer.Option(
            metavar="90d|DATE",
            help="From when it is of no use: after so many h, d or w, or 2027-01-31 (UTC). Left out: never.",
            show_default=False,
        ),
    ] = None,
    requests_per_minute: Annotated[
        int | None, typer.Option(help="Left out: as RUBSCREEN_REQUESTS_PER_MINUTE says.", show_default=False)
    ] = None,
    max_concurrent_requests: Annotated[
        int | None,
        typer.Option(help="Left out: as RUBSCREEN_MAX_CONCURRENT_REQUESTS says.", show_default=False),
    ] = None,
    max_active_jobs: Annotated[
        int | None, typer.Option(help="Left out: as RUBSCREEN_MAX_ACTIVE_JOBS says.", show_default=False)
    ] = None,
    data: DataOption = None,
) -> None:
    """Make a key and print it, this once: only a hash of it is kept.

    Example: rubscreen keys create "design office" --role submit --expires 90d
    """
    from sdm_core.errors import InvalidInput
    from service.records.keys import KeyLimits

    until = None if expires is None else expiry(expires, time.time())
    try:
        limits = KeyLimits(requests_per_minute, max_concurrent_requests, max_active_jobs)
    except InvalidInput as error:
        raise InvalidInput(f"--{error.field.replace('_', '-')}", error.value, error.remedy) from None
    with _store(data) as (store, where):
        key, text = store.create(name, role, until, limits)
    ends = "" if until is None else f", until {_shown(until)}"
    typer.echo(f"key {key.id} ({key.name}), role {role.value}{ends}, in {where}", err=True)
    typer.echo("It is shown this once; clients send it as `Authorization: Bearer KEY`:", err=True)
    typer.echo(text)


@app.command(name="list")
def list_keys(data: DataOption = None, json: JsonOption = None) -> None:
    """List the keys there are or were, with when each was last used."""
    from rich.table import Table
    from rich.text import Text

    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    with _store(data) as (store, where):
        keys = store.all()
    entries = [_entry(key) for key in keys]
    table = Table(title=Text(f"Keys in {where}"), title_justify="left", title_style="bold")
    for heading in ("id", "name", "role", "", "created, UTC", "last used", "expires", "limits of its own"):
        table.add_column(heading, no_wrap=heading != "name")
    for key, entry in zip(keys, entries, strict=True):
        times = (_shown(at) for at in (key.created_at, key.last_used_at, key.expires_at))
        own = ", ".join(f"{name} {value}" for name, value in vars(key.limits).items() if value is not None)
        table.add_row(key.id, Text(key.name), key.role.value, entry["state"], *times, own or "-")
    console = console_beside(json)
    console.print(table if keys else Text(f"no keys in {where}: make one with `rubscreen keys create`"))
    if json:
        write_json(json, {"keys": entries}, indent=True)


@app.command()
def revoke(
    key: Annotated[str, typer.Argument(metavar="ID", help="As `keys list` shows it.")],
    data: DataOption = None,
) -> None:
    """Make a key useless, for good; every running service notices within five seconds."""
    # Whoever has the key at hand pastes it whole, and no error may show it again.
    key_id = key.split("_")[1] if key.startswith("rub_") else key
    with _store(data) as (store, _):
        revoked = store.revoke(key_id)
    assert revoked.revoked_at is not None
    typer.echo(f"key {revoked.id} ({revoked.name}) is revoked since {_shown(revoked.revoked_at)} UTC")


def expiry(text: str, now: float) -> float:
    """The time, s since 1970, that ``90d`` from now on or a date means.

    Raises
    ------
    InvalidInput
        When it is neither, or has passed.

    Examples
    --------
    >>> expiry("2w", 0.0) == expiry("14d", 0.0) == expiry("1970-01-15", 0.0)
    True
    """
    from sdm_core.errors import InvalidInput

    remedy = "give hours, days or weeks, e.g. 12h, 90d or 4w, or a date to come, e.g. 2027-01-31"
    if found := re.fullmatch(r"(\d{1,6})([hdw])", text):
        until = now + int(found[1]) * _UNITS_S[found[2]]
    else:
        try:
            date = datetime.fromisoformat(text)
            until = (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
        except (ValueError, OverflowError):
            raise InvalidInput("--expires", text, remedy) from None
    if until <= now:
        raise InvalidInput("--expires", text, remedy)
    return until


@contextmanager
def _store(data: str | None) -> Iterator[tuple[KeyStore, str]]:
    """The keys of a folder, or of RUBSCREEN_DATABASE_URL, and where that is."""
    from service.commands.serve import settings_from
    from service.records.database import open_database
    from service.records.keys import KeyStore

    settings = settings_from(data=data)
    assert settings.data_folder is not None
    database = open_database(settings.data_folder, settings.database_url)
    try:
        yield KeyStore(database), database.shown
    finally:
        database.close()


def _entry(key: ApiKey) -> dict[str, Any]:
    times = ("created_at", "expires_at", "revoked_at", "last_used_at")
    return {
        "id": key.id,
        "name": key.name,
        "role": key.role.value,
        "state": key.state(time.time()),
        **{name: _iso(getattr(key, name)) for name in times},
        **vars(key.limits),
    }


def _iso(at: float | None) -> str | None:
    return None if at is None else datetime.fromtimestamp(at, UTC).isoformat(timespec="seconds")


def _shown(at: float | None) -> str:
    return "-" if at is None else f"{datetime.fromtimestamp(at, UTC):%Y-%m-%d %H:%M}"
