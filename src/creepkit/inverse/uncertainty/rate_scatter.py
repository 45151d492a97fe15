"""The scatter of creep rates between tests, as levels of one random effect: laboratories, heats, and single tests.

With b_j the ln of the factor by which test j creeps faster than the law, r_j its residuals, J_j and d_j their
derivatives to the unknowns and to b_j, and N_j their covariance without scatter of rates,

    z_j = -d'N^-1 r / d'N^-1 d = b_j + X_j dx + e_j,    X_j = d'N^-1 J / d'N^-1 d,    var e_j = 1 / d'N^-1 d,

is what a test says of its own factor, dx being the error of the unknowns. So each curve becomes one number, and the
standard deviations of the levels have the restricted likelihood of a small linear mixed model. Few tests say little of
them: a half-normal prior, of the size that is usual between creep tests, holds them. Intervals of predictions are
integrals over that posterior distribution, in the place of a factor of Student's t that knows nothing beforehand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import ASSUMED_RATE_SD, NoiseModel, Residuals, covariance
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.records import History, Nuisance

USUAL_SD = {"test": ASSUMED_RATE_SD, "heat": 0.5, "laboratory": 0.3}
"""Of ln rate: standard deviation of the half-normal prior of each level's standard deviation."""


LEVELS = ("laboratory", "heat", "test")
"""From the outermost to the innermost."""


LABELS = {"laboratory": ("laboratory", "lab"), "heat": ("heat", "cast", "batch")}
"""Labels of a history that name its laboratory and its heat."""


NODES = {1: 60, 2: 24, 3: 12}
"""Standard deviations of a level at which its posterior distribution is taken, by the number of levels."""


SMALLEST_SD, LARGEST_IN_PRIORS = 1e-3, 4.0
"""Ends of these standard deviations: of ln rate, and over the standard deviation of the prior."""


def level_of(history: History, level: str) -> str:
    """The laboratory or the heat of a history, by its labels; "" where it states none, and of the level "test"."""
    return next((history.labels[key] for key in LABELS.get(level, ()) if history.labels.get(key)), "")


@dataclass(frozen=True, eq=False)
class RateScatter:
    """What tests say of the scatter of rates between them, and how it enters the unknowns x = (u, e).

    tests : their names. members : {level: (tests,) names} of the levels that these tests tell apart, without "test".
    common : {level: name} of the levels whose one member they all belong to.
    log_factor, variance : (tests,) z and var e. design : (tests, unknowns) X. precision : (unknowns, unknowns) of the
        unknowns by all that is independent of the tests' factors.
    within : (unknowns, unknowns) covariance of the unknowns without scatter; gain : (unknowns, tests) derivatives of
        the estimate to the tests' factors.
    known : the standard deviation between tests where it was given, None where it is estimated; 0 for none.
    output_scales : {output: unit of its transformed output}, in which misfit and drift are stated: 1 for logarithms.
    """

    tests: tuple[str, ...]
    members: Mapping[str, tuple[str, ...]]
    log_factor: Floats
    variance: Floats
    design: Floats
    precision: Floats
    within: Floats
    gain: Floats
    common: Mapping[str, str] = field(default_factory=dict)
    known: float | None = None
    output_scales: Mapping[str, float] = field(default_factory=dict)

    @property
    def levels(self) -> tuple[str, ...]:
        """Levels whose standard deviations these tests say something of, outermost first."""
        return (*(level for level in LEVELS if level in self.members), "test")

    @cached_property
    def indicators(self) -> dict[str, Floats]:
        """{level: (tests, members)} which member a test belongs to; each test is a member of the level "test"."""
        tables = {
            level: np.array([[float(name == member) for member in dict.fromkeys(names)] for name in names])
            for level, names in self.members.items()
        }
        return {**tables, "test": np.eye(len(self.tests))}

    @cached_property
    def posterior(self) -> ScatterPosterior:
        """The posterior distribution of the standard deviations."""
        if self.known is not None:
            sd = np.array([[0.0] * (len(self.levels) - 1) + [self.known]])
            return ScatterPosterior(self.levels, sd, np.ones(1))
        count = len(self.levels)
        axes = [np.geomspace(SMALLEST_SD, LARGEST_IN_PRIORS * USUAL_SD[level], NODES[count]) for level in self.levels]
        sd = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=-1)
        usual = np.array([USUAL_SD[level] for level in self.levels])
        log_weight = np.log(sd).sum(axis=1) - 0.5 * ((sd / usual) ** 2).sum(axis=1)  # d sd = sd d ln sd
        log_weight += np.array([self.restricted_log_likelihood(one) for one in sd])
        weight = np.exp(log_weight - log_weight.max())
        return ScatterPosterior(self.levels, sd, weight / weight.sum())

    def effect_covariance(self, sd: Floats) -> Floats:
        """(tests, tests) covariance of the tests' ln factors; sd : (levels,)."""
        return np.asarray(
            sum(
                s**2 * self.indicators[level] @ self.indicators[level].T
                for s, level in zip(sd, self.levels, strict=True)
            )
        )

    def restricted_log_likelihood(self, sd: Floats) -> float:
        """ln of the restricted likelihood of standard deviations sd (levels,), but for a constant."""
        total = self.effect_covariance(sd) + np.diag(self.variance)
        joined = np.concatenate([self.log_factor[:, None], self.design], axis=1)
        weighted = np.linalg.solve(total, joined)
        normal_matrix = self.precision + self.design.T @ weighted[:, 1:]
        right = self.design.T @ weighted[:, 0]
        chi_square = self.log_factor @ weighted[:, 0] - right @ _scaled_solve(normal_matrix, right)
        log_determinant = np.linalg.slogdet(total)[1] + np.linalg.slogdet(normal_matrix)[1]
        return float(-0.5 * (chi_square + log_determinant))

    def covariance(self, sd: Floats) -> Floats:
        """(unknowns, unknowns) covariance of the unknowns where tests scatter with standard deviations sd (levels,)."""
        return np.asarray(self.within + self.gain @ self.effect_covariance(sd) @ self.gain.T)

    def member_predictor(self, level: str, sd: Floats) -> Floats:
        """(members, tests) best linear predictor of the effects of a level's members from the tests' z; sd : (levels,).

        Universal kriging: it gives nothing for a change of the unknowns, which every test shares.
        """
        total = self.effect_covariance(sd) + np.diag(self.variance)
        weighted = np.linalg.solve(total, np.concatenate([np.eye(len(self.tests)), self.design], axis=1))
        inverse, by_design = weighted[:, : len(self.tests)], weighted[:, len(self.tests) :]
        normal_matrix = self.precision + self.design.T @ by_design
        projected = inverse - by_design @ _scaled_solve(normal_matrix, by_design.T)
        return np.asarray(sd[self.levels.index(level)] ** 2 * self.indicators[level].T @ projected)


@dataclass(frozen=True, eq=False)
class ScatterPosterior:
    """Standard deviations of ln rate with their probabilities: sd (nodes, levels), weight (nodes,)."""

    levels: tuple[str, ...]
    sd: Floats
    weight: Floats

    def mean_square(self, level: str) -> float:
        """Expected variance of a level; of one that the tests do not tell apart 0."""
        if level not in self.levels:
            return 0.0
        return float(self.weight @ self.sd[:, self.levels.index(level)] ** 2)

    @property
    def total_variance(self) -> Floats:
        """(nodes,) variance of ln rate over all levels."""
        return np.asarray((self.sd**2).sum(axis=1))

    def median(self, level: str) -> float:
        """Median standard deviation of a level."""
        values = self.sd[:, self.levels.index(level)]
        order = np.argsort(values)
        cumulative = np.cumsum(self.weight[order])
        return float(values[order][min(int(np.searchsorted(cumulative, 0.5)), values.size - 1)])


def rate_scatter(
    problem: LeastSquaresProblem,
    x: Floats,
    residuals: Residuals,
    fitting_noise: NoiseModel,
    noise_model: NoiseModel,
    shared_effects: Sequence[Floats] = (),
) -> RateScatter:
    """The scatter of rates between tests at an optimum x (unknowns,).

    residuals : there, with derivatives to all unknowns. fitting_noise : under which the values were found; noise_model
        : of the data. shared_effects : (tests, observations) each, one standard deviation of what differs between tests
        beside their rates, such as a thickness within its tolerance.
    """
    count, nuisances = problem.parameter_count, problem.nuisance_parameters
    prior_precision = np.concatenate([12.0 / problem.bounds.width[:count] ** 2, nuisances.precision])
    without_rate = replace(noise_model, rate=0.0)
    at_prior_means = nuisances.integrate_out(residuals, x[count:])
    integrated = [
        count + k
        for k, n in enumerate(nuisances.nuisances[: nuisances.size])
        if n.scope == "test" and np.isfinite(nuisances.sd[k])
    ]
    evidence = _evidence(at_prior_means, without_rate, integrated, prior_precision, shared_effects)
    assert residuals.jacobian is not None
    fitting = CovarianceFactor.of_residuals(residuals, fitting_noise).inverse_times(residuals.jacobian)
    inverse = scaled_inverse(np.einsum("tep,teq->pq", fitting, residuals.jacobian) + np.diag(prior_precision))
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    noise = covariance(unweighted, without_rate)
    meat = np.einsum("tep,tef,tfq->pq", fitting, noise, fitting, optimize=True) + np.diag(prior_precision)
    for effect in shared_effects:
        by_test = np.einsum("tep,te->pt", fitting, effect)
        meat += by_test @ by_test.T
    within = inverse @ meat @ inverse
    return RateScatter(
        tests=tuple(h.name for h in problem.histories),
        members=_members(problem.histories),
        common=_common_members(problem.histories),
        within=0.5 * (within + within.T),
        gain=inverse @ np.einsum("tep,te->pt", fitting, residuals.log_rate_sensitivity),
        known=_known_sd(problem.settings.nuisances),
        output_scales={
            name: float(getattr(transform, "scale", 1.0))
            for name, transform in zip(problem.observations.outputs, problem.observations.transforms, strict=True)
        },
        **evidence,
    )


def _evidence(
    residuals: Residuals,
    noise_model: NoiseModel,
    integrated: Sequence[int],
    prior_precision: Floats,
    shared_effects: Sequence[Floats],
) -> dict[str, Floats]:
    """What tests say of their factors: `log_factor`, `variance`, `design` and `precision` of a RateScatter.

    residuals : at prior means of nuisance parameters of tests; integrated : positions of these among the unknowns.
    """
    assert residuals.jacobian is not None
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    jacobian = residuals.jacobian.copy()
    jacobian[..., list(integrated)] = 0.0
    factor = CovarianceFactor.of_residuals(unweighted, noise_model)
    effects = np.stack([unweighted.values, *shared_effects], axis=-1)
    weighted_rate = factor.inverse_times(unweighted.log_rate_sensitivity)
    information = np.maximum(np.einsum("te,te->t", weighted_rate, unweighted.log_rate_sensitivity), 1e-12)
    joined = np.concatenate([effects, jacobian], axis=-1)
    projected = np.einsum("te,tep->tp", weighted_rate, joined) / information[:, None]
    design = projected[:, effects.shape[-1] :]
    own = np.einsum("tep,teq->pq", factor.inverse_times(jacobian), jacobian)
    precision = own - np.einsum("tp,t,tq->pq", design, information, design) + np.diag(prior_precision)
    return {
        "log_factor": -projected[:, 0],
        "variance": 1.0 / information + (projected[:, 1 : effects.shape[-1]] ** 2).sum(axis=1),
        "design": design,
        "precision": 0.5 * (precision + precision.T),
    }


def _members(histories: Sequence[History]) -> dict[str, tuple[str, ...]]:
    """{level: names} of the levels that tell these tests apart: some member has two tests, and there are two members.

    A test that states none is a member of its own.
    """
    members = {}
    for level in LEVELS[:-1]:
        names = tuple(level_of(h, level) or f"(of {h.name})" for h in histories)
        if 1 < len(set(names)) < len(names):
            members[level] = names
    return members


def _common_members(histories: Sequence[History]) -> dict[str, str]:
    """{level: its one member} of the levels that all these tests state alike."""
    names = {level: {level_of(h, level) for h in histories} for level in LEVELS[:-1]}
    return {level: next(iter(found)) for level, found in names.items() if len(found) == 1 and "" not in found}


def _known_sd(nuisances: Sequence[Nuisance]) -> float | None:
    """The standard deviation of the rate where a nuisance gives it; 0 without such a nuisance; else None."""
    for nuisance in nuisances:
        if nuisance.kind == "rate":
            return nuisance.sd
    return 0.0


def _scaled_solve(matrix: Floats, right: Floats) -> Floats:
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = right / (scale if right.ndim == 1 else scale[:, None])
    solution = np.linalg.solve(matrix / np.outer(scale, scale), scaled)
    return np.asarray(solution / (scale if right.ndim == 1 else scale[:, None]))
