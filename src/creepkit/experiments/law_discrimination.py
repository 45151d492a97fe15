"""Expected discrimination of laws: chi-squares in every direction, and the probability of a right verdict.

Let law a be true with its weight, at a draw of its posterior, and y be the whitened outcome of a planned test with its
noise. To first order law b, refitted to the tests that were made and to this one, leaves

    Q_b = |r|^2 - r'K (A + K'K)^-1 K'r,    r = y - m_b

more than before (see planned_outcomes): r'S^-1 r with S = I + K A^-1 K' the covariance of what b predicts. The
chi-square of b then lies above that of a by Q_b - Q_a more than now, and weights follow as those of a ranking do. What
a law with bounds, far from its estimates, leaves in truth is found for the best candidates by a refit in full: the
search of an identification, from several starts, over all tests. Its ratio to the linear value corrects Q_b. Before
that the step begins at the draw of the posterior of b which explains the outcome best.

The information is the mutual information of law and outcome (Box & Hill (1967), Technometrics 9, 57), in nats: the mean
decrease of the entropy of the weights. A decisive verdict has to exclude more than the other laws: shares of them, and
a threshold stress (selection.challenges). Those that the tests allow are compared in the same way with the law that
they alter. The mean of chi-square over laws, with weights, is the T-criterion (Atkinson & Fedorov (1975), Biometrika
62, 57); it grows without limit where a verdict is certain already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.experiments.expectations import Expectation, ExpectedChiSquare
from creepkit.experiments.known_laws import Expansion, KnownLaw, nuisances_of_planned, values_of_nuisances
from creepkit.experiments.planned_outcomes import PlannedOutcomes, test_key
from creepkit.inverse.information_criteria import DECISIVE_WEIGHT
from creepkit.inverse.initial_search import search_problem
from creepkit.inverse.iterative_estimation import starting_point
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.problem import EvaluationCache, LeastSquaresProblem
from creepkit.inverse.residuals import residuals_at_measured_values
from creepkit.inverse.search.local_refinement import Tolerances
from creepkit.inverse.search.multistart import EQUAL_REDUCED_ORDER_PREDICTIONS, MultiStart, distinct
from creepkit.inverse.selection.challenges import NOT_EXCLUDED, AlteredLaw, FittedLaw, above_threshold, sum_with_share
from creepkit.records import History

LINEAR_DRAWS, REPEATS = 64, 2
"""Of the linearised posterior, and of the noise for each."""


POSTERIOR_DRAWS, POSTERIOR_REPEATS = 16, 12
"""Of the posterior itself, with a prediction each."""


SMALLEST_REFITTED = 3.0
"""A chi-square that is linearly less than this is not corrected: a ratio of it says nothing."""


RATIO_LIMITS = (0.0, 5.0)
"""Of the refitted over the linear chi-square."""


REFIT_TOLERANCES = Tolerances(max_steps=20, tolerance=1e-5)
"""Of a refit, from each of its starts."""


@dataclass(eq=False)
class LawCriterion:
    """The laws that remain, the first of the outcomes, and after them what else a verdict has to exclude.

    weights : (laws,) -. excess : (laws,) of the criterion of the ranking. chi_squares : (laws,) of the tests that were
    made. frames : how many of them are independent. altered : the further laws. ratios : of refitted over linear
    chi-squares, of tests and pairs.
    """

    outcomes: PlannedOutcomes
    weights: Floats
    excess: Floats
    chi_squares: Floats
    frames: float
    altered: Sequence[Alteration] = ()
    seed: int = 0
    ratios: dict[tuple[object, int, int], float] = field(default_factory=dict)
    _baseline: dict[int, float] = field(default_factory=dict)
    _deviations: dict[int, Floats] = field(default_factory=dict)
    _expansions: dict[int, Expansion] = field(default_factory=dict)

    differs_at_draws = True

    @property
    def names(self) -> list[str]:
        """Names of the laws that may be true."""
        return [law.fit.law.name for law in self.outcomes.laws[: len(self.weights)]]

    def expectation(self, histories: Sequence[History], *, at_draws: bool = False) -> Expectation:
        """Information, probability of a right verdict and chi-squares of every direction, with these tests.

        An altered law counts, for the information, as another law.
        """
        weight, count = self.weights / self.weights.sum(), len(self.weights)
        penalty = self._penalties(histories)
        information, right, wrong, chi_squares = 0.0, 0.0, 0.0, []
        for a, name in enumerate(self.names):
            Q = self._increments(a, histories, at_draws)
            score = (self.excess + penalty + Q[:count].T).T
            own = [(k, one.excess + one.penalty) for k, one in enumerate(self.altered) if one.law == a]
            more = np.array([beyond + Q[count + k] - Q[a] for k, beyond in own]).reshape(-1, Q.shape[1])
            before = _shares(np.append(self.excess, [self.excess[a] + beyond for _, beyond in own])[:, None])
            after = _shares(np.concatenate([score, score[a] + more]))
            information += weight[a] * float(np.mean(np.log(np.maximum(after[a], 1e-300)) - np.log(before[a])))
            decided = _shares(score) > DECISIVE_WEIGHT
            right += weight[a] * float((decided[a] & (more > NOT_EXCLUDED).all(axis=0)).mean())
            wrong += weight[a] * float(np.delete(decided, a, axis=0).any(axis=0).mean())
            current = [*(self.chi_squares - self.chi_squares[a]).tolist(), *(one.excess for one in self.altered)]
            for b in (b for b in self._compared(a) if b != a):
                expected, other = current[b] + float(np.median(Q[b] - Q[a])), self.outcomes.laws[b].fit.law.name
                refitted = (_key(histories), a, b) in self.ratios
                chi_squares.append(ExpectedChiSquare(name, other, current[b], expected, refitted))
        chi_squares.sort(key=lambda each: -weight[self.names.index(each.reference_law)])
        return Expectation(max(information, 0.0), probability=right, wrong=wrong, chi_squares=tuple(chi_squares))

    def _penalties(self, histories: Sequence[History]) -> Floats:
        """(laws,) growth of the penalty K ln n of BIC with the frames of these tests."""
        if not np.isfinite(self.frames):
            return np.zeros(len(self.names))
        count = sum(self.outcomes.outcome(h, 0).mean.size for h in histories)
        sizes = np.array([law.size for law in self.outcomes.laws[: len(self.names)]])
        return np.asarray(sizes * float(np.log1p(count / self.frames)))

    def _increments(self, a: int, histories: Sequence[History], at_draws: bool) -> Floats:
        """(laws and altered ones, outcomes) Q of each, if a is true: over draws of its posterior and of the noise."""
        y, repeats = self._true_outcomes(a, histories, at_draws)
        noise = np.random.default_rng(self.seed).standard_normal((len(y) * repeats, y.shape[1]))
        noisy = np.repeat(y, repeats, axis=0) + noise
        increments = np.zeros((len(self.outcomes.laws), len(noisy)))
        for b in self._compared(a):
            ratio = self.ratios.get((_key(histories), a, b), 1.0)
            increments[b] = self._least(b, a, histories, noisy, at_draws)
            if ratio != 1.0:
                increments[b] += (ratio - 1.0) * np.repeat(self._least(b, a, histories, y, at_draws), repeats)
        return increments

    def _compared(self, a: int) -> list[int]:
        """Positions of the laws, and of what a verdict for law a has to exclude."""
        count = len(self.names)
        return [*range(count), *(count + k for k, alteration in enumerate(self.altered) if alteration.law == a)]

    def _least(self, b: int, a: int, histories: Sequence[History], y: Floats, at_draws: bool) -> Floats:
        """(outcomes,) increase of chi-square of law b at outcomes y (outcomes, data), under the covariance of law a.

        About its estimates; at draws from that of its estimates and the draws of its posterior which explains the
        outcome best, by one Gauss-Newton step over all tests.
        """
        law = self.outcomes.laws[b]
        if not at_draws:
            m, K = self.outcomes.of(histories, b, a)
            return _projected(y - m, K, law.information)
        deviations, made = self._drawn(b, True), self._expansion(b)
        parts = [self.outcomes.drawn(h, b, deviations, a) for h in histories]
        m, K = (np.concatenate([part[k] for part in parts], axis=1) for k in (0, 1))
        misfits = made.chi_square + (y**2).sum(axis=1)[:, None] - 2.0 * y @ m.T + (m**2).sum(axis=1)
        nearest, least = misfits.argmin(axis=1), np.empty(len(y))
        bounds = law.measured.bounds
        limits = np.full((2, deviations.shape[1]), np.inf) * [[-1.0], [1.0]]
        limits[:, : law.size] = np.stack([bounds.lower, bounds.upper])[:, : law.size] - law.fit.u
        for k in np.unique(nearest):
            chosen = nearest == k
            r = y[chosen] - m[k]
            downhill = r @ K[k] - made.gradient[k]
            curvature = made.information[k] + K[k].T @ K[k]
            step = _bounded_steps(curvature, downhill, *(limits - deviations[k]))
            change = np.einsum("cp,pq,cq->c", step, curvature, step) - 2.0 * (downhill * step).sum(axis=1)
            least[chosen] = made.chi_square[k] + (r**2).sum(axis=1) + change
        return np.maximum(least, 0.0)  # further tests never lessen a least chi-square; a step may promise that they do

    def _expansion(self, b: int) -> Expansion:
        if b not in self._expansions:
            self._expansions[b] = self.outcomes.laws[b].expansion(self._drawn(b, True))
        return self._expansions[b]

    def _true_outcomes(self, a: int, histories: Sequence[History], at_draws: bool) -> tuple[Floats, int]:
        """Outcomes (draws, data) without noise if a is true, and how often the noise is drawn for each."""
        deviations = self._drawn(a, at_draws)
        if at_draws:
            parts = [self.outcomes.drawn(h, a, deviations)[0][1:] for h in histories]
            return np.concatenate(parts, axis=1), POSTERIOR_REPEATS
        m, K = self.outcomes.of(histories, a)
        return m + deviations @ K.T, REPEATS

    def _drawn(self, a: int, at_draws: bool) -> Floats:
        """(draws, q) deviations from the estimates; those at which predictions are made begin with the estimates."""
        key = 2 * a + int(at_draws)
        if key not in self._deviations:
            count = POSTERIOR_DRAWS if at_draws else LINEAR_DRAWS
            drawn = self.outcomes.laws[a].draws(count, self.seed + a)
            self._deviations[key] = np.concatenate([0.0 * drawn[:1], drawn]) if at_draws else drawn
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
        """All directions (true, alternative), those of most weight first, then those to altered laws."""
        count = len(self.names)
        pairs = [(a, b) for a in range(count) for b in range(count) if a != b]
        pairs.sort(key=lambda pair: -self.weights[pair[0]] * self.weights[pair[1]])
        return pairs + [(alteration.law, count + k) for k, alteration in enumerate(self.altered)]

    def refit(self, histories: Sequence[History], a: int, b: int) -> bool:
        """Correct the expected chi-square of one direction by a refit of b to what a predicts, at the median draw.

        Whether it was done: not where that chi-square is so small that nothing is to be corrected.
        """
        y, _ = self._true_outcomes(a, histories, True)
        law, linear = self.outcomes.laws[b], self._least(b, a, histories, y, True)
        chosen = int(np.argsort(linear)[linear.size // 2])
        if linear[chosen] < SMALLEST_REFITTED:
            return False
        truth, deviation = self.outcomes.laws[a], self._drawn(a, True)[1 + chosen]
        try:
            made = _as_if_made(truth, deviation, histories)
            if b < len(self.names):
                refitted = _refit_in_full(law, self._noise_model, made)[1] - self._baseline_of(b)
            else:
                altered = self.altered[b - len(self.names)]
                own, _ = _refit_in_full(truth, self._noise_model, made, [truth.fit.u + deviation[: truth.size]])
                found = altered.refitted(own, self._noise_model, made)
                refitted = found.excess - altered.excess + float(self._least(a, a, histories, y[[chosen]], True)[0])
        except CreepkitError:  # no start can be predicted: the linear value stands
            return False
        self.ratios[_key(histories), a, b] = float(np.clip(refitted / linear[chosen], *RATIO_LIMITS))
        return True

    @property
    def _noise_model(self) -> NoiseModel:
        return self.outcomes.laws[0].noise_model

    def _baseline_of(self, b: int) -> float:
        if b not in self._baseline:
            self._baseline[b] = _refit_in_full(self.outcomes.laws[b], self._noise_model, [])[1]
        return self._baseline[b]


@dataclass(frozen=True, eq=False)
class Alteration:
    """What a verdict for one law has to exclude.

    law : position of that law. excess : chi-square of the altered law above that law's; penalty : of its further
    parameters, by BIC. other : of a sum, what is known of the law that has a share; None for a threshold.
    """

    law: int
    excess: float
    penalty: float = 0.0
    other: KnownLaw | None = None

    def refitted(self, own: FittedLaw, noise_model: NoiseModel, further: Sequence[History]) -> AlteredLaw:
        """The altered law fitted to further tests too, as a challenge does; own : the law itself, fitted to these."""
        if self.other is None:
            return above_threshold(own)
        return sum_with_share(own, _refit_in_full(self.other, noise_model, further)[0])


def _shares(scores: Floats) -> Floats:
    """(laws, outcomes) weights of scores (laws, outcomes), which are -2 ln of evidence."""
    weights = np.exp(-0.5 * (scores - scores.min(axis=0)))
    return np.asarray(weights / weights.sum(axis=0))


def _key(histories: Sequence[History]) -> object:
    return tuple(test_key(h) for h in histories)


def _projected(r: Floats, K: Floats, information: Floats) -> Floats:
    """(outcomes,) r'(I + K A^-1 K')^-1 r of r (outcomes, data)."""
    scale = 1.0 / np.sqrt(np.diag(information))
    root = np.linalg.cholesky((information + K.T @ K) * np.outer(scale, scale))
    solved = np.linalg.solve(root, scale[:, None] * (K.T @ r.T))
    return np.asarray((r**2).sum(axis=1) - (solved**2).sum(axis=0))


def _bounded_steps(curvature: Floats, downhill: Floats, lower: Floats, upper: Floats) -> Floats:
    """(outcomes, q) steps to the least of d'A d - 2 b'd within bounds (q,), of b (outcomes, q).

    What leaves its bounds is put on them, and the rest is solved for again.
    """
    steps = np.linalg.solve(curvature, downhill.T).T
    for _ in range(2):
        held = (steps < lower) | (steps > upper)
        for pattern in np.unique(held[held.any(axis=1)], axis=0):
            rows, free = (held == pattern).all(axis=1), ~pattern
            steps[rows] = np.clip(steps[rows], lower, upper)
            rest = downhill[rows][:, free] - steps[rows][:, pattern] @ curvature[np.ix_(pattern, free)]
            steps[np.ix_(rows, free)] = np.linalg.solve(curvature[np.ix_(free, free)], rest.T).T
    return np.asarray(np.clip(steps, lower, upper))


def _as_if_made(truth: KnownLaw, deviation: Floats, planned: Sequence[History]) -> list[History]:
    """Planned tests with what a law predicts at a deviation (q,) as if it had been measured, without noise."""
    base, predictor = truth.measured.observations, truth.measured.predictor
    named = [replace(h, name=f"plan {k}") for k, h in enumerate(planned)]
    nuisances = nuisances_of_planned(truth, named)
    e = values_of_nuisances(nuisances, truth, deviation[truth.size :])
    theta = truth.fit.coordinates.theta(truth.fit.u + deviation[: truth.size])
    prediction = predictor.predict(truth.fit.law, theta[None], named, nuisances=nuisances.predictor_values(e))
    made = []
    for k, history in enumerate(named):
        values = {name: prediction.of(k)[:, j] for j, name in enumerate(prediction.outputs) if name in base.outputs}
        sd = {name: np.full(history.times.size, float(base.noise[base.outputs.index(name)])) for name in values}
        finite = np.asarray(np.isfinite(np.stack([*values.values()])).all(axis=0), bool)
        made.append(history.replace(outputs=values, standard_deviation=sd, used=finite))
    return [history for history in made if history.used.any()]


def _refit_in_full(
    law: KnownLaw, noise_model: NoiseModel, further: Sequence[History], starts: Sequence[Floats] | None = None
) -> tuple[FittedLaw, float]:
    """A law fitted to the tests that were made and to further ones, and its least chi-square with all penalties.

    starts : of u (parameters,); by default the estimates and, with further tests, the minima of the search of
    identify().
    """
    measured = law.measured
    histories = (*measured.histories, *further)
    observations = ObservationVector.from_histories(histories, measured.predictor).with_noise_of(measured.observations)
    nuisances = nuisances_of_planned(law, further, of_made=True)
    problem = replace(
        measured, histories=histories, observations=observations, evaluations=EvaluationCache()
    ).with_nuisances(nuisances)
    known = {(n.key, n.owner): n.value for n in law.fit.nuisances}
    begun = [law.fit.u] if starts is None else list(starts)
    if further and starts is None:
        broad = LeastSquaresProblem.from_histories(
            law.fit.law, histories, measured.predictor, law.fit.settings, law.fit.reference
        )
        searched = search_problem(broad, measured.predictor.for_search())
        minima = MultiStart().minima(searched).minima
        begun += [m.x for m in distinct(minima, searched.bounds, equal_predictions=EQUAL_REDUCED_ORDER_PREDICTIONS)]
    own = replace(noise_model, outputs={name: noise_model[name] for name in observations.outputs})
    weights = np.concatenate([[test.weight for test in law.fit.tests], np.ones(len(further))])
    found = []
    for u in begun:
        x = problem.bounds.clip(starting_point(nuisances, u, known))
        residuals = replace(
            problem.residuals(x),
            present=observations.present,
            offset_sensitivity=residuals_at_measured_values(observations).offset_sensitivity,
        )
        residuals = residuals.with_test_weights(weights)
        under = problem.with_covariance(CovarianceFactor.of_residuals(residuals, own))
        minimum = under.minimise(x, tolerances=REFIT_TOLERANCES)
        found.append((FittedLaw(under, minimum.x), 2.0 * float(minimum.cost)))
    return min(found, key=lambda pair: pair[1])
