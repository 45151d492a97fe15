"""Identification: the law of a set of tests, its values with intervals, how tests scatter, and how well it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import Scatter
from creepkit.inverse.uncertainty import Estimate, band, quantile
from creepkit.language import CreepLaw
from creepkit.records import History, Nuisance, Prediction, Predictor

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class TestMisfit:
    """One test in the fit.

    rms, bias : root mean square and mean of ln((predicted + offset) / measured) over its fitted frames.
    offset : estimated loading strain that the law does not explain, in the output's unit.
    rate_factor : estimated factor of this test's creep rate on the law's (heat-to-heat scatter).
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    name: str
    condition: str
    frames: int
    rms: float
    bias: float
    offset: float = 0.0
    rate_factor: float = 1.0


LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")


@dataclass(frozen=True)
class Settings:
    """What a run can be repeated from.

    draws : Sobol points that are screened, a power of two is best; frames : looked at in each history.
    loss : of values only; intervals and scatter are Gaussian and see outliers as scatter.
    nuisances : what differs between tests; unless told otherwise a loading-strain offset of each curve and
        test-to-test scatter of the rate, both estimated.
    """

    starts: int = 8
    draws: int = 64
    frames: int = 40
    seed: int = 0
    loss: str = "linear"
    nuisances: tuple[Nuisance, ...] = (Nuisance("offset"), Nuisance("rate"))

    def __post_init__(self) -> None:
        for name, least in (("starts", 1), ("draws", 1), ("frames", 2), ("seed", 0)):
            value = getattr(self, name)
            if int(value) != value or value < least:
                raise FitError(f"{name} is {value!r}; it must be a whole number of at least {least}")
        if self.loss not in LOSSES:
            raise FitError(f"loss '{self.loss}' is not known; allowed are {', '.join(LOSSES)}")
        for nuisance in self.nuisances:
            _check_nuisance(nuisance)


def _check_nuisance(nuisance: Nuisance) -> None:
    plain = nuisance.mean == 0 and not np.isfinite(nuisance.bounds).any() and nuisance.scope == "test"
    if (
        nuisance.kind not in ("offset", "rate")
        or not plain
        or (nuisance.sd is not None and not np.isfinite(nuisance.sd))
    ):
        raise FitError(
            f"nuisance {nuisance} is not known to this identification; allowed are Nuisance('offset') and "
            "Nuisance('rate'), one for each test, about zero, with sd= a finite number or None to estimate it"
        )


@dataclass(frozen=True, eq=False)
class Identification:
    """The answer of identify().

    estimates : one Estimate for each parameter, in the law's order.
    u, covariance : conditioned coordinates at the optimum and their posterior covariance (see inverse.coordinates).
    scatter : standard deviations of the sources of scatter, found from the data.
    rms : root mean square of ln((predicted + offset) / measured) over the fitted frames of all tests; each test has
        its own offset (loading strain), none its own rate.
    ranges : {"stress", "temperature", "strain", "time": (low, high)} that the fitted frames cover; MPa, K, s.
    log_likelihood : of the fitted frames as if they were independent (working scatter).
    freedom : degrees of freedom of the intervals (see inverse.uncertainty).
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
    converged: bool = True
    notes: tuple[str, ...] = ()
    histories: tuple[History, ...] = ()
    using: Predictor | None = None

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
        middle, sd = band(self._log_rates(stress, temperature, strain, time), self.u, self.covariance)
        half = self._quantile * sd
        return np.exp(middle), np.exp(middle - half), np.exp(middle + half)

    def local_exponent(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Local stress exponent d ln rate / d ln stress with its 95 % interval."""
        stress = np.asarray(stress, float)
        up, down = (self._log_rates(stress * f, temperature, strain, time) for f in (1.0005, 1 / 1.0005))
        middle, sd = band(lambda u: (up(u) - down(u)) / (2 * np.log(1.0005)), self.u, self.covariance)
        half = self._quantile * sd
        return middle, middle - half, middle + half

    def predict(self, histories: list[History] | None = None, using: Predictor | None = None) -> Prediction:
        """Predict histories (by default those that were fitted) at the identified values."""
        predictor = using or self.using
        if predictor is None:
            raise FitError("this identification was loaded from a file: give using=, the specimen it was made with")
        return predictor.predict(self.law, self.values, list(histories or self.histories))

    def on(self, histories: Sequence[History], using: Predictor) -> Identification:
        """The same answer with its histories (found by name) and specimen attached, as after load(), for plots."""
        by_name = {h.name: h for h in histories}
        missing = [m.name for m in self.misfits if m.name not in by_name]
        if missing:
            raise FitError(f"this identification was made from '{missing[0]}', which is not among the histories given")
        return replace(self, histories=tuple(by_name[m.name] for m in self.misfits), using=using)

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

    def _log_rates(
        self, stress: ArrayLike, temperature: ArrayLike | None, strain: ArrayLike | None, time: ArrayLike | None
    ) -> Any:
        from creepkit.kernels import lower

        kernel, coordinates, r = lower(self.law, "numpy"), self.coordinates, self.reference
        if (np.asarray(stress, float) < 0).any():
            raise FitError("a creep rate was asked for at a negative stress; give the von Mises stress, in MPa")
        point = [
            np.asarray(default if given is None else given, float)
            for given, default in ((stress, r.stress), (strain, r.strain), (time, r.time), (temperature, r.temperature))
        ]
        point += [point[0], point[0] / 3]
        inner = [z.initial for z in self.law.states.values()]

        def log_rate(u: Floats) -> Floats:
            out = kernel.internal_log_rate(*point, *inner, *coordinates.theta(u))
            return np.asarray(out + np.zeros(np.broadcast_shapes(*(p.shape for p in point))), float)

        return log_rate


def information_criterion(fit: Identification, size: float) -> float:
    """-2 ln L x size / frames + K ln(size): frames that move together count as one."""
    frames = sum(m.frames for m in fit.misfits)
    return -2.0 * fit.log_likelihood * min(size / max(frames, 1), 1.0) + len(fit.law.params) * float(np.log(size))
