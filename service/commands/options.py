"""Options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

CONTACT, OUTPUT, ANSWERS = "Contact", "Output", "Where answers come from"
URL_VARIABLE = "RUBSCREEN_URL"
LOCAL_SERVICE = "http://127.0.0.1:8000"


def _checked_url(ctx: typer.Context, url: str | None) -> str | None:
    if url is None:
        return None
    from service.service_url import checked_service_url

    typed = ctx.get_parameter_source("url")
    return checked_service_url(url, "--url" if typed is None or typed.name != "ENVIRONMENT" else URL_VARIABLE)


class Policy(StrEnum):
    """Who answers."""

    auto = "auto"
    surrogate = "surrogate"
    exact = "exact"


BladeArgument = Annotated[
    str,
    typer.Argument(
        metavar="BLADE",
        help="Blade file, or a shipped example: nasa_rotor_37, generic_compressor_blade.",
        show_default=False,
    ),
]
SpeedOption = Annotated[
    str | None,
    typer.Option(
        metavar="LOW:HIGH",
        help="Rotor speeds in Hz, rpm or ratio (speed over first frequency at rest): 50Hz:300Hz, "
        "3000rpm:18000rpm, 0.05:0.33ratio. Left out: 0.30 to 1.05 of the design speed.",
        show_default=False,
    ),
]
NodesOption = Annotated[
    str | None,
    typer.Option(
        metavar="LE[,TE...]",
        help="Tip nodes in contact, weight 1 on each. Left out: the leading edge.",
        rich_help_panel=CONTACT,
        show_default=False,
    ),
]
WeightsOption = Annotated[
    str | None,
    typer.Option(
        metavar="LE=1[,TE=0.5...]",
        help="Tip nodes in contact, each with its weight; chord: all of them, by quadrature along the chord.",
        rich_help_panel=CONTACT,
        show_default=False,
    ),
]
ArcsOption = Annotated[
    str | None,
    typer.Option(
        metavar="0:0.25[,0.5:0.75...]",
        help="Arcs of contact round the casing, in revolutions. Left out: permanent contact.",
        rich_help_panel=CONTACT,
        show_default=False,
    ),
]
EngagementOption = Annotated[
    str | None,
    typer.Option(
        metavar="MEAN[:COS,...[:SIN,...]]",
        help="Smooth engagement round the casing instead of arcs, as Fourier coefficients from one cycle a "
        "revolution up: 0.5:0.4,0.1 or 0.5::0.4. Within 0 to 1.",
        rich_help_panel=CONTACT,
        show_default=False,
    ),
]
KeMaxOption = Annotated[float, typer.Option(metavar="N/m", help="Largest cutting stiffness K_e looked at.")]
LinerOption = Annotated[
    float | None,
    typer.Option(metavar="N/m", help="K_e of the liner, for a verdict against it.", show_default=False),
]
PolicyOption = Annotated[
    Policy,
    typer.Option(
        help="auto: the surrogate where it is sure, else the exact core.",
        rich_help_panel=ANSWERS,
    ),
]
AlphaOption = Annotated[
    float | None,
    typer.Option(
        metavar="RATE",
        help="Rate of unstable designs called stable that auto must keep: 1e-2, 5e-3, 1e-3, 5e-4 or 1e-4, or "
        "what the model's card has. Left out: 5e-4.",
        rich_help_panel=ANSWERS,
        show_default=False,
    ),
]
UrlOption = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        help="Ask a running service, e.g. http://127.0.0.1:8000, instead of answering in this process.",
        callback=_checked_url,
        rich_help_panel=ANSWERS,
        show_default=False,
    ),
]
ServiceOption = Annotated[
    str,
    typer.Option(
        "--url",
        metavar="URL",
        envvar=URL_VARIABLE,
        help="The running service.",
        rich_help_panel=ANSWERS,
        callback=_checked_url,
    ),
]
ModelsOption = Annotated[
    str | None,
    typer.Option(
        metavar="FOLDER",
        help="Answer from the active model of this folder instead of the shipped one.",
        rich_help_panel=ANSWERS,
        show_default=False,
    ),
]
DataOption = Annotated[
    str | None,
    typer.Option(
        "--data",
        metavar="FOLDER",
        help="Where the service keeps keys and jobs. Left out: RUBSCREEN_DATA_FOLDER, else "
        "~/.local/share/rubscreen. RUBSCREEN_DATABASE_URL puts its database elsewhere.",
        show_default=False,
    ),
]
DatabaseOption = Annotated[
    str | None,
    typer.Option(
        "--database-url",
        metavar="URL",
        help="The database, where it is not in the data folder. Left out: RUBSCREEN_DATABASE_URL, which "
        "other users of this machine cannot read, as they can a command line with a password.",
        show_default=False,
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option(
        "--json", metavar="PATH", help="Write JSON; - for stdout.", rich_help_panel=OUTPUT, show_default=False
    ),
]
CsvOption = Annotated[
    str | None,
    typer.Option(
        "--csv", metavar="PATH", help="Write the table as CSV.", rich_help_panel=OUTPUT, show_default=False
    ),
]
ParquetOption = Annotated[
    str | None,
    typer.Option(
        "--parquet",
        metavar="PATH",
        help="Write the table as Parquet.",
        rich_help_panel=OUTPUT,
        show_default=False,
    ),
]
NpzOption = Annotated[
    str | None,
    typer.Option(
        "--npz", metavar="PATH", help="Write numpy arrays.", rich_help_panel=OUTPUT, show_default=False
    ),
]
PngOption = Annotated[
    str | None,
    typer.Option("--png", metavar="PATH", help="Write a chart.", rich_help_panel=OUTPUT, show_default=False),
]
