"""What RateNet sees: how a law's rate changes around the path of the one-degree-of-freedom model, and what went before.

Nothing here has a unit that the law or the test could change: times, rates and stresses enter as ratios only, so a test
of 20 minutes is like one of a day, and a law that was never trained on is like any other with such rates.
"""

from __future__ import annotations

import torch
from torch import Tensor

from creepkit.specimens.reduced_observed import TRAJECTORY_COLUMNS

FEATURE_START = len(TRAJECTORY_COLUMNS)
"""Where features begin in a course."""

LOCAL_INPUTS = (
    "ln P/E", "log10 age", "ln D", "ln D/D_elastic", "stress exponent", "strain exponent", "fast", "slow",
    "ln multiplier", "log10 strain/(rate time)", "apex thickness",
)  # fmt: skip
"""What is known at a node beside the features; see specimens.reduced_courses for the columns they are made of."""

MEMORY_STRAIN = 1.0
"""Elastic strains of creep in which a stress field forgets where it came from: the memory of the fading means."""
_LOAD, _AGE, _DEFLECTION, _TINY = 1e-6, 1e-3, 1e-4, 1e-12
"""Floors: P/E; creep strain over elastic strain; mm, a tenth of a micron; mm or strain."""
_LARGEST_EXPONENT = 20.0
"""Exponents are bent towards it."""


def input_names(features: int) -> tuple[str, ...]:
    """The inputs in their order: at the node, the mean over the creep so far, and features in a fading mean."""
    local_names = (*(f"feature {k + 1}" for k in range(features)), *LOCAL_INPUTS)
    return (*local_names, *(f"mean {n}" for n in local_names), *(f"fading {n}" for n in local_names[:features]))


def network_inputs(trajectory: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, inputs) from courses (rows, nodes, columns) and apex thicknesses (rows,) mm."""
    return with_running_means(trajectory, local_inputs(trajectory, thickness))


def with_running_means(trajectory: Tensor, local_values: Tensor) -> Tensor:
    """The same from what is known at each node alone, (rows, nodes, features + LOCAL)."""
    features = trajectory.shape[-1] - FEATURE_START
    creep_increments = torch.diff(_column(trajectory, "creep"), dim=1, prepend=torch.zeros_like(trajectory[:, :1, 0])).clamp(min=_TINY)
    mean = (local_values * creep_increments[..., None]).cumsum(dim=1) / creep_increments.cumsum(dim=1)[..., None]
    return torch.cat([local_values, mean, _exponential_means(local_values[..., :features], _column(trajectory, "age"))], dim=-1)


def local_inputs(trajectory: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, features + LOCAL) what is known at each node alone."""

    def column(name: str) -> Tensor:
        return _column(trajectory, name)

    amplitude, elastic = column("amplitude"), column("elastic")
    strain_ratio = torch.log10((column("strain") + _TINY) / (column("time") + 1.0)) - column("log_rate")
    columns = (
        torch.log(column("pressure") / column("modulus") + _LOAD),
        torch.log10(column("age") + _AGE),
        torch.log(amplitude + _DEFLECTION),
        torch.log((amplitude + _DEFLECTION) / (elastic + _DEFLECTION)),
        _saturated(column("exponent"), _LARGEST_EXPONENT),
        _saturated(column("hardening"), _LARGEST_EXPONENT),
        column("fast"),
        column("slow"),
        column("log_multiplier"),
        _saturated(strain_ratio, 3.0),
        thickness[:, None].expand_as(amplitude),
    )
    return torch.cat([trajectory[..., FEATURE_START:], torch.stack(columns, dim=-1)], dim=-1)


def _column(trajectory: Tensor, name: str) -> Tensor:
    return trajectory[..., TRAJECTORY_COLUMNS.index(name)]


def _saturated(x: Tensor, largest: float) -> Tensor:
    """x for small ones, never beyond the largest."""
    return x / torch.sqrt(1.0 + (x / largest) ** 2)


def _exponential_means(features: Tensor, age: Tensor) -> Tensor:
    """Means of features that forget over an elastic strain of creep: m_k = l_k m_{k-1} + (1 - l_k) f_k.

    Spans of 1, 2, 4 ... steps are joined until each reaches back to the first node.
    """
    decay = torch.exp(-torch.diff(age, dim=1).clamp(min=0.0) / MEMORY_STRAIN)[..., None]
    decay = torch.cat([torch.zeros_like(decay[:, :1]), decay], dim=1)
    means, span = (1.0 - decay) * features, 1
    while span < features.shape[1]:
        combined = torch.addcmul(means[:, span:], decay[:, span:], means[:, :-span])
        means = torch.cat([means[:, :span], combined], dim=1)
        decay = torch.cat([decay[:, :span], decay[:, span:] * decay[:, :-span]], dim=1)
        span *= 2
    return means
