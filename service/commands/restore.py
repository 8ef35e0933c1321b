"""`rubscreen restore`: a data folder, and its database, made of a backup."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import DatabaseOption


def run(
    file: Annotated[str, typer.Argument(metavar="FILE.tar", help="A backup.")],
    data: Annotated[
        str, typer.Option("--data", metavar="FOLDER", help="The new data folder: not there yet, or empty.")
    ],
    database_url: DatabaseOption = None,
) -> None:
    """Restore a backup into a new data folder. Every byte is checked first; a damaged one leaves nothing.

    A backup of PostgreSQL goes into an empty database, given by RUBSCREEN_DATABASE_URL or --database-url.
    Jobs that were under way go on when a service starts there.
    """
    from service.backup.restore import restore
    from service.commands.outputs import progress_bar
    from service.commands.serve import settings_from

    settings = settings_from(data=data, database_url=database_url)
    with progress_bar("MiB") as show:
        done = restore(Path(file), Path(data), settings.database_url, show)
    typer.echo(f"{done.files} files of {done.created_at}, by version {done.version}, are in {done.folder}")
    typer.echo(f"start it with: rubscreen serve --data {done.folder}")
    if done.answers is not None:
        typer.echo(f"  --keep-answers {done.answers}  (it kept its exact answers)")
