"""From what is typed for `rubscreen simulate` to an order."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.time_domain.liner.abradable_liner import Friction
from service.commands.inputs import contact_from, speed_count
from service.commands.serve import settings_from
from service.simulation.constants import CasingConstants, LinerConstants
from service.simulation.limits import check_reachable
from service.simulation.order import SimulationOrder
from service.speeds import Speed, SpeedRange, evenly_spaced

_OPTIONS = {
    "ke": "--ke-liner",
    "youngs_modulus_pa": "--youngs-modulus",
    "yield_stress_pa": "--yield-stress",
    "plastic_modulus_pa": "--plastic-modulus",
    "thickness_m": "--thickness",
    "axial_width_m": "--axial-width",
    "contact_length_m": "--contact-length",
    "clearance_m": "--clearance",
    "ovalisation_m": "--ovalisation",
    "lobes": "--lobes",
    "ovalisation_revolutions": "--ovalisation-revolutions",
    "feed_per_revolution_m": "--feed",
    "radius_m": "--radius",
    "coefficient": "--friction",
    "friction": "--friction",
    "rotation": "--rotation",
    "workers": "--threads",
    "cells": "--cells",
    "steps_per_cell": "--cells",
    "revolutions": "--revolutions",
    "speed_hz": "--speed",
}


@contextmanager
def named() -> Iterator[None]:
    """Refusals inside name the option that was typed, not the field of the core."""
    try:
        yield
    except InvalidInput as error:
        last = error.field.split(".")[-1].split("[")[0]
        option = _OPTIONS.get(last)
        if option is None:
            raise
        remedy = error.remedy
        for name, other in _OPTIONS.items():
            if name.endswith(("_pa", "_m")) or name == "ovalisation_revolutions":
                remedy = remedy.replace(name, other)
        remedy = remedy.replace(", or say interference=True", ", or give less --ovalisation")
        raise type(error)(option, error.value, remedy) from None


def liner_from(**given: float | None) -> LinerConstants:
    """The liner's constants, those not typed as usual."""
    return LinerConstants.from_dict({name: value for name, value in given.items() if value is not None})


def casing_from(clearance: str | None, **given: float | None) -> CasingConstants:
    """The casing's constants, those not typed as usual; the clearance may be one a contact node."""
    typed: dict[str, object] = {name: value for name, value in given.items() if value is not None}
    if clearance is not None:
        try:
            each = [float(part) for part in clearance.split(",")]
        except ValueError:
            remedy = "give metres, one number or one a contact node, e.g. 1e-4 or 1e-4,2e-4"
            raise InvalidInput("--clearance", clearance, remedy) from None
        typed["clearance_m"] = each[0] if len(each) == 1 else each
    return CasingConstants.from_dict(typed)


def friction_from(coefficient: float | None, rotation: int | None) -> Friction | None:
    """Friction as typed; none without a coefficient."""
    if coefficient is None:
        if rotation is not None:
            raise InvalidInput("--rotation", rotation, "give --friction too, or leave it out")
        return None
    if rotation is None:
        remedy = "give 1 where the blade turns towards positive tangential, else -1: no blade file tells"
        raise InvalidInput("--rotation", "left out", remedy)
    return Friction(coefficient, rotation)


def order_from(
    blade: Blade,
    speed: str | None,
    count: int | None,
    nodes: str | None,
    revolutions: int,
    liner: LinerConstants,
    casing: CasingConstants,
    friction: Friction | None,
    cells: int,
) -> SimulationOrder:
    """The order.

    Raises
    ------
    InvalidInput
        Naming the option, its value and the remedy.
    """
    contact = contact_from(nodes, None, None, None, blade)
    order = SimulationOrder(
        blade,
        tuple(_speeds(speed, count, blade).tolist()),
        tuple(contact.weights),
        revolutions,
        liner,
        casing,
        friction,
        cells,
    )
    check_reachable(order, settings_from(None))
    return order


def _speeds(text: str | None, count: int | None, blade: Blade) -> np.ndarray:
    if text is not None and ":" in text:
        return evenly_spaced(
            *SpeedRange.parse(text, "--speed").for_blade(blade), speed_count(200 if count is None else count)
        )
    if count is not None and count != 1:
        raise InvalidInput(
            "--speeds", count, "give a range with --speed, e.g. 0.1:0.33ratio, or leave it out"
        )
    if text is None:
        if blade.design_speed_hz is None:
            raise InvalidInput("--speed", "left out", "give one: the blade file has no design speed")
        return np.array([blade.design_speed_hz])
    speed, reach = Speed.parse(text, "--speed").in_hz(blade.first_frequency_hz), blade.speed_range_hz
    if reach is not None and not reach[0] <= speed <= reach[1]:
        remedy = f"blade {blade.name!r} has modal data from {reach[0]:g} to {reach[1]:g} Hz"
        raise OutOfSpeedRange("--speed", text, f"{remedy}: stay inside or add a state")
    return np.array([speed])
