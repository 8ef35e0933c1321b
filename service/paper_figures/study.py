"""What [SBL] varies from figure to figure: modes, centrifugal effects, contact, range of K_e."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sdm_core.assessment.mode_kind import Kind, ModeKind, mode_kinds
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from service.speeds import HIGHEST_RATIO, LOWEST_RATIO

PAPER_KE_MAX = 2.5e4
"""[SBL] section 4: K_e up to 2.5e4 N/m."""
_STEPS = (1, 2, 4, 10, 20, 40, 100, 200, 400)
# A lobe is to be seen with its flanks: its tip below two thirds of the axis.
_TIP_BELOW = 2 / 3


@dataclass(frozen=True)
class Study:
    """One blade for which the figures are drawn.

    Attributes
    ----------
    blade
        With its centrifugal effects, amplitudes in the direction drawn.
    bending, torsion
        Places of the first bending and the first torsion mode among its modes.
    named_by
        How these two were told, in words.
    """

    blade: Blade
    bending: int
    torsion: int
    named_by: str

    @property
    def first_frequency_hz(self) -> float:
        """f₁ at rest, Hz: speeds are drawn as Ω/f₁."""
        return self.blade.first_frequency_hz

    @property
    def ratios(self) -> tuple[float, float]:
        """Ω/f₁ drawn: [SBL] from where lobes can be told apart."""
        return LOWEST_RATIO, HIGHEST_RATIO

    @property
    def covered(self) -> float:
        """Ω/f₁ up to which the blade has modal data; beyond, they are extrapolated in Ω²."""
        if self.blade.speed_range_hz is None:
            return HIGHEST_RATIO
        return min(HIGHEST_RATIO, self.blade.speed_range_hz[1] / self.first_frequency_hz)

    @property
    def leading_edge(self) -> ContactConfiguration:
        """Contact at the first tip node."""
        return ContactConfiguration.at(self.blade.tip_nodes[0])

    @property
    def trailing_edge(self) -> ContactConfiguration:
        """Contact at the last tip node."""
        return ContactConfiguration.at(self.blade.tip_nodes[-1])

    @property
    def first_two(self) -> tuple[int, int]:
        """The modes [SBL] keeps: first bending and first torsion, by rising frequency."""
        low, high = sorted((self.bending, self.torsion))
        return low, high


_BENDING = (Kind.FLAP, Kind.EDGEWISE, Kind.BENDING)


def study_of(blade: Blade) -> Study:
    """A blade with its first bending and first torsion mode, told by how the tip moves.

    Where no mode is named so, the one that moves, or turns, the most for its size stands in, and `named_by`
    says so.

    Raises
    ------
    InvalidInput
        For a blade with one mode or fewer than three tip nodes.
    """
    if blade.mode_count < 2:
        raise InvalidInput("blade", blade.name, "give a blade with two modes or more")
    kinds = mode_kinds(blade)
    bends = [kind for kind in kinds if kind.kind in _BENDING]
    bending = min(bends, key=_frequency) if bends else max(kinds, key=lambda kind: kind.translation)
    rest = [kind for kind in kinds if kind is not bending]
    turns = [kind for kind in rest if kind.kind is Kind.TORSION]
    torsion = min(turns, key=_frequency) if turns else max(rest, key=lambda kind: kind.rotation)
    named = " and ".join(
        f"mode {kind.mode} as first {role} ({kind.label}{'' if sure else ', for want of a clear one'})"
        for kind, role, sure in ((bending, "bending", bends), (torsion, "torsion", turns))
    )
    return Study(blade, bending.mode - 1, torsion.mode - 1, f"{named}, by the tip's motion at rest")


def _frequency(kind: ModeKind) -> float:
    return kind.frequency_hz


def at_rest(blade: Blade) -> Blade:
    """The blade without centrifugal effects: its slowest state at every speed ([SBL] 4.2)."""
    return replace(blade, states=blade.states[:1])


def with_modes(blade: Blade, modes: Sequence[int]) -> Blade:
    """The blade with some of its modes only ([SBL] 4.2 and 5.2).

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> with_modes(example_blade("nasa_rotor_37"), [0, 2]).at_speed(0.0).frequency_hz.round(1)
    array([ 906. , 3269.7])
    """
    kept = list(modes)
    states = tuple(
        type(state)(state.speed_hz, state.frequency_hz[kept], state.mode_shape[kept])
        for state in blade.states
    )
    return replace(blade, states=states, damping_ratio=blade.damping_ratio[kept])


def least_ke_of_modes(blade: Blade, contact: ContactConfiguration) -> float:
    """The least K_e at which any one mode alone becomes unstable at rest, N/m.

    2ξ_j(1 + ξ_j)ω_j²/G_jj (DESIGN, section 6): infinite where no mode moves the contact nodes.
    """
    state = blade.states[0]
    moved = state.mode_shape**2 @ contact.weight_vector(blade.tip_nodes)
    damping = blade.damping_ratio
    with np.errstate(divide="ignore"):
        alone = 2 * damping * (1 + damping) * (2 * np.pi * state.frequency_hz) ** 2 / moved
    return float(alone.min())


def ke_axis(least: Sequence[float]) -> float:
    """Top of the K_e axis, N/m: the paper's where every lobe shows on it, else the next step that does.

    Parameters
    ----------
    least
        Least K_e of each curve, N/m; infinite ones cannot be shown anyway.

    Examples
    --------
    >>> ke_axis([8000.0, 15000.0]), ke_axis([22000.0])
    (25000.0, 50000.0)
    """
    highest = max((ke for ke in least if np.isfinite(ke)), default=0.0)
    steps = (PAPER_KE_MAX * step for step in _STEPS)
    return next((top for top in steps if highest <= _TIP_BELOW * top), PAPER_KE_MAX * _STEPS[-1])
