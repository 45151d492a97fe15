"""The promises that every law makes, one function each: it yields what it found at the samples."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import mpmath
import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.kernels.calling import call
from creepkit.kernels.exact import Exact
from creepkit.kernels.lowering import Kernel, lower
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT, strain, time
from creepkit.testing.parity import DERIVATIVE_TOLERANCE, NO_RATE, VALUE_TOLERANCE, Truth, worst
from creepkit.testing.report import Check
from creepkit.testing.sampling import Samples, constraints_hold
from creepkit.testing.tables import TABLES

_STRESSES = [0, 4, 5]
_DENORMAL = 1e-290
"""Numbers below this may have lost digits."""

_NOTHING = 1e29
"""ln rates as far from 0 as this mean that no term is left, or that the rate is infinite."""


# ---- what the author wrote -----------------------------------------------------------------------------------------


def table(law: CreepLaw, _: Samples) -> Iterator[Check]:
    """Declared equals used; title, references and units are there."""
    rates = (*law.terms.values(), *(state.rate for state in law.states.values()))
    used = set().union(*(rate.free_symbols for rate in rates))
    stray = sorted(s.name for s in (used - {*POINT}) ^ {*law.params, *law.states})
    told = (
        f"{', '.join(stray)} is in the tables or in the rates, not in both"
        if stray
        else f"{len(law.params)} parameters"
    )
    yield Check("declared equals used", not stray, told)
    missing = [what for what, there in (("title", law.title.strip()), ("references", law.references)) if not there]
    missing += [f"unit of {name}" for name, param in law.table.items() if not param.unit]
    yield Check("title, references, units", not missing, f"missing {', '.join(missing)}" if missing else "present")


def printing(law: CreepLaw, _: Samples) -> Iterator[Check]:
    """LaTeX and source print, and the law survives pickling."""
    text, source = law.latex(), lower(law, "numpy").source
    balanced = text.count("{") == text.count("}") and text.count(r"\left") == text.count(r"\right")
    told = f"{len(text)} and {len(source)} characters"
    yield Check("LaTeX and source print", balanced and "def rate" in source, told)
    again = pickle.loads(pickle.dumps(law))
    yield Check("pickle and equality", again == law and again.fingerprint == law.fingerprint, law.fingerprint)


def signs(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """No term is negative: each is judged by the author's own expression."""
    exact = Exact(law)
    for point, theta in zip(drawn.points, drawn.theta, strict=True):
        for label, value in zip(law.terms, exact.terms(point, theta), strict=True):
            if not (mpmath.im(value) == 0 and value >= 0):
                found = f"term '{label}' is {mpmath.nstr(value, 4)} 1/s at {_place(law, point)}"
                yield Check("no term is negative", False, f"{found}; say in constraints where the law holds")
                return
    yield Check("no term is negative", True, f"{len(drawn)} points")


# ---- what kernels make of it ---------------------------------------------------------------------------------------


def finite(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """The log rate and its derivatives are finite, at zero strain, time and stress too."""
    kernel, compiled = lower(law, "numpy"), lower(law, "numba")
    yield _verdict("ln rate is finite", law, drawn, np.abs(_log_rate(kernel, drawn)) < _NOTHING)
    zeros = ({"strain": 0.0}, {"time": 0.0}, {"stress": 0.0, "principal_stress": 0.0, "mean_stress": 0.0})
    for columns in (*zeros, zeros[0] | zeros[1] | zeros[2]):
        at_zero = drawn.at(**columns)
        flags = [call(compiled, "update", p[None], t)[1] for p, t in zip(at_zero.points, at_zero.theta, strict=True)]
        good = np.isfinite(_log_rate(kernel, at_zero)) & (np.array(flags) == 0)
        words = " and ".join(name for name in columns if "_" not in name)
        yield _verdict(f"ln rate and its derivatives are finite at zero {words}", law, at_zero, good)


def monotone(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """A higher stress of the same direction never lowers the rate."""
    kernel, points = lower(law, "numpy"), drawn.points.copy()
    points[:, _STRESSES] *= 1.01
    raised = Samples(points, drawn.theta)
    before, after = _log_rate(kernel, drawn), _log_rate(kernel, raised)
    rises = after >= before - 1e-9 * np.maximum(1.0, np.abs(before))
    yield _verdict("rate never falls with stress", law, drawn, rises | ~constraints_hold(law, points, drawn.theta))


def parity(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """Every target agrees with 50-digit arithmetic."""
    truth = Truth(Exact(law), drawn)
    for target, evaluate in TABLES.items():
        values, derivatives = worst(truth, evaluate(law, drawn), forgive=True)
        for what, found, limit in (
            ("value", values, VALUE_TOLERANCE),
            ("derivatives", derivatives, DERIVATIVE_TOLERANCE),
        ):
            where = "" if found.size <= limit else f", {truth.at(found)}"
            yield Check(f"{target} {what} against 50 digits", found.size <= limit, f"{found.size:.1e}{where}")


def gradients(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """Torch gradients of the log rate equal the derivatives by symbols, and are finite at zero strain and time."""
    gaps = [_gradient_gap(law, drawn), _gradient_gap(law, drawn.at(strain=0.0, time=0.0))]
    for where, gap in zip(("", " at zero strain and time"), gaps, strict=True):
        name = f"torch gradients{where}"
        yield Check(name, gap <= DERIVATIVE_TOLERANCE, f"{gap:.1e}" if np.isfinite(gap) else "NaN or inf")


def switches(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """A parameter that is off does what fixing it at its off value does; with every term off the rate is 0."""
    off = {name: param.off for name, param in law.table.items() if param.off is not None}
    gaps = {name: _switch_gap(law, drawn, name, value) for name, value in off.items()}
    told = ", ".join(f"{name} {gap:.1e}" for name, gap in gaps.items())
    yield Check("off equals fix", all(gap <= 1e-11 for gap in gaps.values()), told or "no switches")
    columns = [k for k, p in enumerate(law.params.values()) if p.scale == "log" and p.off == 0]
    coefficients = {k for own in _coefficients(law) for k in own[:1]}
    if coefficients <= {*columns} and all(_coefficients(law)):
        theta = drawn.theta.copy()
        theta[:, sorted(coefficients)] = -np.inf
        yield Check("every term off", *_all_off(law, Samples(drawn.points, theta)))


def leading(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """The exponent of time at the start, against slopes of the author's terms at 1e-12 s; logarithms die out slowly."""
    exact, compiled = Exact(law), lower(law, "numba")
    gaps = []
    for start in ((1e-40, 1e-12), (1e-80, 1e-24)):
        few = Samples(drawn.points[:16].copy(), drawn.theta[:16])
        few.points[:, 1:3] = start
        truth = [_leading_exponent(exact, p, t) for p, t in zip(few.points, few.theta, strict=True)]
        gaps.append(np.abs(compiled.leading(few.theta, few.points) - truth))
    early, earlier = gaps
    good = (earlier <= 1e-6) | (earlier <= 0.6 * early)
    yield Check("leading exponent of time", bool(good.all()), f"{earlier.max(initial=0.0):.1e}")


# ---- mechanisms ----------------------------------------------------------------------------------------------------


def _verdict(name: str, law: CreepLaw, drawn: Samples, good: Bools) -> Check:
    if good.all():
        return Check(name, True, f"{good.size} points")
    first = int(np.flatnonzero(~good)[0])
    told = f"not at {int((~good).sum())} of {good.size} points, such as {_place(law, drawn.points[first])}"
    return Check(name, False, told)


def _place(law: CreepLaw, point: Floats) -> str:
    pairs = zip((*POINT, *law.states), point, strict=True)
    return ", ".join(f"{s.name} {value:.4g}" for s, value in pairs if law.uses(s))


def _log_rate(kernel: Kernel, drawn: Samples) -> Floats:
    return np.asarray(kernel.internal_log_rate(*drawn.arguments()), float)


def _gradient_gap(law: CreepLaw, drawn: Samples) -> float:
    """Largest relative difference of torch's gradient of ln rate from d(rate)/rate; inf where one is not finite."""
    import torch

    inputs = [torch.tensor(column, requires_grad=True) for column in drawn.arguments()]
    total = lower(law, "torch").internal_log_rate(*inputs).sum()
    grown = torch.autograd.grad(total, inputs, allow_unused=True)
    found = np.stack([np.zeros(len(drawn)) if g is None else g.numpy() for g in grown], axis=1)
    slopes = lower(law, "numpy").internal_derivatives(*drawn.arguments())
    changes = np.stack([*slopes.point.values(), *slopes.params.values()], axis=1)
    expected = changes / slopes.rate[:, None]
    gap = np.abs(found - expected) / np.abs(expected)
    held = np.isfinite(expected) & (np.minimum(np.abs(changes), np.abs(expected)) > _DENORMAL)
    return float(np.max(gap, where=held, initial=0.0)) if np.isfinite(found).all() else np.inf


def _switch_gap(law: CreepLaw, drawn: Samples, name: str, value: float) -> float:
    inner = [s.name for s in (*POINT, *law.states)]
    point = dict(zip(inner, drawn.points.T, strict=True))
    pairs = zip(law.table.items(), drawn.theta.T, strict=True)
    values = {n: np.exp(t) if p.scale == "log" else t for (n, p), t in pairs}
    off = lower(law, "numpy").rate({**values, name: value}, **point)
    if all(term.subs(law.symbol(name), value) == 0 for term in law.terms.values()):
        return 0.0 if (off < NO_RATE).all() else np.inf
    fixed = law.fix(**{name: value})
    kept = {n: point[n] for n in (*(s.name for s in POINT), *(s.name for s in fixed.states))}
    expected = lower(fixed, "numpy").rate({n: values[n] for n in fixed.names}, **kept)
    held = np.isfinite(expected)
    gap = np.abs(off[held] - expected[held]) / np.maximum(np.abs(expected[held]), NO_RATE)
    return float(gap.max(initial=0.0)) if np.isfinite(off[held]).all() else np.inf


def _coefficients(law: CreepLaw) -> tuple[tuple[int, ...], ...]:
    from creepkit.kernels.logform import log_form

    return log_form(law).coefficients


def _all_off(law: CreepLaw, drawn: Samples) -> tuple[bool, str]:
    """Rate 0 and a finite update, in every target."""
    for target, evaluate in TABLES.items():
        found = evaluate(law, drawn)
        finite = np.isfinite(found.rows).all() and np.isfinite(found.logs).all()
        if not (finite and (found.rows[:, 0, 0] < NO_RATE).all()):
            return False, f"the {target} kernel leaves a rate, or a number that is not finite"
    compiled = lower(law, "numba")
    flags = [call(compiled, "update", p[None], t)[1] for p, t in zip(drawn.points, drawn.theta, strict=True)]
    return not any(flags), "rate 0, update finite" if not any(flags) else "the update entry is not finite"


def _leading_exponent(exact: Exact, point: Floats, theta: Floats) -> float:
    """Smallest (1 + a)/(1 - b) of the terms; one that starts slower than any power, or with strain, does not lead."""
    time_slopes, strain_slopes = (_log_slopes(exact, point, theta, v) for v in (time, strain))
    pairs = zip(time_slopes, strain_slopes, strict=True)
    return min(((1 + a) / (1 - b) for a, b in pairs if a < 1e3 and b < 1 - 1e-6), default=1.0)


def _log_slopes(exact: Exact, point: Floats, theta: Floats, variable: sympy.Symbol) -> list[float]:
    """d(ln term)/d(ln variable) of each term; inf where a term is zero."""
    column = exact.variables.index(variable)
    up, down = point.copy(), point.copy()
    up[column], down[column] = point[column] * (1 + 2.0**-12), point[column] * (1 - 2.0**-12)
    with mpmath.workdps(exact.digits):
        width = mpmath.log(mpmath.mpf(up[column]) / mpmath.mpf(down[column]))
        pairs = zip(exact.terms(up, theta), exact.terms(down, theta), strict=True)
        return [float(mpmath.log(a / b) / width) if a > 0 and b > 0 else np.inf for a, b in pairs]
