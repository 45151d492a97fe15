"""Checks of what a law does along rays of stress, time and strain, at zero time, and to its internal variables."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.language.elastic import Elastic
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, stress, time
from creepkit.records import History, PointLoading, Status
from creepkit.testing.law_checks import log_log_derivatives, point_text
from creepkit.testing.reports import ConformanceCheck
from creepkit.testing.sample_points import STRAIN_RANGE, STRESS_RANGE, TIME_RANGE, LawSamples, constraints_hold

RAYS = 4
"""Samples whose rays are followed; each is some 10 000 evaluations of a kernel."""


MOST_CORNERS = 32


EARLY = 1e-40
"""s, where powers of time are read off."""


_STRESSES = [0, 4, 5]
"""Columns of the stresses of a point, which grow together."""


def check_continuity(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """The rate does not jump as stress, time or strain grow; an equilibrium that jumps has no solution."""
    kernel = lower(law, "numpy")
    rays = ((stress, _STRESSES, STRESS_RANGE, "MPa"), (time, [2], TIME_RANGE, "s"), (strain, [1], STRAIN_RANGE, ""))
    for symbol, columns, (low, high), unit in rays:
        if not law.uses(symbol):
            continue
        detail = ""
        for k in range(min(RAYS, len(samples))):

            def along(places: Floats, k: int = k, columns: list[int] = columns) -> Floats:
                points = np.repeat(samples.points[k : k + 1], places.size, axis=0)
                shape = points[:, columns] / points[:, columns[:1]]
                points[:, columns] = places[:, None] * shape
                theta = np.repeat(samples.theta[k : k + 1], places.size, axis=0)
                rates = np.broadcast_to(kernel.internal_log_rate(*points.T, *theta.T), places.shape)
                return np.where(constraints_hold(law, points, theta), rates, np.nan)

            jump = find_rate_jump(along, low, high)
            if jump is not None:
                ratio = float(np.exp(np.clip(jump.after - jump.before, -700, 700)))
                detail = (
                    f"it jumps by a factor of {ratio:.3g} at {symbol} {jump.place:.6g} {unit}".rstrip()
                    + "; let the branches meet there, or blend them, for example by tanh"
                )
                break
        yield ConformanceCheck(f"rate is continuous in {symbol}", not detail, detail or f"{RAYS} rays")


def check_time_exponents(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """No term grows as fast as 1/time at zero time, at any corner of the bounds: its strain would be infinite."""
    if not law.uses(time):
        return
    exact = MultiprecisionLaw(law)
    point = samples.points[0].copy()
    point[POINT_VARIABLES.index(time)] = EARLY
    point[POINT_VARIABLES.index(strain)] = 1e-3
    for theta in corners(law, point):
        exponents = log_log_derivatives(exact, point, theta, time)
        for label, exponent in zip(law.terms, exponents, strict=True):
            if np.isfinite(exponent) and exponent <= -1.0 + 1e-9:
                detail = (
                    f"term '{label}' goes as time^{exponent:.3g} at zero time with {_values_text(law, theta)}, so that "
                    "creep strain is infinite at once; narrow the bounds so that the power stays above -1"
                )
                yield ConformanceCheck("exponents of time", False, detail)
                return
    yield ConformanceCheck("exponents of time", True, "above -1 at the corners of the bounds")


def check_states(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """Internal variables move from their start towards their limit, and stay finite, at corners of the bounds."""
    for position, (symbol, state) in enumerate(law.states.items()):
        if state.limit is None:
            continue
        points = samples.points.copy()
        points[:, len(POINT_VARIABLES) + position] = state.initial
        rates = np.asarray(lower(law, "numpy").internal_rates(*points.T, *samples.theta.T)[1 + position], float)
        wrong = np.broadcast_to(rates * (state.limit - state.initial) < 0, (len(samples),))
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            detail = (
                f"it leaves its start, {state.initial:g}, away from its limit, {state.limit:g}, at "
                f"{point_text(law, points[first])}; correct the sign of its rate, or exchange initial and limit"
            )
            yield ConformanceCheck(f"state '{symbol}' moves towards its limit", False, detail)
        else:
            yield ConformanceCheck(f"state '{symbol}' moves towards its limit", True, f"{len(samples)} points")
    if law.states:
        yield _short_integration(law, samples)


def _short_integration(law: CreepLaw, samples: LawSamples) -> ConformanceCheck:
    """Integrate to a creep strain of about 1 % under 100 MPa at corners of the bounds."""
    from creepkit.specimens.material_point import MaterialPoint

    kernel, point = lower(law, "compiled"), samples.points[0].copy()
    point[:6] = 100.0, 1e-6, 1.0, 1000.0, 100.0, 100.0 / 3
    point[6:] = [state.initial for state in law.states.values()]
    finished = 0
    chosen = corners(law, point)
    for theta in chosen:
        ln_rate = float(np.asarray(lower(law, "numpy").internal_log_rate(*point, *theta)))
        end = float(np.clip(1e-2 * np.exp(-np.clip(ln_rate, -60.0, 60.0)), 1e-3, 1e9))
        plan = History(
            "states", np.linspace(0.0, end, 12)[1:], {}, PointLoading(stress={"11": 100.0}), 1000.0,
            specimen="point", elastic=Elastic(150e3),
        )  # fmt: skip
        try:
            run = MaterialPoint().simulate(kernel, theta, plan)
        except CreepkitError as error:
            return ConformanceCheck("states in a short integration", False, f"{error}; {_values_text(law, theta)}")
        for k, (symbol, state) in enumerate(law.states.items()):
            low, high = sorted((state.initial, np.inf if state.limit is None else state.limit))
            values = run.states[:, k]
            margin = 1e-6 * max(1.0, abs(state.initial))
            bounded = state.limit is None or bool(((values >= low - margin) & (values <= high + margin)).all())
            if not (np.isfinite(values).all() and bounded):
                worst = float(values[np.argmax(np.abs(values - state.initial))])
                detail = (
                    f"'{symbol}' reaches {worst:.4g}, outside {low:g} to {high:g}, with {_values_text(law, theta)}; "
                    "correct its rate, or narrow the bounds"
                )
                return ConformanceCheck("states in a short integration", False, detail)
        finished += run.status in (Status.COMPLETE, Status.RUPTURED)
    detail = f"within start and limit at {len(chosen)} corners of the bounds, {finished} of them to the end"
    return ConformanceCheck("states in a short integration", True, detail)


def corners(law: CreepLaw, point: Floats) -> list[Floats]:
    """Corners of the bounds at which the constraints hold, (parameters,) internal values each; 32 at most.

    point : (6 + states,) MPa, s and K, at which the constraints are asked.
    """
    low, high = law.internal_bounds
    count = len(law.params)
    if 2**count <= MOST_CORNERS:
        which = (np.arange(2**count)[:, None] >> np.arange(count)) & 1
    else:
        which = np.random.default_rng(0).integers(0, 2, (MOST_CORNERS, count))
        which[0], which[1] = 0, 1
    thetas = np.where(which == 1, high, low)
    holds = constraints_hold(law, np.repeat(point[None], len(thetas), axis=0), thetas)
    return list(thetas[holds])


def _values_text(law: CreepLaw, theta: Floats) -> str:
    pairs = zip(law.params.items(), theta, strict=True)
    return ", ".join(f"{symbol} = {param.from_internal(float(value)):.3g}" for (symbol, param), value in pairs)
