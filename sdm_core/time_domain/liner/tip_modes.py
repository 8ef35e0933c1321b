"""What the integration needs of a blade at one rotor speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.blade.over_speed import over_speed
from sdm_core.errors import InvalidInput


@dataclass(frozen=True)
class TipModes:
    """Modal data of a blade at one rotor speed, and the tip nodes of it that touch.

    Attributes
    ----------
    omega
        Λ, rad/s, shape (n,).
    damping_ratio
        ξ, shape (n,).
    observed
        V_b of all tip nodes in the contact direction, outward positive, kg^-1/2, shape (n, R).
    contact
        V_c: its columns of the r contact nodes, shape (n, r).
    tangential
        V_t: the same nodes' tangential amplitudes, shape (n, r); zeros where no friction is asked for.
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    observed: np.ndarray
    contact: np.ndarray
    tangential: np.ndarray

    @classmethod
    def of_blade(
        cls,
        blade: Blade,
        nodes: Sequence[str],
        speed_hz: float,
        *,
        tangential: bool = False,
        extrapolate: bool = False,
    ) -> TipModes:
        """At one rotor speed, interpolated in Ω² as everywhere.

        Raises
        ------
        InvalidInput
            When a state of the blade lacks `mode_shape_tangential` and `tangential` is asked for.
        OutOfSpeedRange
            When the modal data do not reach `speed_hz`.
        """
        omega, shape = blade.at_speeds(np.array([speed_hz]), extrapolate=extrapolate)
        at = [blade.tip_nodes.index(node) for node in nodes]
        contact = shape[0][:, at]
        sideways = np.zeros_like(contact)
        if tangential:
            found = over_speed(blade, "mode_shape_tangential", np.array([speed_hz]))
            if found is None:
                raise InvalidInput(
                    "friction",
                    f"blade {blade.name!r} without mode_shape_tangential",
                    "give the tangential mode shapes in every state of the blade, or leave friction out",
                )
            sideways = found[0][:, at]
        return cls(
            np.array(omega[0]), blade.damping_ratio, np.array(shape[0]), contact.copy(), sideways.copy()
        )
