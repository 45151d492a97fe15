"""The equations of one time step of the reduced-order model, and the outputs recorded at its end.

    sigma* = k(D, h) P,  d eps*/dt = f(sigma*, eps*, t, T),  dD_cr/dt = kappa(D, h) M d eps*/dt,  D = D_el(P/E) + D_cr

by the implicit midpoint rule in t^beta.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator

from creepkit.arrays import Floats
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, STRESS, TEMPERATURE, TIME
from creepkit.specimens.bulge.reduced_order.deflection_curves import (
    AMPLITUDE,
    CURVES,
    ELASTIC_SHAPE,
    ELASTIC_WIDTH,
    LOG_STRESS,
    RESIDUAL,
    SHAPE,
    WIDTH,
    DimpleCurves,
    GridPosition,
    exp,
    grid_position,
    interpolate_exponents,
    log,
    sqrt,
    write_curves,
)

MEAN_STRESS_RATIO = 2.0 / 3.0
"""Over the von Mises stress, in equibiaxial tension, as in the middle of the roof."""


PROBES = 3
"""Rows the law is asked at: the reference point, there with more stress, there with more strain."""


PROBE_FACTOR = 1.2
"""Factor on stress, and on strain, that shows their local exponents; elastic stresses lie above sigma*."""


_PER_PROBE_FACTOR = float(1.0 / np.log(PROBE_FACTOR))


CREEP_DEFLECTION, STRAIN_STATE, EXPONENT_STATE, FAST, SLOW, STATES = range(6)
"""Of a state: creep deflection mm, strain, creep times mean n'/(n' + 2), elastic pressures phi P (MPa), the law's."""


SLOW_SIZE, SLOW_SPEED, FAST_SIZE, FAST_OFFSET, FAST_SPEED, CEILING = range(6)
"""Of redistribution: m_slow = . ln n, rho_slow, m_fast = . (n - 1)^2 / (n + .), rho_fast = . n; n at most."""


_NODES = np.array([0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262])


_WEIGHTS = np.array([0.17392742256872692, 0.3260725774312731, 0.3260725774312731, 0.17392742256872692])
"""Gauss and Legendre's of four points in (0, 1)."""


_FLOOR = 1e-6
"""MPa; pressure of a dimple at rest."""


POWER = 1.5


_RELIEF = 0.3
"""Redistribution after unloading over that after loading, of small changes."""


_ROUNDING = 0.02


class StepData(NamedTuple):
    """A step: pressures, temperatures, moduli, elastic deflections at its ends; of its middle the share of time before
    it, its time and ln of dt/ds times the step, s.
    """

    pressure0: Any
    pressure: Any
    temperature0: Any
    temperature: Any
    modulus0: Any
    modulus: Any
    elastic0: Any
    elastic: Any
    share: Any
    time: Any
    log_weight: Any


class StepMidpoint(NamedTuple):
    """What is known of the middle of a step, beside the law's rows and the dimple's curves: the deflection (mm) and
    where it lies, the modulus over the stress, and the increments of strain and of creep deflection (mm).
    """

    deflection: Any
    at: GridPosition
    stiffness: Any
    strained: Any
    grown: Any


@njit(cache=True, error_model="numpy")
def within(x: Any, low: float, high: float, rounding: float) -> Any:
    """x kept between two limits, with corners rounded."""
    above = x - low
    below = high - low - 0.5 * (above + sqrt(above * above + rounding * rounding))
    return high - 0.5 * (below + sqrt(below * below + rounding * rounding))


@njit(cache=True, error_model="numpy")
def write_probes(
    node: StepData, state: Any, unknown: Any, dimple: DimpleCurves, thickness_change: Any, rows: Any, values: Any
) -> StepMidpoint:
    """Write the rows that the law is asked at, (PROBES, 6 + S), and the curves up to WIDTH into values (CURVES,).

    unknown : ln of the increments of strain and of creep deflection (mm), then the states in the middle.
    """
    strained, grown = exp(unknown[0]), exp(unknown[1])
    deflection = 0.5 * (node.elastic0 + node.elastic) + state[CREEP_DEFLECTION] + 0.5 * grown
    at = grid_position(deflection, dimple)
    write_curves(LOG_STRESS, WIDTH, at, dimple, thickness_change, values)
    pressure = node.pressure0 + node.share * (node.pressure - node.pressure0) + _FLOOR
    stress = exp(values[LOG_STRESS]) * pressure
    strain = state[STRAIN_STATE] + 0.5 * strained
    temperature = node.temperature0 + node.share * (node.temperature - node.temperature0)
    modulus = node.modulus0 + node.share * (node.modulus - node.modulus0)
    for k in range(PROBES):
        pushed = stress * (PROBE_FACTOR if k == 1 else 1.0)
        rows[k, STRESS], rows[k, PRINCIPAL_STRESS], rows[k, MEAN_STRESS] = pushed, pushed, MEAN_STRESS_RATIO * pushed
        rows[k, STRAIN] = strain * (PROBE_FACTOR if k == 2 else 1.0)
        rows[k, TIME], rows[k, TEMPERATURE] = node.time, temperature
        for v in range(unknown.size - 2):
            rows[k, POINT_SIZE + v] = unknown[2 + v]
    return StepMidpoint(deflection, at, modulus / stress, strained, grown)


class StepExponents(NamedTuple):
    """Local exponents of stress and strain, n'/(n' + 2) of proportional creep, what is left of the shares after a step
    (times pressure, MPa), ln of the mean multiplier, and how fast that changes with ln of the strain increment.
    """

    exponent: Any
    hardening: Any
    place: Any
    fast: Any
    slow: Any
    log_multiplier: Any
    bend: Any


@njit(cache=True, error_model="numpy")
def _left(share: Any, added: Any, x: Any) -> Any:
    """A share that decays by exp(-x) while `added` comes in evenly."""
    if added == 0.0:
        return share * exp(-x)
    if abs(x.real) < 1e-4:
        return share * (1.0 - x) + added * (1.0 - 0.5 * x)
    decay = exp(-x)
    return share * decay + added * (1.0 - decay) / x


@njit(cache=True, error_model="numpy")
def _felt(share: Any) -> Any:
    """A share as growth feels it: less after unloading, and never much less than none."""
    root = sqrt(share * share + _ROUNDING**2)
    fallen = 0.5 * _RELIEF * (root - share)
    return 0.5 * (share + root) - fallen / (1.0 + fallen) - 0.5 * (1.0 - _RELIEF) * _ROUNDING


@njit(cache=True, error_model="numpy")
def _multiplied(excess: Any) -> Any:
    """Growth over steady growth by how much redistribution adds to it; a power law in between a line and exp."""
    root = sqrt(1.0 + excess * (1.0 / POWER))
    return root * root * root


@njit(cache=True, error_model="numpy")
def step_exponents(
    node: StepData, fast: Any, slow: Any, values: Any, numbers: Floats, middle: StepMidpoint, logs: Any
) -> StepExponents:
    """How the dimple creeps in a step, by ln of the rates at the PROBES.

    fast, slow : shares times pressure before, MPa; values : of the curves; numbers : of redistribution.
    """
    n, m = (logs[1] - logs[0]) * _PER_PROBE_FACTOR, (logs[2] - logs[0]) * _PER_PROBE_FACTOR
    proportional = n / (1.0 - within(m, -20.0, 0.8, 0.05))
    power = within(proportional, 0.4, 14.0, 0.1)
    place_of_power = power / (power + 2.0)
    steady = interpolate_exponents(RESIDUAL, place_of_power, values)
    redistributing = within(proportional, 0.4, numbers[CEILING], 0.2)
    beyond, size = redistributing - 1.0, values[AMPLITUDE]
    slow_size = size * numbers[SLOW_SIZE] * log(redistributing)
    fast_size = size * numbers[FAST_SIZE] * beyond * beyond / (redistributing + numbers[FAST_OFFSET])
    strains = middle.strained * middle.stiffness
    slow_x, fast_x = numbers[SLOW_SPEED] * strains, numbers[FAST_SPEED] * redistributing * strains
    end = node.pressure + _FLOOR
    added = (node.pressure - node.pressure0) / end
    slow, fast = slow * (1.0 / end), fast * (1.0 / end)
    mean = 0.0 * strains
    for g in range(_NODES.size):
        y = _NODES[g] ** 2
        now = slow_size * _felt(_left(slow, added * y, slow_x * y)) + fast_size * _felt(
            _left(fast, added * y, fast_x * y)
        )
        mean += 2.0 * _NODES[g] * _WEIGHTS[g] * _multiplied(now)
    slow, fast = _left(slow, added, slow_x), _left(fast, added, fast_x)
    last = _multiplied(slow_size * _felt(slow) + fast_size * _felt(fast))
    return StepExponents(n, m, place_of_power, fast * end, slow * end, steady + log(mean), (last / mean).real - 1.0)


@njit(cache=True, error_model="numpy")
def step_residual(
    node: StepData, state: Any, unknown: Any, log_growth: Any, now: StepExponents, log_rate: Any, rates: Any, out: Any
) -> None:
    """What must be zero of each unknown; log_rate : ln of the strain rate, rates (S,) of the law's states."""
    out[0] = log_rate + node.log_weight - unknown[0]
    out[1] = log_growth + unknown[0] + now.log_multiplier - unknown[1]
    for v in range(rates.size):
        out[2 + v] = state[STATES + v] + 0.5 * exp(node.log_weight) * rates[v] - unknown[2 + v]


@njit(cache=True, error_model="numpy")
def advance_state(state: Any, unknown: Any, middle: StepMidpoint, now: StepExponents, gains: Floats) -> None:
    """The state after a step, in place; gains (S,) : what the law's states do after the middle over that before it."""
    state[CREEP_DEFLECTION] += middle.grown
    state[STRAIN_STATE] += middle.strained
    state[EXPONENT_STATE] += middle.grown * now.place
    state[FAST], state[SLOW] = now.fast, now.slow
    for v in range(unknown.size - 2):
        state[STATES + v] = unknown[2 + v] + gains[v] * (unknown[2 + v] - state[STATES + v])


REDISTRIBUTION = np.array([0.22, 1.15, 1.15, 8.0, 2.0, 14.0])
"""SLOW_SIZE, SLOW_SPEED, FAST_SIZE, FAST_OFFSET, FAST_SPEED and CEILING of the constants above."""


_DEFLECTIONS = (0.0, 0.2, 0.8, 1.8)
"""Over the apex thickness."""


_SIZES = (1.5, 1.18, 1.0, 0.8)
"""A bulged roof carries more load as a membrane, whose stresses are steady from the first."""


def redistribution_sizes(deflections: Floats) -> Floats:
    """Size of redistribution; deflections : (...) D/h."""
    known = PchipInterpolator(np.log(0.1 + np.array(_DEFLECTIONS)), _SIZES)
    return np.asarray(known(np.log(0.1 + np.minimum(deflections, _DEFLECTIONS[-1]))))


def growth_multiplier(strains: Floats, exponent: float, *, size: float = 1.0, share: float = 1.0) -> Floats:
    """Growth over steady growth at creep strains lambda since `share` of the elastic stresses came, in Norton creep."""
    slow_size, slow_speed, fast_size, offset, fast_speed, _ = REDISTRIBUTION
    slow = slow_size * np.log(exponent) * np.exp(-slow_speed * strains)
    fast = fast_size * (exponent - 1.0) ** 2 / (exponent + offset) * np.exp(-fast_speed * exponent * strains)
    return np.asarray((1.0 + size * share * (slow + fast) / POWER) ** POWER)


TRAJECTORY_COLUMNS = (
    "elastic",
    "creep",
    "amplitude",
    "width",
    "shape",
    "strain",
    "stress",
    "age",
    "fast",
    "slow",
    "pressure",
    "modulus",
    "temperature",
    "time",
    "middle",
    "log_rate",
    "log_multiplier",
    "exponent",
    "hardening",
)
"""Columns of a trajectory at each node; see write_node_outputs and write_step_outputs."""


AMPLITUDE_COLUMN = TRAJECTORY_COLUMNS.index("amplitude")


FIRST_STEP_COLUMN = TRAJECTORY_COLUMNS.index("middle")
"""The first of the columns of the step before a node."""


LOG10_RATE_COLUMN = TRAJECTORY_COLUMNS.index("log_rate")


_REST_DEFLECTION = 1e-9
"""mm; far below what can be measured."""


_DECADES = float(1.0 / np.log(10.0))


_PRESSURE_FLOOR = 1e-6
"""MPa, as in the step."""


@njit(cache=True, error_model="numpy")
def write_node_outputs(
    node: StepData,
    state: Any,
    toughness: Any,
    dimple: DimpleCurves,
    thickness_change: Any,
    time: float,
    values: Any,
    out: Any,
) -> None:
    """Write the columns at the end of a step; toughness : n'/(n' + 2) there, for a dimple that has not crept.

    values : workspace for the curves, (CURVES,).
    """
    deflection = node.elastic + state[CREEP_DEFLECTION]
    at = grid_position(deflection, dimple)
    write_curves(LOG_STRESS, LOG_STRESS + 1, at, dimple, thickness_change, values)
    write_curves(WIDTH, CURVES, at, dimple, thickness_change, values)
    end = node.pressure + _PRESSURE_FLOOR
    stress = exp(values[LOG_STRESS]) * end
    mean = (state[EXPONENT_STATE] + _REST_DEFLECTION * toughness) / (state[CREEP_DEFLECTION] + _REST_DEFLECTION)
    part = (node.elastic + _REST_DEFLECTION) / (deflection + _REST_DEFLECTION)
    width, shape = interpolate_exponents(WIDTH, mean, values), interpolate_exponents(SHAPE, mean, values)
    out[0], out[1], out[2] = node.elastic, state[CREEP_DEFLECTION], deflection
    out[3] = width + part * (values[ELASTIC_WIDTH] - width)
    out[4] = shape + part * (values[ELASTIC_SHAPE] - shape)
    out[5], out[6] = state[STRAIN_STATE], stress
    out[7] = node.modulus * state[STRAIN_STATE] / stress
    out[8], out[9] = state[FAST] * (1.0 / end), state[SLOW] * (1.0 / end)
    out[10], out[11], out[12], out[13] = node.pressure, node.modulus, node.temperature, time


@njit(cache=True, error_model="numpy")
def write_step_outputs(strain: Any, now: StepExponents, log_rate: Any, out: Any) -> None:
    """Write the columns of the step itself: strain and ln of the rate in its middle, local exponents."""
    out[14], out[15], out[16] = strain, log_rate * _DECADES, now.log_multiplier
    out[17], out[18] = now.exponent, now.hardening
