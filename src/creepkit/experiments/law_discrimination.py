"""Expected discrimination of laws: chi-squares in every direction, and the probability of a right verdict.

Let law a be true with its weight, at a draw of its posterior, and y be the whitened outcome of a planned test with its
noise. To first order law b, refitted to the tests that were made and to this one, leaves

    Q_b = |r|^2 - r'K (A + K'K)^-1 K'r,    r = y - m_b

more than before (see planned_outcomes): r'S^-1 r with S = I + K A^-1 K' the covariance of what b predicts. The
chi-square of b then lies above that of a by Q_b - Q_a more than now, and weights follow as those of a ranking do. What
a law with bounds, far from its estimates, leaves in truth is found for the best candidates by a refit in full: the
search of an identification, from several starts, over all tests. Its ratio to the linear value corrects Q_b.

The information is the mutual information of law and outcome (Box & Hill (1967), Technometrics 9, 57), in nats: the mean
decrease of the entropy of the weights. The mean of chi-square over laws, with weights, is the T-criterion (Atkinson &
Fedorov (1975), Biometrika 62, 57); it grows without limit where a verdict is certain already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.experiments.expectations import Expectation, ExpectedChiSquare
from creepkit.experiments.planned_outcomes import STATED_THICKNESS, KnownLaw, PlannedOutcomes, test_key
from creepkit.inverse.composite_predictor import predict, search_predictor_of
from creepkit.inverse.identify import search_problem
from creepkit.inverse.information_criteria import DECISIVE_WEIGHT
from creepkit.inverse.iterative_estimation import starting_point
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.problem import EvaluationCache, LeastSquaresProblem
from creepkit.inverse.search.local_refinement import Tolerances
from creepkit.inverse.search.multistart import EQUAL_REDUCED_ORDER_PREDICTIONS, MultiStart, distinct
from creepkit.records import History

LINEAR_DRAWS, REPEATS = 64, 2
"""Of the linearised posterior, and of the noise for each."""


POSTERIOR_DRAWS, POSTERIOR_REPEATS = 16, 12
"""Of the posterior itself, with a prediction each."""


SMALLEST_REFITTED = 1.0
"""A chi-square that is linearly less than this is not corrected: a ratio of it says nothing."""


RATIO_LIMITS = (0.0, 5.0)
"""Of the refitted over the linear chi-square."""


REFIT_TOLERANCES = Tolerances(max_steps=20, tolerance=1e-5)
"""Of a refit, from each of its starts."""


@dataclass(eq=False)
class LawCriterion:
    """The laws that remain, with weights; excess : (laws,) of the criterion of the ranking; frames : independent ones.

    chi_squares : (laws,) of the tests that were made.
    """

    outcomes: PlannedOutcomes
    weights: Floats
    excess: Floats
    chi_squares: Floats
    frames: float
    seed: int = 0
    ratios: dict[tuple[object, int, int], float] = field(default_factory=dict)
    _baseline: dict[int, float] = field(default_factory=dict)
    _deviations: dict[int, Floats] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the laws."""
        return [law.fit.law.name for law in self.outcomes.laws]

    def expectation(self, histories: Sequence[History], *, at_draws: bool = False) -> Expectation:
        """Information, probability of a right verdict and chi-squares of every direction, with these tests."""
        weight = self.weights / self.weights.sum()
        log_weight, penalty = np.log(weight), self._penalties(histories)
        information, right, wrong, chi_squares = 0.0, 0.0, 0.0, []
        for a, name in enumerate(self.names):
            Q = self._increments(a, histories, at_draws)
            score = self.excess + penalty + Q.T
            score = score - score.min(axis=1, keepdims=True)
            posterior = np.exp(-0.5 * score)
            posterior /= posterior.sum(axis=1, keepdims=True)
            information += weight[a] * float(np.mean(np.log(np.maximum(posterior[:, a], 1e-300)) - log_weight[a]))
            decided = posterior > DECISIVE_WEIGHT
            right += weight[a] * float(decided[:, a].mean())
            wrong += weight[a] * float(np.delete(decided, a, axis=1).any(axis=1).mean())
            for b, other in enumerate(self.names):
                if a != b:
                    current = float(self.chi_squares[b] - self.chi_squares[a])
                    expected = current + float(np.median(Q[b] - Q[a]))
                    is_refitted = (_key(histories), a, b) in self.ratios
                    chi_squares.append(ExpectedChiSquare(name, other, current, expected, is_refitted))
        chi_squares.sort(key=lambda each: -weight[self.names.index(each.reference_law)])
        return Expectation(max(information, 0.0), probability=right, wrong=wrong, chi_squares=tuple(chi_squares))

    def _penalties(self, histories: Sequence[History]) -> Floats:
        """(laws,) growth of the penalty K ln n of BIC with the frames of these tests."""
        if not np.isfinite(self.frames):
            return np.zeros(len(self.names))
        count = sum(self.outcomes.outcome(h, 0).mean.size for h in histories)
        return np.array([law.size for law in self.outcomes.laws]) * float(np.log1p(count / self.frames))

    def _increments(self, a: int, histories: Sequence[History], at_draws: bool) -> Floats:
        """(laws, outcomes) Q of each law, if a is true: over draws of its posterior and of the noise."""
        y, distances, repeats = self._true_outcomes(a, histories, at_draws)
        rng = np.random.default_rng(self.seed)
        noise = rng.standard_normal((len(y) * repeats, y.shape[1]))
        noisy = np.repeat(y, repeats, axis=0) + noise
        increments = np.empty((len(self.names), len(noisy)))
        for b, law in enumerate(self.outcomes.laws):
            m, K = self.outcomes.of(histories, b)
            increments[b] = _projected(noisy - m, K, law.information)
            ratio = self.ratios.get((_key(histories), a, b), 1.0)
            if b == a:  # its true values are among those it may have
                at_truth = np.repeat(distances, repeats) + (noise**2).sum(axis=1)
                increments[b] = np.minimum(increments[b], at_truth)
            elif ratio != 1.0:
                without_noise = _projected(y - m, K, law.information)
                increments[b] += (ratio - 1.0) * np.repeat(without_noise, repeats)
        return increments

    def _true_outcomes(self, a: int, histories: Sequence[History], at_draws: bool) -> tuple[Floats, Floats, int]:
        """Outcomes (draws, data) without noise if a is true, d'A d (draws,) of their values, repeats of the noise."""
        law = self.outcomes.laws[a]
        deviations = self._drawn(a, at_draws)
        distances = np.einsum("cp,pq,cq->c", deviations, law.information, deviations)
        if at_draws:
            parts = [self.outcomes.drawn(h, a, deviations)[0] for h in histories]
            return np.concatenate(parts, axis=1), distances, POSTERIOR_REPEATS
        m, K = self.outcomes.of(histories, a)
        return m + deviations @ K.T, distances, REPEATS

    def _drawn(self, a: int, at_draws: bool) -> Floats:
        key = 2 * a + int(at_draws)
        if key not in self._deviations:
            count = POSTERIOR_DRAWS if at_draws else LINEAR_DRAWS
            self._deviations[key] = self.outcomes.laws[a].draws(count, self.seed + a)
        return self._deviations[key]

    def probability_of_rupture(self, histories: Sequence[History]) -> float:
        """That one of the tests ruptures, over the laws and the draws of their posteriors."""
        weight, total = self.weights / self.weights.sum(), 0.0
        for a in range(len(self.names)):
            deviations = self._drawn(a, True)
            ruptures = np.stack([self.outcomes.drawn(h, a, deviations)[2] for h in histories])
            total += weight[a] * float(ruptures.any(axis=0).mean())
        return total

    # ---- refits in full ----------------------------------------------------------------------------------------------

    def directions(self) -> list[tuple[int, int]]:
        """All directions (true, alternative), those of most weight first."""
        count = len(self.names)
        pairs = [(a, b) for a in range(count) for b in range(count) if a != b]
        return sorted(pairs, key=lambda pair: -self.weights[pair[0]] * self.weights[pair[1]])

    def refit(self, histories: Sequence[History], a: int, b: int) -> None:
        """Correct the expected chi-square of one direction by a refit of b to what a predicts, at the median draw."""
        y, _, _ = self._true_outcomes(a, histories, True)
        law = self.outcomes.laws[b]
        m, K = self.outcomes.of(histories, b)
        linear = _projected(y - m, K, law.information)
        chosen = int(np.argsort(linear)[linear.size // 2])
        if linear[chosen] < SMALLEST_REFITTED:
            self.ratios[_key(histories), a, b] = 1.0
            return
        truth = self.outcomes.laws[a]
        u = truth.fit.u + self._drawn(a, True)[chosen, : truth.size]
        try:
            if b not in self._baseline:
                self._baseline[b] = _refitted_chi_square(law, self.outcomes.laws[0].noise_model, [])
            made = _as_if_made(truth, u, histories)
            refitted = _refitted_chi_square(law, self.outcomes.laws[0].noise_model, made) - self._baseline[b]
        except CreepkitError:  # no start can be predicted: the linear value stands
            return
        self.ratios[_key(histories), a, b] = float(np.clip(refitted / linear[chosen], *RATIO_LIMITS))


def _key(histories: Sequence[History]) -> object:
    return tuple(test_key(h) for h in histories)


def _projected(r: Floats, K: Floats, information: Floats) -> Floats:
    """(outcomes,) r'(I + K A^-1 K')^-1 r of r (outcomes, data)."""
    scale = 1.0 / np.sqrt(np.diag(information))
    root = np.linalg.cholesky((information + K.T @ K) * np.outer(scale, scale))
    solved = np.linalg.solve(root, scale[:, None] * (K.T @ r.T))
    return np.asarray((r**2).sum(axis=1) - (solved**2).sum(axis=0))


def _as_if_made(truth: KnownLaw, u: Floats, planned: Sequence[History]) -> list[History]:
    """Planned tests with what a law predicts at u (parameters,) as if it had been measured, without noise."""
    base, predictor = truth.measured.observations, truth.measured.predictor
    named = [replace(h, name=f"plan {k}") for k, h in enumerate(planned)]
    nuisances = truth.fit.nuisance_values(named, using=predictor)
    if "thickness" in nuisances:
        nuisances["thickness"] = np.array(
            [[h.geometry.get(STATED_THICKNESS, v) for h, v in zip(named, nuisances["thickness"][0], strict=True)]]
        )
    theta = truth.fit.coordinates.theta(u)
    prediction = predict(predictor, truth.fit.law, theta[None], named, nuisances=nuisances)
    made = []
    for k, history in enumerate(named):
        values = {name: prediction.of(k)[:, j] for j, name in enumerate(prediction.outputs) if name in base.outputs}
        sd = {name: np.full(history.times.size, float(base.noise[base.outputs.index(name)])) for name in values}
        finite = np.asarray(np.isfinite(np.stack([*values.values()])).all(axis=0), bool)
        made.append(replace(history, outputs=values, standard_deviation=sd, used=finite))
    return [history for history in made if history.used.any()]


def _refitted_chi_square(law: KnownLaw, noise_model: NoiseModel, further: Sequence[History]) -> float:
    """The least chi-square of a law over the tests that were made and further ones, by the search of identify().

    Without further tests from its estimates alone, which are those of such a search.
    """
    measured = law.measured
    histories = (*measured.histories, *further)
    observations = _observations(measured, histories)
    nuisances = _nuisances(law, histories)
    problem = replace(
        measured, histories=histories, observations=observations, evaluations=EvaluationCache()
    ).with_nuisances(nuisances)
    known = {(n.key, n.owner): n.value for n in law.fit.nuisances}
    starts = [law.fit.u]
    if further:
        broad = LeastSquaresProblem.from_histories(
            law.fit.law, histories, measured.predictor, law.fit.settings, law.fit.reference
        )
        searched = search_problem(broad, search_predictor_of(measured.predictor))
        minima = MultiStart().minima(searched).minima
        starts += [m.x for m in distinct(minima, searched.bounds, equal_predictions=EQUAL_REDUCED_ORDER_PREDICTIONS)]
    outputs = {name: noise_model[name] for name in observations.outputs}
    own = replace(noise_model, outputs=outputs)
    least = np.inf
    for u in starts:
        x = problem.bounds.clip(starting_point(nuisances, u, known))
        residuals = replace(problem.residuals(x), present=problem.observations.present)
        residuals = residuals.with_test_weights(_test_weights(law, len(further)))
        under = problem.with_covariance(CovarianceFactor.of_residuals(residuals, own))
        least = min(least, 2.0 * under.minimise(x, tolerances=REFIT_TOLERANCES).cost)
    return float(least)


def _observations(measured: LeastSquaresProblem, histories: Sequence[History]) -> ObservationVector:
    """The observations of histories with the transforms and the noise of the tests that were made."""
    base = measured.observations
    observations = ObservationVector.from_histories(histories, measured.predictor)
    position = [base.outputs.index(name) for name in observations.outputs]
    return replace(observations, transforms=tuple(base.transforms[k] for k in position), noise=base.noise[position])


def _nuisances(law: KnownLaw, histories: Sequence[History]) -> NuisanceParameters:
    """Those of the tests that were made and of further ones, with the prior standard deviations of the fit."""
    nuisances = NuisanceParameters.from_histories(law.fit.settings.nuisances, histories, law.measured.predictor)
    spread = {n.kind: n.prior_sd for n in law.fit.nuisances}
    mean = nuisances.mean.copy()
    further = {h.name: h for h in histories[len(law.measured.histories) :]}
    for k, (n, owner) in enumerate(zip(nuisances.nuisances, nuisances.owners, strict=True)):
        if n.kind == "thickness" and n.scope == "test" and owner in further:
            mean[k] = further[owner].geometry.get(STATED_THICKNESS, mean[k])
    sd = np.array([spread.get(n.kind, sd) for n, sd in zip(nuisances.nuisances, nuisances.sd, strict=True)])
    return replace(nuisances, mean=mean, sd=sd)


def _test_weights(law: KnownLaw, further: int) -> Floats:
    """(tests,) of the fit, and one for further tests."""
    return np.concatenate([[test.weight for test in law.fit.tests], np.ones(further)])
