"""Learn then Test: which of a row of ever bolder rules keep a bound on a rate, proven on a sample.

Angelopoulos, Bates, Candès, Jordan, Lei, *Learn then Test: calibrating predictive algorithms to achieve
risk control* (2021), section 2 (p-values) and section 4 (fixed sequences).
"""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import binom


def binomial_p_value(errors: int, accepted: int, rate: float) -> float:
    """P(at most `errors` | rate): how well a true rate above `rate` would explain so few errors.

    Of the points a rule accepts, the wrong ones are binomial whatever the rule and the distribution, so
    that the test is exact: p = Σ_{i ≤ k} C(n, i) αⁱ (1 − α)ⁿ⁻ⁱ. With nothing accepted nothing is proven,
    and p = 1.

    Examples
    --------
    >>> binomial_p_value(0, 29_956, 1e-4) <= 0.05 < binomial_p_value(0, 29_955, 1e-4)
    True
    """
    return float(binom.cdf(errors, accepted, rate))


def fixed_sequence(errors: Sequence[int], accepted: Sequence[int], rate: float, level: float) -> int:
    """How many rules, from the first on, keep the rate; the order is set before any data is seen.

    Rules are tested one after the other, each at the full `level`, until one fails. A rule that breaks
    the bound is among those counted with probability at most `level`: to be counted, the first of them
    must pass its own test.
    """
    for held, (k, n) in enumerate(zip(errors, accepted, strict=True)):
        if binomial_p_value(k, n, rate) > level:
            return held
    return len(errors)


def simultaneous_sequences(
    errors: Sequence[int], accepted: Sequence[int], rates: Sequence[float], confidence: float
) -> tuple[int, ...]:
    """How many rules hold for each rate, all statements true together with `confidence`.

    Each rate has a fixed sequence of its own and an equal share of 1 − confidence. A sequence tested to
    its end hands its share on to the next, stricter rate (the fallback procedure of Wiens and Dmitrienko,
    *J. Biopharm. Stat.* 15, 2005): it has no rule left that could be wrong without one of its own errors
    having been made. The shares in use never add up to more than 1 − confidence.

    Parameters
    ----------
    errors, accepted
        Of each rule, boldest last.
    rates
        Falling.

    Returns
    -------
    One count a rate; it never grows as the rate falls.
    """
    share = (1.0 - confidence) / len(rates)
    counts, handed_on = [], 0.0
    for rate in rates:
        level = share + handed_on
        held = fixed_sequence(errors, accepted, rate, level)
        handed_on = level if held == len(errors) else 0.0
        counts.append(held)
    return tuple(counts)
