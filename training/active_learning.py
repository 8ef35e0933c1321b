"""Ask and tell: exact solves go where the surrogate could call an unstable design stable."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from training.cases import CaseBatch
from training.contact_class import ARCS, PERMANENT
from training.design_space import DesignSpace
from training.seeds import seed_for
from training.space_filling import space_filling
from training.surrogate import Surrogate
from training.verification_band import ONE_PERCENT

SPEEDS_EACH = {PERMANENT: 6, ARCS: 2}
"""Speeds of a design in a space-filling sample: in permanent contact those of one design share a solve."""

_CANDIDATES = 3  # drawn for each that is asked for
_SHARPNESS = 1.0  # exponent of the risk in the chance to be asked


@dataclass
class ActiveLearner:
    """Labelled cases so far, and which to label next.

    The risk of a case is the width in log K_e over which the surrogate could be wrong about it: its learned
    spread, and how far its boundary moved when the last labels came in (two surrogates are a committee).
    Cases are drawn without replacement, with chances in proportion to the risk: that spends labels where
    the risk is, and a batch never consists of neighbours that all tell the same.

    Parameters
    ----------
    space
        Where cases come from.
    seed
        Of all that is drawn.
    shares
        Classes of contact and their shares of the first, space-filling cases.
    """

    space: DesignSpace
    seed: int
    shares: dict[str, float] = field(default_factory=lambda: {PERMANENT: 0.5, ARCS: 0.5})
    rounds: int = 0
    _cases: list[CaseBatch] = field(default_factory=list)
    _kappa: list[np.ndarray] = field(default_factory=list)
    _committee: list[Surrogate] = field(default_factory=list)

    def ask(self, count: int) -> CaseBatch:
        """About `count` cases to label next: space-filling while there is no surrogate, by risk later."""
        self.rounds += 1
        draw = count if not self._committee else _CANDIDATES * count
        pool = CaseBatch.concatenate(
            [self._drawn(contact, int(share * draw)) for contact, share in self.shares.items()]
        )
        if not self._committee:
            return pool
        rng = np.random.default_rng(seed_for(f"choice {self.rounds}", self.seed))
        return pool[chosen(self.risk(pool), min(count, len(pool)), rng)]

    def _drawn(self, contact: str, count: int) -> CaseBatch:
        # Chosen one by one later, speeds of one blade would share nothing.
        each = SPEEDS_EACH[contact] if not self._committee else 2
        designs = max(1, count // each)
        seed = seed_for(f"cases {self.rounds} {contact}", self.seed)
        return space_filling(self.space, designs, each, seed, contact)

    def tell(self, cases: CaseBatch, kappa: np.ndarray) -> None:
        """Labels of cases, asked for or not; κ as `critical_kappa` gives it."""
        self._cases.append(cases)
        self._kappa.append(np.asarray(kappa, dtype=float))

    def learnt(self, surrogate: Surrogate) -> None:
        """The surrogate fitted to what has been told: the next risk is judged by it and the one before."""
        self._committee = [*self._committee[-1:], surrogate]

    @property
    def surrogate(self) -> Surrogate | None:
        """The latest."""
        return self._committee[-1] if self._committee else None

    @property
    def labelled(self) -> tuple[CaseBatch, np.ndarray]:
        """All cases told of and their κ."""
        return CaseBatch.concatenate(self._cases), np.concatenate(self._kappa)

    @property
    def labels(self) -> int:
        """How many cases have been told of."""
        return sum(len(k) for k in self._kappa)

    def risk(self, cases: CaseBatch) -> np.ndarray:
        """Width in log10 K_e over which the surrogate could be wrong, shape (m,)."""
        found = [surrogate.boundary(cases) for surrogate in self._committee]
        moved = np.abs(found[-1].log_ke - found[0].log_ke)
        width = found[-1].spread + moved
        # Nothing is at risk where the boundary lies far beyond every K_e that is asked about.
        beyond = found[-1].log_ke - np.log10(self.space.largest_ke(cases))
        return np.where(beyond > 10 * width + ONE_PERCENT, 1e-3 * width, width)


def chosen(risk: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Rows drawn without replacement, with chances in proportion to the risk; shape (count,).

    The largest of log(risk) plus Gumbel noise are such a draw (Efraimidis and Spirakis, *Inf. Process. Lett.*
    97, 2006, in another form).
    """
    key = _SHARPNESS * np.log(np.maximum(risk, 1e-300)) + rng.gumbel(size=len(risk))
    return np.sort(np.argpartition(-key, count - 1)[:count])
