"""`rubscreen batch`: screenings as durable jobs of a running service."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands import batch_submit
from service.commands.options import (
    LOCAL_SERVICE,
    CsvOption,
    JsonOption,
    ParquetOption,
    ServiceOption,
)

app = typer.Typer(
    help="Many blades as a job of a running service: submit, watch, fetch.", no_args_is_help=True
)
app.command("submit")(batch_submit.run)

Job = Annotated[str, typer.Argument(metavar="ID", help="As `submit` printed it.")]


@app.command()
def status(job: Job, url: ServiceOption = LOCAL_SERVICE, json: JsonOption = None) -> None:
    """Say how far a screening is."""
    from service.client import Client
    from service.commands.job_watching import job_lines
    from service.commands.outputs import check_writable, write_json

    check_writable(json=json)
    with Client(url) as client:
        found = client.screening(job)
    for line in job_lines(found):
        typer.echo(line, err=json == "-")
    if json:
        write_json(json, found.document, indent=True)


@app.command()
def watch(job: Job, url: ServiceOption = LOCAL_SERVICE) -> None:
    """Watch a screening to its end; Ctrl-C leaves it running."""
    from service.client import Client
    from service.commands.job_watching import job_lines, watched

    with Client(url) as client:
        done = watched(client.wait, job, "batch", url)
    for line in job_lines(done):
        typer.echo(line)
    typer.echo(f"  its ranking: rubscreen batch results {job} --url {url}", err=True)


@app.command()
def results(
    job: Job,
    url: ServiceOption = LOCAL_SERVICE,
    contact: Annotated[
        str | None, typer.Option(help="Only rows of this contact.", show_default=False)
    ] = None,
    verdict: Annotated[
        str | None,
        typer.Option(
            help='Only rows of this verdict: "stable", "unstable at some speed" or "not decided".',
            show_default=False,
        ),
    ] = None,
    criteria: Annotated[
        bool | None,
        typer.Option(
            "--meets/--misses", help="Only rows that meet, or miss, the criteria.", show_default=False
        ),
    ] = None,
    json: JsonOption = None,
    csv: CsvOption = None,
    parquet: ParquetOption = None,
) -> None:
    """Show the ranking, safest first, and write it; of what is there while the job runs.

    Example: rubscreen batch results ID --misses --csv to_look_at.csv
    """
    from service.client import Client
    from service.commands.batch_tables import show_results
    from service.commands.outputs import check_writable

    check_writable(json=json, csv=csv, parquet=parquet)
    with Client(url) as client:
        found = client.screening_results(job, contact=contact, verdict=verdict, meets_criteria=criteria)
        show_results(client, found, json=json, csv=csv, parquet=parquet)
    if not found.rows:
        typer.echo(
            "rubscreen: no results fit, or none are there: `rubscreen batch status ID` tells how far it is",
            err=True,
        )


@app.command()
def report(
    job: Job,
    out: Annotated[str, typer.Option("--html", "-o", metavar="FILE", help="Where to.", show_default=False)],
    url: ServiceOption = LOCAL_SERVICE,
    sheets: Annotated[
        int | None,
        typer.Option(
            help="Blades, the riskiest, with a sheet each. Left out: 50.", min=1, show_default=False
        ),
    ] = None,
) -> None:
    """Write the report for reading and printing: one page, pictures within it."""
    from service.client import Client
    from service.commands.outputs import check_writable, write_bytes

    check_writable(html=out)
    with Client(url) as client:
        write_bytes("--html", out, client.screening_report(job, sheets=sheets))
    typer.echo(f"wrote {out}")


@app.command("map")
def map_of(
    job: Job,
    index: Annotated[int, typer.Argument(metavar="INDEX", help="blade_index of a result.", min=0)],
    contact: Annotated[str, typer.Option(help="Name of the contact.", show_default=False)],
    out: Annotated[str, typer.Option("--png", "-o", metavar="FILE", help="Where to.", show_default=False)],
    url: ServiceOption = LOCAL_SERVICE,
) -> None:
    """Draw the stability map of one blade under one contact."""
    from service.client import Client
    from service.commands.outputs import check_writable, write_bytes

    check_writable(png=out)
    with Client(url) as client:
        write_bytes("--png", out, client.screening_map(job, index, contact))
    typer.echo(f"wrote {out}")


@app.command()
def cancel(job: Job, url: ServiceOption = LOCAL_SERVICE) -> None:
    """Let a screening stop; what it stored stays, and `retry` goes on from there."""
    from service.client import Client
    from service.commands.job_watching import job_lines

    with Client(url) as client:
        found = client.cancel(job)
    typer.echo(f"{job_lines(found)[0]}{'' if found.finished else ', stopping'}")


@app.command()
def retry(
    job: Job,
    url: ServiceOption = LOCAL_SERVICE,
    wait: Annotated[bool, typer.Option("--wait", help="Wait for the end.")] = False,
) -> None:
    """Run a screening that is over once more; what is stored and whole is not computed again."""
    from service.client import Client
    from service.commands.job_watching import job_lines, watched

    with Client(url) as client:
        found = client.retry(job)
        if wait:
            found = watched(client.wait, job, "batch", url)
    for line in job_lines(found):
        typer.echo(line)


@app.command("list")
def list_them(
    url: ServiceOption = LOCAL_SERVICE,
    state: Annotated[
        str | None,
        typer.Option(help="One or more, with commas: queued,running,waiting,...", show_default=False),
    ] = None,
    most: Annotated[int, typer.Option(help="Jobs shown.", min=1)] = 50,
    json: JsonOption = None,
) -> None:
    """List screenings, newest first."""
    from itertools import islice

    from service.client import Client
    from service.commands.job_watching import jobs_table
    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    with Client(url) as client:
        found = list(islice(client.screenings(state), most))
    console_beside(json).print(jobs_table(found) if found else "no screenings")
    if json:
        write_json(json, {"jobs": [job.document for job in found]}, indent=True)
