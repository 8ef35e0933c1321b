"""`rubscreen batch submit`: blades of this machine as a durable job of a running service."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import (
    CONTACT,
    LOCAL_SERVICE,
    OUTPUT,
    AlphaOption,
    ArcsOption,
    CsvOption,
    EngagementOption,
    JsonOption,
    KeMaxOption,
    LinerOption,
    ParquetOption,
    Policy,
    PolicyOption,
    ServiceOption,
    SpeedOption,
)

if TYPE_CHECKING:
    from sdm_core.contact import ContactConfiguration
    from service.client import Client, JobStatus
    from service.commands.batch_files import PackedBlades

CRITERIA, JOB = "Criteria", "Job"


class BadBlades(StrEnum):
    """What becomes of a job with a blade that cannot be screened."""

    refuse = "refuse"
    skip = "skip"


def run(
    blades: Annotated[
        list[str],
        typer.Argument(
            metavar="BLADE...",
            help="Blade files, profiles, folders of them (*.json), or shipped examples: nasa_rotor_37, "
            "generic_compressor_blade.",
            show_default=False,
        ),
    ],
    url: ServiceOption = LOCAL_SERVICE,
    speed: SpeedOption = None,
    ke_max: KeMaxOption = 2.5e4,
    ke_liner: LinerOption = None,
    grid: Annotated[
        str | None,
        typer.Option(
            metavar="SPEEDSxSTIFFNESSES",
            help="Points of each map. Left out: 100x100, or 50x50 with an engagement.",
            show_default=False,
        ),
    ] = None,
    nodes: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LE[,TE...]",
            help="Tip nodes of one contact; repeat for more. Left out: leading edge, trailing edge, both.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    weights: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LE=1[,TE=0.5...]",
            help="Nodes and weights of one contact; repeat for more.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    policy: PolicyOption = Policy.auto,
    alpha: AlphaOption = None,
    least_ke: Annotated[
        float | None,
        typer.Option(
            metavar="N/m",
            help="Of the smallest destabilising K_e.",
            rich_help_panel=CRITERIA,
            show_default=False,
        ),
    ] = None,
    least_margin: Annotated[
        float | None,
        typer.Option(
            help="Of that K_e over the liner's, minus 1: 0.2 is 20 %.",
            rich_help_panel=CRITERIA,
            show_default=False,
        ),
    ] = None,
    most_unstable_share: Annotated[
        float | None,
        typer.Option(help="Of the map, 0 to 1.", rich_help_panel=CRITERIA, show_default=False),
    ] = None,
    bad_blades: Annotated[
        BadBlades | None,
        typer.Option(
            help="Refuse the job for a blade that cannot be screened, or skip and list it. Left out: refuse "
            "a single blade, skip among several.",
            rich_help_panel=JOB,
            show_default=False,
        ),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="In lists and reports.", rich_help_panel=JOB, show_default=False)
    ] = None,
    priority: Annotated[int, typer.Option(help="1 is first, 9 last.", min=1, max=9, rich_help_panel=JOB)] = 5,
    idempotency_key: Annotated[
        str | None,
        typer.Option(
            metavar="KEY",
            help="The same files and options under the same key are the same job, however often submitted.",
            rich_help_panel=JOB,
            show_default=False,
        ),
    ] = None,
    wait: Annotated[
        bool, typer.Option("--wait", help="Wait for the end, and show the ranking.", rich_help_panel=JOB)
    ] = False,
    json: JsonOption = None,
    csv: CsvOption = None,
    parquet: ParquetOption = None,
    html: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Write the report.", rich_help_panel=OUTPUT, show_default=False),
    ] = None,
) -> None:
    """Hand blades over to a service, which screens them whatever becomes of this terminal.

    Prints the id of the job; with --json its document. --wait waits and shows the ranking; --csv, --parquet,
    --html and --json are of that then.

    Example: rubscreen batch submit blades/ --ke-liner 9000 --least-margin 0.2 --wait --csv ranking.csv
    """
    from sdm_core.errors import InvalidInput, RubscreenError
    from service.client import Client
    from service.commands.batch_files import packed
    from service.commands.batch_tables import show_results
    from service.commands.blade_batch import blade_paths
    from service.commands.inputs import check_stiffnesses, grid_from
    from service.commands.job_watching import watched
    from service.commands.outputs import check_writable, write_json

    for option, path in (("--csv", csv), ("--parquet", parquet), ("--html", html)):
        if path is not None and not wait:
            raise InvalidInput(option, path, "give --wait too, or ask `rubscreen batch results` later")
    check_writable(json=json, csv=csv, parquet=parquet, html=html)
    check_stiffnesses(ke_max, ke_liner)
    criteria = {
        "least_ke": least_ke,
        "least_margin": least_margin,
        "most_unstable_share": most_unstable_share,
    }
    asked: dict[str, Any] = {
        **_speeds(speed),
        "ke_max": ke_max,
        "ke_liner": ke_liner,
        "criteria": criteria if any(bound is not None for bound in criteria.values()) else None,
        "map_shape": None if grid is None else grid_from(grid),
        "policy": policy.value,
        "alpha": alpha,
        "name": name,
        "priority": priority,
        "idempotency_key": idempotency_key,
    }
    contacts = _contacts(nodes or (), weights or (), arcs, engagement)
    paths = blade_paths(blades)
    bad = bad_blades or (BadBlades.refuse if paths.alone else BadBlades.skip)
    with Client(url) as client:
        with packed(paths, skip=bad is BadBlades.skip) as sending:
            failures = sending.failures
            if sending.archive is None and not sending.examples:
                raise RubscreenError(
                    f"none of the blades can be read: {failures[0].source}: {failures[0].reason}"
                )
            job = _handed_in(client, sending, contacts, {**asked, "bad_blades": bad.value})
        for failure in failures:
            typer.echo(f"rubscreen: not sent: {failure.source}: {failure.reason}", err=True)
        if not wait:
            if json:
                write_json(json, job.document, indent=True)
            if json != "-":
                typer.echo(job.id)
            typer.echo(f"  watch it: rubscreen batch watch {job.id} --url {url}", err=True)
            return
        typer.echo(f"rubscreen: screening {job.id}", err=True)
        done = watched(client.wait, job.id, "batch", url)
        found = client.screening_results(done.id)
        show_results(
            client,
            found,
            json=json,
            csv=csv,
            parquet=parquet,
            html=html if found.rows else None,
            failures=failures,
        )
        if not found.rows:
            raise RubscreenError("none of the blades could be screened: see the reasons above")


def _handed_in(
    client: Client,
    sending: PackedBlades,
    contacts: dict[str, ContactConfiguration] | None,
    asked: dict[str, Any],
) -> JobStatus:
    from service.client import ServiceProblem
    from service.commands.batch_files import ARCHIVE, as_typed

    blades: list[Any] = [] if sending.archive is None else [client.upload(sending.archive, ARCHIVE)]
    try:
        return client.submit_screening([*blades, *sending.examples], contacts, **asked)
    except ServiceProblem as problem:
        said = as_typed(str(problem.problem.get("detail", "")))
        raise ServiceProblem(problem.problem | {"detail": said}) from None


def _contacts(
    nodes: Sequence[str], weights: Sequence[str], arcs: str | None, engagement: str | None
) -> dict[str, ContactConfiguration] | None:
    from sdm_core.errors import InvalidInput
    from service.commands.inputs import CHORD, named_contacts

    if CHORD in weights:
        remedy = "give nodes and weights: those along the chord differ from blade to blade"
        raise InvalidInput("--weights", CHORD, f"{remedy} (`rubscreen screen` takes them)")
    return named_contacts(nodes, weights, arcs, engagement) or None


def _speeds(text: str | None) -> dict[str, tuple[float, float]]:
    """The range as the service takes it: in Hz, or as ratios."""
    from sdm_core.errors import InvalidInput
    from service.speeds import SpeedRange

    if text is None:
        return {}
    asked = SpeedRange.parse(text, "--speed")
    if asked.low.unit == asked.high.unit == "ratio":
        return {"speed_range_ratio": (asked.low.value, asked.high.value)}
    if "ratio" in (asked.low.unit, asked.high.unit):
        raise InvalidInput("--speed", text, "give both ends as ratios, or neither")
    low, high = asked.low.in_hz(1.0), asked.high.in_hz(1.0)
    if low >= high:
        raise InvalidInput("--speed", text, "give the lower speed first")
    return {"speed_range_hz": (low, high)}
