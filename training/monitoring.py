"""When to stop asking: the certified figure, on a sample kept for that alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from training.calibration import Progress
from training.certificate import certify
from training.contact_class import ARCS, PERMANENT, in_words
from training.design_space import DesignSpace
from training.labelling import point_verdicts
from training.reference_space import NAME, ReferenceSample, reference_sample
from training.seeds import seed_for
from training.surrogate import Surrogate


@dataclass(frozen=True)
class Goal:
    """A rate, and the share of points that may be verified for it in each class of contact."""

    alpha: float = 1e-4
    verified_share: Mapping[str, float] = field(default_factory=lambda: {PERMANENT: 0.02, ARCS: 0.02})

    def reached(self, shares: Mapping[str, float]) -> bool:
        """Whether every class keeps to its share."""
        return all(shares[contact] <= most for contact, most in self.verified_share.items())


@dataclass(frozen=True)
class Monitor:
    """Labelled points of each class of contact.

    Looked at after every round, they prove nothing about the model that is chosen by them in the end: its
    certificate comes from points that nobody has looked at.
    """

    seed: int
    samples: dict[str, tuple[ReferenceSample, np.ndarray]]

    @classmethod
    def drawn(
        cls,
        contacts: Sequence[str],
        points: int,
        seed: int,
        workers: int,
        progress: Progress = lambda stage, done, of, remark: None,
    ) -> Monitor:
        """`points` of each class, with verdicts of the exact core."""
        samples = {}
        for contact in contacts:
            sample = reference_sample(points, seed_for(f"monitoring, {contact}", seed), contact)

            def report(done: int, of: int, contact: str = contact) -> None:
                progress("monitor", done, of, in_words(contact))

            stable = point_verdicts(sample.cases, sample.ke, workers=workers, progress=report)
            samples[contact] = sample, stable != 1.0
        return cls(seed, samples)

    def verified_shares(
        self, surrogate: Surrogate | None, space: DesignSpace, goal: Goal
    ) -> dict[str, float]:
        """Share to verify for the goal's rate, by class of contact; infinite where no band is proven."""
        assert surrogate is not None
        shares = {}
        for contact, (sample, unstable) in self.samples.items():
            found = certify(
                surrogate.boundary(sample.cases),
                space.contains(sample.cases, sample.ke),
                sample.ke,
                unstable,
                distribution=NAME,
                contact=contact,
                seed=self.seed,
                alphas=(goal.alpha,),
            )
            shares[contact] = found.table[0].verified_share if found.table else float("inf")
        return shares
