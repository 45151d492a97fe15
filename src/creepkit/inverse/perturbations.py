"""Perturbations of the tests of an identification: what nobody models, and what it changes.

A dimple may be thicker than its drawing, a camera may have moved, a furnace may drift; a thermocouple, a load cell or a
micrometer may be off in every test. Where no nuisance parameter stands for it, it is a perturbation.
What an error does to values that do not know of it is, to first order, du = -(J'C^-1 J + P)^-1 J'C^-1 s, with s its
effect on the residuals and C the covariance under which values are found, of a drift with the misfit that it makes.

Those that the settings name, settings.usual_errors, are in the covariance under which values are found by likelihood:
with s their effects, one standard deviation of the usual size each,

    C = C0 + sum of s s',

one s for each test of what its tests have independently, one s over all tests of what an instrument has in all of them,
which no number of tests averages out. C0 has the scatter of rates between tests with its expected square, given the
tests: temperatures and loads that are off in each by itself are part of it, and counted once. So tests count by how
exactly they are known, and the covariance of the values, (J'C^-1 J + P)^-1, includes the errors; a further test never
widens it. The noise model, and what a law is judged by, has the scatter as estimated. Values that are not found by
likelihood stay as they are, and their covariance is that under C.

A temperature or load that is off changes the creep rate of each test by its own factor. Of tests under an imposed
strain or displacement the stress is E (strain - creep strain): a modulus or a strain that is off moves it from the
first reading on.

The same perturbations, as random effects in the covariance, show what a law would explain with them (inverse.judging),
and whether the choice of a law rests on their absence (selection.challenges).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.inverse.noise_covariance import CovarianceFactor, effective_sample_size
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import DRIFT, OFFSET, Perturbation, prior_mean
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import USUAL_ERRORS
from creepkit.inverse.uncertainty.laplace_approximation import (
    covariance_of_values,
    known_to_freedom,
    positive_semidefinite,
)
from creepkit.inverse.uncertainty.quantities import gradient, local_exponent, log_rate
from creepkit.inverse.uncertainty.rate_scatter import rate_scatter
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.language import temperature, time
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import History, Nuisance, Program, RecordedLoading, dimension_named, dimensions_of, output_unit

OFFSET_IN_NOISES = 3.0
"""Size of an offset that nobody models, in noises of a frame."""


USUAL_DRIFT = 5.0
"""K over a test: what furnaces drift where nobody looks."""


LOADS, IMPOSED = ("stress", "pressure", "force"), ("strain", "displacement")
"""Quantities of a loading that an instrument sets, and those under which the stress follows from the stiffness."""


MOTION_STEP = 1e-3
"""Relative, of central differences in what is imposed."""


USUAL_ACTIVATION_ENERGY = 400e3
"""J/mol, of the rate of a law that knows no temperature: of nickel alloys and austenitic steels, within 30 %."""


LOWEST_USUAL_TEMPERATURE = 1000.0
"""K, below which the rate of a law that knows no temperature is taken to change by as much per K as there."""


def perturbations(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    full_histories: Sequence[History],
    known: Sequence[Perturbation] = (),
    working_noise: NoiseModel | None = None,
) -> tuple[Perturbation, ...]:
    """Those that no nuisance parameter of the problem stands for, with what they do to the rate, about the optimum.

    Errors that the tests have independently of one another, lengths, offsets, drifts; then those common to all. known :
    as errors_of_tests() has them, where lengths have been simulated already.
    working_noise : under which values were found that are not by likelihood.
    """
    reference, found = problem.coordinates.reference, list[Perturbation]()
    slope = float(log_rate_per_kelvin(problem, linear.x, reference.stress, reference.temperature))
    kinds = {n.kind for n in problem.settings.nuisances}
    known = [e for e in known if e.kind != RATE] or of_lengths_and_instruments(problem, linear)
    own, common = ([one for one in known if one.common is is_common] for is_common in (False, True))
    own += [] if "offset" in kinds else _offsets(problem, linear)
    recorded = any(isinstance(h.temperature, Program) for h in full_histories)
    # A drift changes curves, and no single value.
    if any(h.outputs for h in full_histories) and not recorded and kinds.isdisjoint({DRIFT, "rate drift"}):
        own.append(_drift(problem, linear))
    for one in (*own, *common):
        if one.common:
            one = replace(one, residual_change=np.zeros((0, 0)))
        elif not one.included:
            change, noise = one.residual_change, working_noise or noise_model
            if one.kind == DRIFT:
                noise = _with_misfit_of(change, problem, noise)
                one = replace(one, per_kelvin=slope, assumed=not problem.law.uses(temperature))
            moved = value_changes(linear, noise, change)[:, : problem.parameter_count]
            by_error = moved @ _log_rate_gradient(problem, linear.x)
            one = replace(one, rate_change=float(np.linalg.norm(by_error)))
        found.append(one)
    return tuple(found)


def sizes_of_effect(
    linear: LinearisedProblem, effect: Perturbation, noise_model: NoiseModel, *, common: bool = False
) -> Floats:
    """(1,) of all tests or (tests,) sizes that a perturbation takes in a linear problem, in standard deviations.

    Best linear predictions of it as a random effect.
    """
    perturbed = linear.with_effects([replace(effect, common=common)])
    solution = perturbed.solve(CovarianceFactor.of_residuals(perturbed.residuals, noise_model))
    sizes = -(effect.residual_change * solution.weighted_residuals).sum(axis=1)
    return np.asarray(sizes.sum(keepdims=True) if common else sizes)


# ---- what each does to the residuals ---------------------------------------------------------------------------------


def of_lengths_and_instruments(
    problem: LeastSquaresProblem, linear: LinearisedProblem, among: int = 1
) -> tuple[Perturbation, ...]:
    """Lengths that are off in each test by itself, errors common to all tests, and lengths that are off in all alike.

    Those for which no nuisance parameter stands. among : as in errors_of_tests().
    """
    own, common = list[Perturbation](), list[Perturbation]()
    kinds, included = {n.kind for n in problem.settings.nuisances}, problem.settings.included_errors
    for names, nominal, tolerances in uncertain_lengths(problem):
        slope, sizes = _slope(problem, linear.x, names[-1], nominal), included.get("dimensions", 1.0) * tolerances
        form: dict[str, Any] = {"tests": max(among, len(sizes)), "included": "dimensions" in included}
        form["residual_change"] = linear.residuals.offset_sensitivity * slope * sizes[:, None]
        found = Perturbation(names[-1], float(np.median(sizes)), "mm", **form)
        own += [found] if found.size > 0 and kinds.isdisjoint(names) else []
        common += [replace(found, common=True)] if found.size > 0 and found.tests > 1 else []
    return (*own, *common_errors(problem, linear), *common)


def with_derivatives_to_lengths(problem: LeastSquaresProblem) -> LeastSquaresProblem:
    """The problem whose predictions have derivatives to lengths known to a tolerance only, which then cost no more."""
    if not problem.settings.included_errors or problem.observations.followed_to_rupture.any():
        return problem
    return replace(problem, lengths={names[-1]: nominal[None] for names, nominal, _ in uncertain_lengths(problem)})


def common_errors(problem: LeastSquaresProblem, linear: LinearisedProblem) -> list[Perturbation]:
    """Those of instruments that no nuisance parameter common to tests stands for."""
    shared = {n.kind for n in problem.settings.nuisances if n.scope != "test"}
    included, rates = problem.settings.included_errors, linear.residuals.log_rate_sensitivity
    per_kelvin, exponents = rate_slopes(problem, linear.x).T[..., None]
    effects = {"temperature": per_kelvin * rates, **({"load": exponents * rates} if exponents.any() else {})}
    moved = np.array([h.loading.quantity in IMPOSED for h in problem.histories])
    imposed = [h for h, is_moved in zip(problem.histories, moved, strict=True) if is_moved]
    if imposed:
        outputs = linear.residuals.offset_sensitivity * moved[:, None]
        if "modulus" not in shared and all(problem.predictor.for_history(h).follows("modulus") for h in imposed):
            effects["modulus"] = outputs * _slope(problem, linear.x, "modulus")
        effects["motion"] = outputs * _motion_slope(problem, linear.x)
    made = []
    for name, size in {**USUAL_ERRORS, **included}.items():
        if name in effects and name not in shared and size > 0:
            kind = (
                f"imposed {' and '.join(sorted({h.loading.quantity for h in imposed}))}" if name == "motion" else name
            )
            amount, unit = (size, "K") if name == "temperature" else (100 * size, "%")
            form: dict[str, Any] = {"common": True, "tests": len(moved), "included": name in included}
            made.append(Perturbation(kind, amount, unit, residual_change=size * effects[name], **form))
    return made


def uncertain_lengths(problem: LeastSquaresProblem) -> list[tuple[tuple[str, ...], Floats, Floats]]:
    """Names, values (tests,) and tolerances (tests,), mm, of lengths that all specimens know to a tolerance only.

    Those for which no nuisance parameter of several tests stands.
    """
    shared = {n.kind for n in problem.settings.nuisances if n.scope != "test"}
    predictors, lengths = [problem.predictor.for_history(h) for h in problem.histories], []
    for names in {d.name: d.names for p in predictors for d in dimensions_of(p) if d.tolerance > 0.0}.values():
        known = [dimension_named(p, names[-1]) if p.follows(names[-1]) else None for p in predictors]
        tolerances = np.array([0.0 if length is None else length.tolerance for length in known])
        if shared.isdisjoint(names) and tolerances.all():
            nominal = np.array([prior_mean(Nuisance(names[-1]), h, problem.predictor) for h in problem.histories])
            lengths.append((names, nominal, nominal * tolerances))
    return lengths


def _offsets(problem: LeastSquaresProblem, linear: LinearisedProblem) -> Iterator[Perturbation]:
    """An offset of each output that grows with creep."""
    observations, slopes = problem.observations, linear.residuals.offset_sensitivity
    leading = observations.present & observations.leading_output
    for position in np.unique(observations.output_index[leading]):
        size, name = OFFSET_IN_NOISES * float(observations.noise[position]), observations.outputs[position]
        if size > 0:
            change = np.where(leading & (observations.output_index == position), slopes * size, 0.0)
            kind, unit, tests = f"{OFFSET}{name}", output_unit(name), len(problem.histories)
            yield Perturbation(kind, size, unit, residual_change=change, tests=tests)


def _drift(problem: LeastSquaresProblem, linear: LinearisedProblem) -> Perturbation:
    """A furnace that drifts linearly over each test: the clock of the creep runs ahead.

    A factor 1 + b g(t) on the rate moves the clock by the integral of b g, and an output by that times its slope, as
    long as the load is constant; where it changes, the advance counts in the new, faster, clock.
    """
    observations, residuals = problem.observations, linear.residuals
    predicted = observations.inverse(residuals.values + observations.transformed_values)
    change, by_time = np.zeros_like(predicted), problem.law.uses(time)
    for test, _, index in observations.series:
        if index.size >= 3 and not observations.rupture_mask[test, index].any():
            history, times = problem.histories[test], observations.times[test, index]
            change[test, index] = _advance(history, times, predicted[test, index], explicit_time=by_time)
    reference = problem.coordinates.reference
    factor = log_rate_per_kelvin(problem, linear.x, reference.stress, reference.temperature) * USUAL_DRIFT
    change = factor * change * residuals.offset_sensitivity
    return Perturbation(DRIFT, USUAL_DRIFT, "K over a test", residual_change=change, tests=len(change))


def _advance(history: History, times: Floats, values: Floats, *, explicit_time: bool = False) -> Floats:
    """(frames,) change of an output by a clock that advances by t^2 / 2 t_end; values : (frames,) in its unit.

    A law of explicit time has no clock of its own: each increment is multiplied by t / t_end.
    """
    levels = history.loading.program().at(times)
    change, advance, last_slope, begin = np.zeros_like(values), 0.0, 0.0, 0
    for end in [*(np.flatnonzero(np.abs(np.diff(levels)) > 1e-3 * np.abs(levels).max()) + 1), times.size]:
        part, start = slice(begin, end), times[begin - 1] if begin else 0.0
        if end - begin >= 2:
            t, slope = times[part], np.gradient(values[part], times[part])
            if explicit_time:
                increments = np.diff(values[part]) * 0.5 * (t[1:] + t[:-1]) / times[-1]
                first = float(change[begin - 1]) if begin else 0.5 * float(slope[0]) * times[0] ** 2 / times[-1]
                change[part] = first + np.concatenate([[0.0], np.cumsum(increments)])
            else:
                advance *= last_slope / slope[0] if begin and slope[0] != 0.0 else 1.0
                clock = advance + (t**2 - start**2) / (2.0 * times[-1])
                change[part], advance, last_slope = slope * clock, float(clock[-1]), float(slope[-1])
        begin = end
    return change


def _slope(problem: LeastSquaresProblem, x: Floats, kind: str, at: Floats | None = None) -> Floats:
    """(tests, observations) derivative of the outputs to a nuisance, 0 where nothing is predicted.

    at : (tests,) its values, by default those of the fit, or zero.
    """
    if kind in problem.lengths:
        prediction = problem.prediction(x)
    else:
        known = problem.nuisance_parameters.predictor_values(x[problem.parameter_count :])
        values = known.get(kind, np.zeros((1, len(problem.histories)))) if at is None else at[None]
        prediction = problem.predicted_by(problem.predictor, x, given={kind: values})
    slope = problem.observations.select_outputs(prediction.nuisance_jacobian[kind], prediction)[0]
    return np.where(np.isfinite(slope), slope, 0.0)


def _motion_slope(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(tests, observations) derivative of the outputs to the relative change of what is imposed."""

    def outputs(change: float) -> Floats:
        histories = [_moved(history, change) for history in problem.histories]
        prediction = problem.predicted_by(problem.predictor, x, histories)
        return np.asarray(problem.observations.select_outputs(prediction.values, prediction)[0])

    with np.errstate(invalid="ignore"):  # of tests that end before
        slope = (outputs(MOTION_STEP) - outputs(-MOTION_STEP)) / (2.0 * MOTION_STEP)
    return np.where(np.isfinite(slope), slope, 0.0)


def _moved(history: History, change: float) -> History:
    """The history with all that is imposed larger by that share."""
    if history.loading.quantity not in IMPOSED:
        return history
    program = history.loading.program()
    loading = RecordedLoading(Program(program.times, program.values * (1.0 + change)), history.loading.quantity)
    return replace(history, loading=loading)


def log_rate_per_kelvin(problem: LeastSquaresProblem, x: Floats, stress: ArrayLike, T: ArrayLike) -> Floats:
    """d ln rate / dT, (points,) 1/K, of the law; of one that knows no temperature by the usual activation energy.

    x : (unknowns,), or those of the law alone. stress, T : (points,) MPa and K.
    """
    T = np.asarray(T, float)
    if not problem.law.uses(temperature):
        return np.asarray(USUAL_ACTIVATION_ENERGY / (GAS_CONSTANT * np.maximum(T, LOWEST_USUAL_TEMPERATURE) ** 2))
    u = x[: problem.parameter_count]
    up, down = (log_rate(problem.coordinates, stress, T + step)(u) for step in (1.0, -1.0))
    return np.asarray(0.5 * (up - down))


def rate_slopes(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(tests, 2) of ln rate at the conditions of each test: d / dT, 1/K, and the stress exponent, 0 without a load.

    x : (unknowns,).
    """
    exponents = local_exponent(problem.coordinates, *problem.conditions)(x[: problem.parameter_count])
    loaded = [history.loading.quantity in LOADS for history in problem.histories]
    return np.stack([log_rate_per_kelvin(problem, x, *problem.conditions), np.where(loaded, exponents, 0.0)], axis=1)


# ---- what each does to the values ------------------------------------------------------------------------------------


def value_changes(linear: LinearisedProblem, noise_model: NoiseModel, change: Floats) -> Floats:
    """(tests, unknowns) changes of x; change : (tests, observations) of the residuals of each test."""
    solution = linear.solve(CovarianceFactor.of_residuals(linear.residuals, noise_model))
    moved = np.zeros((len(change), linear.free.size))
    moved[:, linear.free] = -np.einsum("tep,te->tp", solution.weighted_jacobian, change) @ solution.covariance
    return moved


def _log_rate_gradient(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(parameters,) derivatives of ln of the rate at the reference point to u."""
    coordinates, count = problem.coordinates, problem.parameter_count
    return gradient(log_rate(coordinates, coordinates.reference.stress), x[:count], np.ones(count))


def _with_misfit_of(change: Floats, problem: LeastSquaresProblem, noise_model: NoiseModel) -> NoiseModel:
    """The noise model with the autocorrelated misfit that a change of the shape of curves would be estimated as.

    change : (tests, observations) -, of the residuals; of each output its root mean square counts.
    """
    observations = problem.observations
    for position, name in enumerate(observations.outputs):
        mask = observations.present & (observations.output_index == position)
        if name in noise_model.outputs and mask.any():
            size = float(np.hypot(noise_model[name].drift, np.sqrt(np.mean(change[mask] ** 2))))
            noise_model = noise_model.with_output(name, drift=size, correlation_length=1.0)
    return noise_model


RATE = "rate of a test"
"""What is included beside lengths and instruments, each test by itself: ln rate by temperatures and loads, where no
nuisance lets rates scatter."""


def errors_of_tests(
    problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel, among: int = 1
) -> tuple[Perturbation, ...]:
    """Errors at the optimum, of which those count that the settings include; none where they include none.

    Those of lengths and instruments, then RATE. among : how many tests there are, with others than these.
    """
    included, tests = problem.settings.included_errors, max(among, len(problem.histories))
    if not included:
        return ()
    kinds = {n.kind for n in problem.settings.nuisances}
    own = list[Perturbation]()
    if tests > 1 and "rate" not in kinds:
        kelvin = 0.0 if "temperature" in kinds else included.get("temperature", 0.0)
        sizes = np.array([kelvin, included.get("load", 0.0)])
        rates = np.linalg.norm(rate_slopes(problem, linear.x) * sizes, axis=1)
        change = rates[:, None] * linear.residuals.log_rate_sensitivity
        made = Perturbation(RATE, 1.0, "", residual_change=change, tests=tests, included=True)
        own += [made] if change.any() else []
    return (*of_lengths_and_instruments(problem, linear, among), *own)


def with_expected_scatter(
    problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel
) -> NoiseModel:
    """The noise model with the root of the expected square of the scatter of ln rate between tests.

    Few tests hardly show how they scatter, as by temperatures and loads that are off in each by itself; see
    uncertainty.rate_scatter for the prior. As it is where no nuisance has it or that states it, and of one test, whose
    error is the common one.
    """
    scatter = replace(rate_scatter(problem, linear, noise_model), members={})
    if len(problem.histories) == 1 or scatter.known is not None:
        return noise_model
    return replace(noise_model, rate=max(noise_model.rate, scatter.posterior.mean_square("test") ** 0.5))


def covariances_of_values_with_errors(
    linear: LinearisedProblem, noise_model: NoiseModel, errors: Sequence[Perturbation], working_noise: NoiseModel | None
) -> tuple[Floats, Floats, Floats]:
    """(unknowns, unknowns) covariance of x by the tests alone, what errors add to it, and what common ones add.

    noise_model : with the expected scatter of rates. working_noise : under which values were found that are not by
    likelihood.
    """

    def under(some: Sequence[Perturbation], noise: NoiseModel = noise_model) -> Floats:
        return covariance_of_values(linear.with_errors(some), noise, working_noise)

    alone, with_common, with_all = (under(some) for some in ((), [e for e in errors if e.common], errors))
    of_all, of_common = (positive_semidefinite(c - alone, np.sqrt(np.diag(c))) for c in (with_all, with_common))
    of_readings = replace(noise_model, rate=0.0)
    freedom = effective_sample_size(linear.residuals, of_readings) - linear.precision.size
    return known_to_freedom(alone, under((), of_readings), freedom), of_all, of_common
