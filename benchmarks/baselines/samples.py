"""What every method is fitted to, and what every one is tried on."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from training.active_learning import SPEEDS_EACH
from training.cases import CaseBatch
from training.contact_class import ARCS, PERMANENT
from training.design_space import DesignSpace
from training.evaluation import HARD
from training.labelling import critical_kappa, truth
from training.reference_space import reference_sample
from training.seeds import seed_for
from training.space_filling import space_filling

VERIFIED_SHARE = {PERMANENT: 0.02, ARCS: 0.05}
_SEED = 2013


@dataclass(frozen=True)
class Labels:
    """Cases and log10 κ of their first crossings, infinite where there is none up to `reach`; m each."""

    cases: CaseBatch
    log_kappa: np.ndarray
    reach: float

    def __len__(self) -> int:
        return len(self.log_kappa)

    def first(self, count: int) -> Labels:
        """The first `count`: a smaller set is part of every larger one."""
        return Labels(self.cases[:count], self.log_kappa[:count], self.reach)

    @classmethod
    def drawn(cls, contact: str, count: int, workers: int) -> Labels:
        """A space-filling sample of our design space in random order; what is not decided is left out."""
        space, each = DesignSpace(), SPEEDS_EACH[contact]
        seed = seed_for(f"baselines, labels, {contact}", _SEED)
        cases = space_filling(space, -(-count // each), each, seed, contact)
        kappa = critical_kappa(cases, space, workers=workers)
        known = np.flatnonzero(~np.isnan(kappa))
        rows = np.random.default_rng(seed).permutation(known)[:count]
        limit = space.largest_kappa if contact == PERMANENT else space.largest_kappa_with_arcs
        return cls(read_only(cases[rows]), _fixed(np.log10(kappa[rows])), float(np.log10(limit)))


@dataclass(frozen=True)
class Trial:
    """Independent points of the reference design space, and the truth about them; m each.

    Attributes
    ----------
    ke, critical_ke
        N/m; infinite where there is no crossing, NaN where it is not known.
    unstable
        The exact verdict at `ke`.
    share
        Of the points that is verified.
    """

    contact: str
    cases: CaseBatch
    ke: np.ndarray
    critical_ke: np.ndarray
    unstable: np.ndarray
    share: float

    def __len__(self) -> int:
        return len(self.ke)

    @property
    def log_kappa(self) -> np.ndarray:
        """log10 κ of the points."""
        return np.log10(self.ke / self.cases.stiffness_scale)

    @property
    def near(self) -> np.ndarray:
        """Points within 25 % of the boundary."""
        with np.errstate(invalid="ignore"):
            return np.abs(self.ke / self.critical_ke - 1) <= HARD

    @classmethod
    def drawn(cls, contact: str, count: int, workers: int) -> Trial:
        """Points that no training, calibration or other figure has seen."""
        sample = reference_sample(count, seed_for(f"baselines, points, {contact}", _SEED), contact)
        critical, unstable = truth(sample.cases, sample.ke, workers=workers)
        held = (_fixed(a) for a in (sample.ke, critical, unstable))
        return cls(contact, read_only(sample.cases), *held, VERIFIED_SHARE[contact])


def read_only(cases: CaseBatch) -> CaseBatch:
    """The same cases, which no method can change for the next."""
    return CaseBatch(*(_fixed(getattr(cases, field.name)) for field in fields(cases)))


def _fixed(array: np.ndarray) -> np.ndarray:
    held = np.array(array)
    held.setflags(write=False)
    return held
