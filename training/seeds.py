"""Seeds of samples that must be independent of one another."""

from __future__ import annotations

import hashlib


def seed_for(purpose: str, seed: int) -> int:
    """A seed of its own for each purpose, from the one seed a user gives.

    Not ``seed + 1`` and the like: the sampler of the design space uses the seed's neighbour itself, and
    the certificate holds only on points independent of the training set. Hashing keeps the streams
    apart whatever seeds are given, and 2^47 or more is beyond any that a user counts up to.

    Examples
    --------
    >>> seed_for("calibration", 2013) == seed_for("calibration", 2013)
    True
    >>> seed_for("calibration", 2013) != seed_for("evaluation", 2013)
    True
    """
    digest = hashlib.sha256(f"{purpose} {seed}".encode()).digest()
    return int.from_bytes(digest[:6], "big") | 1 << 47
