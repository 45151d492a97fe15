"""What identified laws expect of planned tests: whitened predictions with their derivatives to all that tests share.

With q the unknowns of a law (see known_laws), the outcome of a planned test is y = m + K (q - q_0) + e, all over the
Cholesky factor of its covariance: white noise, drift and discrepancy of the noise model, and as random effects its own
offset, its own rate and its own nuisance parameters, with their priors. Afterwards the information is A + K'K.

A ranking compares laws under one covariance, that of the law which explains the tests best. What is expected if a law
is true is therefore whitened by what that law predicts: noise depends on it where outputs are compared by logarithms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.experiments.known_laws import KnownLaw, compact_effects, nuisances_of_planned, values_of_nuisances
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.residuals import candidate_residuals_and_jacobian, residuals_of_prediction
from creepkit.records import History, Status

CHUNK = 8
"""Planned tests that are predicted at once: between two chunks progress is reported, and a stop takes effect."""


@dataclass(frozen=True, eq=False)
class PlannedOutcome:
    """What one law expects of one planned test, whitened.

    mean : (data,) m; jacobian : (data, q) K. ruptures : whether it would rupture before its end. growth : of the
    leading output over the test, in noises of a frame; largest : of that output, in its unit.
    """

    mean: Floats
    jacobian: Floats
    ruptures: bool
    growth: float
    largest: float


@dataclass(frozen=True, eq=False)
class _Chunk:
    """What one law predicts of some planned tests.

    residuals : with zero in the place of what is measured. leading : (tests,) arrays of the leading output, in its
    unit. ruptures : (tests,). own_effects : (tests, observations, effects) -, of one standard deviation of the nuisance
    parameters that each test has for itself, or None. kept : columns of the derivatives that are of q.
    """

    residuals: Residuals
    leading: list[Floats]
    ruptures: Bools
    own_effects: Floats | None
    kept: tuple[int, ...]


@dataclass(eq=False)
class PlannedOutcomes:
    """What some laws expect of planned tests, under the covariance of each that may be true; each test is done once.

    candidates : how many of the laws, the first, may be true; the rest are what a verdict has to exclude. None for all.
    """

    laws: Sequence[KnownLaw]
    progress: Callable[[str, int, int], None] | None = None
    candidates: int | None = None
    _known: dict[object, list[list[PlannedOutcome]]] = field(default_factory=dict)
    _drawn: dict[object, tuple[list[Floats], list[Floats], Bools]] = field(default_factory=dict)
    _covariances: dict[object, list[CovarianceFactor]] = field(default_factory=dict)

    def add(self, histories: Sequence[History]) -> None:
        """Predict the planned tests that are not known yet."""
        fresh = list({test_key(h): h for h in histories if test_key(h) not in self._known}.values())
        for start in range(0, len(fresh), CHUNK):
            chunk = [replace(h, name=f"plan {k}") for k, h in enumerate(fresh[start : start + CHUNK])]
            by_law = self._outcomes(chunk)
            for k, history in enumerate(fresh[start : start + CHUNK]):
                self._known[test_key(history)] = [[under[k] for under in outcomes] for outcomes in by_law]
            if self.progress is not None:
                self.progress("planned tests", min(start + CHUNK, len(fresh)), len(fresh))

    def of(self, histories: Sequence[History], law: int, under: int | None = None) -> tuple[Floats, Floats]:
        """Whitened means (data,) and derivatives (data, q) of some tests that were added, end to end.

        under : the law whose covariance it is, by default its own.
        """
        outcomes = [self._known[test_key(h)][law][law if under is None else under] for h in histories]
        return np.concatenate([o.mean for o in outcomes]), np.concatenate([o.jacobian for o in outcomes])

    def outcome(self, history: History, law: int) -> PlannedOutcome:
        """That of one test that was added."""
        return self._known[test_key(history)][law][law]

    def is_known(self, history: History) -> bool:
        """Whether a test was added."""
        return test_key(history) in self._known

    def drawn(
        self, history: History, law: int, deviations: Floats, under: int | None = None
    ) -> tuple[Floats, Floats, Bools]:
        """Whitened predictions at draws of a law's posterior, their derivatives, and which draws rupture.

        deviations : (draws, q) from the estimates; s is taken as linear. under : as in `of`. Returns (draws, data),
        (draws, data, q) and (draws,).
        """
        key = test_key(history), law, deviations.tobytes()
        if key not in self._drawn:
            self._drawn[key] = self._evaluated_at(replace(history, name="plan 0"), law, deviations)
        means, jacobians, ruptures = self._drawn[key]
        covariance = law if under is None else under
        return means[covariance], jacobians[covariance], ruptures

    # ---- predictions -------------------------------------------------------------------------------------------------

    def _outcomes(self, chunk: Sequence[History]) -> list[list[list[PlannedOutcome]]]:
        """For each law, under the covariance of each law, the outcomes of each test of a chunk."""
        observations = self._observations(chunk)
        predicted = [_predicted(law, chunk, observations) for law in self.laws]
        factors = [self._covariance(one, observations) for one in predicted[: self.candidates]]
        if len(chunk) == 1:
            self._covariances[test_key(chunk[0])] = factors
        return [[self._whitened(one, factor, observations) for factor in factors] for one in predicted]

    def _whitened(
        self, predicted: _Chunk, factor: CovarianceFactor, observations: ObservationVector
    ) -> list[PlannedOutcome]:
        """The outcomes of one law for each test of a chunk."""
        residuals = predicted.residuals
        assert residuals.jacobian is not None
        transformed = np.where(observations.present, residuals.values + observations.transformed_values, 0.0)
        mean, jacobian = factor.whiten(transformed), factor.whiten(residuals.jacobian[..., predicted.kept])
        outcomes = []
        for k, leading in enumerate(predicted.leading):
            mask = observations.present[k]
            noise = float(observations.noise[observations.output_index[k, observations.leading_output[k]][0]])
            growth, largest = (float(np.ptp(leading)), float(leading.max())) if leading.size else (0.0, 0.0)
            outcomes.append(
                PlannedOutcome(
                    mean[k][mask], jacobian[k][mask], bool(predicted.ruptures[k]), growth / max(noise, 1e-300), largest
                )
            )
        return outcomes

    def _observations(self, chunk: Sequence[History]) -> ObservationVector:
        """The observations of planned tests, with the transforms and the noise of those that were made."""
        base, predictor = self.laws[0].measured.observations, self.laws[0].measured.predictor
        planned = []
        for history in chunk:
            names = predictor.for_history(history).outputs_of_test(history) or base.outputs
            noise = {n: float(base.noise[base.outputs.index(n)]) for n in names if n in base.outputs}
            sd = {n: np.full(history.times.size, max(v, 1e-300)) for n, v in noise.items()}
            zero = {n: np.zeros(history.times.size) for n in noise}
            planned.append(history.replace(outputs=zero, standard_deviation=sd, rupture_time=None, unruptured=False))
        observations = ObservationVector.from_histories(planned, predictor).with_noise_of(base)
        return replace(observations, relative_noise=np.ones_like(observations.relative_noise))

    def _covariance(self, predicted: _Chunk, observations: ObservationVector) -> CovarianceFactor:
        """Noise, offset and rate of each planned test, and its own nuisance parameters, as a law predicts it."""
        known = self.laws[0].noise_model  # the same for all; the derivatives are those of each law
        outputs = {name: known[name] for name in observations.outputs}
        noise_model = NoiseModel(outputs, known.rate, known.discrepancy, known.discrepancy_length)
        residuals = replace(
            predicted.residuals,
            present=observations.present,
            discrepancy_unit=np.where(observations.present, observations.discrepancy_unit, 0.0),
            random_effect_sensitivities=predicted.own_effects,
        )
        return CovarianceFactor.of_residuals(residuals, noise_model)

    def _evaluated_at(self, history: History, law: int, deviations: Floats) -> tuple[list[Floats], list[Floats], Bools]:
        """Predictions at draws whitened by the covariance of each law, their derivatives, and which draws rupture."""
        known, observations = self.laws[law], self._observations([history])
        if test_key(history) not in self._covariances:
            outcomes = self._outcomes([history])
            self._known.setdefault(test_key(history), [[under[0] for under in by_law] for by_law in outcomes])
        mask, nuisances = observations.present[0], nuisances_of_planned(known, [history])
        u = known.fit.u + deviations[:, : known.size]
        prediction = known.measured.predictor.predict(
            known.fit.law,
            known.fit.coordinates.theta(u),
            [history],
            nuisances=nuisances.predictor_values(values_of_nuisances(nuisances, known)),
            sensitivities=True,
        )
        values, internal = candidate_residuals_and_jacobian(observations, prediction)
        of_u = np.einsum("cep,cpq->ecq", internal[:, 0], known.fit.coordinates.jacobian(u))
        derivatives = of_u.reshape(1, mask.size, -1)
        transformed = np.where(observations.present, values + observations.transformed_values, 0.0)
        columns = np.moveaxis(transformed, 0, -1)
        means, jacobians = [], []
        for under, factor in enumerate(self._covariances[test_key(history)]):
            at_estimates = self._known[test_key(history)][law][under].jacobian
            jacobian = np.tile(at_estimates, (len(u), 1, 1))
            whitened = factor.whiten(derivatives)[0][mask].reshape(-1, len(u), known.size)
            jacobian[:, :, : known.size] = np.moveaxis(whitened, 1, 0)
            of_shared = deviations[:, known.size :] @ at_estimates[:, known.size :].T
            means.append(np.asarray(factor.whiten(columns)[0][mask].T + of_shared))
            jacobians.append(jacobian)
        return means, jacobians, np.isin(prediction.status[:, 0], ENDED)


ENDED = (int(Status.RUPTURED), int(Status.NOT_CONVERGED))
"""Status of tests that a prediction does not follow to their end."""


def test_key(history: History) -> tuple[object, ...]:
    """What a planned test is, whatever it is called."""
    temperature = history.temperature
    return (
        history.specimen,
        history.loading,
        temperature if isinstance(temperature, float) else (temperature.times.tobytes(), temperature.values.tobytes()),
        tuple(sorted(history.geometry.items())),
        history.times.tobytes(),
    )


def _predicted(law: KnownLaw, planned: Sequence[History], observations: ObservationVector) -> _Chunk:
    """What a law predicts of planned tests at its estimates, with derivatives."""
    nuisances, problem, coordinates = nuisances_of_planned(law, planned), law.measured, law.fit.coordinates
    e, u, size = values_of_nuisances(nuisances, law), law.fit.u, law.size
    prediction = problem.predictor.predict(
        law.fit.law, coordinates.theta(u)[None], planned, nuisances=nuisances.predictor_values(e), sensitivities=True
    )
    coefficients = coordinates.coefficients if coordinates.every_rate_has_coefficient else None
    residuals = residuals_of_prediction(observations, prediction, nuisances, coefficients)
    assert residuals.jacobian is not None
    internal, of_nuisances = np.split(residuals.jacobian, [size], axis=-1)
    jacobian = np.concatenate([internal @ coordinates.jacobian(u), of_nuisances], axis=-1)
    owners = [(n.key, owner) for n, owner in zip(nuisances.nuisances, nuisances.owners, strict=True)]
    made = problem.nuisance_parameters
    made_owners = [(n.key, owner) for n, owner in zip(made.nuisances, made.owners, strict=True)]
    kept = (*range(size), *(size + owners.index(made_owners[k - size]) for k in law.shared))
    names = {h.name for h in planned}
    own = [k for k, n in enumerate(nuisances.nuisances) if n.scope == "test" and nuisances.owners[k] in names]
    sd = np.minimum(nuisances.sd, (nuisances.high - nuisances.low) / np.sqrt(12.0))
    effects = compact_effects(jacobian[..., [size + k for k in own]] * sd[own]) if own else None
    leading = []
    for k, history in enumerate(planned):
        outputs = problem.predictor.for_history(history).outputs_of_test(history) or prediction.outputs
        values = prediction.of(k)[:, prediction.outputs.index(outputs[0])]  # the first grows with creep
        leading.append(values[np.isfinite(values)])
    return _Chunk(
        residuals=replace(residuals, jacobian=jacobian),
        leading=leading,
        ruptures=np.isin(prediction.status[0], ENDED),
        own_effects=effects,
        kept=kept,
    )
