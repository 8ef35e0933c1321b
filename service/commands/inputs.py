"""From what is typed to blades, contacts, speeds, and whatever answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sdm_core.assessment.margins import OperatingPoint
from sdm_core.blade import EXAMPLES, Blade, example_blade, read_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.validation import KE_LIMIT, number
from service.speeds import Speed, SpeedRange, evenly_spaced, operating_range

if TYPE_CHECKING:
    from service.answerer import Answerer

LARGEST_GRID = 4000
# Typed for weights: all tip nodes, by quadrature along the chord.
CHORD = "chord"


def blade_from(text: str) -> Blade:
    """A blade file, or one of the shipped examples by name."""
    if text in EXAMPLES and not Path(text).exists():
        return example_blade(text)
    if not Path(text).exists() and not Path(text).suffix:
        raise InvalidInput("BLADE", text, f"give a blade file or one of {', '.join(EXAMPLES)}")
    return read_blade(text)


def contact_from(
    nodes: str | None, weights: str | None, arcs: str | None, engagement: str | None, blade: Blade
) -> ContactConfiguration:
    """The contact as typed; without nodes or weights, the leading edge.

    Raises
    ------
    InvalidInput
        Also for a node the blade has not got.
    """
    if nodes is not None and weights is not None:
        raise InvalidInput("--nodes", nodes, "give either --nodes or --weights, not both")
    if weights == CHORD:
        from sdm_core.contact_weights import chord_weights

        chosen = dict(chord_weights(blade).weights)
    elif weights is not None:
        chosen = _weights(weights)
    else:
        chosen = {blade.tip_nodes[0]: 1.0} if nodes is None else _unit_weights(nodes)
    contact = _contact(chosen, arcs, engagement)
    contact.weight_vector(blade.tip_nodes)
    return contact


def _contact(weights: dict[str, float], arcs: str | None, engagement: str | None) -> ContactConfiguration:
    """The contact as typed, for no blade in particular."""
    if arcs is not None and engagement is not None:
        raise InvalidInput("--engagement", engagement, "give either --arcs or --engagement, not both")
    return ContactConfiguration(
        weights,
        None if arcs is None else _arcs(arcs),
        None if engagement is None else _engagement(engagement),
    )


def named_contacts(
    nodes: Sequence[str], weights: Sequence[str], arcs: str | None, engagement: str | None
) -> dict[str, ContactConfiguration]:
    """The contacts of one for each --nodes and --weights, by what was typed; not the weights of `CHORD`.

    Raises
    ------
    InvalidInput
        For what is wrong with the text.
    """
    if not nodes and not weights:
        for option, given in (("--arcs", arcs), ("--engagement", engagement)):
            if given is not None:
                raise InvalidInput(option, given, "say which nodes too, e.g. --nodes LE --nodes TE")
    same = {text: _contact(_unit_weights(text), arcs, engagement) for text in nodes}
    return same | {text: _contact(_weights(text), arcs, engagement) for text in weights if text != CHORD}


def contacts_from(
    nodes: Sequence[str], weights: Sequence[str], arcs: str | None, engagement: str | None
) -> Callable[[Blade], dict[str, ContactConfiguration]]:
    """What gives the contacts of a blade, one for each --nodes and --weights, by what was typed.

    Without either the usual three. What is wrong with the text is said here, a node that a blade has not got
    when it is asked for.
    """
    from service.screening.screen import default_contacts

    same = named_contacts(nodes, weights, arcs, engagement)
    if not nodes and not weights:
        return default_contacts

    def of_blade(blade: Blade) -> dict[str, ContactConfiguration]:
        named = dict(same)
        if CHORD in weights:
            named[CHORD] = contact_from(None, CHORD, arcs, engagement, blade)
        for contact in named.values():
            contact.weight_vector(blade.tip_nodes)
        return named

    return of_blade


def speeds_from(text: str | None, blade: Blade) -> tuple[float, float]:
    """(low, high) in Hz."""
    return operating_range(blade) if text is None else SpeedRange.parse(text, "--speed").for_blade(blade)


def speeds_at(texts: Sequence[str], blade: Blade) -> list[float]:
    """Rotor speeds in Hz, typed as ``16000rpm``; none is the blade's design speed."""
    if texts:
        return [Speed.parse(text, "--at").in_hz(blade.first_frequency_hz) for text in texts]
    if blade.design_speed_hz is None:
        raise InvalidInput("--at", "left out", "give a rotor speed: the blade file has no design speed")
    return [blade.design_speed_hz]


def operating_points(texts: Sequence[str], blade: Blade) -> list[OperatingPoint]:
    """Operating points typed as ``16000rpm=0.6``; without a share each counts once."""
    out = []
    for text in texts:
        typed, equals, share = (part.strip() for part in text.partition("="))
        speed = Speed.parse(typed, "--point").in_hz(blade.first_frequency_hz)
        reach = blade.speed_range_hz
        if reach is not None and not reach[0] <= speed <= reach[1] * (1 + 1e-9):
            raise OutOfSpeedRange(
                "--point", text, f"blade {blade.name!r} has modal data from {reach[0]:g} to {reach[1]:g} Hz"
            )
        out.append(OperatingPoint(typed, speed, _number("--point", share, text) if equals else 1.0))
    return out


def check_work(
    blade: Blade,
    contact: ContactConfiguration,
    speeds_hz: tuple[float, float],
    ke_max: float,
    *,
    here: bool,
    every_lobe: bool,
    option: str = "--speed",
) -> None:
    """Refuse what the exact core would take hours for, as the service does.

    Parameters
    ----------
    here
        Whether it is answered in this process; a service has limits of its own.
    every_lobe
        Whether every lobe is to be followed.
    option
        Where the speeds were typed.

    Raises
    ------
    InvalidInput
        Naming the option, its value and the remedy.
    """
    from sdm_core.lobe_tips import lobe_grid
    from service.commands.serve import settings_from
    from service.sizes import check_reach

    try:
        if here:
            check_reach(blade, contact, np.array(speeds_hz), "--ke-max", ke_max, settings_from(None))
        if every_lobe:
            lobe_grid(blade, contact, evenly_spaced(*speeds_hz, 2), ke_max)
    except InvalidInput as error:
        if not error.field.startswith("speed"):
            raise
        kind = OutOfSpeedRange if isinstance(error, OutOfSpeedRange) else InvalidInput
        raise kind(option, error.value, error.remedy) from None


def grid_from(text: str, field: str = "--grid") -> tuple[int, int]:
    """Speeds and stiffnesses of a map, typed as ``200x200``."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdecimal() for part in parts):
        raise InvalidInput(field, text, "give SPEEDSxSTIFFNESSES, e.g. 200x200")
    shape = int(parts[0]), int(parts[1])
    if not all(2 <= count <= LARGEST_GRID for count in shape):
        raise InvalidInput(field, text, f"give 2 to {LARGEST_GRID} each way")
    return shape


def check_stiffnesses(ke_max: float, ke_liner: float | None) -> None:
    """Refuse a --ke-max or --ke-liner that no liner has."""
    number("--ke-max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    if ke_liner is not None:
        number("--ke-liner", ke_liner, 0.0, ke_max, "N/m (--ke-max)", open_low=True)


def speed_count(count: int) -> int:
    """How many speeds of a boundary."""
    if not 2 <= count <= LARGEST_GRID:
        raise InvalidInput("--speeds", count, f"give 2 to {LARGEST_GRID}")
    return count


def answerer_from(url: str | None, models: str | None, policy: str) -> Answerer:
    """A client of the service at `url`, or a model in this process; under `exact`, no model.

    Raises
    ------
    InvalidInput, DamagedFile
        When the model cannot be loaded.
    """
    if url is not None:
        if models is not None:
            raise InvalidInput("--models", models, "leave it out with --url: the service has its own")
        from service.client import Client

        return Client(url)
    from training.screening import Screener

    if policy == "exact":
        return Screener(None)
    return Screener.default() if models is None else Screener.default(Path(models))


def _unit_weights(text: str) -> dict[str, float]:
    names = [part.strip() for part in text.split(",")]
    for name in names:
        if not name or names.count(name) > 1:
            raise InvalidInput("--nodes", text, "name each tip node once, e.g. LE,TE")
    return dict.fromkeys(names, 1.0)


def _weights(text: str) -> dict[str, float]:
    chosen: dict[str, float] = {}
    for part in text.split(","):
        node, equals, weight = (piece.strip() for piece in part.partition("="))
        if not equals or not node or node in chosen:
            raise InvalidInput("--weights", text, "give each node once with its weight, e.g. LE=1,TE=0.5")
        chosen[node] = _number("--weights", weight, text)
    return chosen


def _arcs(text: str) -> list[tuple[float, float]]:
    arcs = []
    for part in text.split(","):
        ends = part.split(":")
        if len(ends) != 2:
            raise InvalidInput("--arcs", text, "give START:END in revolutions, e.g. 0:0.25,0.5:0.75")
        arcs.append((_number("--arcs", ends[0], text), _number("--arcs", ends[1], text)))
    return arcs


def _engagement(text: str) -> FourierEngagement:
    mean, *series = text.split(":")
    if len(series) > 2:
        raise InvalidInput("--engagement", text, "give MEAN, MEAN:COS,... or MEAN:COS,...:SIN,...")
    rows = [[_number("--engagement", c, text) for c in part.split(",")] if part else [] for part in series]
    return FourierEngagement(_number("--engagement", mean, text), *rows)


def _number(field: str, part: str, text: str) -> float:
    try:
        return float(part)
    except ValueError:
        raise InvalidInput(field, text, f"give a number instead of {part.strip()!r}") from None
