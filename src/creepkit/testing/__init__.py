"""The conformance kit: check_law(law) says whether a law is fit for every verb. `creepkit check FILE` runs it.

Points are Sobol samples of the full bounds and of stress 1e-3 to 2000 MPa, strain 1e-12 to 1, time 1e-3 to 1e6 s,
temperature 600 to 1600 K, wherever the law's constraints hold. So that rates at zero strain and zero time are finite,
stress, strain and states are floored at 1e-30 and time at 1e-120 s where they are bases of powers; composite bases,
such as Max(stress - threshold, 0), at 1e-200.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.kernels.lowering import lower
from creepkit.language.law import CreepLaw
from creepkit.testing import promises
from creepkit.testing.parity import DERIVATIVE_TOLERANCE, VALUE_TOLERANCE
from creepkit.testing.report import Check, Report
from creepkit.testing.sampling import Samples, sample

__all__ = ["DERIVATIVE_TOLERANCE", "VALUE_TOLERANCE", "Check", "Report", "Samples", "check_law", "sample"]

_FEWEST = 8
"""Samples at which the constraints must hold for a verdict to mean something."""

_PROMISES: dict[str, Callable[[CreepLaw, Samples], Iterator[Check]]] = {
    "table": promises.table,
    "printing": promises.printing,
    "signs": promises.signs,
    "finite": promises.finite,
    "monotone": promises.monotone,
    "parity": promises.parity,
    "torch gradients": promises.gradients,
    "switches": promises.switches,
    "leading exponent": promises.leading,
}


def check_law(law: CreepLaw, samples: int = 64, seed: int = 0) -> Report:
    """Run every check on a law; never raises for a law that fails one.

    samples : a power of two.
    """
    try:
        lower(law, "numpy")
    except CreepkitError as error:
        return Report(law, (Check("lowering", False, str(error)),))
    drawn = sample(law, samples, seed)
    if len(drawn) < _FEWEST:
        detail = f"the constraints hold at {len(drawn)} of the samples; widen them or narrow the bounds"
        return Report(law, (Check("constraints", False, detail),))
    found: list[Check] = []
    for name, promise in _PROMISES.items():
        found += _kept(name, promise, law, drawn)
        if name == "signs" and not found[-1].ok:
            break  # the logarithm of a negative term means nothing
    return Report(law, tuple(found))


def _kept(
    name: str, promise: Callable[[CreepLaw, Samples], Iterator[Check]], law: CreepLaw, drawn: Samples
) -> list[Check]:
    """The findings of one promise; one that cannot even be examined is a finding too."""
    try:
        with np.errstate(all="ignore"):
            return list(promise(law, drawn))
    except (CreepkitError, ArithmeticError, ValueError) as error:
        return [Check(name, False, f"{type(error).__name__}: {error}")]
