"""The material point of a finite element: Hencky elasticity and von Mises creep by the Cauchy stress."""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.kinematics import DIFFERENCE, HOOP, SHEAR, SUM, Four, Kinematics, Three
from creepkit.integration.stage_problem import (
    BY_MEAN,
    BY_PRINCIPAL,
    BY_TRIAL,
    Axes,
    StageProblem,
    differentiate_stage,
    gradient_of_update,
    stress_derivative,
)
from creepkit.integration.stage_solver import solve_stage
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN

CREEP_COMPONENTS = 3


EQUIVALENT_STRAIN = 3
"""Place of the equivalent creep strain in a point's history: three components, this, then the states."""


class StageConditions(NamedTuple):
    """What all points of a stage share.

    weight : gamma h dt/ds, s; 0 for a purely elastic change. time : s. temperature : K. bulk, shear : K and G, MPa.
    pressure : MPa.
    """

    weight: float
    time: float
    temperature: float
    bulk: float
    shear: float
    pressure: float


class ElasticPredictor(NamedTuple):
    """The elastic predictor of a point: w (three numbers), e, tr E, J, the largest principal direction, the mean.

    top : largest principal value of the unit deviator over its von Mises stress.
    """

    hoop: float
    difference: float
    shear: float
    equivalent: float
    trace: float
    volume: float
    top: float
    mean: float


class PointWorkspace(NamedTuple):
    """Working arrays for one point with S states: kernel row and output; gradient, matrix, response; dP/dF (5, 5)."""

    row: Floats
    out: Floats
    gradient: Floats
    matrix: Floats
    response: Floats
    tangent: Floats


@njit(cache=True, error_model="numpy")
def elastic_predictor(stage: StageConditions, at: Kinematics, base: Floats, k: int) -> ElasticPredictor:
    """The elastic predictor of point `k` from the total strain and the history (points, 3 + 1 + S)."""
    strain, volume = at.strain, at.volume
    trace = strain[SUM] + strain[HOOP]
    hoop = strain[HOOP] - trace / 3.0 - base[k, 0]
    difference, shear = strain[DIFFERENCE] - base[k, 1], strain[SHEAR] - base[k, 2]
    radius2 = difference * difference + shear * shear
    equivalent = sqrt(hoop * hoop + radius2 / 3.0)
    top = max(2.0 * hoop, sqrt(radius2) - hoop) / (3.0 * equivalent) if equivalent > 0.0 else 0.0
    return ElasticPredictor(hoop, difference, shear, equivalent, trace, volume, top, stage.bulk * trace / volume)


@njit(cache=True, error_model="numpy")
def axes_of(elastic: ElasticPredictor) -> Axes:
    """Largest principal and mean Cauchy stress along the equivalent one."""
    return Axes(elastic.mean, elastic.top, elastic.mean, 0.0)


@njit(cache=True, error_model="numpy")
def problem_of(stage: StageConditions, elastic: ElasticPredictor, strain: float) -> StageProblem:
    """The stage of `integration.stage_problem` at this point; strain : equivalent creep strain so far."""
    stiffness = 3.0 * stage.shear / elastic.volume
    return StageProblem(stiffness * elastic.equivalent, stiffness, 0.0, stage.weight, strain)


@njit(cache=True, error_model="numpy")
def creep_increment(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: StageProblem,
    base: Floats,
    k: int,
    row: Floats,
    out: Floats,
    guess: float,
    tolerance: float,
) -> tuple[float, int]:
    """Creep increment D of point `k` and a flag, from any guess and for any law; base : (points, 3 + 1 + S)."""
    if not guess > 0.0:  # the point was at rest; a logarithm of nothing lies too far from any answer
        guess = 1e-6 * problem.trial / problem.stiffness
    return solve_stage(update, theta, axes, problem, base[k, EQUIVALENT_STRAIN + 1 :], row, out, guess, tolerance)


@njit(cache=True, error_model="numpy")
def log_stress(stage: StageConditions, elastic: ElasticPredictor, increment: float) -> Four:
    """The log-conjugate stress."""
    left = 1.0 - increment / elastic.equivalent if increment > 0.0 else 1.0
    pressure, shear = stage.bulk * elastic.trace, stage.shear * left
    hoop = shear * elastic.hoop
    return pressure - hoop, shear * elastic.difference, pressure + 2.0 * hoop, shear * elastic.shear


@njit(cache=True, error_model="numpy")
def creep_derivatives(axes: Axes, problem: StageProblem, increment: float, out: Floats) -> Three:
    """Derivatives of D to the trial stress, and to shifts of the largest principal and of the mean stress.

    out : output of the entry `update` of a law without states, at the solution.
    """
    by_stress = increment * stress_derivative(out, 1, axes)
    divisor = 1.0 / (1.0 + by_stress * problem.stiffness - increment * out[1 + STRAIN])
    return (
        by_stress * divisor,
        increment * out[1 + PRINCIPAL_STRESS] * divisor,
        increment * out[1 + MEAN_STRESS] * divisor,
    )


@njit(cache=True, error_model="numpy")
def creep_derivatives_with_states(
    axes: Axes, problem: StageProblem, increment: float, out: Floats, gradient: Floats, matrix: Floats, response: Floats
) -> Three:
    """The same for a law with states; zero where the equations are singular."""
    size = matrix.shape[0]
    gradient_of_update(out, problem, increment, gradient)
    stress = problem.trial - problem.stiffness * increment
    if not differentiate_stage(axes, problem, increment, stress, out[1:size], gradient, matrix, response):
        return 0.0, 0.0, 0.0
    return response[0, BY_TRIAL], response[0, BY_PRINCIPAL], response[0, BY_MEAN]


@njit(cache=True, error_model="numpy")
def strain_derivatives(stage: StageConditions, elastic: ElasticPredictor, increment: float, by: Three) -> Four:
    """Derivatives of D to w (three) and to tr E, from those `by` trial, largest principal and mean stress."""
    if increment == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    by_trial, by_principal, by_mean = by
    e, stiffness = elastic.equivalent, 3.0 * stage.shear / elastic.volume
    stress = stiffness * (e - increment)
    along = by_trial * stiffness / e
    hoop, difference, shear = along * elastic.hoop, along * elastic.difference / 3.0, along * elastic.shear / 3.0
    trace = -by_trial * stress
    if by_principal != 0.0 or by_mean != 0.0:
        radius = sqrt(elastic.difference * elastic.difference + elastic.shear * elastic.shear)
        turned = by_principal * stress / (3.0 * e)
        shrink = by_principal * stress * elastic.top / (e * e)
        hoop -= shrink * elastic.hoop
        difference -= shrink * elastic.difference / 3.0
        shear -= shrink * elastic.shear / 3.0
        if 2.0 * elastic.hoop > radius - elastic.hoop:
            hoop += 2.0 * turned
        else:
            hoop -= turned
            difference += turned * elastic.difference / radius
            shear += turned * elastic.shear / radius
        trace += (by_mean + by_principal) * (stage.bulk / elastic.volume - elastic.mean)
    return hoop, difference, shear, trace


@njit(cache=True, error_model="numpy")
def tangent_moduli(
    stage: StageConditions, elastic: ElasticPredictor, increment: float, follow: Four, symmetric: bool
) -> tuple[Four, Four, Four, Four]:
    """Consistent tangent dT/dE, exact or its symmetric part; rows and columns in the order of the strains.

    follow : derivatives of D to w and to tr E, see `following`.

    y_i = 3G (1 - D/e) g_i w_i is conjugate to w_i, and dy_i = 3G (1 - D/e) g_i dw_i + g_i w_i (v_j dw_j + v_t dtr).
    """
    e, shear3, third = elastic.equivalent, 3.0 * stage.shear, 1.0 / 3.0
    left = 1.0 - increment / e if increment > 0.0 else 1.0
    inverse = shear3 / e if increment > 0.0 else 0.0
    d0, d1, d2 = elastic.hoop, elastic.difference * third, elastic.shear * third
    bend = inverse * increment / (e * e) if increment > 0.0 else 0.0
    v0, v1, v2 = bend * d0 - inverse * follow[0], bend * d1 - inverse * follow[1], bend * d2 - inverse * follow[2]
    vt = -inverse * follow[3]
    a00, a01, a02 = shear3 * left + d0 * v0, d0 * v1, d0 * v2
    a10, a11, a12 = d1 * v0, stage.shear * left + d1 * v1, d1 * v2
    a20, a21, a22 = d2 * v0, d2 * v1, stage.shear * left + d2 * v2
    t0, t1, t2 = d0 * vt, d1 * vt, d2 * vt
    if symmetric:
        a01 = a10 = 0.5 * (a01 + a10)
        a02 = a20 = 0.5 * (a02 + a20)
        a12 = a21 = 0.5 * (a12 + a21)
    # w_1 changes by -1/3 with E11 + E22 and by 2/3 with E33; the trace by one with both.
    s, h, bulk = t0 - third * a00, t0 + 2.0 * third * a00, stage.bulk
    ss, sh, hs, hh = bulk - third * s, bulk - third * h, bulk + 2.0 * third * s, bulk + 2.0 * third * h
    sd, hd, sx, hx = -third * a01, 2.0 * third * a01, -third * a02, 2.0 * third * a02
    ds, dh, xs, xh = t1 - third * a10, t1 + 2.0 * third * a10, t2 - third * a20, t2 + 2.0 * third * a20
    if symmetric:
        sh = hs = 0.5 * (sh + hs)
        sd = ds = 0.5 * (sd + ds)
        hd = dh = 0.5 * (hd + dh)
        sx = xs = 0.5 * (sx + xs)
        hx = xh = 0.5 * (hx + xh)
    return (ss, sd, sh, sx), (ds, a11, dh, a12), (hs, hd, hh, hx), (xs, a21, xh, a22)
