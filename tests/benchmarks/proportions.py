"""Shares of successes with their 95 % binomial intervals, as benchmark tables print them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from scipy.stats import binomtest


def share_with_interval(hits: Sequence[bool], method: Literal["exact", "wilson"] = "exact") -> str:
    """Share of true values and its 95 % interval: by Clopper and Pearson ("exact") or by Wilson."""
    if not len(hits):
        return "-"
    count, trials = int(sum(hits)), len(hits)
    low, high = binomtest(count, trials).proportion_ci(method=method)
    return f"{count / trials:.3f} [{low:.3f}, {high:.3f}]"
