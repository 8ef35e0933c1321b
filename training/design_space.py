"""The design space the surrogate is trained on: named, bounded, with a reason for what lies outside."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from training.cases import ARCS, MODES, CaseBatch

Range = tuple[float, float]


@dataclass(frozen=True)
class DesignSpace:
    """Bounds of the training domain; a little wider than the reference space (DESIGN, section 7).

    Amplitudes and correlations at the contact are not bounded: modes from dominant to invisible
    and every correlation are sampled. Nor are places and lengths of arcs.

    Attributes
    ----------
    mode_count
        n.
    first_ratio, next_ratio
        f2/f1, and f_{j+1}/f_j above.
    damping_ratio
        ξ of every mode.
    damping_spread
        Largest ratio of a mode's ξ to their geometric mean, or the inverse.
    speed_ratio
        Ω/f1, f1 at that speed.
    arc_count, engaged_share
        Arcs of contact, and the share of the revolution in contact; permanent contact apart.
    largest_kappa, largest_kappa_with_arcs
        κ = K_e·max_j G_jj/ω_j² up to which first crossings were looked for.
    """

    name: str = "contact/1"
    mode_count: tuple[int, int] = (1, MODES)
    first_ratio: Range = (1.3, 6.0)
    next_ratio: Range = (1.01, 2.7)
    damping_ratio: Range = (1.2e-4, 1.7e-2)
    damping_spread: float = 2.0
    speed_ratio: Range = (0.045, 0.9)
    arc_count: tuple[int, int] = (1, ARCS)
    engaged_share: Range = (0.03, 0.95)
    largest_kappa: float = 4.0
    largest_kappa_with_arcs: float = 1.5

    def contains(self, cases: CaseBatch, ke: np.ndarray | None = None) -> np.ndarray:
        """Which cases lie inside, shape (m,); with K_e in N/m, shape (m,), which points do."""
        inside = self.first_violation(cases) == ""
        return inside if ke is None else inside & (ke <= self.largest_ke(cases))

    def largest_ke(self, cases: CaseBatch) -> np.ndarray:
        """K_e up to which the surrogate may be asked, N/m, shape (m,)."""
        kappa = np.where(cases.permanent, self.largest_kappa, self.largest_kappa_with_arcs)
        return kappa * cases.stiffness_scale

    def first_violation(self, cases: CaseBatch) -> np.ndarray:
        """Why a case lies outside, in words; an empty string where it is inside. Shape (m,)."""
        out = np.full(len(cases), "", dtype=object)
        n = np.minimum(cases.mode_count, MODES)
        pair = np.arange(MODES - 1) < (n - 1)[:, None]
        own = np.arange(MODES) < n[:, None]
        ratio = cases.omega[:, 1:] / cases.omega[:, :-1]
        speed_ratio = 2 * np.pi * cases.speed_hz / cases.omega[:, 0]
        mean = np.exp((np.log(np.maximum(cases.damping_ratio, 1e-300)) * own).sum(axis=1) / own.sum(axis=1))
        spread = np.abs(np.log(np.maximum(cases.damping_ratio, 1e-300) / mean[:, None]))
        reached = np.einsum("mjj->mj", cases.contact_matrix).max(axis=1) > 0

        def mark(bad: np.ndarray, text: str) -> None:
            out[bad & (out == "")] = text

        mark(cases.mode_count > self.mode_count[1], f"more than {self.mode_count[1]} modes")
        mark(~reached, "no mode moves the contact nodes")
        with_arcs, share = ~cases.permanent, cases.engaged_share
        mark(cases.arc_count == 0, "smooth engagement, which this model does not cover")
        mark(
            with_arcs & (cases.arc_count > self.arc_count[1]),
            f"more than {self.arc_count[1]} arcs of contact",
        )
        bare = with_arcs & _outside(share, self.engaged_share)
        mark(bare, f"share of the revolution in contact outside {_text(self.engaged_share)}")
        mark(_outside(speed_ratio, self.speed_ratio), f"speed/f1 outside {_text(self.speed_ratio)}")
        first = pair[:, 0] & _outside(ratio[:, 0], self.first_ratio)
        mark(first, f"f2/f1 outside {_text(self.first_ratio)}")
        later = (pair[:, 1:] & _outside(ratio[:, 1:], self.next_ratio)).any(axis=1)
        mark(later, f"f(j+1)/f(j) outside {_text(self.next_ratio)}")
        damping = (own & _outside(cases.damping_ratio, self.damping_ratio)).any(axis=1)
        mark(damping, f"damping_ratio outside {_text(self.damping_ratio)}")
        uneven = (own & (spread > np.log(self.damping_spread))).any(axis=1)
        mark(uneven, f"damping of the modes differs by more than a factor {self.damping_spread:g}")
        return out

    def to_dict(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> DesignSpace:
        """From the model card."""
        values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
        return cls(**values)


def _outside(values: np.ndarray, limits: Range) -> np.ndarray:
    return (values < limits[0] * (1 - 1e-9)) | (values > limits[1] * (1 + 1e-9))


def _text(limits: Range) -> str:
    return f"{limits[0]:g} to {limits[1]:g}"
