"""Cases that serving met, with what the exact core said of each: material for retraining."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from sdm_core.contact import ContactConfiguration
from training.cases import MODES, CaseBatch
from training.design_space import DesignSpace
from training.exact_answers import CROSSING, NO_CROSSING, STABLE, UNSTABLE, ExactAnswers

ARCS = 4
# Cases that agree in six digits are one: more than a label's own error, less than any lobe's width.
_DIGITS = 6


@dataclass(frozen=True)
class TrainingCases:
    """Distinct cases inside a design space, and where they come from for a dataset's provenance."""

    cases: CaseBatch
    provenance: dict[str, Any]


@dataclass(frozen=True)
class ServedCases:
    """m exact answers, each a case (as in `CaseBatch`), its arcs and a finding at a K_e.

    Attributes
    ----------
    omega, damping_ratio, contact_matrix, speed_hz, mode_count
        As in `CaseBatch`.
    arcs
        (start, end) in revolutions, shape (m, 4, 2), NaN where there is none; permanent contact is the one
        arc (0, 1).
    ke
        N/m, shape (m,).
    finding
        As in `ExactAnswers`, shape (m,).
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    contact_matrix: np.ndarray
    speed_hz: np.ndarray
    mode_count: np.ndarray
    arcs: np.ndarray
    ke: np.ndarray
    finding: np.ndarray

    def __len__(self) -> int:
        return len(self.speed_hz)

    def __getitem__(self, index: slice | np.ndarray) -> Self:
        return type(self)(*(getattr(self, field.name)[index] for field in fields(self)))

    @classmethod
    def none(cls) -> Self:
        """No cases."""
        five, count = np.empty((0, MODES)), np.empty(0, dtype=np.int64)
        square, arcs = np.empty((0, MODES, MODES)), np.empty((0, ARCS, 2))
        return cls(five, five, square, np.empty(0), count, arcs, np.empty(0), count.astype(np.int8))

    @classmethod
    def concatenate(cls, parts: Sequence[ServedCases]) -> Self:
        """One after another."""
        whole = [cls.none(), *parts]
        return cls(*(np.concatenate([getattr(p, field.name) for p in whole]) for field in fields(cls)))

    @classmethod
    def from_answers(cls, answers: ExactAnswers) -> Self:
        """The answers that a surrogate of this form could learn from.

        Left out: smooth engagement, more than four arcs, more than five modes (a case would forget the
        others), and contact that no mode moves.
        """
        arcs = _arcs_of(answers.contact)
        if arcs is None or not len(answers) or answers.blade.mode_count > MODES:
            return cls.none()
        speeds, which = np.unique(answers.speed_hz, return_inverse=True)
        cases = CaseBatch.from_blade(answers.blade, answers.contact, speeds)
        if not np.isfinite(cases.stiffness_scale).all():
            return cls.none()
        each = cases[which]
        return cls(
            each.omega,
            each.damping_ratio,
            each.contact_matrix,
            each.speed_hz,
            each.mode_count,
            np.tile(arcs, (len(answers), 1, 1)),
            np.asarray(answers.ke, dtype=float),
            np.asarray(answers.finding, dtype=np.int8),
        )

    @property
    def cases(self) -> CaseBatch:
        """Without K_e and finding."""
        return CaseBatch(
            self.omega,
            self.damping_ratio,
            self.contact_matrix,
            self.speed_hz,
            self.mode_count,
            self.arcs,
            np.isfinite(self.arcs[:, :, 0]).sum(axis=1),
        )

    @property
    def permanent(self) -> np.ndarray:
        """Which are in permanent contact, shape (m,)."""
        return (self.arcs[:, 0, 1] - self.arcs[:, 0, 0] >= 1.0) & np.isnan(self.arcs[:, 1, 0])

    @property
    def log_kappa(self) -> np.ndarray:
        """log10 κ, κ = K_e·max_j G_jj/ω_j², shape (m,)."""
        return np.log10(self.ke / self.cases.stiffness_scale)

    def case_digests(self) -> np.ndarray:
        """A name for each dimensionless case, contact included and K_e not; shape (m,) of 16 bytes.

        The same for blades that differ in units, in the signs of their modes, in their tip nodes but not
        in G, or in where round the casing the arcs begin.
        """
        return _hashed(self._dimensionless())

    def digests(self) -> np.ndarray:
        """A name for each answer: the case with its κ and finding."""
        answer = np.stack([self.log_kappa, self.finding], axis=1)
        return _hashed(np.concatenate([self._dimensionless(), answer], axis=1))

    def distinct(self) -> Self:
        """Each answer once, the first of its name."""
        return self[np.sort(np.unique(self.digests(), return_index=True)[1])]

    def bounds(self) -> tuple[Self, np.ndarray, np.ndarray]:
        """Distinct cases, and between which log10 κ the first crossing of each must lie.

        A case found unstable crosses at or below; one without a crossing up to a κ, above. A stable verdict
        says "above" too, but only below the lowest κ found unstable: with arcs a blade may be stable again
        above its first crossing (rare), and a stable verdict alone may come from there. Whoever wants labels
        and not bounds asks the exact core again (`for_training`).

        Returns
        -------
        One row a distinct case, and the lower (−∞: unknown) and upper (∞: unknown) bounds, shape (d,).
        """
        _, first, which = np.unique(self.case_digests(), return_index=True, return_inverse=True)
        value = self.log_kappa
        low, high = np.full(len(first), -np.inf), np.full(len(first), np.inf)
        at_most = np.isin(self.finding, (UNSTABLE, CROSSING))
        np.minimum.at(high, which[at_most], value[at_most])
        stable = (self.finding == STABLE) & (value <= high[which])
        at_least = np.isin(self.finding, (CROSSING, NO_CROSSING)) | stable
        np.maximum.at(low, which[at_least], value[at_least])
        return self[first], low, high

    def for_training(self, space: DesignSpace) -> TrainingCases:
        """The distinct cases of a design space, to be labelled by the exact core.

        Those outside it stay out: the surrogate would not be asked about them.
        """
        _, first = np.unique(self.case_digests(), return_index=True)
        distinct = self[np.sort(first)]
        taken = space.contains(distinct.cases)
        chosen = distinct[taken]
        digest = hashlib.sha256(np.sort(chosen.case_digests()).tobytes()).hexdigest()
        provenance = {"cases": len(chosen), "left_out": len(distinct) - len(chosen), "sha256": digest}
        return TrainingCases(chosen.cases, provenance)

    def _dimensionless(self) -> np.ndarray:
        """Everything the dynamics depends on but K_e, in canonical form, shape (m, 49)."""
        own = np.arange(MODES) < np.minimum(self.mode_count, MODES)[:, None]
        ratio = np.where(own, self.omega / self.omega[:, :1], 0.0)
        damping = np.where(own, self.damping_ratio, 0.0)
        g = self.contact_matrix / (self.omega[:, :, None] * self.omega[:, None, :])
        largest = np.einsum("mjj->mj", g)
        lead = largest.argmax(axis=1)
        g = g / largest.max(axis=1)[:, None, None]
        sign = np.where(np.take_along_axis(g, lead[:, None, None], axis=2)[:, :, 0] < 0, -1.0, 1.0)
        g = g * sign[:, :, None] * sign[:, None, :]
        g[np.abs(g) < 1e-12] = 0.0
        turn = 2 * np.pi * self.speed_hz / self.omega[:, 0]
        # Few patterns of arcs, many cases; no NaN, which equals nothing.
        flat = np.nan_to_num(self.arcs.reshape(-1, 2 * ARCS), nan=-1.0)
        patterns, which = np.unique(flat, axis=0, return_inverse=True)
        turned = [_from_its_first_arc(a.reshape(ARCS, 2)).ravel() for a in patterns]
        arcs = np.reshape(turned, (-1, 2 * ARCS))[which]
        return np.concatenate([ratio, damping, g.reshape(len(self), MODES**2), turn[:, None], arcs], axis=1)


def _arcs_of(contact: ContactConfiguration) -> np.ndarray | None:
    """Arcs, shape (4, 2); None where there is no place for them."""
    out = np.full((ARCS, 2), np.nan)
    if contact.permanent:
        out[0] = 0.0, 1.0
        return out
    if contact.smooth or contact.arcs is None or len(contact.arcs) > ARCS:
        return None
    out[: len(contact.arcs)] = contact.arcs
    return out


def _from_its_first_arc(arcs: np.ndarray) -> np.ndarray:
    """Arcs (below 0: none) turned so that one of them begins at 0, whichever gives the lowest numbers."""
    there = arcs[arcs[:, 0] >= 0.0]
    if not len(there):
        return np.zeros(arcs.shape)
    if there[0, 1] - there[0, 0] >= 1.0:
        there = np.array([[0.0, 1.0]])
    turned = []
    for start, _ in there:
        moved = np.roll(there, -int(np.flatnonzero(there[:, 0] == start)[0]), axis=0) - start
        moved += np.where(moved[:, :1] < -1e-12, 1.0, 0.0)
        turned.append(np.round(moved, _DIGITS).ravel().tolist())
    out = np.zeros(arcs.shape)
    out[: len(there)] = np.reshape(min(turned), (-1, 2))
    return out


def _hashed(rows: np.ndarray) -> np.ndarray:
    """16 bytes a row, the same for rows that agree in six digits."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(rows == 0.0, 0.0, np.floor(np.log10(np.abs(rows))))
        mantissa = np.where(rows == 0.0, 0.0, np.round(rows * 10.0 ** (_DIGITS - 1 - size)))
    whole = np.concatenate([mantissa, size], axis=1).astype("<i8")
    names = [hashlib.blake2b(row.tobytes(), digest_size=16).digest() for row in whole]
    return np.array(names, dtype="V16") if names else np.empty(0, dtype="V16")
