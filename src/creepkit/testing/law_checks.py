"""The conformance checks of a law, one function each: it yields one ConformanceCheck a property."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import mpmath
import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.kernels.interface import call_entry
from creepkit.kernels.lowering import ArrayKernel, lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, time
from creepkit.testing.parity import (
    DERIVATIVE_TOLERANCE,
    KERNEL_EVALUATORS,
    NEGLIGIBLE_RATE,
    VALUE_TOLERANCE,
    MultiprecisionReference,
    largest_differences,
)
from creepkit.testing.reports import ConformanceCheck
from creepkit.testing.sample_points import LawSamples, constraints_hold

_STRESS_COLUMNS = [0, 4, 5]


_SMALLEST_ACCURATE = 1e-290
"""Numbers below this may have lost digits."""


_LARGEST_LOG_RATE = 1e29
"""ln rates as far from 0 as this mean that no term is left, or that the rate is infinite."""


# ---- what the author wrote -----------------------------------------------------------------------------------------


def check_declarations(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """Declared equals used; title, references and units are there."""
    rates = (*law.terms.values(), *(state.rate for state in law.states.values()))
    used = set().union(*(rate.free_symbols for rate in rates))
    undeclared = sorted(s.name for s in (used - {*POINT_VARIABLES}) ^ {*law.params, *law.states})
    description = (
        f"{', '.join(undeclared)} is in the tables or in the rates, not in both"
        if undeclared
        else f"{len(law.params)} parameters"
    )
    yield ConformanceCheck("declared equals used", not undeclared, description)
    stated = {
        "title, such as title='Norton power law'": law.title.strip(),
        "references, such as references=('Norton (1929), The Creep of Steel at High Temperatures',)": law.references,
    }
    missing = [what for what, there in stated.items() if not there]
    missing += [f"unit of {name}" for name, param in law.table.items() if not param.unit]
    yield ConformanceCheck(
        "title, references, units", not missing, f"missing {', '.join(missing)}" if missing else "present"
    )


def check_printing(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """LaTeX and source print, and the law survives pickling."""
    text, source = law.latex(), lower(law, "numpy").source
    balanced = text.count("{") == text.count("}") and text.count(r"\left") == text.count(r"\right")
    description = f"{len(text)} and {len(source)} characters"
    yield ConformanceCheck("LaTeX and source print", balanced and "def rate" in source, description)
    again = pickle.loads(pickle.dumps(law))
    yield ConformanceCheck(
        "pickle and equality", again == law and again.fingerprint == law.fingerprint, law.fingerprint
    )


def check_signs(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """No term is negative: each is checked with the author's own expression."""
    exact = MultiprecisionLaw(law)
    for point, theta in zip(samples.points, samples.theta, strict=True):
        for label, value in zip(law.terms, exact.terms(point, theta), strict=True):
            if not (mpmath.im(value) == 0 and value >= 0):
                remedy = (
                    "say in constraints where the law holds, constraints=(stress > s0,), or use Max(stress - s0, 0)"
                )
                description = f"term '{label}' is {mpmath.nstr(value, 4)} 1/s at {point_text(law, point)}"
                yield ConformanceCheck("no term is negative", False, f"{description}; {remedy}")
                return
    yield ConformanceCheck("no term is negative", True, f"{len(samples)} points")


# ---- what kernels make of it ---------------------------------------------------------------------------------------


def check_finite(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """The log rate and its derivatives are finite, at zero strain, time and stress too."""
    kernel, compiled = lower(law, "numpy"), lower(law, "compiled")
    yield check_at_samples("ln rate is finite", law, samples, np.abs(log_rate(kernel, samples)) < _LARGEST_LOG_RATE)
    zeros = ({"strain": 0.0}, {"time": 0.0}, {"stress": 0.0, "principal_stress": 0.0, "mean_stress": 0.0})
    for columns in (*zeros, zeros[0] | zeros[1] | zeros[2]):
        at_zero = samples.at(**columns)
        flags = [
            call_entry(compiled, "update", p[None], t)[1] for p, t in zip(at_zero.points, at_zero.theta, strict=True)
        ]
        is_finite = np.isfinite(log_rate(kernel, at_zero)) & (np.array(flags) == 0)
        zero_names = " and ".join(name for name in columns if "_" not in name)
        yield check_at_samples(f"ln rate and its derivatives are finite at zero {zero_names}", law, at_zero, is_finite)


def check_monotonic(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """A higher stress of the same direction never lowers the rate."""
    kernel, points = lower(law, "numpy"), samples.points.copy()
    points[:, _STRESS_COLUMNS] *= 1.01
    samples_at_higher_stress = LawSamples(points, samples.theta)
    before, after = log_rate(kernel, samples), log_rate(kernel, samples_at_higher_stress)
    is_monotonic = after >= before - 1e-9 * np.maximum(1.0, np.abs(before))
    yield check_at_samples(
        "rate never falls with stress", law, samples, is_monotonic | ~constraints_hold(law, points, samples.theta)
    )


def check_parity(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """Every target agrees with 50-digit arithmetic."""
    reference = MultiprecisionReference(MultiprecisionLaw(law), samples)
    for target, evaluate in KERNEL_EVALUATORS.items():
        values, derivatives = largest_differences(reference, evaluate(law, samples), allow_cancellation=True)
        for what, result, limit in (
            ("value", values, VALUE_TOLERANCE),
            ("derivatives", derivatives, DERIVATIVE_TOLERANCE),
        ):
            where = "" if result.size <= limit else f", {reference.location_text(result)}"
            yield ConformanceCheck(
                f"{target} {what} against 50 digits", result.size <= limit, f"{result.size:.1e}{where}"
            )


def check_torch_gradients(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """Torch gradients of the log rate equal the derivatives by symbols, and are finite at zero strain and time."""
    differences = [_gradient_difference(law, samples), _gradient_difference(law, samples.at(strain=0.0, time=0.0))]
    for where, difference in zip(("", " at zero strain and time"), differences, strict=True):
        name = f"torch gradients{where}"
        yield ConformanceCheck(
            name, difference <= DERIVATIVE_TOLERANCE, f"{difference:.1e}" if np.isfinite(difference) else "NaN or inf"
        )


def check_switches(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """A parameter that is off does what fixing it at its off value does; with every term off the rate is 0."""
    off_values = {name: param.off for name, param in law.table.items() if param.off is not None}
    differences = {name: _switch_difference(law, samples, name, value) for name, value in off_values.items()}
    description = ", ".join(f"{name} {difference:.1e}" for name, difference in differences.items())
    yield ConformanceCheck(
        "off equals fix", all(gap <= 1e-11 for gap in differences.values()), description or "no switches"
    )
    columns = [k for k, p in enumerate(law.params.values()) if p.scale == "log" and p.off == 0]
    coefficients = {k for own_values in _coefficient_positions(law) for k in own_values[:1]}
    if coefficients <= {*columns} and all(_coefficient_positions(law)):
        theta = samples.theta.copy()
        theta[:, sorted(coefficients)] = -np.inf
        yield ConformanceCheck("every term off", *_check_all_terms_off(law, LawSamples(samples.points, theta)))


def check_leading_exponent(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """The exponent of time at the start, against slopes of the author's terms at 1e-12 s; logarithms die out slowly."""
    exact, compiled = MultiprecisionLaw(law), lower(law, "compiled")
    differences = []
    for start in ((1e-40, 1e-12), (1e-80, 1e-24)):
        subset = LawSamples(samples.points[:16].copy(), samples.theta[:16])
        subset.points[:, 1:3] = start
        exact_exponents = [_leading_exponent(exact, p, t) for p, t in zip(subset.points, subset.theta, strict=True)]
        differences.append(np.abs(compiled.leading_exponent(subset.theta, subset.points) - exact_exponents))
    early, earlier = differences
    is_converging = (earlier <= 1e-6) | (earlier <= 0.6 * early)
    yield ConformanceCheck("leading exponent of time", bool(is_converging.all()), f"{earlier.max(initial=0.0):.1e}")


# ---- mechanisms ----------------------------------------------------------------------------------------------------


def check_at_samples(name: str, law: CreepLaw, samples: LawSamples, holds: Bools) -> ConformanceCheck:
    """Whether something holds at all samples; if not, the first point where it does not; holds : (samples,)."""
    if holds.all():
        return ConformanceCheck(name, True, f"{holds.size} points")
    first = int(np.flatnonzero(~holds)[0])
    description = (
        f"not at {int((~holds).sum())} of {holds.size} points, such as {point_text(law, samples.points[first])}"
    )
    return ConformanceCheck(name, False, description)


def point_text(law: CreepLaw, point: Floats) -> str:
    """What a law uses of a point, in words; point : (6 + states,) MPa, s and K."""
    pairs = zip((*POINT_VARIABLES, *law.states), point, strict=True)
    return ", ".join(f"{s.name} {value:.4g}" for s, value in pairs if law.uses(s))


def log_rate(kernel: ArrayKernel, samples: LawSamples) -> Floats:
    """The ln rate at samples, (samples,)."""
    return np.asarray(kernel.internal_log_rate(*samples.arguments()), float)


def _gradient_difference(law: CreepLaw, samples: LawSamples) -> float:
    """Largest relative difference of torch's gradient of ln rate from d(rate)/rate; inf where one is not finite."""
    import torch

    inputs = [torch.tensor(column, requires_grad=True) for column in samples.arguments()]
    total = lower(law, "torch").internal_log_rate(*inputs).sum()
    gradients_of_log_rate = torch.autograd.grad(total, inputs, allow_unused=True)
    result = np.stack([np.zeros(len(samples)) if g is None else g.numpy() for g in gradients_of_log_rate], axis=1)
    derivatives = lower(law, "numpy").internal_derivatives(*samples.arguments())
    rate_derivatives = np.stack([*derivatives.point.values(), *derivatives.params.values()], axis=1)
    expected = rate_derivatives / derivatives.rate[:, None]
    difference = np.abs(result - expected) / np.abs(expected)
    is_comparable = np.isfinite(expected) & (
        np.minimum(np.abs(rate_derivatives), np.abs(expected)) > _SMALLEST_ACCURATE
    )
    return float(np.max(difference, where=is_comparable, initial=0.0)) if np.isfinite(result).all() else np.inf


def _switch_difference(law: CreepLaw, samples: LawSamples, name: str, value: float) -> float:
    point_names = [s.name for s in (*POINT_VARIABLES, *law.states)]
    point = dict(zip(point_names, samples.points.T, strict=True))
    pairs = zip(law.table.items(), samples.theta.T, strict=True)
    values = {n: np.exp(t) if p.scale == "log" else t for (n, p), t in pairs}
    off = lower(law, "numpy").rate({**values, name: value}, **point)
    if all(term.subs(law.symbol(name), value) == 0 for term in law.terms.values()):
        return 0.0 if (off < NEGLIGIBLE_RATE).all() else np.inf
    fixed = law.fix(**{name: value})
    kept = {n: point[n] for n in (*(s.name for s in POINT_VARIABLES), *(s.name for s in fixed.states))}
    expected = lower(fixed, "numpy").rate({n: values[n] for n in fixed.names}, **kept)
    is_finite = np.isfinite(expected)
    difference = np.abs(off[is_finite] - expected[is_finite]) / np.maximum(np.abs(expected[is_finite]), NEGLIGIBLE_RATE)
    return float(difference.max(initial=0.0)) if np.isfinite(off[is_finite]).all() else np.inf


def _coefficient_positions(law: CreepLaw) -> tuple[tuple[int, ...], ...]:
    from creepkit.kernels.log_form import log_form

    return log_form(law).coefficients


def _check_all_terms_off(law: CreepLaw, samples: LawSamples) -> tuple[bool, str]:
    """Rate 0 and a finite update, in every target."""
    for target, evaluate in KERNEL_EVALUATORS.items():
        result = evaluate(law, samples)
        finite = np.isfinite(result.rows).all() and np.isfinite(result.log_rates).all()
        if not (finite and (result.rows[:, 0, 0] < NEGLIGIBLE_RATE).all()):
            return False, f"the {target} kernel leaves a rate, or a number that is not finite"
    compiled = lower(law, "compiled")
    flags = [call_entry(compiled, "update", p[None], t)[1] for p, t in zip(samples.points, samples.theta, strict=True)]
    return not any(flags), "rate 0, update finite" if not any(flags) else "the update entry is not finite"


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
