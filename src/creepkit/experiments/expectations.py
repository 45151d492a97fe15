"""What a planned test is expected to tell: information in nats, standard deviations, and chi-squares between laws.

For the values of a law, with S the covariance of its parameters u before and S' after the test,

    information = (ln det S - ln det S') / 2        (D-optimal: all parameters)
    information = ln sd - ln sd',  sd^2 = c'S c      (c-optimal: one quantity, c its derivative to u)

Both are to first order about the estimates; of several laws they are averaged with their weights. The errors that
tests usually have are in S and in S' as they are in intervals (see planned_outcomes), and of a rate beyond the tests
what the law misses there (uncertainty.law_misfit), less of it after a test nearer to it that agrees with the law.

Let law a be true with its weight, at a draw of its posterior, and y be the whitened outcome of a planned test with its
noise. To first order law b, refitted to the tests that were made and to this one, leaves

    Q_b = |r|^2 - r'K (A + K'K)^-1 K'r,    r = y - m_b

more than before (see planned_outcomes): r'S^-1 r with S = I + K A^-1 K' the covariance of what b predicts. The
chi-square of b then lies above that of a by Q_b - Q_a more than now, and weights follow as those of a ranking do. For
the best candidates the step begins at the draw of the posterior of b which explains the outcome best, and stays within
the bounds of b. A chi-square that is expected by one step is off by up to a factor of two.

The information is the mutual information of law and outcome (Box & Hill (1967), Technometrics 9, 57), in nats: the mean
decrease of the entropy of the weights. Planned tests have to tell more apart than the other laws: shares of them, and a
threshold stress (selection.challenges). Those that the tests allow are compared in the same way with the law that they
alter; a verdict stands where none of them refutes it by the rule of a ranking. The mean of chi-square over laws, with
weights, is the T-criterion (Atkinson & Fedorov (1975), Biometrika 62, 57); it grows without limit where a verdict is
certain already.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.experiments.planned_outcomes import Expansion, PlannedOutcomes
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import reference_condition
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, gradient, log_rate
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.language import CreepLaw
from creepkit.records import History


@dataclass(frozen=True)
class ExpectedChiSquare:
    """One direction: if the reference law is true, by how much more the alternative is expected to miss the tests.

    current : difference of chi-squares now; expected : with the planned test, the median over the posterior.
    """

    reference_law: str
    alternative_law: str
    current: float
    expected: float


@dataclass(frozen=True)
class Expectation:
    """What one planned test, or several together, are expected to tell.

    information : nats. sd, current_sd : of the quantity asked for, on its scale (of ln where that is log), NaN without.
    parameter_sd, current_parameter_sd : {name: standard deviation} of the best law's parameters after the test and now,
    of ln where the scale is log, when the name is "ln A". probability : that the right law has more than 0.95 of the
    weight and nothing that the tests allow beside it refutes it; wrong : that a wrong one has more than 0.95.
    """

    information: float
    sd: float = float("nan")
    current_sd: float = float("nan")
    parameter_sd: Mapping[str, float] = field(default_factory=dict)
    current_parameter_sd: Mapping[str, float] = field(default_factory=dict)
    probability: float = float("nan")
    wrong: float = float("nan")
    chi_squares: tuple[ExpectedChiSquare, ...] = ()


@dataclass(eq=False)
class PrecisionCriterion:
    """The precision of the parameters (quantity None) or of one quantity, averaged over laws with weights (laws,)."""

    outcomes: PlannedOutcomes
    weights: Floats
    quantity: DerivedQuantity | None = None
    _misfits: dict[tuple[int, bytes], float] = field(default_factory=dict)

    def expectation(self, histories: Sequence[History]) -> Expectation:
        """The expected precision after these tests."""
        gains, sds, current, parameters = [], [], [], [dict[str, float](), dict[str, float]()]
        for position, law in enumerate(self.outcomes.laws):
            covariances = self._covariances(position, histories)
            if self.quantity is None:
                logs = [float(np.linalg.slogdet(S)[1]) for S in covariances]
                gains.append(0.5 * (logs[0] - logs[1]))
            else:
                function = self.quantity.function(law.fit.coordinates)
                c = gradient(function, law.fit.u, np.sqrt(np.diag(law.fit.covariance)))
                before, after = (
                    float(np.hypot(np.sqrt(c @ S @ c), self._misfit_sd(position, tests)))
                    for tests, S in zip(([], histories), covariances, strict=True)
                )
                gains.append(float(np.log(before / after)))
                current.append(before)
                sds.append(after)
            if position == 0:
                parameters = [_parameter_sd(law.fit, S) for S in covariances]
        sd, current_sd = (float(np.sqrt(self.weights @ np.square(v))) if v else float("nan") for v in (sds, current))
        return Expectation(
            float(self.weights @ gains), sd, current_sd, parameter_sd=parameters[1], current_parameter_sd=parameters[0]
        )

    def _misfit_sd(self, position: int, planned: Sequence[History]) -> float:
        """Standard deviation of what the law misses of the rate that is asked for; 0 of other quantities."""
        fit, quantity = self.outcomes.laws[position].fit, self.quantity
        assert fit.predictor is not None
        if quantity is None or quantity.unit != "1/s" or not quantity.point:
            return 0.0
        conditions = np.array([reference_condition(history, fit.predictor) for history in planned]).reshape(-1, 2).T
        key = position, conditions.round(6).tobytes()
        if key not in self._misfits:
            T = quantity.point["temperature"]
            place = float(quantity.point["stress"] or 0.0), fit.reference.temperature if T is None else T
            misfit = _after(fit, conditions).misfit_at(*place)
            self._misfits[key] = 0.0 if misfit is None else misfit.sd
        return self._misfits[key]

    def _covariances(self, position: int, histories: Sequence[History]) -> list[Floats]:
        """Covariances (parameters, parameters) of u before and after the tests."""
        law = self.outcomes.laws[position]
        _, K = self.outcomes.of(histories, position)
        A, T, size = law.information, law.sandwich, law.size
        return [(T @ scaled_inverse(each) @ T.T)[:size, :size] for each in (A, A + K.T @ K)]


def _after(fit: Identification, conditions: Floats) -> Identification:
    """An identification with planned tests at which the law holds, as what it misses elsewhere depends on them.

    conditions : (2, planned tests) MPa and K.
    """
    scatter, ranges, count = fit.rate_scatter, dict(fit.ranges), conditions.shape[1]
    if scatter is None or scatter.stresses.size != len(scatter.tests):
        return fit
    for name, values in zip(("stress", "temperature"), conditions, strict=True):
        ranges[name] = min([ranges[name][0], *values]), max([ranges[name][1], *values])
    rows = np.zeros((count, scatter.design.shape[1]))
    rows[:, : fit.u.size] = gradient(log_rate(fit.coordinates, *conditions), fit.u, np.ones(fit.u.size))
    extended = replace(
        scatter,
        tests=(*scatter.tests, *map(str, range(count))),
        members={level: (*names, *names[-1:] * count) for level, names in scatter.members.items()},
        log_factor=np.append(scatter.log_factor, np.zeros(count)),
        variance=np.append(scatter.variance, np.full(count, scatter.variance.min())),
        design=np.concatenate([scatter.design, rows]),
        stresses=np.append(scatter.stresses, conditions[0]),
        temperatures=np.append(scatter.temperatures, conditions[1]),
    )
    return replace(fit, rate_scatter=extended, ranges=ranges)


def _parameter_sd(fit: Identification, covariance: Floats) -> dict[str, float]:
    to_theta = fit.coordinates.jacobian(fit.u)
    sd = np.sqrt(np.einsum("pq,qr,pr->p", to_theta, covariance, to_theta))
    return dict(zip(_scaled_names(fit.law), sd.tolist(), strict=True))


def _scaled_names(law: CreepLaw) -> list[str]:
    """Names of parameters, "ln A" of one whose scale is log."""
    return [f"ln {p.name}" if param.scale == "log" else p.name for p, param in law.params.items()]


LINEAR_DRAWS, REPEATS = 64, 2
"""Of the linearised posterior, and of the noise for each."""


POSTERIOR_DRAWS, POSTERIOR_REPEATS = 16, 12
"""Of the posterior itself, with a prediction each."""


@dataclass(eq=False)
class LawCriterion:
    """The laws that remain, the first of the outcomes, and after them what else a verdict has to exclude.

    weights : (laws,) -. excess : (laws,) of the criterion of the ranking. chi_squares : (laws,) of the tests that were
    made. altered : of the further laws, the position of the law that each
    alters, its chi-square above that one's, and that up to which it refutes it.
    """

    outcomes: PlannedOutcomes
    weights: Floats
    excess: Floats
    chi_squares: Floats
    altered: Sequence[tuple[int, float, float]] = ()
    seed: int = 0
    _deviations: dict[int, Floats] = field(default_factory=dict)
    _expansions: dict[int, Expansion] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the laws that may be true."""
        return [law.fit.law.name for law in self.outcomes.laws[: len(self.weights)]]

    def expectation(self, histories: Sequence[History], *, at_draws: bool = False) -> Expectation:
        """Information, probability of a right verdict and chi-squares of every direction, with these tests.

        An altered law counts, for the information, as another law of as many parameters.
        """
        weight, count = self.weights, len(self.weights)
        penalty = self._penalties(histories)
        information, right, wrong, chi_squares = 0.0, 0.0, 0.0, []
        for a, name in enumerate(self.names):
            Q = self._increments(a, histories, at_draws)
            score = (self.excess + penalty + Q[:count].T).T
            own = [(count + k, excess, limit) for k, (law, excess, limit) in enumerate(self.altered) if law == a]
            more = np.array([beyond + Q[k] - Q[a] for k, beyond, _ in own]).reshape(-1, Q.shape[1])
            refuting = np.array([limit for *_, limit in own]).reshape(-1, 1)
            before = _shares(np.append(self.excess, [self.excess[a] + beyond for _, beyond, _ in own])[:, None])
            after = _shares(np.concatenate([score, score[a] + more]))
            information += weight[a] * float(np.mean(np.log(np.maximum(after[a], 1e-300)) - np.log(before[a])))
            decided = _shares(score) > DECISIVE_WEIGHT
            right += weight[a] * float((decided[a] & (more > refuting).all(axis=0)).mean())
            wrong += weight[a] * float(np.delete(decided, a, axis=0).any(axis=0).mean())
            current = [*(self.chi_squares - self.chi_squares[a]).tolist(), *(excess for _, excess, _ in self.altered)]
            for b in (b for b in self._compared(a) if b != a):
                expected, other = current[b] + float(np.median(Q[b] - Q[a])), self.outcomes.laws[b].fit.law.name
                chi_squares.append(ExpectedChiSquare(name, other, current[b], expected))
        chi_squares.sort(key=lambda each: -weight[self.names.index(each.reference_law)])
        return Expectation(max(information, 0.0), probability=right, wrong=wrong, chi_squares=tuple(chi_squares))

    def _penalties(self, histories: Sequence[History]) -> Floats:
        """(laws,) growth of what the parameters of each cost, as these tests narrow them further."""
        grown = []
        for b in range(len(self.names)):
            A, K = self.outcomes.laws[b].information, self.outcomes.of(histories, b)[1]
            grown.append(np.linalg.slogdet(A + K.T @ K)[1] - np.linalg.slogdet(A)[1])
        return np.array(grown)

    def _increments(self, a: int, histories: Sequence[History], at_draws: bool) -> Floats:
        """(laws and altered ones, outcomes) Q of each, if a is true: over draws of its posterior and of the noise."""
        y, repeats = self._true_outcomes(a, histories, at_draws)
        noise = np.random.default_rng(self.seed).standard_normal((len(y) * repeats, y.shape[1]))
        noisy = np.repeat(y, repeats, axis=0) + noise
        increments = np.zeros((len(self.outcomes.laws), len(noisy)))
        for b in self._compared(a):
            increments[b] = self._least(b, a, histories, noisy, at_draws)
        return increments

    def _compared(self, a: int) -> list[int]:
        """Positions of the laws, and of what a verdict for law a has to exclude."""
        count = len(self.names)
        return [*range(count), *(count + k for k, (law, *_) in enumerate(self.altered) if law == a)]

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
        total = 0.0
        for a in range(len(self.names)):
            deviations = self._drawn(a, True)
            ruptures = np.stack([self.outcomes.drawn(h, a, deviations)[2] for h in histories])
            total += self.weights[a] * float(ruptures.any(axis=0).mean())
        return total


def _shares(scores: Floats) -> Floats:
    """(laws, outcomes) weights of scores (laws, outcomes), which are -2 ln of evidence."""
    weights = np.exp(-0.5 * (scores - scores.min(axis=0)))
    return np.asarray(weights / weights.sum(axis=0))


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
