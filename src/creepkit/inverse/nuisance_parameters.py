"""Explicit nuisance parameters of tests, estimated beside the parameters of the law under Gaussian priors.

Each is of one test, of one alloy, or of all tests or a group of them: a length of the test piece, modulus, temperature,
and what the rig did during the tests (steps and drifts of temperature, rate and load).

What nobody models is a perturbation (see inverse.perturbations): the record of one, its size, what it does to the rate,
and sentences.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError, nearest, refuse_unknown
from creepkit.inverse.noise_model import Residuals
from creepkit.language import CreepLaw, temperature
from creepkit.records import (
    SCALABLE_LOADS,
    STEP_NUISANCES,
    History,
    Nuisance,
    Predictor,
    dimension_named,
    drift_duration,
    is_length_nuisance,
    kind_and_start,
    nuisance_key,
)


@dataclass(frozen=True)
class UsualSize:
    """Of a kind of nuisance: unit, where the estimate of a prior standard deviation begins, limits."""

    unit: str
    prior_sd: float
    low: float
    high: float


USUAL = {
    "modulus": UsualSize("relative", 0.05, -0.7, 2.0),
    "temperature": UsualSize("K", 5.0, -150.0, 150.0),
    "temperature step": UsualSize("K", 10.0, -150.0, 150.0),
    "temperature drift": UsualSize("K", 5.0, -150.0, 150.0),
    "rate step": UsualSize("in ln", 0.3, -5.0, 5.0),
    "rate drift": UsualSize("in ln", 0.3, -5.0, 5.0),
    "load step": UsualSize("relative", 0.05, -0.7, 2.0),
}
"""Of the kinds that are no lengths."""


USUAL_LENGTH = UsualSize("mm", 0.06, 0.3, 3.0)
"""Of lengths, as multiples of their mean."""


SMALLEST_PRIOR_SD = 1e-3
"""Of the initial prior standard deviation: an estimated one is never less."""


@dataclass(frozen=True, eq=False)
class NuisanceParameters:
    """The nuisance parameters e of tests.

    nuisances, owners : of each, its nuisance and whose it is (a test, an alloy, or "all").
    test_index : {kind: (tests,)} which one a test has, -1 where its predictor does not know the kind.
    mean, sd, low, high : (nuisances,) prior and limits, in the unit of the kind; sd may be infinite.
    fixed : whether they stay at their means, as in a global search.
    """

    nuisances: tuple[Nuisance, ...]
    owners: tuple[str, ...]
    test_index: Mapping[str, Ints]
    mean: Floats
    sd: Floats
    low: Floats
    high: Floats
    fixed: bool = False

    @classmethod
    def from_histories(
        cls, nuisances: Sequence[Nuisance], histories: Sequence[History], predictor: Predictor
    ) -> NuisanceParameters:
        """One for each test, alloy, group or all tests that it applies to and whose predictor knows the kind."""
        parameters: list[tuple[Nuisance, str]] = []
        test_index: dict[str, Ints] = {}
        _refuse_two_names(nuisances, histories, predictor)
        for nuisance in (n for n in nuisances if n.is_simulated):
            offered = [_takes_effect(nuisance, h, predictor) for h in histories]
            named = any(nuisance.applies_to(h.name) for h in histories)
            if named and not any(offered):
                allowed = {k for h in histories for k in getattr(predictor.for_history(h), "nuisances", ())}
                raise FitError(
                    f"nuisance '{nuisance.key}' means nothing to the predictor of these histories; leave it out, or "
                    f"take another: {nearest(nuisance.kind, sorted(allowed))}"
                )
            index = test_index.setdefault(nuisance.key, np.full(len(histories), -1, np.int64))
            first, owners = len(parameters), list[str]()
            for test in map(int, np.flatnonzero(offered)):
                if index[test] >= 0:
                    raise FitError(
                        f"test '{histories[test].name}' has the nuisance '{nuisance.key}' twice; let tests= of one of "
                        "them leave it out"
                    )
                owner = owner_of(nuisance, histories[test])
                owners += [owner] if owner not in owners else []
                index[test] = first + owners.index(owner)
            if named and nuisance.sd is None and len(owners) < 2:
                raise FitError(
                    f"nuisance '{nuisance.key}': a standard deviation cannot be estimated from a single value; "
                    "give its sd="
                )
            parameters += [(nuisance, owner) for owner in owners]
        for key, index in test_index.items():
            if (
                is_length_nuisance(kind_and_start(key)[0]) and (index >= 0).any()
            ):  # which is no deviation: a test cannot be without one
                for test in map(int, np.flatnonzero(index < 0)):
                    if predictor.for_history(histories[test]).follows(key):
                        raise FitError(
                            f"test '{histories[test].name}' has no nuisance '{key}', which other tests have; give it "
                            "one, or leave out tests="
                        )
        by_name = {h.name: h for h in histories}
        means = [prior_mean(n, by_name.get(owner), predictor) for n, owner in parameters]
        priors = [
            (mean, initial_prior_sd(n, mean), *_bounds_of(n, mean))
            for (n, _), mean in zip(parameters, means, strict=True)
        ]
        mean, sd, low, high = np.array(priors, float).reshape(-1, 4).T
        return cls(
            tuple(n for n, _ in parameters), tuple(owner for _, owner in parameters), test_index, mean, sd, low, high
        )

    @property
    def size(self) -> int:
        """Number of those that are estimated."""
        return 0 if self.fixed else self.mean.size

    @property
    def precision(self) -> Floats:
        """(nuisances,) 1 / unit^2, of the priors."""
        return 1.0 / self.sd[: self.size] ** 2

    def predictor_values(self, e: Floats) -> dict[str, Floats]:
        """{key: (1, tests)} as predictors take them, from e (nuisances,), in the unit of the kind; 0 where none is."""
        values = np.append(self.mean if self.fixed else e, 0.0)
        return {key: values[index][None] for key, index in self.test_index.items()}

    def jacobian(self, sensitivities: Mapping[str, Floats]) -> Floats:
        """(tests, observations, nuisances) derivatives.

        sensitivities : {key: (tests, observations)} to each test's own nuisance.
        """
        jacobian_matrix = np.zeros((*next(iter(sensitivities.values())).shape, self.size))
        for key, index in self.test_index.items():
            for test, position in enumerate(index):
                if position >= 0:
                    jacobian_matrix[test, :, position] = sensitivities[key][test]
        return jacobian_matrix

    @property
    def integrated(self) -> list[int]:
        """Positions of those of single tests that have a prior: what integrate_out() makes part of the covariance."""
        return [k for k, n in enumerate(self.nuisances[: self.size]) if n.scope == "test" and np.isfinite(self.sd[k])]

    def integrate_out(self, residuals: Residuals, e: Floats) -> Residuals:
        """The residuals of tests at their prior means, with the priors as part of the covariance; e : (nuisances,).

        To first order. At its estimate a nuisance parameter has taken up what scatter between tests it can, so that the
        residuals there do not show that scatter. Nuisance parameters that tests share stay as estimated.
        """
        test_parameters = self.integrated
        if not test_parameters:
            return residuals
        sensitivities = residuals.jacobian[..., -self.size :][..., test_parameters]
        values = residuals.values - sensitivities @ (e - self.mean)[test_parameters]
        return replace(residuals, values=values, random_effect_sensitivities=sensitivities * self.sd[test_parameters])

    def with_prior_sd(self, e: Floats, variance: Floats) -> NuisanceParameters:
        """With standard deviations estimated where none is given, from e (nuisances,) and its variance (nuisances,)."""
        sd = self.sd.copy()
        for nuisance in dict.fromkeys(self.nuisances):
            if nuisance.sd is None:
                mask = np.array([n is nuisance for n in self.nuisances])
                estimated_sd = np.sqrt(np.mean((e - self.mean)[mask] ** 2 + variance[mask]))
                least = SMALLEST_PRIOR_SD * initial_prior_sd(replace(nuisance, sd=None), float(self.mean[mask][0]))
                sd[mask] = max(float(estimated_sd), least)
        return replace(self, sd=sd)


def _refuse_two_names(nuisances: Sequence[Nuisance], histories: Sequence[History], predictor: Predictor) -> None:
    """FitError where a test would have one length twice, by its name and by its alias."""
    for history in histories:
        own = predictor.for_history(history)
        of_length: dict[str, str] = {}
        for kind in (n.kind for n in nuisances if n.is_length and n.applies_to(history.name)):
            length = dimension_named(own, kind)
            if length is not None and of_length.setdefault(length.name, kind) != kind:
                raise FitError(
                    f"nuisances '{of_length[length.name]}' and '{kind}' are the same length of the test piece; keep one"
                )


def _takes_effect(nuisance: Nuisance, history: History, predictor: Predictor) -> bool:
    """Whether a nuisance applies to a test, its predictor knows it, and it begins before the last used frame."""
    if not nuisance.applies_to(history.name) or not predictor.for_history(history).follows(nuisance.kind):
        return False
    if nuisance.kind == "load step" and history.loading.quantity not in SCALABLE_LOADS:
        return False
    return nuisance.kind not in STEP_NUISANCES or nuisance.start < drift_duration(history)


def owner_of(nuisance: Nuisance, history: History) -> str:
    """Whose nuisance parameter a history has: the test, its alloy, "all", or the group of tests that it names."""
    return {"test": history.name, "alloy": history.alloy, "all": _group(nuisance.tests)}[nuisance.scope]


def _group(tests: tuple[str, ...]) -> str:
    if not tests:
        return "all"
    return tests[0] if len(tests) == 1 else f"{tests[0]} and {len(tests) - 1} more"


def check_nuisance_tests(nuisances: Sequence[Nuisance], names: Sequence[str]) -> None:
    """FitError for a nuisance of a test that is not among those of these names."""
    for nuisance in nuisances:
        for test in nuisance.tests:
            refuse_unknown(test, names, FitError, f"nuisance '{nuisance.key}': there is no test '{test}'")


def check_nuisance_law(nuisances: Sequence[Nuisance], law: CreepLaw) -> None:
    """FitError where the temperature changes during a test and the law does not know it."""
    for kind in (n.kind for n in nuisances):
        if kind in ("temperature step", "temperature drift") and not law.uses(temperature):
            like = kind.replace("temperature", "rate")
            raise FitError(
                f"law '{law.name}' has no temperature and cannot follow a {kind}; take a '{like}', or give the law "
                "one, such as law.times(arrhenius(T_ref=1073))"
            )


def prior_mean(nuisance: Nuisance, history: History | None, using: Predictor) -> float:
    """The prior mean of a test's nuisance parameter; of a length, by default, that which the test states.

    mm for lengths; the geometry of the history takes precedence over that of the specimen.
    """
    if not nuisance.is_length or nuisance.mean > 0 or history is None:
        return nuisance.mean
    length = dimension_named(using.for_history(history), nuisance.kind)
    if length is None:
        problem = (
            f"nuisance '{nuisance.kind}' has no mean, and the specimen of test '{history.name}' has no such length"
        )
        raise FitError(f"{problem}; give mean=")
    return float(history.geometry.get(length.name, length.default))


def has_nuisance(nuisance: Nuisance, history: History, using: Predictor | None) -> bool:
    """Whether what predicts a test knows a nuisance: in joint fits lengths belong to tests of some specimens alone."""
    return using is None or not nuisance.is_length or using.for_history(history).follows(nuisance.kind)


def initial_prior_sd(nuisance: Nuisance, mean: float) -> float:
    """The prior standard deviation of a nuisance parameter, or where its estimate begins; mean : of the prior."""
    if nuisance.sd is not None:
        return nuisance.sd
    return USUAL_LENGTH.prior_sd * abs(mean) if nuisance.is_length else USUAL[nuisance.kind].prior_sd


def nuisance_unit(kind: str) -> str:
    """The unit of a kind; "" of an offset, whose output has one."""
    if is_length_nuisance(kind):
        return USUAL_LENGTH.unit
    return USUAL[kind].unit if kind in USUAL else "in ln" if kind == "rate" else ""


def _bounds_of(nuisance: Nuisance, mean: float) -> tuple[float, float]:
    usual, unit = (USUAL_LENGTH, mean) if nuisance.is_length else (USUAL[nuisance.kind], 1.0)
    return max(usual.low * unit, nuisance.bounds[0]), min(usual.high * unit, nuisance.bounds[1])


@dataclass(frozen=True)
class NuisanceEstimate:
    """The estimate of one explicit nuisance of one test, alloy or all tests.

    owner : name of the test or alloy, "all", or the group of tests. value, sd : estimate and its standard deviation,
    in the kind's unit. prior_mean, prior_sd : of the prior, the latter as it was given or estimated. start : s, of a
    step.
    """

    kind: str
    scope: str
    owner: str
    value: float
    sd: float
    prior_mean: float
    prior_sd: float
    start: float = 0.0

    @property
    def key(self) -> str:
        """The kind, of a step with its start; as Nuisance.key."""
        return nuisance_key(self.kind, self.start)


def nuisance_estimates_of(
    nuisance_parameters: NuisanceParameters, e: Floats, sd: Floats
) -> tuple[NuisanceEstimate, ...]:
    """The estimates of nuisance parameters from e (nuisances,) and their standard deviations sd (nuisances,)."""
    known = nuisance_parameters
    numbers = np.stack([e, sd, known.mean, known.sd], axis=-1).astype(float).tolist()
    return tuple(
        NuisanceEstimate(n.kind, n.scope, owner, value, deviation, mean, prior_sd, n.start)
        for n, owner, (value, deviation, mean, prior_sd) in zip(known.nuisances, known.owners, numbers, strict=True)
    )


DRIFT, OFFSET = "temperature drift", "offset of "


@dataclass(frozen=True, eq=False)
class Perturbation:
    """Something that tests may hide, with the prior standard deviation that is usual for it.

    kind : of the nuisance parameter that would stand for it. size : one standard deviation, in its unit, of errors that
        the tests have independently of one another, or of one error common to all tests.
    rate_change : one standard deviation of ln of the rate at the reference point; NaN of what intervals include, and of
        what is common to all tests.
    residual_change : (tests, observations) -, of the residuals, by one standard deviation; saved in kept fits alone.
    common : whether it is one error of all tests, as of an instrument that measures them all. tests : how many have it.
    included : whether the intervals include it.
    per_kelvin : change of ln rate a kelvin at the reference point, NaN where it is no drift of temperature; assumed :
        whether by a usual activation energy, as the law has none.
    """

    kind: str
    size: float
    unit: str
    rate_change: float = float("nan")
    residual_change: Floats = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    common: bool = False
    tests: int = 1
    included: bool = False
    per_kelvin: float = float("nan")
    assumed: bool = False

    @property
    def amount(self) -> str:
        """Its size with the unit."""
        return f"{self.size:.2g} {self.unit}".strip()

    @property
    def description(self) -> str:
        """What, and of which size, in one test."""
        if self.unit == "mm" and not self.kind.startswith(OFFSET):
            return f"an error of {self.amount} in the {self.kind}"
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind} of {self.amount}"


def beyond_intervals(perturbations: Sequence[Perturbation]) -> list[Perturbation]:
    """Those that intervals do not include, of which it is known what they do to the rate."""
    return [one for one in perturbations if np.isfinite(one.rate_change)]
