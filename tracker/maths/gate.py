"""Chi-square limits, computed once each."""

from __future__ import annotations

from functools import lru_cache

from scipy.stats import chi2


@lru_cache(maxsize=256)
def chi2_limit(probability: float, dof: int) -> float:
    """Return what a chi-square variable with `dof` degrees of freedom does not exceed with a probability."""
    return float(chi2.ppf(probability, dof))
