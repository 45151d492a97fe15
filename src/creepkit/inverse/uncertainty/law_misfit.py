"""What a law misses at a stress and a temperature, by what it misses of its tests: kriging of the rates of tests.

With b_j what test j says of ln of its own factor (see uncertainty.rate_scatter), the law may miss the rate by smooth
functions of stress and temperature,

    b_j = f(ln s_j) + h(-1 / R T_j) + scatter,    f'', h'' white noise of unknown sizes,

so that the stress exponent and the activation energy wander as Brownian motion does. Constants and slopes of f and h
are what the law itself takes up; what is left of them grows beyond the tests with the distance to the power of 3/2, as
fast as the tests make likely: a law that follows them within their scatter is hardly doubted near them. Sizes are
averaged over their restricted likelihood on a grid, with the scatter between tests; a quarter of the prior is on a law
that misses nothing. So each size counts as far as the tests of each condition are likely, predicted from those before:
it is cross-validation by condition that says how far a law can be trusted beyond the tests.

Source: G. Wahba, Spline Models for Observational Data (1990), chapter 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.special import logsumexp

from creepkit.arrays import Bools, Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.rate_explanations import ENERGY_CHANGE, EXPONENT_CHANGE, FACTOR_SD
from creepkit.inverse.uncertainty.quantities import gradient, log_rate
from creepkit.inverse.uncertainty.rate_scatter import SMALLEST_EFFECT, RateScatter
from creepkit.language.symbols import GAS_CONSTANT

USUAL_LOG_STRESS, USUAL_KELVIN = 0.9, 50.0
"""Over which a stress exponent and an activation energy may change by EXPONENT_CHANGE and ENERGY_CHANGE: a factor of
2.5 in stress, and K."""


CHANGES = np.geomspace(0.1, 1.0, 5)
"""Sizes of the misfit, over these changes."""


FEWEST_CONDITIONS = 3
"""Stresses, or temperatures, from which on a law can be seen to miss how the rate depends on them."""


SAME_CONDITION = 0.02
"""Of the span of ln stress, or of -1 / R T, within which two tests are of one condition."""


KNOTS = (np.arange(16) + 0.5) / 8.0
"""Where slopes change, to both sides of the middle of the tests, in spans: up to one and a half beyond them."""


AS_IT_IS = 0.25
"""Prior probability that the law misses nothing of how rates depend on stress, and on temperature."""


@dataclass(frozen=True)
class LawMisfit:
    """What a law misses at a question.

    total : root mean square of what is to be added to the law's ln rate there; own : what of it is not that of a right
    law whose rates scatter as much; sd : what of it lies beyond parameters and scatter of a right law, as the tests
    show them. test : the nearest; stress : its, in MPa; temperature : its, in K; log_factor : ln of the rate of the
    tests of its condition over what the others say of it.
    """

    total: float
    own: float
    sd: float
    test: str
    stress: float
    temperature: float
    log_factor: float

    @property
    def factor(self) -> float:
        """By which a 95 % interval is wider to each side where nothing else is uncertain."""
        return float(np.exp(1.96 * self.sd))


@dataclass(frozen=True, eq=False)
class Wandering:
    """A slope of ln rate that wanders: over one abscissa of the tests.

    values : (tests,) the abscissa. usual_change : one standard deviation of what the slope changes by over usual_span.
    """

    values: Floats
    usual_change: float
    usual_span: float

    @property
    def span(self) -> float:
        """Of the tests, or a tenth of the usual one where that is more."""
        return max(float(np.ptp(self.values)), 0.1 * self.usual_span)

    @property
    def change(self) -> float:
        """One standard deviation of the slope over the span, at size one."""
        return float(self.usual_change * np.sqrt(self.span / self.usual_span))

    @property
    def conditions(self) -> int:
        """How many of the tests' values are apart by more than what is one condition."""
        return 1 + int((np.diff(np.sort(self.values)) > SAME_CONDITION * self.span).sum())

    def distance(self, at: float) -> Floats:
        """(tests,) of the tests from a value, in spans."""
        return np.asarray(np.abs(self.values - at) / self.span)

    def effects(self, at: Floats) -> Floats:
        """(points, knots) effects on ln rate of changes of the slope, one standard deviation each.

        at : (points,) values of the abscissa.
        A ramp from each knot outwards: the integral of Brownian motion from the middle of the tests to both sides.
        """
        middle = 0.5 * float(self.values.min() + self.values.max())
        about = (np.asarray(at, float)[:, None] - middle) / self.span
        ramps = np.concatenate([np.maximum(about - KNOTS, 0.0), np.maximum(-about - KNOTS, 0.0)], axis=1)
        return np.asarray(ramps * (self.change * self.span * np.sqrt(KNOTS[1] - KNOTS[0])))


@dataclass(frozen=True, eq=False)
class LawMisfits:
    """What a law misses, anywhere, by the tests of an identification.

    u : (parameters,) coordinates of the fit. scatter : what the tests say of their rates.
    """

    coordinates: Coordinates
    u: Floats
    scatter: RateScatter

    @cached_property
    def _axes(self) -> tuple[Wandering, Wandering]:
        stresses, temperatures = self.scatter.stresses, self.scatter.temperatures
        kelvin = GAS_CONSTANT * float(np.mean(temperatures)) ** 2
        over_temperature = Wandering(-1.0 / (GAS_CONSTANT * temperatures), ENERGY_CHANGE, USUAL_KELVIN / kelvin)
        return Wandering(np.log(stresses), EXPONENT_CHANGE, USUAL_LOG_STRESS), over_temperature

    @cached_property
    def _seen(self) -> list[bool]:
        known = self.scatter.stresses.size == len(self.scatter.tests)
        return [known and axis.conditions >= FEWEST_CONDITIONS for axis in self._axes]

    def at(self, stress: float, temperature: float) -> LawMisfit | None:
        """At MPa and K; None where the tests cannot show it."""
        if not (0.0 < stress < np.inf and temperature > 0.0) or not any(self._seen):
            return None
        where = (float(np.log(stress)), -1.0 / (GAS_CONSTANT * temperature))
        u, shared = self.u, self.scatter.joint_design.shape[1]
        row = np.zeros(shared)
        row[: u.size] = gradient(log_rate(self.coordinates, stress, temperature), u, np.ones(u.size))
        ramps = [a.effects(np.array([x]))[0] for a, x, seen in zip(self._axes, where, self._seen, strict=True) if seen]
        question = np.concatenate([row, *ramps])
        second, without = self._second_moments
        total = max(float(question @ second @ question), 0.0)
        own = max(total - float(question @ without @ question), 0.0)
        beyond = min(max(total - float(row @ self._by_law @ row), 0.0), own)
        distance = np.hypot(*(a.distance(x) for a, x in zip(self._axes, where, strict=True)))
        nearest = int(np.argmin(distance))
        same = np.all([a.distance(float(a.values[nearest])) <= SAME_CONDITION for a in self._axes], axis=0)
        s, T = float(self.scatter.stresses[nearest]), float(self.scatter.temperatures[nearest])
        found = float(np.sqrt(total)), float(np.sqrt(own)), float(np.sqrt(beyond))
        return LawMisfit(*found, self.scatter.tests[nearest], s, T, self._beside_the_others(same))

    @cached_property
    def _by_law(self) -> Floats:
        """Covariance of unknowns and effects as intervals have it, without the errors common to all tests."""
        return replace(self.scatter, errors=None).mean_joint[1]

    @cached_property
    def _second_moments(self) -> tuple[Floats, Floats]:
        """Of unknowns, effects and changes of slopes, over the scatter of rates and the sizes of the misfit.

        The second is that of a law that misses nothing, over the same scatter.
        """
        axes = [a for a, seen in zip(self._axes, self._seen, strict=True) if seen]
        columns = [a.effects(a.values) for a in axes]
        logs, sizes = list[Floats](), [(0.0, AS_IT_IS)]
        without, moments = list[Floats](), list[Floats]()
        sizes += [(float(size), (1.0 - AS_IT_IS) / CHANGES.size) for size in CHANGES]
        for tried in product(sizes, repeat=len(axes)):
            prior = np.repeat([max(size, SMALLEST_EFFECT) for size, _ in tried], 2 * KNOTS.size)
            log, mean, covariance = self.scatter.over_scatter(np.concatenate(columns, axis=1), prior)
            logs.append(log + float(np.log([likely for _, likely in tried]).sum()))
            moments.append(covariance + mean[:, :, None] * mean[:, None, :])
            without.append(moments[0])
        share = np.exp(np.array(logs) - logsumexp(logs))
        with_misfit, right = (np.einsum("ks,ksij->ij", share, np.array(one)) for one in (moments, without))
        return with_misfit, right

    def _beside_the_others(self, tests: Bools) -> float:
        """ln of the rate of some tests (tests,) over what the others say of it, by the law."""
        return float(self.scatter.evidence(tests.astype(float)[:, None], np.array([FACTOR_SD])).mean[0])
