"""Evidence, from a running count of mistakes, that a certified rate is not kept; valid at any time."""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp, xlog1py, xlogy

# Alternatives are so many times as large, one after the other: what lies between two is found nearly as fast.
RATIO = 2.0
LARGEST_RATE = 0.5


def log_evidence(errors: int, answers: int, rate: float) -> float:
    """Natural logarithm of the evidence against "each answer is wrong with probability at most `rate`".

        E = 1/J Σ_j (q_j/α)ᵏ ((1 − q_j)/(1 − α))ⁿ⁻ᵏ,   q_j = 2α, 4α, ..., at last 1/2

    is a mixture of likelihood ratios of k errors in n answers. Under the hypothesis every factor has an
    expectation of at most 1 given all answers before: E is a nonnegative supermartingale that begins at 1,
    and by Ville's inequality P(E ≥ 1/δ at any time) ≤ δ. So it may be looked at after every answer, for
    years, at one price. It takes about (ln 1/δ + ln J)/KL(q, α) answers to find a rate q. See Robbins,
    *Ann. Math. Statist.* 41 (1970), section 3; Ramdas, Grünwald, Vovk, Shafer, *Statist. Sci.* 38 (2023),
    section 2.

    It knows no order of the answers, so that counts of several services may be added up. Answers need not
    be independent: what must not exceed α is the probability of an error given the answers before.

    Parameters
    ----------
    errors, answers
        k of n.
    rate
        α, above 0 and below 1/2.

    Examples
    --------
    >>> log_evidence(0, 0, 1e-3)
    0.0
    >>> bool(log_evidence(3, 100, 1e-3) > np.log(100) > log_evidence(1, 100, 1e-3))
    True
    """
    alternatives = _alternatives(rate)
    right = answers - errors
    gain = xlogy(errors, alternatives / rate) + xlog1py(right, -alternatives) - xlog1py(right, -rate)
    return float(logsumexp(gain) - np.log(len(alternatives)))


def _alternatives(rate: float) -> np.ndarray:
    count = int(np.ceil(np.log(LARGEST_RATE / rate) / np.log(RATIO) - 1e-9))
    return np.minimum(rate * RATIO ** np.arange(1, count + 1), LARGEST_RATE)
