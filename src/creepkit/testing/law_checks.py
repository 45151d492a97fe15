"""Checks of a law: what its author states, what kernels make of it, and what it does.

Stated are name, texts, units, examples, signs and temperature. Kernels must be finite, monotonic and equal to 50
digits, with their switches. What the law does is tried along rays of stress, time and strain, at zero time, and on its
internal variables.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any

import mpmath
import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.errors import SAID, CreepkitError, restated
from creepkit.integration import integrate
from creepkit.kernels.interface import call_entry
from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.language.algebra import with_conditions_as_parameters
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, stress, temperature, time
from creepkit.records import ZERO_CELSIUS, History, Status, StressSteps
from creepkit.registry import default_registry
from creepkit.specimens.uniaxial import point_test
from creepkit.testing.law_dimensions import check_dimensions
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
from creepkit.testing.sample_points import (
    STRAIN_RANGE,
    STRESS_COLUMNS,
    STRESS_RANGE,
    TIME_RANGE,
    LawSamples,
    constraints_hold,
    log_rate,
    point_text,
)

NAME_OF_LAW = re.compile(r"[a-z0-9]+([-_][a-z0-9]+)*([+*(\[@].*)?")
"""Words in small letters joined by hyphens; what sums and temperature add may follow."""


FEWEST_SAMPLES = 8
"""At which the constraints must hold for a verdict to mean something."""


EXAMPLE_TOLERANCE = 1e-6


@finding("constraints", needed=True)
def check_constraints(_: CreepLaw, samples: LawSamples) -> str:
    """The constraints hold at enough points of the bounds."""
    assert len(samples) >= FEWEST_SAMPLES, (
        f"the constraints hold at {len(samples)} of the samples; widen them or narrow the bounds"
    )
    return f"{len(samples)} points"


@finding("name")
def check_name(law: CreepLaw, _: LawSamples) -> str:
    """The name has the stated pattern, and no other plugin has it."""
    assert NAME_OF_LAW.fullmatch(law.name), (
        f"'{law.name}' is not in small letters and digits joined by hyphens, such as my-law; rename it"
    )
    for plugin in default_registry().plugins():
        other = plugin.contributions.get("law", {}).get(law.name)
        taken = other is not None and other != law
        assert not taken, f"'{law.name}' is taken, by {plugin.provenance}; give the law another name"
    return law.name


@finding("title, references, units")
def check_texts(law: CreepLaw, _: LawSamples) -> str:
    """Title, references and units are there, and each reference says who and when."""
    assert law.title.strip(), "missing title, such as title='Norton power law'"
    example = "references=('Norton (1929), The Creep of Steel at High Temperatures',)"
    assert law.references, f"missing references, such as {example}"
    short = [reference for reference in law.references if len(reference.strip()) < 2]
    assert not short, f"{short[0]!r} is no reference; write a tuple of texts, {example}"
    missing = [name for name, param in law.table.items() if not param.unit]
    assert not missing, f"missing unit of {', '.join(missing)}"
    return "present"


@finding("dimensions")
def check_units(law: CreepLaw, _: LawSamples) -> str:
    """The units of parameters make rates in 1/s and arguments of functions without a unit."""
    check_dimensions(law)
    return "rates in 1/s"


@finding("LaTeX, source and copies")
def check_printing(law: CreepLaw, _: LawSamples) -> str:
    """LaTeX and source print, and the law survives pickling."""
    text, source, copy = law.latex(), lower(law, "numpy").source, pickle.loads(pickle.dumps(law))
    assert text.count("{") == text.count("}") and text.count(r"\left") == text.count(r"\right"), text
    assert "def rate" in source, source
    assert copy == law and copy.fingerprint == law.fingerprint, "a copy in another process is another law"
    return f"{len(text)} and {len(source)} characters"


@finding("rate grows with temperature")
def check_temperature(law: CreepLaw, samples: LawSamples) -> str | None:
    """The rate grows with temperature at most points, or the law declares that it falls."""
    if not law.uses(temperature):
        return None
    parts = [*law.terms.values(), *(state.rate for state in law.states.values()), *law.constraints]
    for one in set[sympy.Expr]().union(*(part.atoms(sympy.Add) for part in parts)):
        shift = sympy.expand(one / (one.coeff(temperature) or 1) - temperature)
        is_celsius = shift.is_number and abs(abs(shift) - ZERO_CELSIUS) < 1.0
        assert not (is_celsius and (shift > 0 or any(part.has(1 / one) for part in parts))), (
            f"temperature {shift:+.5g} stands in it, and temperature is in K already; leave it out"
        )
    warmer = samples.scaled([POINT_VARIABLES.index(temperature)], 1.01)
    before, after = (log_rate(lower(law, "numpy"), one) for one in (samples, warmer))
    counted = np.isfinite(before) & np.isfinite(after) & constraints_hold(law, warmer.points, warmer.theta)
    falling, rising = int((after < before)[counted].sum()), int((after > before)[counted].sum())
    assert falling <= rising or law.falls_with_temperature, (
        f"a higher temperature lowers it at {falling} of {int(counted.sum())} points; check the sign of the activation "
        "energy, exp(-Q/(R T)), or declare falls_with_temperature=True"
    )
    return f"at {rising} of {int(counted.sum())} points"


@finding("example {}", each=lambda law, _: range(1, len(law.examples) + 1))
def check_example(law: CreepLaw, _: LawSamples, number: int) -> str:
    """An example of the author has the rate that he states."""
    variables, given = (*POINT_VARIABLES, *law.states), dict(law.examples[number - 1])
    law = with_conditions_as_parameters(law)
    stated = float(given.pop("rate"))
    missing = [key for key in law.names if key not in given]
    missing += [s.name for s in variables if law.uses(s) and s.name not in given]
    remedy = "give every parameter and what the rates use of the point"
    assert not missing, f"it has no {missing[0]}; {remedy}"
    unknown = given.keys() - {s.name for s in variables} - {*law.names}
    assert not unknown, f"it has {min(unknown)}, which the law does not know; {remedy}"
    theta = law.to_internal(law.values({key: given[key] for key in law.names}))[0]
    point = np.array([float(given.get(s.name, 0.0)) for s in variables])
    found = float(sum(MultiprecisionLaw(law).terms(point, theta)))
    assert abs(found - stated) <= EXAMPLE_TOLERANCE * abs(stated), (
        f"{found:.7g} 1/s, and the example states {stated:.7g}; correct one of them"
    )
    return f"{found:.7g} 1/s"


@finding("no term is negative", needed=True)
def check_signs(law: CreepLaw, samples: LawSamples) -> str:
    """Each term is evaluated as the author wrote it."""
    exact = MultiprecisionLaw(law)
    for point, theta in zip(samples.points, samples.theta, strict=True):
        for label, value in zip(law.terms, exact.terms(point, theta), strict=True):
            assert mpmath.im(value) == 0 and value >= 0, (
                f"term '{label}' is {mpmath.nstr(value, 4)} 1/s at {point_text(law, point)}; say in constraints where "
                "the law holds, constraints=(stress > s0,), or use Max(stress - s0, 0)"
            )
    return f"{len(samples)} points"


_POINT = (100.0, 0.01, 1e5, 1000.0, 100.0, 33.0)
"""Stress, strain, time, temperature, principal and mean stress at which internal variables are followed."""


_GROWTH = [float(step) for step in np.geomspace(1e-3, 1e3, 61)]
"""How far internal variables are followed from where they begin."""


_STILL = 1e-9
"""Share of its first rate at which an internal variable stands still."""


@finding("internal variables without a limit")
def check_unlimited_states(law: CreepLaw, _: LawSamples) -> str | None:
    """As far as an internal variable without a limit grows, no term is infinite, complex or negative."""
    exact, values, count = MultiprecisionLaw(law), [*law.center().values()], len(law.terms)
    initial = [state.initial for state in law.states.values()]
    unlimited = [(k, symbol) for k, (symbol, state) in enumerate(law.states.items()) if state.limit is None]

    def rates(k: int, grown: float) -> tuple[list[Any], Any]:
        try:
            point = [*_POINT, *initial[:k], initial[k] + grown, *initial[k + 1 :]]
            *terms, rate = exact.term_and_state_rates(point, values)[: count + k + 1]
        except ArithmeticError:
            return [mpmath.inf], None
        return terms, rate if mpmath.im(rate) == 0 else 0.0

    for k, symbol in unlimited:
        sign = -1.0 if (rates(k, 0.0)[1] or 0.0) < 0 else 1.0
        first, last = rates(k, sign * _GROWTH[0])[1] or 0.0, 0.0
        for grown in (sign * step for step in _GROWTH):
            terms, rate = rates(k, grown)
            before, end = rates(k, last + 0.999 * (grown - last))[1] if rate is None else rate, initial[k] + grown
            if before is not None and not sign * before > sign * _STILL * first:
                break  # it does not come so far
            assert all(mpmath.im(one) == 0 and 0 <= one < mpmath.inf for one in terms), (
                f"'{symbol}' has no limit, and a term is infinite or changes its sign before it is {end:.3g}; "
                f"state where the material ends, ck.State(..., limit={initial[k] + (last or grown):.1g})"
            )
            last = grown
    return f"{len(unlimited)} followed" if unlimited else None


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
    sizes = np.minimum(np.minimum(np.abs(exact), np.abs(expected)), derivatives.rate[:, None])
    accurate = np.isfinite(expected) & (sizes > _SMALLEST_ACCURATE)
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


RAYS = 4
"""Samples whose rays are followed; each is some 10 000 evaluations of a kernel."""


MOST_CORNERS = 32


EARLY = 1e-40
"""s, where powers of time are read off."""


_RAYS = {stress: (STRESS_COLUMNS, STRESS_RANGE, "MPa"), time: ([2], TIME_RANGE, "s"), strain: ([1], STRAIN_RANGE, "")}
"""{variable: (columns of a point that grow together, range, unit)}."""


@finding("rate is continuous in {}", each=lambda law, _: filter(law.uses, _RAYS))
def check_continuity(law: CreepLaw, samples: LawSamples, symbol: sympy.Symbol) -> str:
    """The rate does not jump as stress, time or strain grow; an equilibrium that jumps has no solution."""
    columns, (low, high), unit = _RAYS[symbol]
    for k in range(min(RAYS, len(samples))):
        jump = find_rate_jump(partial(_along, law, samples.points[k], samples.theta[k], columns), low, high)
        if jump is not None:
            ratio = float(np.exp(np.clip(jump.after - jump.before, -700, 700)))
            place = f"{symbol} {jump.place:.6g} {unit}".rstrip()
            raise AssertionError(
                f"it jumps by a factor of {ratio:.3g} at {place}; let the branches meet there, or blend them, for "
                "example by tanh"
            )
    return f"{RAYS} rays"


def _along(law: CreepLaw, point: Floats, theta: Floats, columns: list[int], places: Floats) -> Floats:
    """ln rate, (places,), where the first of the columns of a point is at these places; NaN outside the constraints."""
    points, thetas = np.repeat(point[None], places.size, axis=0), np.repeat(theta[None], places.size, axis=0)
    points[:, columns] = places[:, None] * (point[columns] / point[columns[0]])
    rates = np.broadcast_to(lower(law, "numpy").internal_log_rate(*points.T, *thetas.T), places.shape)
    return np.where(constraints_hold(law, points, thetas), rates, np.nan)


@finding("exponents of time")
def check_time_exponents(law: CreepLaw, samples: LawSamples) -> str | None:
    """No term grows as fast as 1/time at zero time, at any corner of the bounds: its strain would be infinite."""
    if not law.uses(time):
        return None
    exact, point = MultiprecisionLaw(law), samples.points[0].copy()
    point[POINT_VARIABLES.index(time)], point[POINT_VARIABLES.index(strain)] = EARLY, 1e-3
    for theta in corners(law, point):
        for label, exponent in zip(law.terms, log_log_derivatives(exact, point, theta, time), strict=True):
            assert not (np.isfinite(exponent) and exponent <= -1.0 + 1e-9), (
                f"term '{label}' goes as time^{exponent:.3g} at zero time with {_values_text(law, theta)}, so that "
                "creep strain is infinite at once; narrow the bounds so that the power stays above -1"
            )
    return "above -1 at the corners of the bounds"


@finding(
    "state {} moves towards its limit", each=lambda law, _: [s for s, z in law.states.items() if z.limit is not None]
)
def check_state(law: CreepLaw, samples: LawSamples, symbol: sympy.Symbol) -> str:
    """An internal variable leaves its start towards its limit."""
    state, position = law.states[symbol], list(law.states).index(symbol)
    limit = float(state.limit or 0.0)
    points = samples.points.copy()
    points[:, len(POINT_VARIABLES) + position] = state.initial
    rates = np.asarray(lower(law, "numpy").internal_rates(*points.T, *samples.theta.T)[1 + position], float)
    wrong = np.flatnonzero(np.broadcast_to(rates * (limit - state.initial) < 0, (len(samples),)))
    assert not wrong.size, (
        f"it leaves its start, {state.initial:g}, away from its limit, {limit:g}, at "
        f"{point_text(law, points[wrong[0]])}; correct the sign of its rate, or exchange initial and limit"
    )
    return f"{len(samples)} points"


@finding("states in a short integration")
def check_short_integration(law: CreepLaw, samples: LawSamples) -> str | None:
    """States stay finite, to a creep strain of about 1 % under 100 MPa at corners of the bounds."""
    if not law.states:
        return None
    kernel, point, finished = lower(law, "compiled"), samples.points[0].copy(), 0
    point[:6] = 100.0, 1e-6, 1.0, 1000.0, 100.0, 100.0 / 3
    point[6:] = [state.initial for state in law.states.values()]
    chosen, held = corners(law, point), StressSteps(((0.0, 100.0),), control="stress")
    for theta in chosen:
        ln_rate = float(np.asarray(lower(law, "numpy").internal_log_rate(*point, *theta)))
        times = np.linspace(0.0, np.clip(1e-2 * np.exp(-np.clip(ln_rate, -60.0, 60.0)), 1e-3, 1e9), 12)
        values, plan = _values_text(law, theta), History("states", times, {}, held, 1000.0)
        with restated(CreepkitError, AssertionError, f"{SAID}; {values}"):
            run = integrate(kernel, theta, [point_test(plan)], keep_states=True)
        paths = np.asarray(run.states)[0, np.isfinite(run.strain[0])].T
        for (symbol, state), path in zip(law.states.items(), paths, strict=True):
            low, high = sorted((state.initial, np.inf if state.limit is None else state.limit))
            margin = 1e-6 * max(1.0, abs(state.initial))
            inside = state.limit is None or ((path >= low - margin) & (path <= high + margin)).all()
            assert np.isfinite(path).all() and inside, (
                f"'{symbol}' reaches {path[np.argmax(np.abs(path - state.initial))]:.4g}, outside {low:g} to {high:g}, "
                f"with {values}; correct its rate, or narrow the bounds"
            )
        finished += run.status[0, 0] in (Status.COMPLETE, Status.RUPTURED)
    return f"within start and limit at {len(chosen)} corners of the bounds, {finished} of them to the end"


def corners(law: CreepLaw, point: Floats) -> list[Floats]:
    """Corners of the bounds at which the constraints hold, (parameters,) internal values each; 32 at most.

    point : (6 + states,) MPa, s and K, at which the constraints are asked.
    """
    (low, high), count = law.internal_bounds, len(law.params)
    if 2**count <= MOST_CORNERS:
        which = (np.arange(2**count)[:, None] >> np.arange(count)) & 1
    else:
        which = np.random.default_rng(0).integers(0, 2, (MOST_CORNERS, count))
        which[0], which[1] = 0, 1
    thetas = np.where(which == 1, high, low)
    return list(thetas[constraints_hold(law, np.repeat(point[None], len(thetas), axis=0), thetas)])


def _values_text(law: CreepLaw, theta: Floats) -> str:
    pairs = zip(law.params.items(), theta, strict=True)
    return ", ".join(f"{symbol} = {param.from_internal(float(value)):.3g}" for (symbol, param), value in pairs)
