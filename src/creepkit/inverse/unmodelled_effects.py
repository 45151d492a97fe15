"""Unmodelled effects: what the intervals of an identification do not include, and what it would change.

A dimple may be thicker than its drawing, a camera may have moved, a furnace may drift. Where no nuisance parameter
stands for it, an interval takes it as exactly known. Its effect on the residuals, s (one standard deviation of the
usual size), moves the values by

    du = -(J'C^-1 J + P)^-1 J'C^-1 s

to first order, and with it the rate. C is the covariance under which values are found. Where the scatter of rates is
estimated from the tests, independent errors of them are found as such scatter: C then holds the scatter that they make,
and each test weighs as much as any other, however small the scatter is without them. An error common to all tests
makes no scatter (see inverse.common_errors); one that moves the stresses of all tests is found as offsets of them.

The same effects, as random effects in the covariance, show whether the choice of a law rests on their absence (see
selection.challenges).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy

from creepkit.arrays import Floats
from creepkit.inverse.common_errors import activation_energy, common_errors, log_rate_per_kelvin
from creepkit.inverse.composite_predictor import predict_with_sensitivities, predictor_for, supports_nuisance
from creepkit.inverse.imposed_motion_errors import moves_stress
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, components_fixed_by_priors
from creepkit.inverse.nuisance_parameters import prior_mean
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.uncertainty.quantities import gradient, log_rate
from creepkit.inverse.unmodelled_effect import DRIFT, UnmodelledEffect
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, LinearisedProblem
from creepkit.inverse.working_noise import with_single_value_weight
from creepkit.language import CreepLaw, strain, time
from creepkit.records import Dimension, History, Nuisance, Program, dimension_named, dimensions_of, output_unit

OFFSET_IN_NOISES = 3.0
"""Size of an offset that nobody models, in noises of a frame."""


USUAL_DRIFT = 5.0
"""K over a test: what furnaces drift where nobody looks."""


def unmodelled_effects(
    problem: LeastSquaresProblem,
    x: Floats,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    full_histories: Sequence[History],
    working_noise: NoiseModel | None = None,
) -> tuple[UnmodelledEffect, ...]:
    """The effects that no nuisance parameter of the problem stands for; x : (unknowns,) its optimum.

    working_noise : under which the values were found where that is not `noise_model`, as of frames of equal weight.
    """
    fitting_noise = None if working_noise is None else with_single_value_weight(working_noise, problem.observations)
    kinds = {n.kind for n in problem.settings.nuisances}
    common_kinds = {n.kind for n in problem.settings.nuisances if n.scope != "test"}
    changes: list[tuple[str, float, str, Floats]] = []
    common = [(e.kind, e.size, e.unit, e.change) for e in common_errors(problem, x, linear)]
    for dimension in tolerated_dimensions(problem):
        found = [] if common_kinds & set(dimension.names) else _dimension(problem, x, linear, dimension.names[-1])
        changes += found if kinds.isdisjoint(dimension.names) else []
        common += found if len(problem.histories) > 1 else []
    if "offset" not in kinds:
        changes += _offset(problem, linear)
    drifting_kinds = {DRIFT, "rate drift"}
    without_curves = not any(h.outputs for h in full_histories)
    recorded = any(isinstance(h.temperature, Program) for h in full_histories)
    if not (kinds & drifting_kinds or recorded or without_curves):  # a drift changes curves, and no single value
        changes += _drift(problem, x, linear)
    factor = CovarianceFactor.of_residuals(linear.residuals, noise_model)
    energy, assumed = activation_energy(problem, x)
    count = len(problem.histories)
    effects = []
    for kind, size, unit, change in changes:
        by_test = _rate_changes(
            problem, x, linear, fitting_noise or _with_scatter_of(change, problem, linear, noise_model), change
        )
        rate_change = float(np.sqrt((by_test**2).sum()))
        likeness = _likeness_of_hardening(problem, x, linear, factor, change) if kind == DRIFT else (np.nan, np.nan)
        effect = UnmodelledEffect(kind, size, unit, rate_change, size * likeness[0], likeness[1], change, tests=count)
        effects.append(replace(effect, activation_energy=energy, assumed=assumed) if kind == DRIFT else effect)
    for kind, size, unit, change in common:
        noise = fitting_noise or noise_model
        noise = _with_offset_of(change, problem, linear, noise) if moves_stress(kind) else noise
        rate_change = float(_rate_changes(problem, x, linear, noise, change).sum())
        effect = UnmodelledEffect(kind, size, unit, rate_change, common=True, tests=count)
        of_heat = kind == "temperature"
        effects.append(replace(effect, activation_energy=energy, assumed=assumed) if of_heat else effect)
    return tuple(effects)


def _rate_changes(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, noise_model: NoiseModel, change: Floats
) -> Floats:
    """(tests,) changes of ln of the rate at the reference point by changes of the residuals of each test."""
    solution = linear.solve(CovarianceFactor.of_residuals(linear.residuals, noise_model))
    coordinates, count = problem.coordinates, problem.parameter_count
    free_parameters = np.flatnonzero(linear.free[:count])
    derivative = gradient(log_rate(coordinates, coordinates.reference.stress), x[:count], np.ones(count))
    row = np.zeros(len(solution.covariance))
    row[: free_parameters.size] = derivative[free_parameters]
    return np.asarray(-np.einsum("tep,te->tp", solution.weighted_jacobian, change) @ solution.covariance @ row)


def _with_scatter_of(
    change: Floats, problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel
) -> NoiseModel:
    """The noise model with the scatter of rates that independent errors of tests would be estimated as.

    change : (tests, observations) -, of the residuals by one standard deviation. Of each test its projection on a
    change of ln of the rate counts.
    """
    fixed = components_fixed_by_priors(problem.settings.nuisances, list(noise_model.outputs))
    if not noise_model.rate > 0 or ("", "rate") in fixed:
        return noise_model
    sensitivity = linear.residuals.log_rate_sensitivity
    weighted = CovarianceFactor.of_residuals(linear.residuals, noise_model).inverse_times(sensitivity)
    information = np.maximum((sensitivity * weighted).sum(axis=1), 1e-300)
    like_rates = (change * weighted).sum(axis=1) / information
    scatter = float(np.hypot(noise_model.rate, np.sqrt(np.mean(like_rates**2))))
    return replace(noise_model, rate=min(scatter, LARGEST_RATE_SCATTER))


def _with_offset_of(
    change: Floats, problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel
) -> NoiseModel:
    """The noise model with the offsets of tests that an error common to them would be estimated as.

    change : (tests, observations) -, of the residuals. Of each output the mean of a test, in its unit, counts.
    """
    fixed = components_fixed_by_priors(problem.settings.nuisances, list(noise_model.outputs))
    observations, slopes = problem.observations, linear.residuals.offset_sensitivity
    if not any(n.kind == "offset" for n in problem.settings.nuisances):
        return noise_model
    for position, name in enumerate(observations.outputs):
        if (name, "offset") in fixed or name not in noise_model.outputs:
            continue
        mask = linear.residuals.present & (observations.output_index == position)
        weights = np.where(mask, slopes**2, 0.0).sum(axis=1)
        means = np.where(mask, change * slopes, 0.0).sum(axis=1) / np.maximum(weights, 1e-300)
        offset = float(np.sqrt(np.mean(means[weights > 0] ** 2))) if (weights > 0).any() else 0.0
        noise_model = noise_model.with_output(name, offset=float(np.hypot(noise_model[name].offset, offset)))
    return noise_model


def tolerated_dimensions(problem: LeastSquaresProblem) -> list[Dimension]:
    """The lengths of the test pieces that their specimens know to a tolerance only, each once."""
    predictors = [predictor_for(problem.predictor, h) for h in problem.histories]
    lengths = {d.name: d for p in predictors for d in dimensions_of(p) if d.tolerance > 0.0}
    return list(lengths.values())


def _likeness_of_hardening(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, factor: CovarianceFactor, change: Floats
) -> tuple[float, float]:
    """(ratio, correlation) of an effect to what the law's hardening does, beside all other unknowns.

    Hardening is what disappears where an exponent of strain, of time or of an internal variable is zero.
    """
    law, jacobian = problem.law, linear.residuals.jacobian
    assert jacobian is not None
    theta = problem.coordinates.theta(x[: problem.parameter_count])
    positions = [k for k in _hardening_exponents(law) if abs(theta[k]) > 0]
    if not positions:
        return float("nan"), float("nan")
    hardening = np.einsum("tep,p->te", jacobian[..., positions], theta[positions])
    others = [k for k in range(jacobian.shape[-1]) if k not in positions]
    columns = np.concatenate([hardening[..., None], change[..., None], jacobian[..., others]], axis=-1)
    whitened = factor.whiten(columns)[linear.residuals.present]
    basis, _ = np.linalg.qr(whitened[:, 2:] / np.maximum(np.linalg.norm(whitened[:, 2:], axis=0), 1e-300))
    own, effect = (whitened[:, k] - basis @ (basis.T @ whitened[:, k]) for k in (0, 1))
    sizes = float(np.linalg.norm(own)), float(np.linalg.norm(effect))
    if min(sizes) == 0.0:
        return float("nan"), float("nan")
    product = float(own @ effect)
    return product / sizes[1] ** 2, abs(product) / (sizes[0] * sizes[1])


def _hardening_exponents(law: CreepLaw) -> list[int]:
    """Positions of the parameters without which a term no longer depends on strain, time or an internal variable."""
    memory = {strain, time, *law.states}

    def hardens(parameter: sympy.Symbol) -> bool:
        return any(
            memory & term.free_symbols - term.subs(parameter, 0).free_symbols
            for term in law.terms.values()
            if parameter in term.free_symbols
        )

    return [
        k for k, (symbol, p) in enumerate(law.params.items()) if p.off == 0.0 and p.scale != "log" and hardens(symbol)
    ]


def _dimension(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, kind: str
) -> list[tuple[str, float, str, Floats]]:
    """A length of the test pieces that is known to its tolerance only."""
    histories, count = problem.histories, problem.parameter_count
    tolerances = [
        length.tolerance
        if (length := dimension_named(predictor_for(problem.predictor, h), kind)) is not None
        and supports_nuisance(predictor_for(problem.predictor, h), kind)
        else 0.0
        for h in histories
    ]
    if not all(tolerances):
        return []
    nominal = np.array([prior_mean(Nuisance(kind), h, problem.predictor) for h in histories])
    nuisances = {**problem.nuisance_parameters.predictor_values(x[count:]), kind: nominal[None]}
    theta = problem.coordinates.theta(x[:count])
    prediction = predict_with_sensitivities(problem.predictor, problem.law, theta, histories, nuisances)
    slope = problem.observations.select_outputs(prediction.nuisance_jacobian[kind], prediction)[0]
    sizes = nominal * np.array(tolerances)
    change = linear.residuals.offset_sensitivity * np.where(np.isfinite(slope), slope, 0.0) * sizes[:, None]
    return [(kind, float(np.median(sizes)), "mm", change)]


def _offset(problem: LeastSquaresProblem, linear: LinearisedProblem) -> list[tuple[str, float, str, Floats]]:
    """An offset of the output that grows with creep."""
    observations, residuals = problem.observations, linear.residuals
    leading = observations.present & observations.leading_output
    if not leading.any():
        return []
    offsets = []
    for position in np.unique(observations.output_index[leading]):
        size, name = OFFSET_IN_NOISES * float(observations.noise[position]), observations.outputs[position]
        if size > 0:
            mask = leading & (observations.output_index == position)
            change = np.where(mask, residuals.offset_sensitivity * size, 0.0)
            offsets.append((f"offset of {name}", size, output_unit(name), change))
    return offsets


def _drift(problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem) -> list[tuple[str, float, str, Floats]]:
    """A furnace that drifts linearly over each test: the clock of the creep runs ahead.

    A factor 1 + b g(t) on the rate moves the clock by the integral of b g, and an output by that times its slope, as
    long as the load is constant; where it changes, the advance counts in the new, faster, clock.
    """
    observations, residuals = problem.observations, linear.residuals
    factor = log_rate_per_kelvin(problem, x) * USUAL_DRIFT
    predicted = observations.inverse(residuals.values + observations.transformed_values)
    change = np.zeros_like(predicted)
    for test, history in enumerate(problem.histories):
        for position in np.unique(observations.output_index[test, observations.present[test]]):
            index = np.flatnonzero(observations.present[test] & (observations.output_index[test] == position))
            if index.size < 3 or observations.rupture_mask[test, index].any():
                continue
            times = observations.times[test, index]
            by_time = problem.law.uses(time)
            change[test, index] = _advance(history, times, predicted[test, index], explicit_time=by_time)
    return [(DRIFT, USUAL_DRIFT, "K over a test", factor * change * residuals.offset_sensitivity)]


def _advance(history: History, times: Floats, values: Floats, *, explicit_time: bool = False) -> Floats:
    """(frames,) change of an output by a clock that advances by t^2 / 2 t_end; values : (frames,) in its unit.

    A law of explicit time has no clock of its own: each increment is multiplied by t / t_end.
    """
    program = history.loading.program()
    levels = program.at(times)
    change, advance, last_slope = np.zeros_like(values), 0.0, 0.0
    begin = 0
    for end in [*(np.flatnonzero(np.abs(np.diff(levels)) > 1e-3 * np.abs(levels).max()) + 1), times.size]:
        part = slice(begin, end)
        if end - begin >= 2:
            slope = np.gradient(values[part], times[part])
            start = times[begin - 1] if begin else 0.0
            if explicit_time:
                increments = np.diff(values[part]) * 0.5 * (times[part][1:] + times[part][:-1]) / times[-1]
                first = float(change[begin - 1]) if begin else 0.5 * float(slope[0]) * times[0] ** 2 / times[-1]
                change[part] = first + np.concatenate([[0.0], np.cumsum(increments)])
                begin = end
                continue
            if begin and slope[0] != 0.0:
                advance *= last_slope / slope[0]
            clock = advance + (times[part] ** 2 - start**2) / (2.0 * times[-1])
            change[part], advance, last_slope = slope * clock, float(clock[-1]), float(slope[-1])
        begin = end
    return change


def with_random_effects(linear: LinearisedProblem, effects: Sequence[UnmodelledEffect]) -> LinearisedProblem:
    """The linear problem with these effects as random effects of each test in its covariance."""
    columns = [effect.residual_change[..., None] for effect in effects]
    present = linear.residuals.random_effect_sensitivities
    stacked = np.concatenate([*([present] if present is not None else []), *columns], axis=-1)
    return replace(linear, residuals=replace(linear.residuals, random_effect_sensitivities=stacked))


def with_unknown_effects(linear: LinearisedProblem, changes: Floats) -> LinearisedProblem:
    """The linear problem with further unknowns of prior mean zero and standard deviation one, after all others.

    changes : (tests, observations, unknowns) -, of the residuals by each.
    """
    jacobian, more = linear.residuals.jacobian, changes.shape[-1]
    assert jacobian is not None
    return LinearisedProblem(
        replace(linear.residuals, jacobian=np.concatenate([jacobian, changes], axis=-1)),
        np.append(linear.precision, np.ones(more)),
        np.append(linear.prior_residual, np.zeros(more)),
        np.append(linear.free, np.ones(more, bool)),
        np.concatenate([linear.step_bounds, np.outer([-np.inf, np.inf], np.ones(more))], axis=1),
    )
