"""What is kept of simulated speeds: arrays by column, that go into one file and come out of it unchanged."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from sdm_core.stability import StabilitySolution
from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from sdm_core.time_domain.liner.speed_sweep import SpeedResult
from sdm_core.time_domain.liner.wear_map import WearMap
from service.simulation.order import SimulationOrder


@dataclass(frozen=True)
class SimulatedSpeeds:
    """m speeds, r contact nodes, R tip nodes, n modes, a angles, k frequencies, q revolutions.

    Attributes
    ----------
    speed_hz
        Hz, shape (m,).
    worn_m
        Deepest wear in each sector round the casing, m, shape (m, r, a).
    worn_volume_m3
        By the end of each revolution, m³, NaN after the liner was worn through; shape (m, q).
    worn_through
        Whether it was, which ended the simulation; shape (m,).
    lobes, lobe_amplitude_m
        Wear lobes, the ovalisation's left aside, and the amplitude of that harmonic, m; shape (m, r).
    peak_m
        Largest displacement of each tip node in the contact direction, m, shape (m, R).
    force_peak_n
        Largest contact force of each contact node, N, shape (m, r).
    spectrum_m
        Amplitude of the first contact node over the last revolutions, m, shape (m, k).
    natural_hz
        Natural frequencies, Hz, shape (m, n).
    cell_damping_ratio
        What the length of the cells adds to each damping ratio, shape (m, n).
    energy_imbalance
        Of the energy account, relative to its largest term, shape (m,).
    stable
        The exact core's verdict on permanent contact with the liner's K_e: 1.0 stable, 0.0 unstable, NaN not
        decided; shape (m,).
    growth_per_revolution, chatter_hz
        Of it: ln |μ|, and the frequency of that motion, Hz; shape (m,).
    """

    speed_hz: np.ndarray
    worn_m: np.ndarray
    worn_volume_m3: np.ndarray
    worn_through: np.ndarray
    lobes: np.ndarray
    lobe_amplitude_m: np.ndarray
    peak_m: np.ndarray
    force_peak_n: np.ndarray
    spectrum_m: np.ndarray
    natural_hz: np.ndarray
    cell_damping_ratio: np.ndarray
    energy_imbalance: np.ndarray
    stable: np.ndarray
    growth_per_revolution: np.ndarray
    chatter_hz: np.ndarray

    @classmethod
    def of(cls, order: SimulationOrder, found: SpeedResult, exact: StabilitySolution) -> Self:
        """One speed."""
        worn, volume = found.worn_m, np.full(order.revolutions, np.nan)
        volume[: len(found.worn_volume_m3)] = found.worn_volume_m3
        sectors = worn.reshape(len(worn), order.angles, -1).max(axis=2)
        one: dict[str, Any] = {
            **{name: getattr(found, name) for name in _AS_FOUND},
            "worn_m": sectors,
            "worn_volume_m3": volume,
            "stable": np.nan if exact.stable is None else float(exact.stable),
            "growth_per_revolution": exact.growth_per_revolution,
            "chatter_hz": exact.chatter_hz,
        }
        return cls(**{name: np.asarray(value)[None] for name, value in one.items()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All of them, by rising speed."""
        order = np.argsort(np.concatenate([part.speed_hz for part in parts]), kind="stable")
        return cls(
            **{f.name: np.concatenate([getattr(part, f.name) for part in parts])[order] for f in fields(cls)}
        )

    def wear_map(self, order: SimulationOrder, node: str | None = None) -> WearMap:
        """Of one contact node; the first where left out."""
        name = order.nodes[0] if node is None else node
        at, angles = order.nodes.index(name), self.worn_m.shape[2]
        together = order.cells // angles
        return WearMap(
            name,
            self.speed_hz,
            self.speed_hz / order.blade.first_frequency_hz,
            2 * np.pi * (np.arange(angles) + (together - 1) / (2 * together)) / angles,
            self.worn_m[:, at],
            self.lobes[:, at],
            self.worn_through,
        )

    def spectrum_map(self, order: SimulationOrder) -> SpectrumMap:
        """Of the first contact node."""
        return SpectrumMap(
            order.nodes[0],
            self.speed_hz,
            order.frequency_hz,
            self.spectrum_m,
            self.natural_hz,
            order.blade.first_frequency_hz,
        )

    @property
    def unstable(self) -> np.ndarray:
        """Where the exact core says so, shape (m,)."""
        return self.stable == 0.0

    def arrays(self) -> dict[str, np.ndarray]:
        """By name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Any) -> Self:
        """Those of `arrays`, among others."""
        return cls(**{f.name: np.asarray(arrays[f.name]) for f in fields(cls)})


_AS_FOUND = (
    "speed_hz",
    "worn_through",
    "lobes",
    "lobe_amplitude_m",
    "peak_m",
    "force_peak_n",
    "spectrum_m",
    "natural_hz",
    "cell_damping_ratio",
    "energy_imbalance",
)


def npz_bytes(arrays: dict[str, np.ndarray]) -> bytes:
    """One npz file; the same arrays give the same bytes."""
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)  # type: ignore[arg-type]
    return out.getvalue()


def npz_arrays(content: bytes) -> dict[str, np.ndarray]:
    """The arrays of an npz file; no objects are read from it."""
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
