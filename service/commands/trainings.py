"""`rubscreen trainings`: retraining as durable jobs of a running service, now or by the calendar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import LOCAL_SERVICE, JsonOption, ServiceOption

if TYPE_CHECKING:
    from service.client import TrainingQuestion
    from service.rest.job_schemas import ScheduleReply, TrainedReply

app = typer.Typer(
    help="Retrain on a running service (role admin): submit, watch, by the calendar.", no_args_is_help=True
)
SIZE = "Size"
Job = Annotated[str, typer.Argument(metavar="ID", help="As `submit` printed it.")]


def _size(text: str) -> Any:
    return typer.Option(help=text, min=0, rich_help_panel=SIZE, show_default=False)


Name = Annotated[str | None, typer.Option(help="In lists.", show_default=False)]
Seed = Annotated[
    int | None, typer.Option(help="Left out: one of its own each time.", min=0, show_default=False)
]
Cases = Annotated[
    int | None, _size("Cases labelled before the first fit. Left out, all as the shipped model.")
]
CasesEach = Annotated[int | None, _size("Cases labelled in each round of asking.")]
Rounds = Annotated[int | None, _size("Most rounds of asking.")]
Epochs = Annotated[int | None, _size("Passes over the training set.")]
Points = Annotated[int | None, _size("Independent points of the certificate, each class of contact.")]
EvaluationPoints = Annotated[int | None, _size("Further points to evaluate on.")]
Threads = Annotated[int | None, typer.Option(help="Labelling processes.", min=1, show_default=False)]
WithServed = Annotated[
    bool, typer.Option("--with-served", help="Also train on what the service answered exactly.")
]
Promote = Annotated[bool, typer.Option(help="Make the model active, unless it is worse than the active one.")]
Priority = Annotated[int | None, typer.Option(help="1 is first, 9 last.", min=1, max=9, show_default=False)]


@app.command()
def submit(
    url: ServiceOption = LOCAL_SERVICE,
    name: Name = None,
    seed: Seed = None,
    cases: Cases = None,
    cases_each: CasesEach = None,
    rounds: Rounds = None,
    epochs: Epochs = None,
    points: Points = None,
    evaluation_points: EvaluationPoints = None,
    threads: Threads = None,
    with_served: WithServed = False,
    promote: Promote = True,
    priority: Priority = None,
    idempotency_key: Annotated[
        str | None,
        typer.Option(
            metavar="KEY", help="The same training under the same key is the same job.", show_default=False
        ),
    ] = None,
    wait: Annotated[bool, typer.Option("--wait", help="Wait for the end, and say what came of it.")] = False,
    json: JsonOption = None,
) -> None:
    """Train a new model there; it becomes the active one unless the promotion gate refuses it.

    Example: rubscreen trainings submit --rounds 2 --with-served --wait
    """
    from service.client import Client
    from service.commands.job_watching import watched
    from service.commands.outputs import check_writable, write_json

    check_writable(json=json)
    asked = _training(
        name=name,
        seed=seed,
        first_cases=cases,
        cases_each=cases_each,
        rounds=rounds,
        epochs=epochs,
        points=points,
        evaluation_points=evaluation_points,
        threads=threads,
        with_served=with_served or None,
        promote=None if promote else False,
        priority=priority,
    )
    with Client(url) as client:
        job = client.submit_training(asked, idempotency_key=idempotency_key)
        if not wait:
            if json:
                write_json(json, job.document, indent=True)
            if json != "-":
                typer.echo(job.id)
            typer.echo(f"  watch it: rubscreen trainings watch {job.id} --url {url}", err=True)
            return
        typer.echo(f"rubscreen: training {job.id}", err=True)
        watched(client.wait_training, job.id, "trainings", url)
        made = client.training_result(job.id)
    _say_made(made, err=json == "-")
    if json:
        write_json(json, made.model_dump(), indent=True)


@app.command()
def status(job: Job, url: ServiceOption = LOCAL_SERVICE, json: JsonOption = None) -> None:
    """Say how far a training is."""
    from service.client import Client
    from service.commands.job_watching import job_lines
    from service.commands.outputs import check_writable, write_json

    check_writable(json=json)
    with Client(url) as client:
        found = client.training(job)
    for line in job_lines(found):
        typer.echo(line, err=json == "-")
    if json:
        write_json(json, found.document, indent=True)


@app.command()
def watch(job: Job, url: ServiceOption = LOCAL_SERVICE) -> None:
    """Watch a training to its end, and say what came of it; Ctrl-C leaves it running."""
    from service.client import Client
    from service.commands.job_watching import watched

    with Client(url) as client:
        watched(client.wait_training, job, "trainings", url)
        _say_made(client.training_result(job))


@app.command()
def cancel(job: Job, url: ServiceOption = LOCAL_SERVICE) -> None:
    """Let a training stop; its labels stay, and `retry` goes on from them."""
    from service.client import Client
    from service.commands.job_watching import job_lines

    with Client(url) as client:
        found = client.cancel_training(job)
    typer.echo(f"{job_lines(found)[0]}{'' if found.finished else ', stopping'}")


@app.command()
def retry(job: Job, url: ServiceOption = LOCAL_SERVICE) -> None:
    """Run a training that is over once more, from the labels that are there."""
    from service.client import Client
    from service.commands.job_watching import job_lines

    with Client(url) as client:
        found = client.retry_training(job)
    typer.echo(job_lines(found)[0])


@app.command("list")
def list_them(
    url: ServiceOption = LOCAL_SERVICE,
    state: Annotated[str | None, typer.Option(help="One or more, with commas.", show_default=False)] = None,
    most: Annotated[int, typer.Option(help="Jobs shown.", min=1)] = 50,
    json: JsonOption = None,
) -> None:
    """List trainings, newest first."""
    from itertools import islice

    from service.client import Client
    from service.commands.job_watching import jobs_table
    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    with Client(url) as client:
        found = list(islice(client.trainings(state), most))
    console_beside(json).print(jobs_table(found) if found else "no trainings")
    if json:
        write_json(json, {"jobs": [job.document for job in found]}, indent=True)


@app.command()
def schedule(
    cron: Annotated[
        str | None,
        typer.Argument(
            metavar="[CRON]",
            help='Five fields, e.g. "0 3 * * SUN": Sundays at three. Left out: show the schedule.',
            show_default=False,
        ),
    ] = None,
    url: ServiceOption = LOCAL_SERVICE,
    timezone: Annotated[str, typer.Option(help="IANA name, e.g. Europe/Paris.")] = "UTC",
    off: Annotated[bool, typer.Option("--off", help="Train by the calendar no longer.")] = False,
    rounds: Rounds = None,
    epochs: Epochs = None,
    with_served: WithServed = False,
    promote: Promote = True,
    json: JsonOption = None,
) -> None:
    """Train again and again, by the calendar; show when, or stop it.

    Example: rubscreen trainings schedule "0 3 * * SUN" --timezone Europe/Paris --with-served
    """
    from sdm_core.errors import InvalidInput
    from service.client import Client
    from service.commands.outputs import check_writable, write_json

    if off and cron is not None:
        raise InvalidInput("--off", cron, "give either a schedule or --off")
    check_writable(json=json)
    with Client(url) as client:
        if off:
            found = client.unschedule_trainings()
        elif cron is None:
            found = client.training_schedule()
        else:
            asked = _training(
                rounds=rounds,
                epochs=epochs,
                with_served=with_served or None,
                promote=None if promote else False,
            )
            found = client.schedule_trainings(cron, timezone, asked)
    typer.echo(_said(found), err=json == "-")
    if json:
        write_json(json, found.model_dump(), indent=True)


def _training(**given: Any) -> TrainingQuestion:
    """What was typed as the question it makes.

    Raises
    ------
    InvalidInput
        Naming the option.
    """
    from pydantic import ValidationError

    from sdm_core.errors import InvalidInput
    from service.client import TrainingQuestion

    try:
        return TrainingQuestion(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        name = str(fault["loc"][0])
        option = {"first_cases": "cases"}.get(name, name).replace("_", "-")
        raise InvalidInput(f"--{option}", fault["input"], fault["msg"]) from None


def _said(schedule: ScheduleReply) -> str:
    if schedule.cron is None:
        return "no training is scheduled"
    return f"{schedule.cron} ({schedule.timezone}), next {schedule.next}"


def _say_made(made: TrainedReply, *, err: bool = False) -> None:
    typer.echo(f"model {made.model}{', now active' if made.promoted else ', not active'}", err=err)
    for reason in made.refused:
        typer.echo(f"  {reason}", err=err)
