"""What RateNet sees: how a law's rate changes around the path of the one-degree-of-freedom model, and what went before.

Nothing here has a unit that the law or the test could change: times, rates and stresses enter as ratios only, so a test
of 20 minutes is like one of a day, and a law that was never trained on is like any other with such rates.
"""

from __future__ import annotations

import torch
from torch import Tensor

from creepkit.specimens.reduced_observed import COLUMNS

FEATURES = len(COLUMNS)
"""Where features begin in a course."""

LOCAL = (
    "ln P/E", "log10 age", "ln D", "ln D/D_elastic", "stress exponent", "strain exponent", "fast", "slow",
    "ln multiplier", "log10 strain/(rate time)", "apex thickness",
)  # fmt: skip
"""What is known at a node beside the features; see specimens.reduced_courses for the columns they are made of."""

FADING = 1.0
"""Elastic strains of creep in which a stress field forgets where it came from: the memory of the fading means."""
_LOAD, _AGE, _DEFLECTION, _TINY = 1e-6, 1e-3, 1e-4, 1e-12
"""Floors: P/E; creep strain over elastic strain; mm, a tenth of a micron; mm or strain."""
_BENT = 20.0
"""Exponents are bent towards it."""


def names(features: int) -> tuple[str, ...]:
    """The inputs in their order: at the node, the mean over the creep so far, and features in a fading mean."""
    own = (*(f"feature {k + 1}" for k in range(features)), *LOCAL)
    return (*own, *(f"mean {n}" for n in own), *(f"fading {n}" for n in own[:features]))


def inputs(course: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, inputs) from courses (rows, nodes, columns) and apex thicknesses (rows,) mm."""
    return remembering(course, local(course, thickness))


def remembering(course: Tensor, own: Tensor) -> Tensor:
    """The same from what is known at each node alone, (rows, nodes, features + LOCAL)."""
    features = course.shape[-1] - FEATURES
    grown = torch.diff(_column(course, "creep"), dim=1, prepend=torch.zeros_like(course[:, :1, 0])).clamp(min=_TINY)
    mean = (own * grown[..., None]).cumsum(dim=1) / grown.cumsum(dim=1)[..., None]
    return torch.cat([own, mean, _fading(own[..., :features], _column(course, "age"))], dim=-1)


def local(course: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, features + LOCAL) what is known at each node alone."""

    def of(name: str) -> Tensor:
        return _column(course, name)

    amplitude, elastic = of("amplitude"), of("elastic")
    passed = torch.log10((of("strain") + _TINY) / (of("time") + 1.0)) - of("log_rate")
    columns = (
        torch.log(of("pressure") / of("modulus") + _LOAD),
        torch.log10(of("age") + _AGE),
        torch.log(amplitude + _DEFLECTION),
        torch.log((amplitude + _DEFLECTION) / (elastic + _DEFLECTION)),
        _bent(of("exponent"), _BENT),
        _bent(of("hardening"), _BENT),
        of("fast"),
        of("slow"),
        of("log_multiplier"),
        _bent(passed, 3.0),
        thickness[:, None].expand_as(amplitude),
    )
    return torch.cat([course[..., FEATURES:], torch.stack(columns, dim=-1)], dim=-1)


def _column(course: Tensor, name: str) -> Tensor:
    return course[..., COLUMNS.index(name)]


def _bent(x: Tensor, largest: float) -> Tensor:
    """x for small ones, never beyond the largest."""
    return x / torch.sqrt(1.0 + (x / largest) ** 2)


def _fading(features: Tensor, age: Tensor) -> Tensor:
    """Means of features that forget over an elastic strain of creep: m_k = l_k m_{k-1} + (1 - l_k) f_k.

    Spans of 1, 2, 4 ... steps are joined until each reaches back to the first node.
    """
    left = torch.exp(-torch.diff(age, dim=1).clamp(min=0.0) / FADING)[..., None]
    left = torch.cat([torch.zeros_like(left[:, :1]), left], dim=1)
    means, span = (1.0 - left) * features, 1
    while span < features.shape[1]:
        joined = torch.addcmul(means[:, span:], left[:, span:], means[:, :-span])
        means = torch.cat([means[:, :span], joined], dim=1)
        left = torch.cat([left[:, :span], left[:, span:] * left[:, :-span]], dim=1)
        span *= 2
    return means
