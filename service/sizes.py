"""What is too large to be taken: blades, lists, and questions no rotor asks."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from service.settings import Settings


class TooLarge(InvalidInput):
    """The request is larger than the service takes in one call."""


def check_length(field: str, values: Any, most: int, remedy: str = "split the request") -> None:
    """Refuse a list, object or text of more than `most` entries; other types are left to the core.

    Raises
    ------
    TooLarge
        Naming the field, its length and the remedy.
    """
    if isinstance(values, Sized) and len(values) > most:
        kind = "characters" if isinstance(values, str) else "entries"
        raise TooLarge(field, f"{len(values)} {kind}", f"give at most {most}, or {remedy}")


def check_blade_size(blade: dict[str, Any], settings: Settings) -> None:
    """Refuse a blade larger than any real one before any of it is read.

    Fields of the wrong type are left to the core, which names them.
    """
    reduce = "reduce the modal data"
    nodes = blade.get("tip_nodes")
    check_length("blade.name", blade.get("name"), settings.max_name_length, "shorten it")
    check_length("blade.tip_nodes", nodes, settings.max_tip_nodes, reduce)
    for i, node in enumerate(nodes if isinstance(nodes, list) else ()):
        check_length(f"blade.tip_nodes[{i}]", node, settings.max_name_length, "shorten it")
    for key in ("tip_radius_m", "tip_z_m", "tip_theta_rad"):
        check_length(f"blade.{key}", blade.get(key), settings.max_tip_nodes, reduce)
    check_length("blade.damping_ratio", blade.get("damping_ratio"), settings.max_modes, reduce)
    states = blade.get("states")
    check_length("blade.states", states, settings.max_states, reduce)
    for i, state in enumerate(states if isinstance(states, list) else ()):
        if isinstance(state, dict):
            _check_state_size(f"blade.states[{i}]", state, settings)


def _check_state_size(field: str, state: dict[str, Any], settings: Settings) -> None:
    reduce = "reduce the modal data"
    for key in ("frequency_hz", "mode_shape", *FURTHER_SHAPES):
        rows = state.get(key)
        check_length(f"{field}.{key}", rows, settings.max_modes, reduce)
        for j, row in enumerate(rows if isinstance(rows, list) else ()):
            check_length(f"{field}.{key}[{j}]", row, settings.max_tip_nodes, reduce)
    check_length(f"{field}.tip_growth_m", state.get("tip_growth_m"), settings.max_tip_nodes, reduce)


def check_reach(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_field: str,
    ke: float,
    settings: Settings,
) -> None:
    """Refuse what no rotor does and the exact core would take hours for.

    Raises
    ------
    InvalidInput
        When a contact node is not the blade's.
    OutOfSpeedRange
        Where the blade's modal data do not reach.
    TooLarge
        When the blade vibrates too often in a revolution, its frequencies lie too far apart, or the
        contact is too stiff.
    """
    frequency = np.array([state.frequency_hz for state in blade.states])
    shape = np.array([state.mode_shape for state in blade.states])
    lowest, highest = float(frequency.min()), float(frequency.max())
    if highest > settings.max_frequency_span * lowest:
        found = f"{lowest:g} to {highest:g} Hz"
        most = settings.max_frequency_span
        raise TooLarge("blade.states", found, f"leave out modes {most:g} times above the first")
    slowest, fastest = int(np.argmin(speed_hz)), int(np.argmax(speed_hz))
    for i in (slowest, fastest):
        try:
            blade.at_speeds(speed_hz[i : i + 1])
        except OutOfSpeedRange as error:
            raise OutOfSpeedRange(f"speed_hz[{i}]", error.value, error.remedy) from None
    least = highest / settings.max_vibrations_per_revolution
    if speed_hz[slowest] < least:
        raise TooLarge(
            f"speed_hz[{slowest}]",
            float(speed_hz[slowest]),
            f"give at least {least:.6g} Hz for a natural frequency of {highest:g} Hz, or leave out the mode",
        )
    g_jj = (shape**2 * contact.weight_vector(blade.tip_nodes)).sum(axis=2)
    softest = float((g_jj / (2 * np.pi * frequency) ** 2).max())
    if ke * softest > settings.max_contact_ratio:
        most = settings.max_contact_ratio / softest
        raise TooLarge(
            ke_field, ke, f"give at most {most:.6g} N/m: the contact is far stiffer than the blade"
        )
