"""The command line: `rubscreen`."""

from __future__ import annotations

import os
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from sdm_core.errors import InvalidInput, RubscreenError
from sdm_core.version import __version__
from service.commands import (
    assess,
    backup,
    batch,
    blade,
    boundary,
    demo,
    jobs,
    keys,
    map,
    models,
    paper,
    restore,
    screen,
    sensitivities,
    serve,
    simulate,
    train,
    trainings,
    verify,
)
from service.environment import unknown_variables


class _Commands(TyperGroup):
    """Commands whose refusals are one line on stderr and exit code 2, never a traceback."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except RubscreenError as error:
            typer.echo(f"rubscreen: {_said(error)}", err=True)
            raise typer.Exit(2) from None


def _said(error: RubscreenError) -> str:
    if not isinstance(error, InvalidInput):
        return str(error)
    # One line, whatever the value: a file name or a number typed by somebody may hold anything.
    return " ".join(f"{error.field} = {error.value}: {error.remedy}".split())


app = typer.Typer(
    name="rubscreen",
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"rubscreen {__version__}")
        raise typer.Exit


@app.callback()
def rubscreen(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Screen turbomachinery blades for rub-induced instability."""
    for warning in unknown_variables(os.environ):
        typer.echo(f"rubscreen: warning: {warning}", err=True)


for command in (
    demo,
    serve,
    screen,
    assess,
    map,
    boundary,
    sensitivities,
    simulate,
    verify,
    train,
    paper,
    backup,
    restore,
):
    app.command(command.__name__.rpartition(".")[2])(command.run)

app.add_typer(blade.app, name="blade")
app.add_typer(batch.app, name="batch")
app.add_typer(models.app, name="models")
app.add_typer(trainings.app, name="trainings")
app.add_typer(keys.app, name="keys")
app.add_typer(jobs.app, name="jobs")


if __name__ == "__main__":
    app()
