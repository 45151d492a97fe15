"""Identification: the law of a set of tests, its values with intervals, the noise model, and the goodness of fit."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, FitWarning
from creepkit.inverse.adequacy import Adequacy
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.defect_correction import NumericalError, correct_defect
from creepkit.inverse.explanation import LeftOut
from creepkit.inverse.extrapolation import RANGE_TOLERANCE, UNSEEN_RUPTURE, warn_of_extrapolation
from creepkit.inverse.goodness_of_fit import OutputErrors, OutputFit, TestFit
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import NuisanceEstimate, Perturbation, has_nuisance, owner_of, prior_mean
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.predictor_documents import PredictorDocument, missing_predictor
from creepkit.inverse.problem import NOTEWORTHY_FACTOR, LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint, simulated_stresses
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.single_values import LawAtTests, constant_stress_tests
from creepkit.inverse.uncertainty.laplace_approximation import (
    NORMAL_QUANTILE,
    Estimate,
    delta_method,
    parameter_estimates,
    positive_semidefinite,
)
from creepkit.inverse.uncertainty.quantities import (
    CoordinateFunction,
    Interval,
    PointQuantity,
    RateStatements,
    activation_energy,
    log_rate,
)
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.language import CreepLaw
from creepkit.records import History, LawWithValues, Nuisance, Prediction, Predictor
from creepkit.records.presentable import Plotted, Presentable, Tabulated
from creepkit.registry.arguments import resolve_predictors

if TYPE_CHECKING:
    from creepkit.inverse.sparsity.result import Sparsity
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit, LawMisfits
    from creepkit.inverse.variance_components import LinearisedProblem


__all__ = ["Identification", "IdentificationSettings", "NuisanceEstimate", "OutputFit", "TestFit"]


@dataclass(frozen=True, eq=False)
class Identification(RateStatements, Presentable, Plotted, Tabulated):
    """The result of identify().

    estimates : one Estimate for each parameter, in the order of the law.
    u : (parameters,) conditioned coordinates at the optimum; covariance : (parameters, parameters) their posterior
        covariance (see inverse.coordinates). error_covariance : (parameters, parameters) the part of it by errors
        that tests usually have and nobody modelled (settings.usual_errors), scaled so that one quantile fits both.
    noise_model : standard deviations of the sources of scatter, estimated from the data.
    rms : root mean square of ln((predicted + offset) / measured) over the fitted strains of all tests; each test has
        its own offset (loading strain), none its own rate. NaN without strains.
    errors : {output: OutputErrors} over all used frames of all tests, whatever was minimised.
    nuisances : estimates of explicit nuisances.
    adequacy : whether the law explains the tests to their noise. numerical_error : of the predictor at the optimum,
        which was corrected; None where there is no more exact one. unmodelled : what nobody modelled, and whether
        intervals include it.
    left_out : each test beside all others, of four tests or more.
    rate_scatter : what the tests say of the scatter of rates between tests, heats and laboratories, and how it enters
        the covariance: what forecasts need.
    samples : (samples, parameters) conditioned coordinates drawn from the posterior, where some value lies at its bound
        or is not determined (see uncertainty.importance_sampling); None elsewhere.
    ranges : {"stress", "temperature", "strain", "time": (low, high)} of the fitted frames; MPa, K, -, s.
    log_likelihood : of the fitted frames as if they were independent (working noise), with explicit nuisances
        integrated out; of identifications by likelihood the restricted one, but for a constant of the law.
    effective_frames : number of independent frames (about one a test when tests differ from one another).
    freedom : the median degrees of freedom of the parameters, those of samples; `covariance` is as large
        as these ask for, so that 1.96 standard deviations are a 95 % interval.
    linearised : the problem made linear at the optimum, of identifications
        by likelihood; problem : what was minimised, under the covariance that was found (none of them is saved).
    sparsity : how a penalty reduced the sum that this law was part of, if one did.
    predictor_documents : {specimen: document} of the predictor, of identifications that come from a file.
    """

    law: CreepLaw
    estimates: tuple[Estimate, ...]
    u: Floats
    covariance: Floats
    reference: ReferencePoint
    noise_model: NoiseModel
    rms: float
    log_likelihood: float
    effective_frames: float
    freedom: float
    tests: tuple[TestFit, ...]
    ranges: Mapping[str, tuple[float, float]]
    settings: IdentificationSettings
    provenance: Mapping[str, Any]
    errors: Mapping[str, OutputErrors] = field(default_factory=dict)
    error_covariance: Floats | None = None
    nuisances: tuple[NuisanceEstimate, ...] = ()
    adequacy: Adequacy | None = None
    numerical_error: NumericalError | None = None
    unmodelled: tuple[Perturbation, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    rate_scatter: RateScatter | None = None
    samples: Floats | None = None
    converged: bool = True
    notes: tuple[str, ...] = ()
    histories: tuple[History, ...] = ()
    predictor: Predictor | None = None
    linearised: LinearisedProblem | None = field(default=None, repr=False)
    sparsity: Sparsity | None = field(default=None, repr=False)
    problem: LeastSquaresProblem | None = field(default=None, repr=False)
    predictor_documents: Mapping[str, PredictorDocument] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {value:.4g}" for name, value in self.values.items())
        return f"<Identification of {self.law.name} from {len(self.tests)} tests: {values}>"

    @property
    def prediction_error(self) -> float:
        """Of ln strain: root of the mean squares of what curves leave at rates of their own, and of rates left out.

        NaN of fewer than four tests, or without strains.
        """
        if not self.left_out:
            return np.nan
        own, rates = np.log([m.rate_factor for m in self.tests]), [one.log_factor for one in self.left_out]
        shape = max(self.rms**2 - float(np.mean(own**2)), 0.0)
        return float(np.sqrt(shape + np.mean(np.square(rates))))

    def to_arviz(self, *, draws: int = 1000, seed: int = 0) -> Any:
        """Draws from the posterior as an xarray Dataset, which arviz takes: one chain, with units of the parameters."""
        return self.sample(draws=draws, seed=seed).to_arviz()

    @property
    def headline(self) -> str:
        """Whether to use the law, for what and within how much, then whether it could be the true one: one sentence."""
        from creepkit.reports.description import headline

        return headline(self)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What limits the trust in it, a sentence each: its notes, and what its numbers say."""
        from creepkit.reports.verdicts import remarks

        return remarks(self)

    @property
    def values(self) -> dict[str, float]:
        """{parameter: value} in the author's units."""
        return {e.name: e.value for e in self.estimates}

    @property
    def stated_laws(self) -> tuple[CreepLaw, ...]:
        """The law."""
        return (self.law,)

    @property
    def valued(self) -> LawWithValues:
        """The law with its numbers, intervals and range of validity: what every exporter takes."""
        return LawWithValues(self.law, self.values, tuple(self.comments()), ranges=self.ranges)

    def comments(self, ranking: Any = None) -> list[str]:
        """What an exported law says of itself, a line each; ranking : that it is the best of, where there was one."""
        from creepkit.reports.identification import identification_comments

        return identification_comments(self, ranking)

    @cached_property
    def simulated_stresses(self) -> tuple[Floats, ...]:
        """Of each test the stresses (stresses,) MPa that it goes through by the law."""
        return tuple(simulated_stresses(self.law, self.values, h, self.predictor) for h in self.histories)

    @property
    def tested_point(self) -> ReferencePoint:
        """Where rates and exponents are stated: the reference point, its stress amid those that the tests saw."""
        low, high = self.ranges["stress"]
        if low <= self.reference.stress <= high:
            return self.reference
        return replace(self.reference, stress=float(np.sqrt(low * high)))

    @cached_property
    def coordinates(self) -> Coordinates:
        """The map between conditioned coordinates and parameters."""
        return Coordinates(self.law, self.reference)

    @property
    def x(self) -> Floats:
        """(unknowns,) the unknowns at the optimum: conditioned coordinates u, then explicit nuisances."""
        return np.concatenate([self.u, [n.value for n in self.nuisances]])

    @cached_property
    def least_squares_problem(self) -> LeastSquaresProblem:
        """The problem that was solved, under the covariance found; built anew for an identification from a file."""
        if self.problem is not None:
            return self.problem
        if not self.histories:
            raise FitError("this identification was loaded from a file: attach its histories with fit.with_histories()")
        problem = LeastSquaresProblem.from_histories(
            self.law, self.histories, self._predictor_or(None), self.settings, self.reference
        )
        nuisances = problem.nuisance_parameters
        if self.nuisances:
            prior_sd = np.array([n.prior_sd for n in self.nuisances], float)
            problem = problem.with_nuisances(replace(nuisances, sd=prior_sd))
        if self.numerical_error is not None:
            problem, _ = correct_defect(problem, self.x)
        log_factors = np.log([(one.rate_factor, one.life_factor) for one in self.tests]).T
        if self.settings.weights == "likelihood" and np.abs(log_factors).max() > NOTEWORTHY_FACTOR:
            problem = problem.about_rates(self.x, log_factors)
        problem = problem.about_stopped_tests(self.x, self.noise_model)
        return problem.with_covariance(CovarianceFactor.of_residuals(problem.residuals(self.x), self.noise_model))

    @property
    def linear_problem(self) -> LinearisedProblem:
        """The problem made linear at the values; of an identification from a file predicted again."""
        if self.linearised is not None:
            return self.linearised
        return self.least_squares_problem.linearised(self.x)

    @property
    def scatter_of_rates(self) -> RateScatter:
        """The scatter of rates between tests; FitError for an identification that does not have it."""
        if self.rate_scatter is None:
            raise FitError(
                f"this identification of law '{self.law.name}' says nothing of the scatter between tests, without "
                "which a prediction has no interval; identify again"
            )
        return self.rate_scatter

    def interval_at(self, quantity: PointQuantity, point: Mapping[str, ArrayLike | None]) -> Interval:
        """Value and 95 % interval of a quantity, of ln rate with what the law misses there; point : {name: (...,)}."""
        function = quantity(self.coordinates, **point)
        value, low, high = self.interval_of(function)
        if quantity is not log_rate:
            return value, low, high
        T = self.reference.temperature if point["temperature"] is None else point["temperature"]
        more = self.misfit_half_widths(function, np.asarray(point["stress"], float), np.asarray(T, float))
        return value, value - np.hypot(value - low, more), value + np.hypot(high - value, more)

    @cached_property
    def misfits(self) -> LawMisfits:
        """What the law misses at any stress and temperature, by what it misses of the rates of its tests."""
        from creepkit.inverse.uncertainty.law_misfit import LawMisfits

        return LawMisfits(self.coordinates, self.u, self.scatter_of_rates)

    def misfit_at(self, stress: float, temperature: float) -> LawMisfit | None:
        """What intervals at MPa and K hold of what the law misses: outside the tests, or where they contradict it."""
        inside = all(
            low * (1.0 - RANGE_TOLERANCE) <= value <= high * (1.0 + RANGE_TOLERANCE)
            for value, (low, high) in ((stress, self.ranges["stress"]), (temperature, self.ranges["temperature"]))
        )
        if self.rate_scatter is None or (inside and (self.adequacy is None or not self.adequacy.rejects)):
            return None
        return self.misfits.at(stress, temperature)

    def misfit_half_widths(self, function: CoordinateFunction, stress: Floats, temperature: Floats) -> Floats:
        """(...,) what is to be added in quadrature to the half widths of ln rate by what the law misses; or 0.

        function : ln rate as a function of the coordinates. stress, temperature : MPa and K, that broadcast to (...,).
        """
        stresses, temperatures = np.broadcast_arrays(stress, temperature)
        found = [self.misfit_at(float(s), float(T)) for s, T in zip(stresses.flat, temperatures.flat, strict=True)]
        if not any(found):
            return np.zeros(())
        value, _, high = self.by_tests_alone.interval_of(function)
        total, own = (
            np.reshape([0.0 if one is None else float(getattr(one, name)) for one in found], stresses.shape)
            for name in ("total", "own")
        )
        return np.sqrt(np.clip((NORMAL_QUANTILE * total) ** 2 - (high - value) ** 2, 0.0, (NORMAL_QUANTILE * own) ** 2))

    def activation_energy(self) -> tuple[float, float, float]:
        """Activation energy -R d ln rate / d(1/T), J/mol, amid the tests with its 95 % interval."""
        r = self.tested_point
        value, low, high = self.interval_of(activation_energy(self.coordinates, r.stress, r.temperature))
        return float(value), float(low), float(high)

    def interval_of(self, function: CoordinateFunction) -> tuple[Floats, Floats, Floats]:
        """Value and 95 % interval, (...,) each, of a function of the coordinates: u (..., parameters) to (...,).

        By the delta method; from samples of the posterior where a value lies at its bound or is not determined.
        """
        if self.samples is not None:
            value, draws = function(self.u), function(self.samples)
            low, high = np.quantile(draws, (0.025, 0.975), axis=0)
            below, above = np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)
            errors = NORMAL_QUANTILE * self.error_sd(function)
            return value, value - np.hypot(below, errors), value + np.hypot(above, errors)
        value, sd = delta_method(function, self.u, self.covariance)
        return value, value - NORMAL_QUANTILE * sd, value + NORMAL_QUANTILE * sd

    @checked
    def rupture_time(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        control: Literal["load", "stress"] = "load",
        test_scatter: bool = True,
        using: Predictor | None = None,
        warn: bool = True,
    ) -> tuple[Floats, Floats, Floats]:
        """When a bar will break, s, with its 95 % interval: (time, low, high), each of the broadcast shape.

        stress : number or (...,) MPa, nominal, held as `control` says. temperature : number or (...,) K, by default
        that of the reference point.
        test_scatter : whether the interval is that of a single test, which has its own rate, or that of the law alone.
        Infinite where nothing breaks within some thousand times the longest test. A stress or temperature outside
        `ranges` gives a FitWarning, a temperature that seems to be in Celsius a FitError, but for warn=False.
        """
        T = self.reference.temperature if temperature is None else temperature
        tests, shape = constant_stress_tests(stress, T, self.ranges["time"][1], control)
        if warn:
            warn_of_extrapolation(self.stated_laws, self.ranges, {"stress": stress, "temperature": temperature})
        time, low, high = self.rupture_times(tests, test_scatter=test_scatter, using=using)
        if warn and RUPTURE_OUTPUT not in self.noise_model.outputs:
            warnings.warn(UNSEEN_RUPTURE, FitWarning, stacklevel=3)
        return time.reshape(shape), low.reshape(shape), high.reshape(shape)

    @checked
    def rupture_times(
        self, histories: Sequence[History] | None = None, *, test_scatter: bool = True, using: Predictor | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """The same for histories (by default those that were fitted), whatever their loading: (tests,) each."""
        law = self.at_tests(self._predictor_or(using), test_scatter=test_scatter)
        return law.rupture_times(list(histories or self.histories))

    def at_tests(self, predictor: Predictor, *, test_scatter: bool = True) -> LawAtTests:
        """The law as it predicts single values of tests; test_scatter : whether the scatter of tests counts."""
        noise_model = self.noise_model if test_scatter else None
        return LawAtTests(
            self.coordinates, self.u, self.scatter_of_rates, noise_model, predictor, misfit_at=self.misfit_at
        )

    @checked
    def predict(
        self, histories: Sequence[History] | None = None, using: Predictor | None = None, *, own_nuisances: bool = True
    ) -> Prediction:
        """Predict histories (by default those that were fitted) at the identified values.

        own_nuisances : fitted tests, known by name, with their own nuisances and offsets; else, and all other
            histories, with what is known of their alloy or of all tests, or the prior means, and without offset.

        A prediction is the predictor's own: where the identification was corrected for its numerical error
        (`numerical_error`), that error is in it.
        """
        predictor = self._predictor_or(using)
        tests = list(histories or self.histories)
        prediction = predictor.predict(
            self.law,
            self.law.to_internal(self.values),
            tests,
            nuisances=self.nuisance_values(tests, own_nuisances=own_nuisances, using=predictor),
        )
        by_name = {m.name: m for m in self.tests} if own_nuisances else {}
        for k, history in enumerate(tests):
            for output_fit in by_name[history.name].outputs if history.name in by_name else ():
                prediction.values[:, k, :, prediction.outputs.index(output_fit.output)] += output_fit.offset
        return prediction

    def nuisance_values(
        self, histories: Sequence[History], *, own_nuisances: bool = True, using: Predictor | None = None
    ) -> dict[str, Floats]:
        """{key: (1, tests)} explicit nuisances of histories, as predictors take them."""
        estimates = {(n.key, n.owner): n.value for n in self.nuisances if own_nuisances or n.scope != "test"}
        using = using or self.predictor

        def of(n: Nuisance, history: History) -> float:
            if not n.applies_to(history.name) or not has_nuisance(n, history, using):
                return 0.0
            known = estimates.get((n.key, owner_of(n, history)))
            return known if known is not None else n.mean if using is None else prior_mean(n, history, using)

        values: dict[str, Floats] = {}
        for n in self.settings.nuisances:
            if n.is_simulated:  # groups of tests with a nuisance each: zero where it is another's
                values[n.key] = values.get(n.key, 0.0) + np.array([[of(n, h) for h in histories]])
        return values

    @checked
    def with_histories(
        self, histories: Sequence[History], using: Predictor | str | Mapping[str, Predictor | str] | None = None
    ) -> Identification:
        """The same with its histories (found by name) attached, as after load(), and what predicts them.

        using : by default the specimen that the file names, with its settings.
        """
        by_name = {h.name: h for h in histories}
        missing = [m.name for m in self.tests if m.name not in by_name]
        if missing:
            raise FitError(f"this identification was made from '{missing[0]}', which is not among the histories given")
        tests = tuple(by_name[m.name] for m in self.tests)
        stated = using is None and (self.predictor is not None or self.predictor_documents)
        predictor = self._predictor_or(None) if stated else CompositePredictor.of(resolve_predictors(using, tests))
        from creepkit.inverse.identification_notes import with_attached

        return with_attached(self, tests, predictor)

    def _predictor_or(self, using: Predictor | None) -> Predictor:
        """The predictor given, or the identification's own; FitError where a file does not give it."""
        predictor = self.predictor if using is None else using
        if predictor is None:
            raise FitError(missing_predictor(self.predictor_documents))
        return predictor

    def error_sd(self, function: CoordinateFunction) -> Floats:
        """(...,) standard deviation that usual errors of tests make of a function of the coordinates; 0 without them.

        Scaled as `error_covariance` is.
        """
        if self.error_covariance is None:
            return np.zeros(())
        return delta_method(function, self.u, self.error_covariance)[1]

    @cached_property
    def by_tests_alone(self) -> Identification:
        """The same with intervals that take temperatures, loads and dimensions as exactly known."""
        if self.error_covariance is None:
            return self
        covariance = positive_semidefinite(self.covariance - self.error_covariance)
        return replace(
            self,
            settings=replace(self.settings, usual_errors="none"),
            covariance=covariance,
            error_covariance=None,
            estimates=parameter_estimates(self.law, self.coordinates, self.u, covariance),
            rate_scatter=self.rate_scatter and replace(self.rate_scatter, errors=None),
        )

    def __getstate__(self) -> dict[str, Any]:
        """All but the problem, which holds compiled code and is set up again when it is needed."""
        worked_out = ("least_squares_problem", "by_tests_alone", "misfits")
        state = {name: value for name, value in self.__dict__.items() if name not in worked_out}
        return {**state, "problem": None}

    def forecast(self, tests: History | Sequence[History], *, level: float = 0.95, **options: Any) -> Any:
        """What tests will show, measured or planned: a Forecast of curves with bands, times and scores.

        options : targets, tolerances, using, draws, progress, as creepkit.forecast() takes them.
        """
        from creepkit.forecasts.forecast import forecast

        return forecast(self, tests, level=level, **options)

    def sample(self, *, draws: int = 1000, seed: int = 0, using: Predictor | None = None) -> Any:
        """PosteriorSamples by population Monte Carlo; `using` may be a surrogate."""
        from creepkit.inverse.uncertainty.importance_sampling import sample_posterior

        return sample_posterior(self, draws=draws, seed=seed, using=using)

    def correlation(self, coordinates: Literal["author", "conditioned"] = "author") -> Any:
        """The Correlation of the estimates, of the author's parameters or of the conditioned coordinates."""
        from creepkit.inverse.uncertainty.correlation import correlation

        return correlation(self, coordinates)

    def undetermined(self) -> tuple[str, ...]:
        """What these tests do not determine, and which combination they do, one sentence each."""
        from creepkit.inverse.uncertainty.correlation import undetermined

        return undetermined(self)

    def save(self, path: str | Path) -> Path:
        """Write the identification as JSON (to a temporary name, then renamed)."""
        from creepkit.inverse.identification_document import write_identification

        return write_identification(self, Path(path))

    drawn_by = "identification_plot.identification_figure", "identification_plot.draw_identification"

    shown_by = "answer.answer_text"
    detailed_by = "identification.identification_text"
