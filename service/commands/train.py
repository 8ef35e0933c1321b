"""`rubscreen train`: a new surrogate from labels of the exact core."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.commands.options import OUTPUT

if TYPE_CHECKING:
    from rich.table import Table

    from training.evaluation import Evaluation

SIZE = "Size"


def run(
    folder: Annotated[
        str,
        typer.Argument(metavar="FOLDER", help="Where models are kept; each gets a folder of its own in it."),
    ] = "out/models",
    seed: Annotated[int, typer.Option(help="Of everything drawn by chance.", min=0)] = 2013,
    threads: Annotated[int, typer.Option(help="Labelling processes.", min=1)] = 2,
    device: Annotated[str, typer.Option(help="Where torch fits: auto, cpu or cuda.")] = "auto",
    cases: Annotated[
        int, typer.Option(help="Cases labelled before the first fit.", min=2048, rich_help_panel=SIZE)
    ] = 98_304,
    cases_each: Annotated[
        int, typer.Option(help="Cases labelled in each round of asking.", min=1024, rich_help_panel=SIZE)
    ] = 49_152,
    rounds: Annotated[
        int,
        typer.Option(
            help="Most rounds of asking; they end when the goal is certified.", min=0, rich_help_panel=SIZE
        ),
    ] = 3,
    epochs: Annotated[
        int, typer.Option(help="Passes over the training set.", min=1, rich_help_panel=SIZE)
    ] = 40,
    points: Annotated[
        int,
        typer.Option(
            help="Independent points of the certificate, each class of contact; 1e-4 takes 92,000.",
            min=20_000,
            rich_help_panel=SIZE,
        ),
    ] = 200_000,
    evaluation_points: Annotated[
        int, typer.Option(help="Further points to evaluate on.", min=1000, rich_help_panel=SIZE)
    ] = 20_000,
    with_served: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Also train on what a service answered exactly (rubscreen serve --keep-answers FOLDER).",
            show_default=False,
        ),
    ] = None,
    activate: Annotated[
        bool, typer.Option(help="Make it the folder's active model, unless it is worse than that.")
    ] = True,
    json: Annotated[
        str | None,
        typer.Option(
            "--json",
            metavar="PATH",
            help="Write its figures; - for stdout.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
) -> None:
    """Label cases with the exact core, fit, ask where it is unsure, calibrate and evaluate a surrogate.

    Labels are kept in a folder `datasets` beside FOLDER: a training that was killed goes on from them.

    Example: rubscreen train out/models --seed 1, then rubscreen map nasa_rotor_37 --models out/models
    """
    from service.commands.models import certificate_table, say_written
    from service.commands.outputs import check_writable, console_beside, progress_bar, write_json
    from training.certificate import CalibrationFailed
    from training.contact_class import in_words
    from training.fit import FitSettings
    from training.pipeline import TrainingSettings, share_in_words, train

    check_writable(json=json, folder=f"{folder}/active")
    settings = TrainingSettings(
        first_cases=cases,
        cases_each=cases_each,
        rounds=rounds,
        monitor_points=min(points, TrainingSettings.monitor_points),
        calibration_points=points,
        evaluation_points=evaluation_points,
        seed=seed,
        threads=threads,
        fit=FitSettings(epochs=epochs, device=device),
    )
    console = console_beside(json)
    try:
        with progress_bar("train") as show:
            made = train(
                Path(folder),
                settings,
                served_folder=None if with_served is None else Path(with_served),
                activate=activate,
                progress=lambda stage, done, of, remark: show(done, of, f"{stage} {remark}"),
            )
    except CalibrationFailed as error:
        typer.echo(
            f"rubscreen: no model was written: {error}. Give it more cases, rounds, epochs or points",
            err=True,
        )
        raise typer.Exit(1) from None
    for certificate in made.model.certificates:
        console.print(certificate_table(certificate))
    for contact, evaluation in made.evaluations.items():
        console.print(_figures(evaluation, in_words(contact)))
        console.print(
            f"boundary error: median {evaluation.median_boundary_error:.2%}, "
            f"99 of 100 below {evaluation.p99_boundary_error:.2%}"
        )
    for one in made.rounds:
        shares = ", ".join(
            f"{in_words(c)} {share_in_words(share)}" for c, share in one.verified_share.items()
        )
        console.print(f"[dim]{one.labels:,} labels: to verify for the goal {shares}[/dim]")
    console.print(f"[dim]seconds: {', '.join(f'{k} {v:g}' for k, v in made.seconds.items())}[/dim]")
    if json:
        evaluations = {contact: found.to_dict() for contact, found in made.evaluations.items()}
        report = {
            "model": made.model.id,
            "seconds": made.seconds,
            "evaluation": evaluations,
            "refused": list(made.refused),
        }
        write_json(json, report, indent=True)
    console.print(f"[dim]labelled cases: {made.dataset_path}[/dim]")
    say_written(console, made.model.id, folder, activate, made.refused)


def _figures(evaluation: Evaluation, contact: str) -> Table:
    from rich.table import Table

    table = Table(
        title=f"On an independent sample of {evaluation.distribution}, {contact}",
        title_justify="left",
        title_style="bold",
    )
    table.add_column("")
    for heading in ("points", "verified", "false stable", "false unstable"):
        table.add_column(heading, justify="right")
    for name, found in (
        ("auto", evaluation.auto),
        ("auto, near the boundary", evaluation.auto_hard),
        ("surrogate alone", evaluation.alone),
        ("alone, near the boundary", evaluation.alone_hard),
    ):
        table.add_row(
            name,
            f"{found.points:,}",
            f"{found.exact_share:.1%}",
            f"{found.false_stable} of {found.answered_stable:,}",
            f"{found.false_unstable} of {found.answered_unstable:,}",
        )
    return table
