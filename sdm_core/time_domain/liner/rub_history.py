"""The solution: what the tip did and what is left of the liner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import get_window, zoom_fft

from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.energy import EnergyAccount
from sdm_core.time_domain.liner.wear_lobes import WearLobes, wear_lobes


@dataclass(frozen=True)
class RubHistory:
    """A simulation of m samples, R tip nodes, r of them in contact, n modes.

    Attributes
    ----------
    speed_hz
        Ω, Hz.
    tip_nodes, contact_nodes
        Names.
    time_s
        Of the samples, s, shape (m,).
    position, velocity
        Modal, kg^½ m and kg^½ m/s, shape (m, n).
    omega, shape
        Λ, rad/s, shape (n,), and V_b, kg^-1/2, shape (n, R).
    force_n
        Contact forces, N, the mean since the sample before, shape (m, r).
    peak_m
        Largest |displacement| of each tip node over all steps, m, shape (R,).
    worn_m
        Depth removed under each contact node in each angular cell, m, shape (r, cells).
    worn_volume_m3
        Removed in all by the end of each revolution, m³, shape (revolutions,).
    energy
        Account of the blade's energy.
    feed_per_revolution_m
        Of the casing, m.
    ovalisation
        Lobes of the casing, 0 for a round one.
    cutting_stiffness
        K_e of each contact node, N/m, shape (r,).
    cell_damping_ratio
        What the length of the cells adds to each ξ in kept contact, shape (n,): to be small beside ξ.
    steps_per_revolution, samples_per_revolution
        As taken.
    correction_rounds
        Most rounds of a correction.
    worn_through
        Node and angle (rad) where the liner was worn through, which ended the simulation; None otherwise.
    cost_s
        Time taken, s.
    """

    speed_hz: float
    tip_nodes: tuple[str, ...]
    contact_nodes: tuple[str, ...]
    time_s: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    omega: np.ndarray
    shape: np.ndarray
    force_n: np.ndarray
    peak_m: np.ndarray
    worn_m: np.ndarray
    worn_volume_m3: np.ndarray
    energy: EnergyAccount
    feed_per_revolution_m: float
    ovalisation: int
    cutting_stiffness: np.ndarray
    cell_damping_ratio: np.ndarray
    steps_per_revolution: int
    samples_per_revolution: int
    correction_rounds: int
    worn_through: tuple[str, float] | None
    cost_s: float

    @property
    def displacement_m(self) -> np.ndarray:
        """Of every tip node in the contact direction, m, shape (m, R)."""
        return self.position @ self.shape

    @property
    def modal_energy_j(self) -> np.ndarray:
        """Kinetic and strain energy of each mode, J, shape (m, n)."""
        return 0.5 * (self.velocity**2 + (self.omega * self.position) ** 2)

    @property
    def angle_rad(self) -> np.ndarray:
        """Angle of each cell, rad, shape (cells,)."""
        cells = self.worn_m.shape[1]
        return 2 * np.pi * np.arange(cells) / cells

    @property
    def lobes(self) -> tuple[WearLobes, ...]:
        """Of the worn profile under each contact node.

        Feed cuts a spiral, which ends one feed deeper than it began: that slope is no lobe, and taken off.
        """
        spiral = self.feed_per_revolution_m * np.arange(self.worn_m.shape[1]) / self.worn_m.shape[1]
        return tuple(wear_lobes(profile - spiral, self.ovalisation) for profile in self.worn_m)

    def of_revolution(self, revolution: int) -> slice:
        """Samples of one revolution, counted from 0, or from −1 backwards."""
        many = self.samples_per_revolution
        last = len(self.time_s) // many
        place = revolution % last
        return slice(place * many, (place + 1) * many)

    def spectrum(
        self, frequency_hz: np.ndarray, node: str | None = None, revolutions: int = 20
    ) -> np.ndarray:
        """Amplitude of a tip node's displacement at frequencies, over the last revolutions.

        Hann's window, scaled so that a sine of amplitude a shows a at its frequency; the mean is taken off.
        Frequencies need not be multiples of the inverse length (chirp z-transform).

        Parameters
        ----------
        frequency_hz
            Evenly spaced, Hz, shape (k,).
        node
            Tip node; the first contact node where left out.

        Returns
        -------
        m, shape (k,).

        Raises
        ------
        InvalidInput
            For a node the blade has not got, or frequencies beyond half the sampling rate.
        """
        node = self.contact_nodes[0] if node is None else node
        if node not in self.tip_nodes:
            raise InvalidInput("node", node, f"name a tip node: {', '.join(self.tip_nodes)}")
        rate = self.samples_per_revolution * self.speed_hz
        frequency = np.asarray(frequency_hz, dtype=float)
        if frequency[-1] > rate / 2 or frequency[0] < 0:
            raise InvalidInput(
                "frequency_hz",
                float(frequency[-1]),
                f"give frequencies from 0 to {rate / 2:g} Hz, or take more samples_per_revolution",
            )
        last = min(revolutions * self.samples_per_revolution, len(self.time_s))
        signal = self.position[-last:] @ self.shape[:, self.tip_nodes.index(node)]
        window = get_window("hann", last)
        windowed = (signal - signal @ window / window.sum()) * window
        found = zoom_fft(windowed, [frequency[0], frequency[-1]], m=len(frequency), fs=rate, endpoint=True)
        return 2 * np.abs(found) / window.sum()
