"""The one-degree-of-freedom model in time: many candidates in many tests at once, in the same number of steps.

    sigma* = k(D, h) P,   d eps/dt = f(sigma*, eps, t, T),   dD_cr/dt = kappa(D, h) d eps/dt,   D = D_el(P/E, h) + D_cr

by the implicit midpoint rule in s = t^beta, in which strain begins as a straight line, so that t^m and strain hardening
need no small first steps. The point stands for the middle of the roof: its stress is equibiaxial.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.records import Status
from creepkit.specimens.reduced_tables import EXPONENTS, Grid, Place, Tables

MEAN_STRESS = 2.0 / 3.0
"""Over the von Mises stress, in equibiaxial tension."""

_SECANTS = 2
"""The first estimate comes from the step before: an error of the increment of some 0.1 % is left."""
_SLOPES = (-10.0, -0.2)
"""Slope of residuals to unknowns that a step may have: -1 without feedback, steeper where deflection softens."""
_PUSH = 1.05
"""Factor on stress and on strain that shows their exponents."""
_STRESS_FLOOR = 1e-6
"""MPa; creep without pressure."""
_REST = 1e-12
"""mm."""
_LARGEST = np.log(1e2)
"""ln of the largest strain increment; the dimple has burst long before."""


class Point(NamedTuple):
    """Where a law is asked, each (candidates, tests): MPa, strain, s, K; states (S, candidates, tests)."""

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    states: Floats


Rates = Callable[[Point], tuple[Floats, Floats]]
"""ln of the strain rate and the rates of states (S, ...), at a point."""


def rates_of(kernel: Any, theta: Floats) -> Rates:
    """The rates of a law lowered for NumPy; theta : (candidates, parameters) internal."""
    columns = theta.T[:, :, None]

    def rates(point: Point) -> tuple[Floats, Floats]:
        arguments = (
            point.stress, point.strain, point.time, point.temperature, point.stress, MEAN_STRESS * point.stress,
            *point.states, *columns,
        )  # fmt: skip
        log = np.asarray(kernel.internal_log_rate(*arguments))
        if not len(point.states):
            return log, point.states
        return log, np.array(kernel.internal_rates(*arguments)[1:])

    return rates


@dataclass(frozen=True, eq=False)
class Batch:
    """What is marched, all broadcastable to (nodes, candidates, tests).

    times s, pressure MPa, temperature K, elastic deflection mm at nodes; beta (1, candidates, 1) exponent of the clock.
    tables, grid, row : of the dimples, and which row (candidates, tests) is whose. initial, limits : (S,) of states.
    deflection_limit mm, strain_limit : of what has not burst.
    """

    times: Floats
    pressure: Floats
    temperature: Floats
    elastic: Floats
    beta: Floats
    tables: Tables
    grid: Grid
    row: Ints
    initial: Floats
    limits: Floats
    deflection_limit: float
    strain_limit: float


class Ended(NamedTuple):
    """Outputs (nodes, candidates, tests, 3); Status and time s of the end, (candidates, tests)."""

    outputs: Floats
    status: Ints
    end_times: Floats


def march(batch: Batch, rates: Rates) -> Ended:
    """March all rows to the end of their tests, or to where they burst; outputs stay as they are from there on."""
    shape = (batch.times.shape[0], *batch.row.shape)
    clock, state = _clock(batch), _virgin(batch)
    status = np.full(shape[1:], int(Status.COMPLETE))
    ends = np.array(np.broadcast_to(batch.times[-1], shape[1:]))
    amplitude, exponent = np.zeros(shape), np.ones(shape)
    amplitude[0] = batch.elastic[0]
    for j in range(1, shape[0]):
        with np.errstate(invalid="ignore"):  # infinities of a row that bursts; _ended looks at what comes of them
            after, exponent[j] = _stepped(batch, rates, clock, j, state)
        reached = batch.elastic[j] + after.creep
        lost, burst = _ended(batch, after, reached)
        alive = status == Status.COMPLETE
        status = np.where(alive & lost, int(Status.NOT_CONVERGED), np.where(alive & burst, int(Status.BURST), status))
        going = alive & ~lost & ~burst
        ends = np.where(alive & ~going, _moment(batch, j, amplitude[j - 1], reached, burst), ends)
        stuck = np.where(alive & burst, np.fmin(reached, batch.deflection_limit), amplitude[j - 1])
        amplitude[j] = np.where(going, reached, stuck)
        state = State(*(np.where(going, new, old) for new, old in zip(after, state, strict=True)))
    exponent[0] = exponent[1]
    return Ended(_observed(batch, amplitude, exponent), status, ends)


class State(NamedTuple):
    """Where rows are: creep deflection mm, strain, ln of the last rate (candidates, tests); states (S, ...)."""

    creep: Floats
    strain: Floats
    log_rate: Floats
    states: Floats


class Clock(NamedTuple):
    """Of each step, broadcastable to (steps, candidates, tests): time s of its middle in the position t^beta, the
    share of the step's time before it, and ln of dt/ds times the step's length in s.
    """

    time: Floats
    share: Floats
    log_weight: Floats


def _virgin(batch: Batch) -> State:
    rows = batch.row.shape
    states = np.broadcast_to(batch.initial[:, None, None], (batch.initial.size, *rows))
    return State(np.zeros(rows), np.zeros(rows), np.full(rows, np.log(1e-9)), states)


def _clock(batch: Batch) -> Clock:
    t = batch.times
    position = t**batch.beta
    middle = (0.5 * (position[1:] + position[:-1])) ** (1.0 / batch.beta)
    length = np.diff(t, axis=0)
    share = np.divide(middle - t[:-1], length, out=np.full(middle.shape, 0.5), where=length > 0)
    weight = np.diff(position, axis=0) / batch.beta * np.maximum(middle, 1e-300) ** (1.0 - batch.beta)
    return Clock(middle, share, np.log(np.maximum(weight, 1e-300)))


def _stepped(batch: Batch, rates: Rates, clock: Clock, j: int, state: State) -> tuple[State, Floats]:
    """The state at node j from that at the node before, and the local stress exponent on the way.

    Unknown are ln of the strain increment and the states in the middle; each is found by secants of its own residual.
    """
    P, T = (v[j - 1] + clock.share[j - 1] * (v[j] - v[j - 1]) for v in (batch.pressure, batch.temperature))
    log_weight = clock.log_weight[j - 1]
    rest = 0.5 * (batch.elastic[j - 1] + batch.elastic[j]) + state.creep

    def at(unknown: Floats, push: float = 1.0, strained: float = 1.0) -> tuple[Floats, Floats, Floats]:
        """What the unknowns should be by what they are; growth mm per strain there, and ln of the rate.

        push, strained : factors on stress and strain.
        """
        increment = np.exp(np.minimum(unknown[0], _LARGEST))
        growth = _growth(batch, rest + 0.5 * _growth(batch, rest) * increment)
        stress = np.exp(_placed(batch, rest + 0.5 * growth * increment).of(batch.tables.stress, batch.row))
        stress = np.maximum(push * stress * P, _STRESS_FLOOR)
        time = np.broadcast_to(clock.time[j - 1], stress.shape)
        log_rate, state_rates = rates(Point(stress, strained * (state.strain + 0.5 * increment), time, T, unknown[1:]))
        middle = state.states + 0.5 * np.exp(log_weight) * state_rates
        return np.concatenate([(log_rate + log_weight)[None], middle]), growth, log_rate

    first = np.concatenate([(state.log_rate + log_weight)[None], state.states])
    x, last, (_, growth, log_rate) = _secants(at, first)
    stress_exponent, strain_exponent = (
        (at(last, *push)[2] - log_rate) / np.log(_PUSH) for push in ((_PUSH, 1.0), (1.0, _PUSH))
    )
    # strain that grows as stress^n strain^m is in proportion to stress^(n / (1 - m)) everywhere
    exponent = stress_exponent / np.maximum(1.0 - strain_exponent, 0.2)
    increment = np.exp(np.minimum(x[0], _LARGEST))
    after = State(state.creep + growth * increment, state.strain + increment, log_rate, 2.0 * x[1:] - state.states)
    return after, exponent


Asked = Callable[[Floats], tuple[Floats, Floats, Floats]]


def _secants(at: Asked, x: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats, Floats]]:
    """Solve at(x)[0] = x element by element: the solution, where it was asked last, and what was said there.

    As many secants for every row, so that what a row gives does not depend on the rows beside it.
    """
    said = at(x)
    residual, slope = said[0] - x, np.full(x.shape, -1.0)
    for _ in range(_SECANTS):
        step = -residual / slope
        x = x + step
        said = at(x)
        change = said[0] - x - residual
        slope = np.divide(change, step, out=np.full(x.shape, -1.0), where=np.abs(step) > 1e-9 * (1.0 + np.abs(x)))
        slope = np.clip(slope, *_SLOPES)
        residual = residual + change
    return x - residual / slope, x, said


def _growth(batch: Batch, deflection: Floats) -> Floats:
    """kappa, mm."""
    return np.exp(_placed(batch, deflection).of(batch.tables.growth, batch.row))


def _placed(batch: Batch, deflection: Floats) -> Place:
    return batch.grid.place(np.maximum(deflection, _REST))


def _ended(batch: Batch, after: State, reached: Floats) -> tuple[Bools, Bools]:
    """Which rows have lost their way (a rate that is no number), and which have burst."""
    lost = ~(np.isfinite(reached) & np.isfinite(after.states).all(axis=0))
    far = (reached > batch.deflection_limit) | (after.strain > batch.strain_limit)
    return lost, ~lost & (far | (after.states >= batch.limits[:, None, None]).any(axis=0))


def _moment(batch: Batch, j: int, before: Floats, reached: Floats, burst: Bools) -> Floats:
    """When rows ended in the step to node j, s: where the deflection crossed its limit."""
    grown = np.where(burst, reached - before, 1.0)
    beyond = burst & (reached > batch.deflection_limit)
    share = np.where(
        beyond, (batch.deflection_limit - before) / np.where(beyond, grown, 1.0), np.where(burst, 1.0, 0.0)
    )
    start, end = batch.times[j - 1], batch.times[j]
    return np.asarray(start + np.clip(share, 0.0, 1.0) * (end - start))


def _observed(batch: Batch, amplitude: Floats, exponent: Floats) -> Floats:
    """Amplitude, width and shape: of elastic and of creeping dimples in the proportion of their deflections."""
    place, count = _placed(batch, amplitude), len(EXPONENTS)
    inverse = 1.0 / np.array(EXPONENTS)
    flexibility = _on_the_way(1.0 / np.clip(exponent, EXPONENTS[0], EXPONENTS[-1]), amplitude - batch.elastic)
    flexibility = np.clip(flexibility, inverse[-1], inverse[0])
    which = np.clip(np.searchsorted(-inverse, -flexibility, side="right") - 1, 0, count - 2)
    share = ((inverse[which] - flexibility) / (inverse[which] - inverse[which + 1]))[..., None]
    rows = batch.tables.shapes.reshape(-1, *batch.tables.shapes.shape[2:])
    low, high = (place.of(rows, batch.row * count + which + k) for k in (0, 1))
    creeping = low + share * (high - low)
    elastic = place.of(batch.tables.elastic_shapes, np.broadcast_to(batch.row, amplitude.shape))
    part = np.clip(batch.elastic / np.maximum(amplitude, _REST), 0.0, 1.0)[..., None]
    return np.concatenate([amplitude[..., None], creeping + part * (elastic - creeping)], axis=-1)


def _on_the_way(values: Floats, creep: Floats) -> Floats:
    """Means of values over the creep deflection so far, node by node: a profile is the sum of what it grew by."""
    grown = np.maximum(np.diff(creep, axis=0, prepend=0.0), 0.0)
    so_far = np.cumsum(grown, axis=0)
    return np.asarray(np.divide(np.cumsum(values * grown, axis=0), so_far, out=values.copy(), where=so_far > _REST))
