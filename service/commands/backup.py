"""`rubscreen backup`: everything a service keeps, in one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import DatabaseOption, DataOption


def run(
    file: Annotated[str, typer.Argument(metavar="FILE.tar", help="A new file; its folder must exist.")],
    data: DataOption = None,
    database_url: DatabaseOption = None,
    models: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="As the service was told. Left out: RUBSCREEN_MODELS_FOLDER, else the data folder's.",
            show_default=False,
        ),
    ] = None,
    keep_answers: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="As the service was told. Left out: RUBSCREEN_SERVED_ANSWERS_FOLDER.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Back up a service, which may run meanwhile: database, jobs, uploads, models, labels, kept answers.

    Run it as the service's user, with the service's settings (RUBSCREEN_...). The file holds no API keys,
    only their hashes. Example: rubscreen backup /backup/rubscreen-$(date +%F).tar
    """
    from service.backup.backup import backup
    from service.commands.outputs import progress_bar
    from service.commands.serve import settings_from

    settings = settings_from(models, keep_answers, data, database_url)
    with progress_bar("MiB") as show:
        made = backup(settings, Path(file), show)
    typer.echo(f"{made.files} files, {made.size_bytes / 2**20:,.1f} MiB in {made.path}")
