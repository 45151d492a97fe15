"""Checks of what kernels make of a law: finite, monotonic, equal to 50 digits, with its switches."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import mpmath
import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.kernels.interface import call_entry
from creepkit.kernels.log_form import log_form
from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, time
from creepkit.testing.parity import (
    DERIVATIVE_TOLERANCE,
    KERNEL_EVALUATORS,
    NEGLIGIBLE_RATE,
    VALUE_TOLERANCE,
    MultiprecisionReference,
    RelativeDifference,
    largest_differences,
)
from creepkit.testing.reports import finding
from creepkit.testing.sample_points import STRESS_COLUMNS, LawSamples, constraints_hold, log_rate, point_text

_SMALLEST_ACCURATE = 1e-290
"""Numbers below this may have lost digits."""


_LARGEST_LOG_RATE = 1e29
"""ln rates as far from 0 as this mean that no term is left, or that the rate is infinite."""


_ZERO = {
    "strain": ("strain",),
    "time": ("time",),
    "stress": ("stress", "principal_stress", "mean_stress"),
    "strain and time and stress": ("strain", "time", "stress", "principal_stress", "mean_stress"),
}
"""{words: variables of the point that are zero}."""


def _require(law: CreepLaw, samples: LawSamples, holds: Bools) -> str:
    """AssertionError with the first sample at which something does not hold; holds : (samples,)."""
    if not holds.all():
        where = point_text(law, samples.points[int(np.flatnonzero(~holds)[0])])
        raise AssertionError(f"not at {int((~holds).sum())} of {holds.size} points, such as {where}")
    return f"{holds.size} points"


@finding("ln rate is finite")
def check_finite(law: CreepLaw, samples: LawSamples) -> str:
    """The log rate is a number wherever the constraints hold."""
    return _require(law, samples, np.abs(log_rate(lower(law, "numpy"), samples)) < _LARGEST_LOG_RATE)


@finding("ln rate and its derivatives are finite at zero {}", each=lambda law, samples: _ZERO)
def check_finite_at_zero(law: CreepLaw, samples: LawSamples, words: str) -> str:
    """So are they at zero strain, time and stress, where the floors of powers count."""
    at_zero = samples.at(**dict.fromkeys(_ZERO[words], 0.0))
    finite = np.isfinite(log_rate(lower(law, "numpy"), at_zero)) & _updates(law, at_zero)
    return _require(law, at_zero, finite)


def _updates(law: CreepLaw, samples: LawSamples) -> Bools:
    """Where the compiled entry of implicit updates gives finite numbers, (samples,)."""
    compiled, pairs = lower(law, "compiled"), zip(samples.points, samples.theta, strict=True)
    return np.array([call_entry(compiled, "update", point[None], theta)[1] == 0 for point, theta in pairs])


@finding("rate never falls with stress")
def check_monotonic(law: CreepLaw, samples: LawSamples) -> str:
    """A higher stress of the same direction never lowers the rate."""
    kernel, higher = lower(law, "numpy"), samples.scaled(STRESS_COLUMNS, 1.01)
    before, after = log_rate(kernel, samples), log_rate(kernel, higher)
    rises = after >= before - 1e-9 * np.maximum(1.0, np.abs(before))
    return _require(law, samples, rises | ~constraints_hold(law, higher.points, higher.theta))


LIMITS = {"value": VALUE_TOLERANCE, "derivatives": DERIVATIVE_TOLERANCE}


@finding("{} against 50 digits", each=lambda law, _: [f"{t} {what}" for t in KERNEL_EVALUATORS for what in LIMITS])
def check_parity(law: CreepLaw, samples: LawSamples, of: str) -> str:
    """Every target agrees with 50-digit arithmetic."""
    target, what = of.split()
    reference, differences = _differences(law, samples)[target]
    difference = differences[list(LIMITS).index(what)]
    assert difference.size <= LIMITS[what], f"{difference.size:.1e}, {reference.location_text(difference)}"
    return f"{difference.size:.1e}"


@lru_cache(maxsize=1)
def _differences(
    law: CreepLaw, samples: LawSamples
) -> Mapping[str, tuple[MultiprecisionReference, tuple[RelativeDifference, RelativeDifference]]]:
    reference = MultiprecisionReference(MultiprecisionLaw(law), samples)
    return {
        target: (reference, largest_differences(reference, evaluate(law, samples), allow_cancellation=True))
        for target, evaluate in KERNEL_EVALUATORS.items()
    }


@finding("torch gradients{}", each=lambda law, samples: ("", " at zero strain and time"))
def check_torch_gradients(law: CreepLaw, samples: LawSamples, where: str) -> str:
    """Torch gradients of the log rate equal the derivatives by symbols, and are finite at zero strain and time."""
    import torch

    if where:
        samples = samples.at(strain=0.0, time=0.0)
    inputs = [torch.tensor(column, requires_grad=True) for column in samples.arguments()]
    total = lower(law, "torch").internal_log_rate(*inputs).sum()
    gradients = torch.autograd.grad(total, inputs, allow_unused=True)
    found = np.stack([np.zeros(len(samples)) if g is None else g.numpy() for g in gradients], axis=1)
    assert np.isfinite(found).all(), "NaN or inf"
    derivatives = lower(law, "numpy").internal_derivatives(*samples.arguments())
    exact = np.stack([*derivatives.point.values(), *derivatives.params.values()], axis=1)
    expected = exact / derivatives.rate[:, None]
    accurate = np.isfinite(expected) & (np.minimum(np.abs(exact), np.abs(expected)) > _SMALLEST_ACCURATE)
    difference = float(np.max(np.abs(found - expected) / np.abs(expected), where=accurate, initial=0.0))
    assert difference <= DERIVATIVE_TOLERANCE, f"{difference:.1e}"
    return f"{difference:.1e}"


@finding("off equals fix")
def check_switches(law: CreepLaw, samples: LawSamples) -> str:
    """A parameter that is off does what fixing it at its off value does."""
    off = {name: param.off for name, param in law.table.items() if param.off is not None}
    differences = {name: _switch_difference(law, samples, name, value) for name, value in off.items()}
    detail = ", ".join(f"{name} {difference:.1e}" for name, difference in differences.items()) or "no switches"
    assert all(gap <= 1e-11 for gap in differences.values()), detail
    return detail


def _switch_difference(law: CreepLaw, samples: LawSamples, name: str, value: float) -> float:
    point = dict(zip((s.name for s in (*POINT_VARIABLES, *law.states)), samples.points.T, strict=True))
    pairs = zip(law.table.items(), samples.theta.T, strict=True)
    values = {n: np.exp(t) if p.scale == "log" else t for (n, p), t in pairs}
    off = lower(law, "numpy").rate({**values, name: value}, **point)
    if all(term.subs(law.symbol(name), value) == 0 for term in law.terms.values()):
        return 0.0 if (off < NEGLIGIBLE_RATE).all() else np.inf
    fixed = law.fix(**{name: value})
    kept = {s.name: point[s.name] for s in (*POINT_VARIABLES, *fixed.states)}
    expected = lower(fixed, "numpy").rate({n: values[n] for n in fixed.names}, **kept)
    finite = np.isfinite(expected)
    difference = np.abs(off[finite] - expected[finite]) / np.maximum(np.abs(expected[finite]), NEGLIGIBLE_RATE)
    return float(difference.max(initial=0.0)) if np.isfinite(off[finite]).all() else np.inf


@finding("every term off")
def check_all_off(law: CreepLaw, samples: LawSamples) -> str | None:
    """With every rate coefficient at zero the rate is 0 and the update finite, in every target."""
    positions = log_form(law).coefficients
    switches = {k for k, p in enumerate(law.params.values()) if p.scale == "log" and p.off == 0}
    coefficients = {k for own in positions for k in own[:1]}
    if not coefficients <= switches or not all(positions):
        return None
    theta = samples.theta.copy()
    theta[:, sorted(coefficients)] = -np.inf
    off = LawSamples(samples.points, theta)
    for target, evaluate in KERNEL_EVALUATORS.items():
        table = evaluate(law, off)
        finite = np.isfinite(table.rows).all() and np.isfinite(table.log_rates).all()
        zero = finite and (table.rows[:, 0, 0] < NEGLIGIBLE_RATE).all()
        assert zero, f"the {target} kernel leaves a rate, or a number that is not finite"
    assert _updates(law, off).all(), "the update entry is not finite"
    return "rate 0, update finite"


@finding("leading exponent of time")
def check_leading_exponent(law: CreepLaw, samples: LawSamples) -> str:
    """The exponent of time at the start, against slopes of the author's terms at 1e-12 s; logarithms die out slowly."""
    exact, compiled = MultiprecisionLaw(law), lower(law, "compiled")
    gaps = []
    for start in ((1e-40, 1e-12), (1e-80, 1e-24)):
        points, theta = samples.points[:16].copy(), samples.theta[:16]
        points[:, 1:3] = start
        slopes = [_leading_exponent(exact, p, t) for p, t in zip(points, theta, strict=True)]
        gaps.append(np.abs(compiled.leading_exponent(theta, points) - slopes))
    early, earlier = gaps
    assert ((earlier <= 1e-6) | (earlier <= 0.6 * early)).all(), f"{earlier.max(initial=0.0):.1e}"
    return f"{earlier.max(initial=0.0):.1e}"


def _leading_exponent(exact: MultiprecisionLaw, point: Floats, theta: Floats) -> float:
    """Smallest (1 + a)/(1 - b) of the terms; one that starts slower than any power, or with strain, does not lead."""
    time_exponents, strain_exponents = (log_log_derivatives(exact, point, theta, v) for v in (time, strain))
    pairs = zip(time_exponents, strain_exponents, strict=True)
    return min(((1 + a) / (1 - b) for a, b in pairs if a < 1e3 and b < 1 - 1e-6), default=1.0)


def log_log_derivatives(exact: MultiprecisionLaw, point: Floats, theta: Floats, variable: sympy.Symbol) -> list[float]:
    """d(ln term)/d(ln variable) of each term; inf where a term is zero.

    point : (6 + states,) MPa, s and K. theta : (parameters,) internal values.
    """
    column = exact.variables.index(variable)
    up, down = point.copy(), point.copy()
    up[column], down[column] = point[column] * (1 + 2.0**-12), point[column] * (1 - 2.0**-12)
    with mpmath.workdps(exact.digits):
        width = mpmath.log(mpmath.mpf(up[column]) / mpmath.mpf(down[column]))
        pairs = zip(exact.terms(up, theta), exact.terms(down, theta), strict=True)
        return [float(mpmath.log(a / b) / width) if a > 0 and b > 0 else np.inf for a, b in pairs]
