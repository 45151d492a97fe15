"""Checks of what a law does along rays of stress, time and strain, at zero time, and to its internal variables."""

from __future__ import annotations

from functools import partial

import numpy as np
import sympy

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.language.elastic import Elastic
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, stress, time
from creepkit.records import History, PointLoading, Status
from creepkit.specimens.material_point import MaterialPoint
from creepkit.testing.law_checks import log_log_derivatives
from creepkit.testing.reports import finding
from creepkit.testing.sample_points import (
    STRAIN_RANGE,
    STRESS_COLUMNS,
    STRESS_RANGE,
    TIME_RANGE,
    LawSamples,
    constraints_hold,
    point_text,
)

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
    chosen = corners(law, point)
    for theta in chosen:
        ln_rate = float(np.asarray(lower(law, "numpy").internal_log_rate(*point, *theta)))
        times = np.linspace(0.0, np.clip(1e-2 * np.exp(-np.clip(ln_rate, -60.0, 60.0)), 1e-3, 1e9), 12)[1:]
        loading, values = PointLoading(stress={"11": 100.0}), _values_text(law, theta)
        plan = History("states", times, {}, loading, 1000.0, specimen="point", elastic=Elastic(150e3))
        try:
            run = MaterialPoint().simulate(kernel, theta, plan)
        except CreepkitError as error:
            raise AssertionError(f"{error}; {values}") from None
        for (symbol, state), path in zip(law.states.items(), run.states.T, strict=True):
            low, high = sorted((state.initial, np.inf if state.limit is None else state.limit))
            margin = 1e-6 * max(1.0, abs(state.initial))
            inside = state.limit is None or ((path >= low - margin) & (path <= high + margin)).all()
            assert np.isfinite(path).all() and inside, (
                f"'{symbol}' reaches {path[np.argmax(np.abs(path - state.initial))]:.4g}, outside {low:g} to {high:g}, "
                f"with {values}; correct its rate, or narrow the bounds"
            )
        finished += run.status in (Status.COMPLETE, Status.RUPTURED)
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
