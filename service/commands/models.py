"""`rubscreen models`: the surrogates there are, and new certificates for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import JsonOption, ModelsOption, UrlOption

if TYPE_CHECKING:
    from rich.table import Table

    from training.certificate import Certificate

app = typer.Typer(help="The surrogates there are; recalibrate one.", invoke_without_command=True)


@app.callback()
def run(
    context: typer.Context, models: ModelsOption = None, url: UrlOption = None, json: JsonOption = None
) -> None:
    """List the surrogates of a folder, or of a running service, the active one marked."""
    if context.invoked_subcommand is not None:
        return
    from rich.table import Table

    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    entries = _of_service(url) if url else _of_folder(models)
    console = console_beside(json)
    table = Table(title="Models", title_justify="left", title_style="bold")
    for heading in ("", "id", "trained on", "median boundary error", "false stable, auto", "certified for"):
        table.add_column(heading, no_wrap=heading == "id")
    for entry in entries:
        table.add_row("active" if entry["active"] else "", entry["id"], *_figures(entry["card"]))
    console.print(table if entries else "no models: train one with `rubscreen train`")
    if json:
        write_json(json, {"models": entries}, indent=True)


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
    activate: Annotated[bool, typer.Option(help="Make the result the folder's active model.")] = True,
) -> None:
    """Give a surrogate a new certificate; its weights and its domain stay.

    A model is named after weights and card, so the result stands beside the old one under a name of its
    own. The points are drawn with a seed derived from the model's, not chosen: trying seeds until one
    pleases proves nothing.

    Example: rubscreen models recalibrate --models out/models
    """
    from pathlib import Path

    from service.commands.outputs import progress_bar
    from training.calibration import CalibrationSettings, recalibrate, seed_of
    from training.certificate import CalibrationFailed
    from training.registry import SHIPPED

    folder = SHIPPED if models is None else Path(models)
    settings = CalibrationSettings(points, evaluation_points, seed_of(model, folder), threads)
    try:
        with progress_bar("recalibrate") as show:
            made, found = recalibrate(
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
    console.print(f"model {made.id} in {folder}{', now active' if activate else ''}")


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


def _of_folder(folder: str | None) -> list[dict[str, Any]]:
    from pathlib import Path

    from sdm_core.errors import InvalidInput
    from training.registry import SHIPPED, list_models

    if folder is not None and not Path(folder).is_dir():
        raise InvalidInput("--models", folder, "give a folder of models")
    found = list_models(SHIPPED if folder is None else Path(folder))
    return [{"id": entry.id, "active": entry.active, "card": entry.card} for entry in found]


def _of_service(url: str) -> list[dict[str, Any]]:
    from service.client import Client

    with Client(url) as client:
        return client.models()


def _figures(card: dict[str, Any]) -> tuple[str, str, str, str]:
    """What a card says of itself; a card of another age may say less."""
    size = f"{card['dataset']['labels']:,} cases" if "labels" in card.get("dataset", {}) else "-"
    errors, wrongs = [], []
    for found in card.get("evaluation", {}).values():
        if "median_boundary_error" in found:
            errors.append(f"{found['median_boundary_error']:.2%}")
        if "false_stable" in found.get("auto", {}):
            wrongs.append(f"{found['auto']['false_stable']} of {found['auto']['answered_stable']:,}")
    certified = []
    for found in card.get("certificates", ()):
        rates = ", ".join(f"{line['alpha']:g}" for line in found["table"])
        certified.append(f"{found['contact']}: {rates}")
    return size, ", ".join(errors) or "-", ", ".join(wrongs) or "-", "; ".join(certified) or "-"
