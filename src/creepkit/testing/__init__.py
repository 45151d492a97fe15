"""The conformance kit: check_law(law) says whether a law is fit for all uses. `creepkit check FILE` runs it.

Points are Sobol samples of the full bounds and of stress 1e-3 to 2000 MPa, strain 1e-12 to 1, time 1e-3 to 1e6 s,
temperature 600 to 1600 K, wherever the law's constraints hold. So that rates at zero strain and zero time are finite,
stress, strain and states are floored at 1e-30 and time at 1e-120 s where they are bases of powers; composite bases,
such as Max(stress - threshold, 0), at 1e-200.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from creepkit.errors import CreepkitError, LawError
from creepkit.kernels.lowering import lower
from creepkit.language.law import CreepLaw
from creepkit.testing import law_behaviour, law_checks, law_declarations
from creepkit.testing.parity import DERIVATIVE_TOLERANCE, VALUE_TOLERANCE
from creepkit.testing.reports import ConformanceCheck, ConformanceReport
from creepkit.testing.sample_points import LawSamples, draw_samples

__all__ = [
    "DERIVATIVE_TOLERANCE",
    "VALUE_TOLERANCE",
    "ConformanceCheck",
    "ConformanceReport",
    "LawSamples",
    "check_law",
    "draw_samples",
]


_FEWEST_SAMPLES = 8
"""Samples at which the constraints must hold for a verdict to mean something."""


_LAW_CHECKS: dict[str, Callable[[CreepLaw, LawSamples], Iterator[ConformanceCheck]]] = {
    "name": law_declarations.check_name,
    "table": law_checks.check_declarations,
    "references": law_declarations.check_references,
    "dimensions": law_declarations.check_units,
    "printing": law_checks.check_printing,
    "signs": law_checks.check_signs,
    "finite": law_checks.check_finite,
    "monotone": law_checks.check_monotonic,
    "continuity": law_behaviour.check_continuity,
    "temperature": law_declarations.check_temperature,
    "exponents of time": law_behaviour.check_time_exponents,
    "states": law_behaviour.check_states,
    "examples": law_declarations.check_examples,
    "parity": law_checks.check_parity,
    "torch gradients": law_checks.check_torch_gradients,
    "switches": law_checks.check_switches,
    "leading exponent": law_checks.check_leading_exponent,
}


def check_law(law: CreepLaw, samples: int = 64, seed: int = 0) -> ConformanceReport:
    """Run every check on a law; never raises for a law that fails one.

    samples : a power of two.
    """
    if not isinstance(law, CreepLaw):
        raise LawError(f"check_law() takes a creep law, found {law!r}; ck.law(name) returns a registered one")
    try:
        lower(law, "numpy")
    except CreepkitError as error:
        return ConformanceReport(law, (ConformanceCheck("lowering", False, str(error)),))
    sampled = draw_samples(law, samples, seed)
    if len(sampled) < _FEWEST_SAMPLES:
        detail = f"the constraints hold at {len(sampled)} of the samples; widen them or narrow the bounds"
        return ConformanceReport(law, (ConformanceCheck("constraints", False, detail),))
    results: list[ConformanceCheck] = []
    for name, check in _LAW_CHECKS.items():
        results += _checks_of_property(name, check, law, sampled)
        if name == "signs" and not results[-1].passed:
            break  # the logarithm of a negative term means nothing
    return ConformanceReport(law, tuple(results))


def _checks_of_property(
    name: str, check: Callable[[CreepLaw, LawSamples], Iterator[ConformanceCheck]], law: CreepLaw, sampled: LawSamples
) -> list[ConformanceCheck]:
    """The findings of one promise; one that cannot even be examined is a finding too."""
    try:
        with np.errstate(all="ignore"):
            return list(check(law, sampled))
    except (CreepkitError, ArithmeticError, ValueError) as error:
        return [ConformanceCheck(name, False, f"{type(error).__name__}: {error}")]
