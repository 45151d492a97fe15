"""Discriminating experiments: the chi-square by which one law is expected to be worse if the other one is true.

Let law a be true at its fitted values, without noise. Law b is refitted to what a predicts of the tests that were made
and of one more; the chi-square that then remains, under the covariance of the fit of a, is what b is expected to be
worse by. With g the whitened difference of the predictions on all these tests, priors of nuisance parameters below, and
J its derivatives to the values of b, a Gauss-Newton step leaves min |g + J d|^2; the best candidates are refitted in
full. Predictions are those of the reduced-order model where the predictor has one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats, single_threaded_blas
from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import CandidateTest
from creepkit.experiments.candidate_tests import candidate_tests as variations
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.composite_predictor import compared_outputs, predict, predictor_for, reduced_order_model_of
from creepkit.inverse.identification import Identification
from creepkit.inverse.information_criteria import CREDIBLE_WEIGHT
from creepkit.inverse.iterative_estimation import starting_point
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import ObservationVector, thinned_history, usable_frames
from creepkit.inverse.problem import EvaluationCache, LeastSquaresProblem
from creepkit.inverse.reference_conditions import median_log_inverse_duration, median_log_strain_rate
from creepkit.inverse.residuals import residuals_at_measured_values
from creepkit.inverse.search.local_refinement import Tolerances
from creepkit.inverse.selection.discrimination import DISTINGUISHABLE_CHI_SQUARE
from creepkit.inverse.uncertainty.model_averaging import WeightedLaws
from creepkit.presentation import Presentable
from creepkit.records import History, Predictor

REFIT_TOLERANCES = Tolerances(max_steps=8, tolerance=1e-5)
"""Of a full refit."""


MIN_FRAMES = 5
"""A planned test with fewer frames before it ruptures is left out."""


WEAK_PRIOR = 0.03
"""Standard deviations of data per width of the bounds by which a Gauss-Newton step is held where nothing else does."""


EXTRAPOLATION_LIMIT = 2.0
"""A planned test is predicted until its leading output is so many times what was measured."""


@dataclass(frozen=True, eq=False)
class ModelDiscrimination:
    """The alternative law b against what the reference law a predicts, without noise.

    problem : of law b, the tests that were made first and the candidates behind them. measured_count : how many were
    made. alternative : the identification of law b. noise_model : that of law a, by which they are compared.
    """

    problem: LeastSquaresProblem
    measured_count: int
    candidates: tuple[CandidateTest, ...]
    alternative: Identification
    noise_model: NoiseModel

    @classmethod
    def from_identifications(
        cls, reference: Identification, alternative: Identification, candidates: Sequence[CandidateTest]
    ) -> ModelDiscrimination:
        """Law b against what law a predicts; candidates that rupture at once are left out."""
        assert reference.predictor is not None
        predictor = reduced_order_model_of(reference.predictor) or reference.predictor
        measured_histories = [_without_rupture(h) for h in reference.histories]
        measured = [thinned_history(h, reference.settings.frames) for h in measured_histories]
        base_observations = ObservationVector.from_histories(measured, predictor, measured_histories)
        planned = [_with_placeholder_outputs(d.history, predictor, base_observations) for d in candidates]
        predicted = _with_predictions(reference, predictor, [*measured, *planned], len(measured), base_observations)
        output_limits = {name: _output_limit(measured, name) for name in base_observations.outputs}
        limited = [_with_usable_frames(h, predictor, output_limits) for h in predicted[len(measured) :]]
        usable = [(d, h) for d, h in zip(candidates, limited, strict=True) if h.used.sum() >= MIN_FRAMES]
        histories = (*predicted[: len(measured)], *(h for _, h in usable))
        observations = replace(
            ObservationVector.from_histories(histories, predictor),
            transforms=base_observations.transforms,
            noise=base_observations.noise,
        )
        noise_model = NoiseModel(
            {name: reference.noise_model[name] for name in base_observations.outputs}, reference.noise_model.rate
        )
        made = histories[: len(measured)]
        nuisances = _nuisances(alternative, histories, len(measured), predictor)
        problem = LeastSquaresProblem(
            histories=histories,
            predictor=predictor,
            coordinates=alternative.coordinates,
            observations=observations,
            nuisance_parameters=nuisances,
            bounds=Bounds.from_law(
                alternative.law,
                alternative.coordinates,
                median_log_strain_rate(made, predictor),
                median_log_inverse_duration(made),
            ).with_nuisances(nuisances),
            settings=alternative.settings,
            covariance_factor=CovarianceFactor.of_residuals(residuals_at_measured_values(observations), noise_model),
        )
        return cls(problem, len(measured), tuple(d for d, _ in usable), alternative, noise_model)

    def linearised_chi_square(self, candidate_indices: Sequence[int]) -> float:
        """The chi-square left after one Gauss-Newton step, with some of the candidates."""
        problem, x = self._problem_of(candidate_indices)
        residuals, jacobian = problem.whitened(x), problem.jacobian(x)
        weak_prior = np.diag(WEAK_PRIOR / problem.bounds.width)
        step = np.linalg.lstsq(
            np.concatenate([jacobian, weak_prior]), np.concatenate([-residuals, np.zeros(x.size)]), rcond=None
        )[0]
        return float(((residuals + jacobian @ step) ** 2).sum())

    def refitted_chi_square(self, candidate_indices: Sequence[int]) -> float:
        """The chi-square left after a full refit, with some of the candidates."""
        problem, x = self._problem_of(candidate_indices)
        return 2.0 * problem.minimise(x, tolerances=REFIT_TOLERANCES).cost

    def _problem_of(self, candidate_indices: Sequence[int]) -> tuple[LeastSquaresProblem, Floats]:
        """The problem of law b with some of the candidates, and where to begin, (unknowns,)."""
        tests = [*range(self.measured_count), *(self.measured_count + k for k in candidate_indices)]
        whole, alternative = self.problem, self.alternative
        histories = [whole.histories[k] for k in tests]
        nuisances = _nuisances(alternative, histories, self.measured_count, whole.predictor)
        problem = replace(
            whole,
            histories=tuple(histories),
            observations=whole.observations.of_tests(tests),
            evaluations=EvaluationCache(),
        ).with_nuisances(nuisances)
        initial_values = {(nuisance.key, nuisance.owner): nuisance.value for nuisance in alternative.nuisances}
        x = problem.bounds.clip(starting_point(nuisances, alternative.u, initial_values))
        residuals = replace(problem.residuals(x), present=problem.observations.present)
        return problem.with_covariance(CovarianceFactor.of_residuals(residuals, self.noise_model)), x


def _without_rupture(history: History) -> History:
    """A history compared at its frames alone: when it would break is not what is asked."""
    return replace(history, rupture_time=None, unruptured=False)


def _with_placeholder_outputs(
    candidate: History, predictor: Predictor, base_observations: ObservationVector
) -> History:
    """A planned history with the outputs of those that were made, zero as yet, at their noise."""
    outputs = getattr(predictor_for(predictor, candidate), "outputs", base_observations.outputs)
    noise = {
        name: np.full(candidate.times.size, base_observations.noise[base_observations.outputs.index(name)])
        for name in outputs
        if name in base_observations.outputs
    }
    return replace(
        _without_rupture(candidate), outputs={name: 0.0 * sd for name, sd in noise.items()}, standard_deviation=noise
    )


def _with_predictions(
    fit: Identification,
    predictor: Predictor,
    histories: Sequence[History],
    measured_count: int,
    base_observations: ObservationVector,
) -> list[History]:
    """Histories with what law a predicts in the place of what was measured, at the noise of what was."""
    nuisance_values = fit.nuisance_values(histories)
    if "thickness" in nuisance_values:
        nuisance_values["thickness"] = nuisance_values["thickness"].copy()
        for k, thickness in _stated_thicknesses(histories, measured_count):
            nuisance_values["thickness"][0, k] = thickness
    theta = fit.law.to_internal(fit.values)
    prediction = predict(predictor, fit.law, theta, histories, nuisances=nuisance_values)
    predicted = []
    for k, history in enumerate(histories):
        outputs, sd = {}, {}
        for name in compared_outputs(predictor, history):
            is_measured = np.isfinite(history.outputs[name])
            outputs[name] = np.where(is_measured, prediction.of(k)[:, prediction.outputs.index(name)], np.nan)
            typical_noise = np.full(is_measured.size, base_observations.noise[base_observations.outputs.index(name)])
            sd[name] = history.standard_deviation.get(name, typical_noise)
        predicted.append(replace(history, outputs=outputs, standard_deviation=sd))
    return predicted


def _output_limit(measured: Sequence[History], name: str) -> float:
    """The largest output of a planned test that is compared, in its unit: as far again as the tests that were made."""
    used_values = [h.outputs[name][usable_frames(h, name)] for h in measured if name in h.outputs]
    values = np.concatenate([*used_values, np.zeros(1)])
    return float(values.min() + EXTRAPOLATION_LIMIT * np.ptp(values))


def _with_usable_frames(candidate: History, predictor: Predictor, output_limits: dict[str, float]) -> History:
    """A planned history with its frames before rupture and below the output limits marked used."""
    first_output, *_ = compared_outputs(predictor, candidate)
    is_finite = np.isfinite(np.stack([*candidate.outputs.values()])).all(axis=0)
    is_within_limit = np.nan_to_num(candidate.outputs[first_output]) <= output_limits[first_output]
    return replace(candidate, used=is_finite & is_within_limit & (candidate.times > 0))


def _stated_thicknesses(histories: Sequence[History], measured_count: int) -> list[tuple[int, float]]:
    """(position, mm) of the planned tests whose apex thickness is stated: it is what they are about."""
    return [
        (k, h.geometry["apex_thickness"])
        for k, h in enumerate(histories)
        if k >= measured_count and "apex_thickness" in h.geometry
    ]


def _nuisances(
    fit: Identification, histories: Sequence[History], measured_count: int, predictor: Predictor
) -> NuisanceParameters:
    """The nuisance parameters of the tests, with prior standard deviations that the fit found."""
    nuisances = NuisanceParameters.from_histories(fit.settings.nuisances, histories, predictor)
    if not nuisances.mean.size:
        return nuisances
    spread, mean = {nuisance.kind: nuisance.prior_sd for nuisance in fit.nuisances}, nuisances.mean.copy()
    for k, thickness in _stated_thicknesses(histories, measured_count) if "thickness" in nuisances.test_index else ():
        position = int(nuisances.test_index["thickness"][k])
        if position >= 0 and nuisances.nuisances[position].scope == "test":
            mean[position] = thickness
    return replace(nuisances, mean=mean, sd=np.array([spread[n.kind] for n in nuisances.nuisances], float))


FULL_REFITS = 3
"""Candidates that are refitted in full."""


@dataclass(frozen=True)
class DiscriminatingExperiment:
    """One further test: what it is, and the chi-square by which the wrong law is expected to be worse with it."""

    description: str
    history: History
    chi_square: float


@dataclass(frozen=True)
class DiscriminationDesign(Presentable):
    """Further tests, the most informative first, if law `true` holds and law `other` is fitted.

    current_chi_square : expected by the tests that were made. excluded : candidates that rupture at once.
    """

    reference_law: str
    alternative_law: str
    current_chi_square: float
    experiments: tuple[DiscriminatingExperiment, ...]
    excluded: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The test of largest expected chi-square, or that none is large enough."""
        premise = (
            f"if {self.reference_law} holds, {self.alternative_law} is worse by an expected chi-square of "
            f"{self.current_chi_square:.2g} in these tests"
        )
        if not self.experiments or self.experiments[0].chi_square < DISTINGUISHABLE_CHI_SQUARE:
            return (
                f"{premise}; none of the {len(self.experiments)} further tests considered brings it above "
                f"{DISTINGUISHABLE_CHI_SQUARE:.2g}"
            )
        best = self.experiments[0]
        return f"{premise}; one more test, {best.description}, would bring it to {best.chi_square:.2g}"


def discriminating_experiments(
    reference: Identification,
    alternative: Identification,
    candidates_or_histories: Sequence[CandidateTest | History] | None = None,
) -> DiscriminationDesign:
    """Further tests by how well they would separate the alternative law from the reference law, if that is true.

    candidates_or_histories : planned tests (without outputs); by default variations of the tests that were made.
    """
    if reference.predictor is None or not reference.histories:
        raise FitError(
            "this identification was loaded from a file: attach its histories and specimen with fit.with_histories()"
        )
    if reference.provenance.get("data") != alternative.provenance.get("data"):
        raise FitError(
            "the two identifications were made from different histories, frames or nuisances; make them alike"
        )
    candidates = _candidates_given(reference, candidates_or_histories)
    with single_threaded_blas():
        discrimination = ModelDiscrimination.from_identifications(reference, alternative, candidates)
        current_chi_square = discrimination.refitted_chi_square([])
        experiments = _expected_chi_squares(discrimination, current_chi_square)
    excluded = tuple(d.description for d in candidates if d not in discrimination.candidates)
    return DiscriminationDesign(reference.law.name, alternative.law.name, current_chi_square, experiments, excluded)


def further_tests(ranking: WeightedLaws) -> tuple[DiscriminationDesign, ...]:
    """What would separate the best law of a ranking, if it is true, from each other one of more than 5 % of weight."""
    best, *others = ranking.laws
    return tuple(discriminating_experiments(best.fit, other.fit) for other in others if other.weight > CREDIBLE_WEIGHT)


def _candidates_given(
    fit: Identification, candidates_or_histories: Sequence[CandidateTest | History] | None
) -> tuple[CandidateTest, ...]:
    """The candidates given, with names of their own; else variations of the tests that were made."""
    if candidates_or_histories is None:
        return variations(fit.histories, float(fit.local_exponent(fit.reference.stress, warn=False)[0]), fit.predictor)
    candidates = (
        candidate if isinstance(candidate, CandidateTest) else CandidateTest(candidate.name, candidate)
        for candidate in candidates_or_histories
    )
    return tuple(CandidateTest(d.description, replace(d.history, name=f"plan: {d.description}")) for d in candidates)


def _expected_chi_squares(
    discrimination: ModelDiscrimination, current_chi_square: float
) -> tuple[DiscriminatingExperiment, ...]:
    """Every candidate with its chi-square, by one step or, of the most promising, in full; at least the current one."""
    chi_squares = [discrimination.linearised_chi_square([k]) for k in range(len(discrimination.candidates))]
    for k in np.argsort(chi_squares)[::-1][:FULL_REFITS]:
        chi_squares[k] = discrimination.refitted_chi_square([int(k)])
    experiments = [
        DiscriminatingExperiment(candidate.description, candidate.history, max(value, current_chi_square))
        for candidate, value in zip(discrimination.candidates, chi_squares, strict=True)
    ]
    return tuple(sorted(experiments, key=lambda test: -test.chi_square))
