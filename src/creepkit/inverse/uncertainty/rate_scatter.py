"""The scatter of creep rates between tests: random effects of laboratories, heats and single tests.

With b_j the ln of the factor by which test j creeps faster than the law, r_j its residuals at the estimate, J_j and d_j
their derivatives to the unknowns x and to b_j, and N_j their covariance without scatter of rates,

    z_j = -d'N^-1 r / d'N^-1 d = b_j + X_j dx + e_j,    X_j = d'N^-1 J / d'N^-1 d,    var e_j = 1 / d'N^-1 d,

is what a test says of its own factor, dx being the true unknowns less the estimate. What else the curves say of dx is
independent of it, a quadratic form with matrix K and gradient g. So each curve becomes one number, and unknowns and
effects of heats and laboratories, c, are those of a linear mixed model: given the standard deviations s of the effects,

    (dx, c) is normal with precision [K 0; 0 S^-1] + [X Z]' D^-1 [X Z],    D = s_test^2 + var e,

Z saying which heat and laboratory a test is of, and S being diagonal with s_heat^2 and s_laboratory^2. Integrating it
out leaves the restricted likelihood of s. Few tests say little of s: a prior of the size u that is usual between creep
tests holds it, exp(-s^2 / 2 u^2) / (s + u / 3), with four times the estimate in the exponent where that is more than
u. Below that it is like that of Jeffreys, 1 / s, with which intervals by few tests are those of Student's t, but flat
where s is too small to matter; a flat prior made them wider by a quarter. Intervals of predictions are integrals over
the posterior distribution of s.

Source: S. Searle, G. Casella and C. McCulloch, Variance Components (1992), chapters 6 and 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtr

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import ASSUMED_RATE_SD, NoiseModel, known_sd
from creepkit.inverse.output_transforms import LinearTransform, LogTransform
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, LinearisedProblem, scaled_inverse
from creepkit.records import History

USUAL_SD = {"test": ASSUMED_RATE_SD, "heat": 0.5, "laboratory": 0.3}
"""Of ln rate: what is usual of each level, u."""


FLAT_BELOW = 1.0 / 3.0
"""Of what is usual: standard deviations that the prior hardly tells apart, since rates are not known that well."""


SMALLEST_FACTOR = 0.1
"""Of ln rate: a smaller deviation of a test is no finding, however exact the tests are."""


LEVELS = ("laboratory", "heat", "test")
"""From the outermost to the innermost."""


LABELS = {"laboratory": ("laboratory", "lab"), "heat": ("heat", "cast", "batch")}
"""Labels of a history that name its laboratory and its heat."""


NODES = {1: 60, 2: 24, 3: 12}
"""Standard deviations of a level at which its posterior distribution is taken, by the number of levels."""


EVIDENCE_NODES = 25
"""Those between single tests over which evidence is averaged."""


REFINEMENTS, GRID_HALF_WIDTH = 2, 4.0
"""How often the grid is refined, and its half width then, in standard deviations of the posterior on the one before."""


SMALLEST_EFFECT = 1e-6
"""Of ln rate: an effect without scatter has this standard deviation."""


SMALLEST_SD, LARGEST_IN_PRIORS = 1e-3, 4.0
"""Ends of these standard deviations: of ln rate, and over the standard deviation of the prior."""


REACH = 4.0
"""Standard deviation of the prior over the estimate, where that is more than what is usual: of 5 and 9 tests intervals
then hold as often as those of Student's t whatever the scatter."""


def level_of(history: History, level: str) -> str:
    """The laboratory or the heat of a history, by its labels; "" where it states none, and of the level "test"."""
    return next((history.labels[key] for key in LABELS.get(level, ()) if history.labels.get(key)), "")


@dataclass(frozen=True, eq=False)
class Evidence:
    """What tests say of further effects on their rates, averaged over the scatter between single tests.

    log : ln of the marginal likelihood, but for a constant of the tests. mean, sd : (effects,). step : (unknowns,) dx.
    p_value : (effects,) of one as far from zero by chance: of Student's t, a mean of normal ones over the scatter;
        its degrees of freedom are those of the tests and of the prior of the scatter.
    """

    log: float
    mean: Floats
    sd: Floats
    step: Floats
    p_value: Floats


@dataclass(frozen=True, eq=False)
class RateScatter:
    """What tests say of the scatter of rates between them, and with it of the unknowns x = (u, e).

    tests : their names. members : {level: (tests,) names} of the levels that these tests tell apart, without "test".
    common : {level: name} of the levels whose one member they all belong to.
    log_factor, variance : (tests,) z and var e. design : (tests, unknowns) X.
    precision, gradient : (unknowns, unknowns) K and (unknowns,) g.
    known : the standard deviation between tests where it was given, None where it is estimated; 0 for none.
    stresses, temperatures : (tests,) MPa and K. errors : (unknowns, unknowns) covariance of x by errors common to all
        tests that nobody modelled, or None; of nuisances none.
    reach : standard deviation of the prior of the scatter, over what is usual.
    output_scales, output_floors : {output: scale of a linear, floor of a logarithmic transform}, in its unit, in which
        misfit and drift of the noise model are stated.
    """

    tests: tuple[str, ...]
    members: Mapping[str, tuple[str, ...]]
    log_factor: Floats
    variance: Floats
    design: Floats
    precision: Floats
    gradient: Floats
    common: Mapping[str, str] = field(default_factory=dict)
    known: float | None = None
    stresses: Floats = field(default_factory=lambda: np.zeros(0))
    temperatures: Floats = field(default_factory=lambda: np.zeros(0))
    errors: Floats | None = None
    reach: float = 1.0
    output_scales: Mapping[str, float] = field(default_factory=dict)
    output_floors: Mapping[str, float] = field(default_factory=dict)

    @property
    def levels(self) -> tuple[str, ...]:
        """Levels whose standard deviations these tests say something of, outermost first."""
        return (*(level for level in LEVELS if level in self.members), "test")

    @cached_property
    def groups(self) -> tuple[tuple[str, str], ...]:
        """(level, member) of each effect c, in the order in which they follow the unknowns."""
        return tuple((level, name) for level in self.levels[:-1] for name in dict.fromkeys(self.members[level]))

    def position(self, level: str, member: str) -> int | None:
        """The position of a member's effect among unknowns and effects; None where it was not fitted."""
        key = (level, member)
        return self.design.shape[1] + self.groups.index(key) if key in self.groups else None

    @cached_property
    def joint_design(self) -> Floats:
        """(tests, unknowns + effects) [X Z]."""
        table = [[float(self.members[level][k] == name) for level, name in self.groups] for k in range(len(self.tests))]
        return np.concatenate([self.design, np.array(table, float).reshape(len(self.tests), -1)], axis=1)

    @cached_property
    def posterior(self) -> ScatterPosterior:
        """The posterior distribution of the standard deviations."""
        if self.known is not None:
            sd = np.array([[0.0] * (len(self.levels) - 1) + [self.known]])
            return ScatterPosterior(self.levels, sd, np.ones(1))
        scale = np.array([USUAL_SD[level] for level in self.levels])
        low, high = np.full(scale.size, np.log(SMALLEST_SD)), np.log(LARGEST_IN_PRIORS * self.reach * scale)
        result = self._on_grid(low, high)
        for _ in range(REFINEMENTS):
            centre = result.weight @ np.log(result.sd)
            spread = np.sqrt(result.weight @ (np.log(result.sd) - centre) ** 2)
            half_width = GRID_HALF_WIDTH * np.maximum(spread, (high - low) / NODES[scale.size])
            low, high = np.maximum(low, centre - half_width), np.minimum(high, centre + half_width)
            result = self._on_grid(low, high)
        return result

    def _on_grid(self, low: Floats, high: Floats) -> ScatterPosterior:
        """The posterior on a grid, even in ln of standard deviations between low and high, (levels,) each."""
        axes = [np.linspace(first, last, NODES[low.size]) for first, last in zip(low, high, strict=True)]
        sd = np.exp(np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=-1))
        log_weight = log_prior(sd, self.levels, self.reach) + self.solved(sd)[0]
        weight = np.exp(log_weight - log_weight.max())
        return ScatterPosterior(self.levels, sd, weight / weight.sum())

    def solved(
        self, sd: Floats, columns: Floats | None = None, prior_sd: Floats | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """ln of the restricted likelihood, mean and covariance of (dx, c) and of further effects on rates, given sd.

        sd : (..., levels). columns : (tests, effects) on ln rates. prior_sd : (effects,) their prior standard
        deviations. Returns (...,), (..., n) and (..., n, n).
        """
        own = np.maximum(sd[..., -1:], SMALLEST_EFFECT) ** 2 + self.variance
        further = np.zeros((self.variance.size, 0)) if columns is None else columns
        Q, size = np.concatenate([self.joint_design, further], axis=1), self.design.shape[1]
        of_group = sd[..., [self.levels.index(level) for level, _ in self.groups]]
        of_further = np.zeros(0) if prior_sd is None else np.asarray(prior_sd, float)
        prior = np.concatenate(
            [np.maximum(of_group, SMALLEST_EFFECT), np.broadcast_to(of_further, (*sd.shape[:-1], of_further.size))], -1
        )
        precision = Q.T @ (Q / own[..., None])
        precision[..., :size, :size] += self.precision
        effects = np.arange(size, Q.shape[1])
        precision[..., effects, effects] += prior**-2.0
        right = (self.log_factor / own) @ Q
        right[..., :size] -= self.gradient
        scale = np.sqrt(np.maximum(np.diagonal(precision, axis1=-2, axis2=-1), 1e-300))
        squares = scale[..., :, None] * scale[..., None, :]
        covariance = np.linalg.inv(precision / squares) / squares
        mean = (covariance @ right[..., None])[..., 0]
        chi_square = (self.log_factor**2 / own).sum(-1) - (right * mean).sum(-1)
        determinant = np.linalg.slogdet(precision / squares)[1] + 2.0 * (np.log(scale).sum(-1) + np.log(prior).sum(-1))
        return -0.5 * (chi_square + determinant + np.log(own).sum(-1)), mean, covariance

    def over_scatter(self, columns: Floats, prior_sd: Floats) -> tuple[Floats, Floats, Floats]:
        """The same at standard deviations between single tests, (nodes, ...), with ln of their prior in the first.

        columns : (tests, effects) on ln rates. prior_sd : (effects,) standard deviations. Those between heats and
        laboratories are as is likely; a known one between tests is the one node.
        """
        known = self.known is not None
        nodes = np.array([self.known]) if known else np.geomspace(SMALLEST_SD, LARGEST_RATE_SCATTER, EVIDENCE_NODES)
        prior = np.zeros(1) if known else log_prior(nodes[:, None], ("test",))
        groups = [np.full(nodes.size, self.posterior.mean_square(level) ** 0.5) for level in self.levels[:-1]]
        log, mean, covariance = self.solved(np.stack([*groups, nodes], axis=-1), columns, prior_sd)
        return log + prior - np.logaddexp.reduce(prior), mean, covariance

    def evidence(self, columns: Floats, prior_sd: Floats) -> Evidence:
        """Of further effects on ln rates. columns : (tests, effects). prior_sd : (effects,) standard deviations."""
        logs, means, covariances = self.over_scatter(columns, prior_sd)
        log, unknowns = float(np.logaddexp.reduce(logs)), self.joint_design.shape[1]
        share = np.exp(logs - log)
        mean = share @ means
        variances = np.diagonal(covariances, axis1=1, axis2=2)
        sd = np.sqrt(share @ (variances + (means - mean) ** 2))
        p_value = share @ (2.0 * ndtr(-np.abs(means) / np.sqrt(variances)))
        step = mean[: self.design.shape[1]]
        return Evidence(log, mean[unknowns:], sd[unknowns:], step, p_value[unknowns:])

    def joint(self, sd: Floats) -> tuple[Floats, Floats]:
        """Means (..., unknowns + effects) and covariances of (dx, c) about the estimate, given sd (..., levels).

        Where the estimate is not the optimum under this covariance (it is one of least squares), its distance from
        that counts as an error of the estimate: dx has the mean zero, and as covariance its second moment. Errors
        common to all tests move dx, and not how tests differ.
        """
        _, optimum, covariance = self.solved(sd)
        size = self.design.shape[1]
        shift, own = optimum[..., :size], covariance[..., :size, :size]
        gain = covariance[..., size:, :size] @ scaled_inverse(own)
        second = shift[..., :, None] * shift[..., None, :]
        about, transposed = own + second, np.swapaxes(gain, -1, -2)
        effects = optimum[..., size:] - (gain @ shift[..., None])[..., 0]
        joint = np.empty_like(covariance)
        joint[..., :size, :size] = about + (0.0 if self.errors is None else self.errors)
        joint[..., :size, size:] = about @ transposed
        joint[..., size:, :size] = gain @ about
        joint[..., size:, size:] = covariance[..., size:, size:] + gain @ second @ transposed
        return np.concatenate([np.zeros_like(shift), effects], axis=-1), joint

    @cached_property
    def joint_at_nodes(self) -> tuple[Floats, Floats]:
        """Means (nodes, unknowns + effects) and covariances of (dx, c) at the nodes of the posterior distribution."""
        return self.joint(self.posterior.sd)

    @cached_property
    def mean_joint(self) -> tuple[Floats, Floats]:
        """Mean and covariance of (dx, c) over the posterior distribution of the standard deviations."""
        posterior, (means, covariances) = self.posterior, self.joint_at_nodes
        mean = posterior.weight @ means
        deviation = means - mean
        between = np.einsum("n,ni,nj->ij", posterior.weight, deviation, deviation)
        return mean, np.einsum("n,nij->ij", posterior.weight, covariances) + between

    def new_test(self, history: History, misfit: float = 0.0) -> NewTest:
        """Which effects a new test shares with those that were fitted, and which levels it draws anew.

        misfit : standard deviation of ln of its rate by what the law misses there (see uncertainty.law_misfit).
        """
        known, unknown = {}, ["test"]
        for level in LEVELS[:-1]:
            name = level_of(history, level)
            position = self.position(level, name)
            if position is not None:
                known[level] = position
            elif level in self.members:
                unknown.append(level)
        unseen = [
            level
            for level in LEVELS[:-1]
            if self.known is None
            and level_of(history, level)
            and self.common.get(level, "") not in ("", level_of(history, level))
        ]
        return NewTest(known, tuple(unknown), tuple(unseen), misfit)

    def own_variance(self, test: NewTest, sd: Floats) -> Floats:
        """(nodes,) variance of ln of what is new in the factor of a test; sd : (nodes, levels)."""
        drawn = sum(sd[:, self.levels.index(level)] ** 2 for level in test.unknown)
        return np.asarray(drawn + sum(USUAL_SD[level] ** 2 for level in test.unseen) + test.misfit**2)


@dataclass(frozen=True)
class NewTest:
    """Where the factor of a new test on the rate comes from.

    known : {level: position of its effect among unknowns and effects} of a heat or laboratory that was fitted.
    unknown : levels that are drawn anew; unseen : levels of which all fitted tests had one other member, so that the
    scatter is what is usual. misfit : standard deviation of ln of its rate by what the law misses there.
    """

    known: Mapping[str, int]
    unknown: tuple[str, ...]
    unseen: tuple[str, ...]
    misfit: float = 0.0


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


def log_prior(sd: Floats, levels: Sequence[str], reach: float = 1.0) -> Floats:
    """(...,) ln of the prior density of ln of standard deviations sd (..., levels), but for a constant."""
    usual = np.array([USUAL_SD[level] for level in levels])
    return np.asarray((np.log(sd / (sd + FLAT_BELOW * usual)) - 0.5 * (sd / (reach * usual)) ** 2).sum(axis=-1))


def redundant_rates(linear: LinearisedProblem, noise_model: NoiseModel) -> int:
    """How many combinations of the rates of tests no unknown moves, within its prior, by more than SMALLEST_FACTOR."""
    residuals = linear.residuals
    factor = CovarianceFactor.of_residuals(residuals, replace(noise_model, rate=0.0))
    weighted = factor.inverse_times(residuals.log_rate_sensitivity)
    information = np.maximum((weighted * residuals.log_rate_sensitivity).sum(axis=1), 1e-300)
    moved = np.einsum("te,tep->tp", weighted, residuals.jacobian) / information[:, None] * linear.prior_sd
    return len(moved) - int((np.linalg.svd(moved, compute_uv=False) > SMALLEST_FACTOR).sum())


def rate_scatter(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    test_effects: Sequence[Floats] = (),
    errors: Floats | None = None,
) -> RateScatter:
    """The scatter of rates between tests, of a problem made linear at its optimum.

    noise_model : of the data. test_effects : (tests, observations) each, one standard deviation of what differs between
        tests beside their rates, such as a thickness within its tolerance. errors : (unknowns, unknowns) as
        RateScatter has them.
    """
    nuisances, count, observations = problem.nuisance_parameters, problem.parameter_count, problem.observations
    integrated = count + np.array(nuisances.integrated, np.int64)
    prior_gradient = linear.precision * linear.prior_residual
    prior_gradient[integrated] = 0.0
    e = nuisances.mean[: nuisances.size] + linear.prior_residual[count:]
    residuals = nuisances.integrate_out(linear.residuals, e)
    jacobian = residuals.jacobian.copy()
    jacobian[..., integrated] = 0.0
    factor = CovarianceFactor.of_residuals(residuals, replace(noise_model, rate=0.0))
    effects = np.stack([residuals.values, *test_effects], axis=-1)
    weighted_rate = factor.inverse_times(residuals.log_rate_sensitivity)
    information = np.maximum(np.einsum("te,te->t", weighted_rate, residuals.log_rate_sensitivity), 1e-12)
    joined = np.concatenate([effects, jacobian], axis=-1)
    projected = np.einsum("te,tep->tp", weighted_rate, joined) / information[:, None]
    design, log_factor = projected[:, effects.shape[-1] :], -projected[:, 0]
    weighted = factor.inverse_times(jacobian)
    precision = np.einsum("tep,teq->pq", weighted, jacobian) + np.diag(linear.precision)
    precision -= np.einsum("tp,t,tq->pq", design, information, design)
    gradient = np.einsum("tep,te->p", weighted, residuals.values) + prior_gradient
    gradient += design.T @ (information * log_factor)
    transforms = dict(zip(observations.outputs, observations.transforms, strict=True))
    return RateScatter(
        tests=tuple(h.name for h in problem.histories),
        members=_members(problem.histories),
        log_factor=log_factor,
        variance=1.0 / information + (projected[:, 1 : effects.shape[-1]] ** 2).sum(axis=1),
        design=design,
        precision=0.5 * (precision + precision.T),
        gradient=gradient,
        common=_common_members(problem.histories),
        known=known_sd(problem.settings.nuisances, "rate"),
        stresses=problem.conditions[0],
        temperatures=problem.conditions[1],
        errors=errors,
        reach=max(1.0, REACH * noise_model.rate / USUAL_SD["test"]),
        output_scales={n: t.scale for n, t in transforms.items() if isinstance(t, LinearTransform)},
        output_floors={n: t.floor for n, t in transforms.items() if isinstance(t, LogTransform)},
    )


def _members(histories: Sequence[History]) -> dict[str, tuple[str, ...]]:
    """{level: names} of the levels that these tests tell apart: some member has two tests, and two members are named.

    Beside two that are named a test that states none is a member of its own; beside one it is taken for one of that.
    """
    members = {}
    for level in LEVELS[:-1]:
        stated = [level_of(h, level) for h in histories]
        names = tuple(name or f"(of {h.name})" for name, h in zip(stated, histories, strict=True))
        if len(set(stated) - {""}) > 1 and len(set(names)) < len(names):
            members[level] = names
    return members


def _common_members(histories: Sequence[History]) -> dict[str, str]:
    """{level: its one member} of the levels of which these tests name no other; those that state none count to it."""
    named = {level: {level_of(h, level) for h in histories} - {""} for level in LEVELS[:-1]}
    return {level: next(iter(found)) for level, found in named.items() if len(found) == 1}


def unstated_member_notes(histories: Sequence[History]) -> list[str]:
    """Tests that state no heat or laboratory where others do, and what was assumed of them, a sentence a level."""
    common, members, notes = _common_members(histories), _members(histories), []
    for level in (*common, *members):
        without = [h.name for h in histories if not level_of(h, level)]
        if without:
            several = len(without) > 1
            tests = f"{without[0]} and {len(without) - 1} more state" if several else f"{without[0]} states"
            own = f"one {level} each" if several else f"a {level} of its own"
            one = "tests" if several else "one"
            assumed = f"{one} of {level} {common[level]}, as the others are" if level in common else own
            notes.append(f"{tests} no {level}: taken for {assumed}")
    return notes
