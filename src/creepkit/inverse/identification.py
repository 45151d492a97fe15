"""Identification: the law of a set of tests, its values with intervals, how tests scatter, and how well it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.effects import member_of, prior_mean
from creepkit.inverse.findings import NuisanceEstimate, OutputMisfit, TestMisfit
from creepkit.inverse.measures import Errors
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.settings import Settings
from creepkit.inverse.together import predict
from creepkit.inverse.uncertainty import Estimate, band, quantile
from creepkit.language import CreepLaw
from creepkit.records import EXPLICIT, History, Nuisance, Prediction, Predictor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.intervals.correlation import Correlation
    from creepkit.inverse.intervals.profile import Profile
    from creepkit.inverse.intervals.quantities import Quantity
    from creepkit.inverse.intervals.sampling import Samples
    from creepkit.inverse.restricted import Linear
    from creepkit.inverse.search.trace import Trace
    from creepkit.inverse.sparsity.record import Sparsity


__all__ = ["Identification", "NuisanceEstimate", "OutputMisfit", "Settings", "TestMisfit"]


@dataclass(frozen=True, eq=False)
class Identification:
    """The answer of identify().

    estimates : one Estimate for each parameter, in the law's order.
    u, covariance : conditioned coordinates at the optimum and their posterior covariance (see inverse.coordinates).
    scatter : standard deviations of the sources of scatter, found from the data.
    rms : root mean square of ln((predicted + offset) / measured) over the fitted strains of all tests; each test has
        its own offset (loading strain), none its own rate. NaN without strains.
    errors : {output: Errors} over all used frames of all tests, whatever was minimised.
    nuisances : what was found of explicit nuisances.
    ranges : {"stress", "temperature", "strain", "time": (low, high)} that the fitted frames cover; MPa, K, s.
    log_likelihood : of the fitted frames as if they were independent (working scatter), with explicit nuisances
        integrated out; of identifications by likelihood the restricted one, but for a constant of the law.
    freedom : degrees of freedom of the intervals (see inverse.uncertainty).
    trace : how its global search went; linear : the problem about its optimum, of identifications by likelihood
        (neither is saved).
    sparsity : how a penalty reduced the sum that this law was part of, if one did.
    size : number of effectively independent frames (about one a test when tests differ from one another).
    """

    law: CreepLaw
    estimates: tuple[Estimate, ...]
    u: Floats
    covariance: Floats
    reference: Reference
    scatter: Scatter
    rms: float
    log_likelihood: float
    size: float
    freedom: float
    misfits: tuple[TestMisfit, ...]
    ranges: Mapping[str, tuple[float, float]]
    settings: Settings
    provenance: Mapping[str, Any]
    errors: Mapping[str, Errors] = field(default_factory=dict)
    nuisances: tuple[NuisanceEstimate, ...] = ()
    converged: bool = True
    notes: tuple[str, ...] = ()
    histories: tuple[History, ...] = ()
    using: Predictor | None = None
    trace: Trace | None = field(default=None, repr=False)
    linear: Linear | None = field(default=None, repr=False)
    sparsity: Sparsity | None = field(default=None, repr=False)

    @property
    def values(self) -> dict[str, float]:
        """{parameter: value} in the author's units."""
        return {e.name: e.value for e in self.estimates}

    @property
    def coordinates(self) -> Coordinates:
        """The map between conditioned coordinates and parameters."""
        return Coordinates(self.law, self.reference)

    def rate(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Creep rate, 1/s, with its 95 % interval: (rate, low, high), each of the broadcast shape.

        stress MPa, temperature K; strain and time default to those of the reference point.
        """
        from creepkit.inverse.intervals.quantities import log_rate

        asked = log_rate(self.coordinates, stress, temperature, strain, time)
        middle, sd = band(asked, self.u, self.covariance)
        half = self._quantile * sd
        return np.exp(middle), np.exp(middle - half), np.exp(middle + half)

    def local_exponent(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Local stress exponent d ln rate / d ln stress with its 95 % interval."""
        from creepkit.inverse.intervals.quantities import local_exponent

        asked = local_exponent(self.coordinates, stress, temperature, strain, time)
        middle, sd = band(asked, self.u, self.covariance)
        half = self._quantile * sd
        return middle, middle - half, middle + half

    def rupture_time(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, control: Literal["load", "stress"] = "load",
        scatter: bool = True, using: Predictor | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """When a bar will break, s, with its 95 % interval: (time, low, high), each of the broadcast shape.

        stress MPa (nominal, held as `control` says); temperature K, by default that of the reference point.
        scatter : whether the interval is that of a single test, which has its own rate, or that of the law alone.
        Infinite where nothing breaks within some thousand times the longest test.
        """
        from creepkit.inverse.rupture import planned

        T = self.reference.temperature if temperature is None else temperature
        tests, shape = planned(stress, T, self.ranges["time"][1], control)
        time, low, high = self.rupture_times(tests, scatter=scatter, using=using)
        return time.reshape(shape), low.reshape(shape), high.reshape(shape)

    def rupture_times(
        self, histories: Sequence[History] | None = None, *, scatter: bool = True, using: Predictor | None = None
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """The same for histories (by default those that were fitted), whatever their loading: (tests,) each."""
        from creepkit.inverse.rupture import rupture_times

        predictor = using or self.using
        if predictor is None:
            raise FitError("this identification was loaded from a file: give using=, the specimen it was made with")
        tests, own = list(histories or self.histories), self.scatter if scatter else None
        return rupture_times(self.coordinates, self.u, self.covariance, own, self._quantile, tests, predictor)

    def predict(
        self, histories: Sequence[History] | None = None, using: Predictor | None = None, *, own: bool = True
    ) -> Prediction:
        """Predict histories (by default those that were fitted) at the identified values.

        own : fitted tests, known by name, with their own nuisances and offsets; else, and all other histories, with
            what is known of their alloy or of all tests, or the prior means, and without offset.
        """
        predictor = using or self.using
        if predictor is None:
            raise FitError("this identification was loaded from a file: give using=, the specimen it was made with")
        tests = list(histories or self.histories)
        found = predict(predictor, self.law, self.values, tests, effects=self.effects(tests, own=own, using=predictor))
        by_name = {m.name: m for m in self.misfits} if own else {}
        for k, history in enumerate(tests):
            for one in by_name[history.name].outputs if history.name in by_name else ():
                found.values[:, k, :, found.outputs.index(one.output)] += one.offset
        return found

    def effects(
        self, histories: Sequence[History], *, own: bool = True, using: Predictor | None = None
    ) -> dict[str, Floats]:
        """{kind: (1, tests)} explicit nuisances of histories, as predictors take them."""
        found = {(n.kind, n.member): n.value for n in self.nuisances if own or n.scope != "test"}
        using = using or self.using

        def of(n: Nuisance, history: History) -> float:
            known = found.get((n.kind, member_of(n, history)))
            return known if known is not None else n.mean if using is None else prior_mean(n, history, using)

        return {
            n.kind: np.array([[of(n, h) for h in histories]]) for n in self.settings.nuisances if n.kind in EXPLICIT
        }

    def on(self, histories: Sequence[History], using: Predictor) -> Identification:
        """The same answer with its histories (found by name) and specimen attached, as after load(), for plots."""
        by_name = {h.name: h for h in histories}
        missing = [m.name for m in self.misfits if m.name not in by_name]
        if missing:
            raise FitError(f"this identification was made from '{missing[0]}', which is not among the histories given")
        return replace(self, histories=tuple(by_name[m.name] for m in self.misfits), using=using)

    def profile(self, of: str | Quantity, *, level: float = 0.95) -> Profile:
        """Profile likelihood of a parameter, or of another quantity (see inverse.intervals.quantities)."""
        from creepkit.inverse.intervals.profile import profile

        return profile(self, of, level=level)

    def sample(self, *, walkers: int = 32, steps: int = 1000, seed: int = 0, using: Predictor | None = None) -> Samples:
        """Draw from the posterior by Markov chains (emcee, an optional dependency); `using` may be a surrogate."""
        from creepkit.inverse.intervals.sampling import sample

        return sample(self, walkers=walkers, steps=steps, seed=seed, using=using)

    def correlation(self, frame: Literal["author", "conditioned"] = "author") -> Correlation:
        """How estimates hang together, of the author's parameters or of the conditioned coordinates."""
        from creepkit.inverse.intervals.correlation import correlation

        return correlation(self, frame)

    def undetermined(self) -> tuple[str, ...]:
        """What these tests do not determine, and which combination they do, one sentence each."""
        from creepkit.inverse.intervals.correlation import undetermined

        return undetermined(self)

    def save(self, path: str | Path) -> Path:
        """Write the identification as JSON (to a temporary name, then renamed)."""
        from creepkit.inverse.files import save

        return save(self, Path(path))

    def plot(self, path: str | Path | None = None) -> Figure:
        """Measured against identified, and residuals; written to `path` when given."""
        from creepkit.inverse.plotting import figure_of

        return figure_of(self, path)

    def __str__(self) -> str:
        from creepkit.inverse.printing import text_of

        return text_of(self)

    @property
    def _quantile(self) -> float:
        return quantile(self.freedom)
