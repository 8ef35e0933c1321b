"""`rubscreen models`: the surrogates there are, which of them is active, new certificates for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import JsonOption, ModelsOption, UrlOption

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console
    from rich.table import Table

    from training.activation import Activation
    from training.certificate import Certificate

app = typer.Typer(
    help="The surrogates there are; promote one, roll back, recalibrate.", invoke_without_command=True
)


@app.callback()
def run(
    context: typer.Context,
    models: ModelsOption = None,
    url: UrlOption = None,
    history: Annotated[bool, typer.Option(help="Also show which model was active when.")] = False,
    json: JsonOption = None,
) -> None:
    """List the surrogates of a folder, or of a running service, the active one marked."""
    if context.invoked_subcommand is None:
        _list(models, url, history, json)


@app.command("list")
def list_them(models: ModelsOption = None, url: UrlOption = None, json: JsonOption = None) -> None:
    """List the surrogates of a folder, or of a running service, the active one marked."""
    _list(models, url, False, json)


@app.command("history")
def show_history(models: ModelsOption = None, url: UrlOption = None, json: JsonOption = None) -> None:
    """Show which surrogate was active when, and what spoke against those that were forced."""
    from dataclasses import asdict

    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    changes = _history_of(models, url)
    console_beside(json).print(_history_table(changes) if changes else "no change of the model is on record")
    if json:
        write_json(json, {"history": [asdict(change) for change in changes]}, indent=True)


def _list(models: str | None, url: str | None, history: bool, json: str | None) -> None:
    from dataclasses import asdict

    from rich.table import Table

    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    _check_one_place(models, url)
    entries = _of_service(url) if url else _of_folder(models)
    console = console_beside(json)
    table = Table(title="Models", title_justify="left", title_style="bold")
    for heading in ("", "id", "trained on", "median boundary error", "false stable, auto", "certified for"):
        table.add_column(heading, no_wrap=heading == "id")
    for entry in entries:
        table.add_row("active" if entry["active"] else "", entry["id"], *_figures(entry["card"]))
    console.print(table if entries else "no models: train one with `rubscreen train`")
    for entry in entries:
        if entry.get("damage"):
            console.print(f"{entry['id']} is damaged: {entry['damage']}", markup=False)
    changes = _history_of(models, url) if history else ()
    if history:
        console.print(_history_table(changes))
    if json:
        said = {"history": [asdict(change) for change in changes]} if history else {}
        write_json(json, {"models": entries, **said}, indent=True)


@app.command()
def promote(
    model: Annotated[str, typer.Argument(metavar="ID", help="The model to become active.")],
    models: ModelsOption = None,
    url: UrlOption = None,
    force: Annotated[bool, typer.Option("--force", help="Promote it though it is worse.")] = False,
) -> None:
    """Make a surrogate the active one, unless its certificate or its figures are worse than the active one's.

    It is also measured anew on fresh points. A running service takes it up by itself.

    Example: rubscreen models promote 0123456789abcdef --models out/models
    """
    from rich.console import Console

    from service.commands.model_places import place_of
    from training.promotion import PromotionRefused

    _check_one_place(models, url)
    place = place_of(url, None if url else _folder(models))
    try:
        with Console(stderr=True).status("measuring it on fresh points"):
            made = place.promote(model, force=force)
    except PromotionRefused as refused:
        typer.echo(f"rubscreen: {model} is not promoted:", err=True)
        for reason in refused.reasons:
            typer.echo(f"  {reason}", err=True)
        typer.echo("Use --force to promote it all the same", err=True)
        raise typer.Exit(1) from None
    if made.was == made.model:
        typer.echo(f"{made.model} is active already")
        return
    for reason in made.overridden:
        typer.echo(f"forced, although {reason}")
    typer.echo(f"{made.model} is active in {place.name}, after {made.was or 'none'}")


@app.command()
def rollback(models: ModelsOption = None, url: UrlOption = None) -> None:
    """Make the surrogate active again that was before the active one; once more, the one before that."""
    from service.commands.model_places import place_of

    _check_one_place(models, url)
    place = place_of(url, None if url else _folder(models))
    made = place.rollback()
    typer.echo(f"{made.model} is active again in {place.name}, instead of {made.was}")


@app.command()
def recalibrate(
    model: Annotated[
        str | None,
        typer.Argument(metavar="[ID]", help="Left out: the folder's active model.", show_default=False),
    ] = None,
    models: ModelsOption = None,
    points: Annotated[int, typer.Option(help="Independent points of the certificate.", min=20_000)] = 200_000,
    evaluation_points: Annotated[int, typer.Option(help="Further points to evaluate on.", min=1000)] = 20_000,
    threads: Annotated[int, typer.Option(help="Labelling processes.", min=1)] = 2,
    activate: Annotated[
        bool, typer.Option(help="Make it the folder's active model, unless it is worse than that.")
    ] = True,
) -> None:
    """Give a surrogate a new certificate; its weights and its domain stay.

    A model is named after weights and card, so the result stands beside the old one under a name of its
    own. The points are drawn with a seed derived from the model's, not chosen: trying seeds until one
    pleases proves nothing.

    Example: rubscreen models recalibrate --models out/models
    """
    from service.commands.outputs import progress_bar
    from training.calibration import CalibrationSettings, recalibrate, seed_of
    from training.certificate import CalibrationFailed

    folder = _folder(models)
    settings = CalibrationSettings(points, evaluation_points, seed_of(model, folder), threads)
    try:
        with progress_bar("recalibrate") as show:
            made, found, refused = recalibrate(
                model,
                folder,
                settings,
                activate=activate,
                progress=lambda stage, done, of, remark: show(done, of, f"{stage} {remark}"),
            )
    except CalibrationFailed as error:
        typer.echo(f"rubscreen: no model was written: {error}. Give it more points", err=True)
        raise typer.Exit(1) from None
    from rich.console import Console

    console = Console()
    for certificate in found.certificates:
        console.print(certificate_table(certificate))
    say_written(console, made.id, str(folder), activate, refused)


def say_written(
    console: Console, model_id: str, folder: str, activate: bool, refused: tuple[str, ...]
) -> None:
    """Say that a model was written, and whether it is active; one refused ends the command with code 1."""
    if not refused:
        console.print(f"model {model_id} in {folder}{', now active' if activate else ''}")
        return
    console.print(f"model {model_id} in {folder}, not active: it is worse than the active one")
    for reason in refused:
        typer.echo(f"  {reason}", err=True)
    typer.echo(f"Use `rubscreen models promote {model_id} --force` to activate it all the same", err=True)
    raise typer.Exit(1)


def certificate_table(certificate: Certificate) -> Table:
    """What is certified, one line a rate."""
    from rich.table import Table

    table = Table(
        title=f"{certificate.points:,} points of {certificate.distribution}, {certificate.contact} contact: "
        f"all lines true together with {certificate.confidence:.0%} confidence",
        title_justify="left",
        title_style="bold",
    )
    for heading in ("false stable below", "band, spreads", "errors", "verified", "false unstable, observed"):
        table.add_column(heading, justify="right")
    for line in certificate.table:
        table.add_row(
            f"{line.alpha:g}",
            f"{line.spreads:g}",
            f"{line.errors} of {line.accepted:,}",
            f"{line.verified_share:.2%}",
            f"{line.false_unstable_rate:.2g}",
        )
    for alpha in certificate.not_reached:
        table.add_row(f"{alpha:g}", "not reached", "", "", "")
    return table


def _folder(models: str | None) -> Path:
    """The folder named, or the shipped one.

    Raises
    ------
    InvalidInput
        When there is none.
    """
    from pathlib import Path

    from sdm_core.errors import InvalidInput
    from training.registry import SHIPPED

    if models is not None and not Path(models).is_dir():
        raise InvalidInput("--models", models, "give a folder of models")
    return SHIPPED if models is None else Path(models)


def _of_folder(models: str | None) -> list[dict[str, Any]]:
    from training.registry import list_models

    found = list_models(_folder(models))
    return [
        {"id": entry.id, "active": entry.active, "card": entry.card, "damage": entry.damage}
        for entry in found
    ]


def _history_of(models: str | None, url: str | None) -> tuple[Activation, ...]:
    from service.commands.model_places import place_of

    _check_one_place(models, url)
    return place_of(url, None if url else _folder(models)).history()


def _check_one_place(models: str | None, url: str | None) -> None:
    from sdm_core.errors import InvalidInput

    if models is not None and url is not None:
        raise InvalidInput("--models", models, "leave it out with --url: the service has its own")


def _history_table(changes: tuple[Activation, ...]) -> Table:
    from rich.table import Table

    table = Table(title="History, oldest first", title_justify="left", title_style="bold")
    for heading in ("UTC", "", "active from then on", "before", "forced although"):
        table.add_column(heading)
    for change in changes:
        reasons = "; ".join(change.reasons) if change.forced else ""
        table.add_row(change.at[:19], change.event, change.model, change.was or "-", reasons)
    return table


def _of_service(url: str) -> list[dict[str, Any]]:
    from service.client import Client

    with Client(url) as client:
        return client.models()


def _figures(card: dict[str, Any]) -> tuple[str, str, str, str]:
    """What a card says of itself; a card of another age may say less."""
    from training.contact_class import PERMANENT
    from training.held_out import held_out

    dataset, found = card.get("dataset", {}), held_out(card)
    size = f"{dataset['labels']:,} cases" if isinstance(dataset.get("labels"), int) else "-"
    errors, wrong = [], []
    for contact, figures in found.items():
        where = "" if list(found) == [PERMANENT] else f"{contact}: "
        if 0.5 in figures.boundary_error:
            errors.append(f"{where}{figures.boundary_error[0.5]:.2%}")
        if ("auto", "false_stable") in figures.counts:
            wrong.append(f"{where}{figures.counts['auto', 'false_stable']}")
    certified = []
    for certificate in card.get("certificates", ()):
        rates = ", ".join(f"{line['alpha']:g}" for line in certificate["table"])
        certified.append(f"{certificate['contact']}: {rates}")
    return size, "; ".join(errors) or "-", "; ".join(wrong) or "-", "; ".join(certified) or "-"
