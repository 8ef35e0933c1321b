"""Charts over (rotor speed, K_e) that measurements share (DESIGN, section 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade

SIDE = 200


@dataclass(frozen=True)
class Chart:
    """A blade in one contact over a grid.

    Attributes
    ----------
    speed_hz
        Rotor speed at each point, Hz, shape (SIDE²,).
    ke
        K_e at each point, N/m, shape (SIDE²,).
    """

    name: str
    blade: Blade
    contact: ContactConfiguration
    speed_hz: np.ndarray
    ke: np.ndarray

    @classmethod
    def over(
        cls, name: str, blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, ke: np.ndarray
    ) -> Chart:
        """All pairs of the two axes."""
        grid = [axis.ravel() for axis in np.meshgrid(speed_hz, ke)]
        return cls(name, blade, contact, *grid)

    def __len__(self) -> int:
        return len(self.ke)

    def sample(self, count: int, seed: int = 0) -> np.ndarray:
        """Indices of points drawn without replacement; a smaller count gives the first of a larger."""
        return np.random.default_rng(seed).permutation(len(self))[:count]

    def problem(self, index: int) -> RubbingBlade:
        """The problem at one point."""
        return RubbingBlade.from_blade(
            self.blade, self.contact, float(self.speed_hz[index]), float(self.ke[index])
        )


def benchmark_chart(arcs: list[list[float]] | None = None) -> Chart:
    """f = 1 and 4 Hz, ξ = 2e-3, V_b = [1, 0.8], Ω in [0.02, 0.45], K_e/(2π)² in [0, 0.1]."""
    state = ModalState(0.0, np.array([1.0, 4.0]), np.array([[1.0], [0.8]]))
    blade = Blade("benchmark", ("tip",), 2e-3, [state])
    name = "benchmark chart" if arcs is None else f"benchmark chart, {len(arcs)} arcs"
    return Chart.over(
        name,
        blade,
        ContactConfiguration.at("tip", arcs=arcs),
        np.linspace(0.02, 0.45, SIDE),
        np.linspace(0.0, 0.1, SIDE) * (2 * np.pi) ** 2,
    )


def two_arcs_chart() -> Chart:
    """The blade of the benchmark chart in contact over two quarters of the circumference."""
    return benchmark_chart([[0.0, 0.25], [0.5, 0.75]])


def rotor_37_chart() -> Chart:
    """NASA rotor 37 with its centrifugal stiffening, both edges in permanent contact."""
    blade = example_blade("nasa_rotor_37")
    assert blade.speed_range_hz is not None
    return Chart.over(
        "rotor 37, both edges",
        blade,
        ContactConfiguration.at("LE", "TE"),
        np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], SIDE),
        np.linspace(0.0, 2.5e4, SIDE),
    )
