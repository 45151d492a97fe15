"""What a planned test is expected to tell: information in nats, standard deviations, and chi-squares between laws.

For the values of a law, with S the covariance of its parameters u before and S' after the test,

    information = (ln det S - ln det S') / 2        (D-optimal: all parameters)
    information = ln sd - ln sd',  sd^2 = c'S c      (c-optimal: one quantity, c its derivative to u)

Both are the mean over draws of the posterior, for the derivatives of the test are those at the true values; of several
laws they are averaged with their weights. What is expected of the law itself stands in law_discrimination.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.experiments.planned_outcomes import PlannedOutcomes
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, gradient
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.language import CreepLaw
from creepkit.records import History

DRAWS = 8
"""Of the posterior, at which the derivatives of the best candidates are taken."""


@dataclass(frozen=True)
class ExpectedChiSquare:
    """One direction: if the reference law is true, by how much more the alternative is expected to miss the tests.

    current : difference of chi-squares now; expected : with the planned test, the median over the posterior.
    refitted : whether the alternative law was refitted in full by the search of an identification.
    """

    reference_law: str
    alternative_law: str
    current: float
    expected: float
    refitted: bool = False


@dataclass(frozen=True)
class Expectation:
    """What one planned test, or several together, are expected to tell.

    information : nats. sd, current_sd : of the quantity asked for, on its scale (of ln where that is log), NaN without.
    parameter_sd, current_parameter_sd : {name: standard deviation} of the best law's parameters after the test and now,
    of ln where the scale is log, when the name is "ln A". probability : that the right law has more than 0.95 of the
    weight, with all that the tests allow beside it excluded; wrong : that a wrong one has more than 0.95.
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
    """The precision of the parameters (quantity None) or of one quantity, averaged over laws with weights (laws,).

    About the estimates, or at draws of the posterior where they are asked for and differ.
    """

    outcomes: PlannedOutcomes
    weights: Floats
    quantity: DerivedQuantity | None = None
    seed: int = 0
    _deviations: dict[int, Floats] = field(default_factory=dict)
    _information: dict[int, Floats] = field(default_factory=dict)

    def expectation(self, histories: Sequence[History], *, at_draws: bool = False) -> Expectation:
        """The expected precision after these tests."""
        gains, sds, current, parameters = [], [], [], [dict[str, float](), dict[str, float]()]
        for position, law in enumerate(self.outcomes.laws):
            before, after, points = self._covariances(position, histories, at_draws)
            size = law.size
            if self.quantity is None:
                logs = [np.linalg.slogdet(S[:, :size, :size])[1] for S in (before, after)]
                gains.append(0.5 * float(np.mean(logs[0] - logs[1])))
            else:
                function = self.quantity.function(law.fit.coordinates)
                rows = np.stack([gradient(function, u, np.sqrt(np.diag(law.fit.covariance))) for u in points])
                both = [np.sqrt(np.einsum("cp,cpq,cq->c", rows, S[:, :size, :size], rows)) for S in (before, after)]
                mean_logs = [float(np.mean(np.log(each))) for each in both]
                gains.append(mean_logs[0] - mean_logs[1])
                current.append(float(np.exp(mean_logs[0])))
                sds.append(float(np.exp(mean_logs[1])))
            if position == 0:
                parameters = [self._parameter_sd(position, S, points) for S in (before, after)]
        weight = self.weights / self.weights.sum()
        sd, current_sd = (float(np.sqrt(weight @ np.square(v))) if v else float("nan") for v in (sds, current))
        return Expectation(
            float(weight @ gains), sd, current_sd, parameter_sd=parameters[1], current_parameter_sd=parameters[0]
        )

    @property
    def differs_at_draws(self) -> bool:
        """Whether anything is worked out at draws: not where rates scatter, or where values have a sandwich covariance.

        The effect of a factor on the rate of a test is that at the estimates. At a draw it would not quite be the
        derivative to the law's own coefficient, and tests would seem to tell the two apart.
        """
        fits = [law.fit for law in self.outcomes.laws]
        return all(fit.noise_model.rate == 0 and fit.settings.weights == "likelihood" for fit in fits)

    def _parameter_sd(self, position: int, after: Floats, points: Floats) -> dict[str, float]:
        law = self.outcomes.laws[position]
        to_theta = law.fit.coordinates.jacobian(points)
        variances = np.einsum("cpq,cqr,cpr->cp", to_theta, after[:, : law.size, : law.size], to_theta)
        sd = np.exp(0.5 * np.log(np.maximum(variances, 1e-300)).mean(axis=0))
        return dict(zip(_scaled_names(law.fit.law), sd.tolist(), strict=True))

    def _covariances(
        self, position: int, histories: Sequence[History], at_draws: bool
    ) -> tuple[Floats, Floats, Floats]:
        """Covariances (draws, q, q) of q before and after the tests, and u (draws, parameters) at the draws."""
        law = self.outcomes.laws[position]
        if not (at_draws and self.differs_at_draws):
            _, K = self.outcomes.of(histories, position)
            information = law.information
            T = law.sandwich
            before, after = (T @ scaled_inverse(A) @ T.T for A in (information, information + K.T @ K))
            return before[None], after[None], law.fit.u[None]
        deviations = self._drawn(position)
        information = self._information[position]
        added = np.zeros_like(information)
        for history in histories:
            _, K, ruptures = self.outcomes.drawn(history, position, deviations)
            added += np.where(ruptures[:, None, None], 0.0, np.einsum("cnp,cnq->cpq", K, K))
        before = np.stack([scaled_inverse(A) for A in information])
        after = np.stack([scaled_inverse(A) for A in information + added])
        return before, after, law.fit.u + deviations[:, : law.size]

    def _drawn(self, position: int) -> Floats:
        if position not in self._deviations:
            law = self.outcomes.laws[position]
            self._deviations[position] = law.draws(DRAWS, self.seed)
            self._information[position] = law.expansion(self._deviations[position]).information
        return self._deviations[position]


def _scaled_names(law: CreepLaw) -> list[str]:
    """Names of parameters, "ln A" of one whose scale is log."""
    return [f"ln {p.name}" if param.scale == "log" else p.name for p, param in law.params.items()]
