"""Explicit nuisance parameters of tests, estimated beside the parameters of the law under Gaussian priors.

Each is of one test, of one alloy or of all tests: thickness, window, modulus, temperature.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import predictor_for, supports_nuisance
from creepkit.inverse.noise_model import Residuals
from creepkit.records import LENGTH_NUISANCES, SIMULATED_NUISANCES, History, Nuisance, Predictor

INITIAL_PRIOR_SD = {"thickness": 0.03, "window": 0.3, "modulus": 0.05, "temperature": 5.0}
"""Where the estimate of a prior standard deviation begins: mm, mm, relative, K."""


LIMITS = {"thickness": (0.3, 3.0), "window": (0.3, 3.0), "modulus": (-0.7, 2.0), "temperature": (-150.0, 150.0)}
"""Limits of nuisance parameters; thickness and window as multiples of their mean."""


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
        """One for each test, alloy or all tests whose predictor knows the kind."""
        parameters: list[tuple[Nuisance, str]] = []
        test_index: dict[str, Ints] = {}
        for nuisance in (n for n in nuisances if n.kind in SIMULATED_NUISANCES):
            offered = [supports_nuisance(predictor_for(predictor, h), nuisance.kind) for h in histories]
            if not any(offered):
                raise FitError(
                    f"nuisance '{nuisance.kind}' means nothing to the predictor of these histories; leave it out"
                )
            owners_of_tests = [owner_of(nuisance, h) for h in histories]
            distinct_owners = list(dict.fromkeys(m for m, k in zip(owners_of_tests, offered, strict=True) if k))
            first = len(parameters)
            test_index[nuisance.kind] = np.array(
                [first + distinct_owners.index(m) if k else -1 for m, k in zip(owners_of_tests, offered, strict=True)],
                np.int64,
            )
            if nuisance.sd is None and len(distinct_owners) < 2:
                raise FitError(
                    f"nuisance '{nuisance.kind}': a standard deviation cannot be estimated from a single value; "
                    "give its sd="
                )
            parameters += [(nuisance, member) for member in distinct_owners]
        nuisance_of_parameter, by_name = [n for n, _ in parameters], {h.name: h for h in histories}
        means = [prior_mean(n, by_name.get(member), predictor) for n, member in parameters]
        limits = [_bounds_of(n, mean) for n, mean in zip(nuisance_of_parameter, means, strict=True)]
        return cls(
            tuple(nuisance_of_parameter),
            tuple(m for _, m in parameters),
            test_index,
            np.array(means, float),
            np.array([INITIAL_PRIOR_SD[n.kind] if n.sd is None else n.sd for n in nuisance_of_parameter], float),
            np.array([low for low, _ in limits], float),
            np.array([high for _, high in limits], float),
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
        """{kind: (1, tests)} as predictors take them, from e (nuisances,), in the unit of the kind."""
        values = self.mean if self.fixed else e
        return {kind: values[np.maximum(index, 0)][None] for kind, index in self.test_index.items()}

    def jacobian(self, sensitivities: Mapping[str, Floats]) -> Floats:
        """(tests, observations, nuisances) derivatives.

        sensitivities : {kind: (tests, observations)} to each test's own nuisance.
        """
        jacobian_matrix = np.zeros((*next(iter(sensitivities.values())).shape, self.size))
        for kind, index in self.test_index.items():
            for test, position in enumerate(index):
                if position >= 0:
                    jacobian_matrix[test, :, position] = sensitivities[kind][test]
        return jacobian_matrix

    def integrate_out(self, residuals: Residuals, e: Floats) -> Residuals:
        """The residuals of tests at their prior means, with the priors as part of the covariance; e : (nuisances,).

        To first order. At its estimate a nuisance parameter has taken up what scatter between tests it can, so that the
        residuals there do not show that scatter. Nuisance parameters that tests share stay as estimated.
        """
        test_parameters = [k for k, n in enumerate(self.nuisances) if n.scope == "test" and np.isfinite(self.sd[k])]
        if not test_parameters or residuals.jacobian is None:
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
                sd[mask] = max(float(estimated_sd), SMALLEST_PRIOR_SD * INITIAL_PRIOR_SD[nuisance.kind])
        return replace(self, sd=sd)


def owner_of(nuisance: Nuisance, history: History) -> str:
    """Whose nuisance parameter a history has: the test, its alloy, or "all"."""
    return {"test": history.name, "alloy": history.alloy, "all": "all"}[nuisance.scope]


def prior_mean(nuisance: Nuisance, history: History | None, using: Predictor) -> float:
    """The prior mean of a test's nuisance parameter; of a thickness, by default, that which the test states.

    mm for lengths; the geometry of the history takes precedence over that of the specimen.
    """
    if nuisance.kind != "thickness" or nuisance.mean > 0 or history is None:
        return nuisance.mean
    predictor = predictor_for(using, history)
    geometry = getattr(getattr(predictor, "specimen", predictor), "geometry", None)
    stated = history.geometry.get("apex_thickness", getattr(geometry, "apex_thickness", None))
    if stated is None:
        problem = f"nuisance 'thickness' has no mean, and test '{history.name}' states no apex_thickness"
        raise FitError(f"{problem}; give mean=")
    return float(stated)


def _bounds_of(nuisance: Nuisance, mean: float) -> tuple[float, float]:
    low, high = LIMITS[nuisance.kind]
    if nuisance.kind in LENGTH_NUISANCES:
        low, high = low * mean, high * mean
    return max(low, nuisance.bounds[0]), min(high, nuisance.bounds[1])


@dataclass(frozen=True)
class NuisanceEstimate:
    """The estimate of one explicit nuisance of one test, alloy or all tests.

    owner : name of the test or alloy, or "all". value, sd : estimate and its standard deviation, in the kind's unit.
    prior_mean, prior_sd : of the prior, the latter as it was given or estimated.
    """

    kind: str
    scope: str
    owner: str
    value: float
    sd: float
    prior_mean: float
    prior_sd: float
