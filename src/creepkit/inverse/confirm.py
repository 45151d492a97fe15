"""confirm: the identified law simulated by the specimen itself, set beside each test and beside what the fit says.

An identification through a surrogate, or one read from a file, is believed once the simulation of its law meets the
tests as well as the fit claims. That says nothing of other laws: a surrogate that is off by a tenth of the noise, but
everywhere in the same way, may still tip the choice between two laws that differ by no more. A choice through a
surrogate is made certain by select(..., using=specimen, through=surrogate).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.findings import OutputMisfit
from creepkit.inverse.identification import Identification
from creepkit.inverse.measures import Errors, errors
from creepkit.inverse.scales import noise_of, usable
from creepkit.inverse.together import Together
from creepkit.records import History, Prediction, Predictor, Status

AGREE = 1.0
"""Largest rms difference to what the fit predicts, in standard deviations of the noise, that confirms it."""
FOLLOWED = 2.0
"""Mean chi-square above which a law does not follow a test, whoever predicts it."""
CUT_SHORT = {Status.BURST: "the specimen bursts", Status.NOT_CONVERGED: "the simulation stops"}


@dataclass(frozen=True)
class ConfirmedOutput:
    """One output of one test.

    simulated : errors of the simulation against the measurement; fitted : the fit's own, or None of a test it has not
        seen and cannot predict.
    difference : rms of simulated less fitted frames over their noise; NaN where the fit's own prediction is not at hand
        or no noise is known.
    """

    output: str
    simulated: Errors
    fitted: Errors | None
    difference: float

    @property
    def distance(self) -> float:
        """How far the simulation is from the fit, in noise: the difference, or what chi-square says it must be."""
        if np.isfinite(self.difference) or self.fitted is None:
            return self.difference
        return float(np.sqrt(max(self.simulated.chi_square - self.fitted.chi_square, 0.0)))


@dataclass(frozen=True)
class ConfirmedTest:
    """One test, how its simulation ended, and when, s."""

    name: str
    status: Status
    end_time: float
    outputs: tuple[ConfirmedOutput, ...]


@dataclass(frozen=True)
class Confirmation:
    """The answer of confirm(). law, using : names of what was simulated, and by what."""

    law: str
    using: str
    tests: tuple[ConfirmedTest, ...]

    @property
    def holds(self) -> bool:
        """Whether the simulation reaches the end of each test and says of it what the fit says."""
        return not self._ended and not self.distance > AGREE

    @property
    def distance(self) -> float:
        """The largest distance of simulation and fit, in noise; NaN where nothing is known of it."""
        known = [o.distance for t in self.tests for o in t.outputs if np.isfinite(o.distance)]
        return max(known, default=float("nan"))

    @property
    def verdict(self) -> str:
        """One sentence: whether the simulation confirms the fit, and whether the law follows the tests."""
        if self._ended:
            test = self._ended[0]
            how = f"{CUT_SHORT[test.status]} at {test.end_time:g} s of test '{test.name}'"
            return f"not confirmed: by {self.using}, {how}; identify again with using= this specimen"
        if not self.holds:
            test_name, output = self._place(lambda o: o.distance)
            return (
                f"not confirmed: {self.using} differs from the fit by {self.distance:.2g} times the noise ({output} of "
                f"'{test_name}'); identify again with using= this specimen"
            )
        test_name, output = self._place(lambda o: o.simulated.chi_square)
        worst = self[test_name, output].simulated.chi_square
        if worst > FOLLOWED:
            return (
                f"confirmed, but the law does not follow the tests: chi-square {worst:.3g} in {output} of "
                f"'{test_name}'; try another law"
            )
        apart = f", {self.distance:.2g} times the noise from the fit" if np.isfinite(self.distance) else ""
        return f"confirmed by {self.using}: chi-square at most {worst:.3g}{apart}"

    def __getitem__(self, place: tuple[str, str]) -> ConfirmedOutput:
        for test in self.tests:
            for one in test.outputs:
                if (test.name, one.output) == place:
                    return one
        raise FitError(f"no output '{place[1]}' of a test '{place[0]}' was confirmed")

    def __str__(self) -> str:
        rows = [f"{self.law}: {self.verdict}"]
        for test in self.tests:
            for o in test.outputs:
                own = "" if o.fitted is None else f", of the fit {o.fitted.chi_square:.3g}"
                apart = f"; apart {o.difference:.2g} noise" if np.isfinite(o.difference) else ""
                rows.append(f"  {test.name}, {o.output}: chi-square {o.simulated.chi_square:.3g}{own}{apart}")
        return "\n".join(rows)

    @property
    def _ended(self) -> list[ConfirmedTest]:
        return [t for t in self.tests if t.status in CUT_SHORT]

    def _place(self, size: Callable[[ConfirmedOutput], float]) -> tuple[str, str]:
        """Test and output of the largest size."""
        sized = [(size(o), t.name, o.output) for t in self.tests for o in t.outputs]
        _, test, output = max(sized, key=lambda s: -np.inf if np.isnan(s[0]) else s[0])
        return test, output


def confirm(fit: Identification, tests: Sequence[History], using: Predictor | Mapping[str, Predictor]) -> Confirmation:
    """Simulate the identified law for each test, with the nuisances and offsets that the fit found for it.

    tests : those of the fit, known by name, or others, which are predicted with what is known of all tests.
    using : the specimen, such as study.specimen("bulge"), or {specimen: predictor}.
    """
    if not tests:
        raise FitError(f"law '{fit.law.name}': there are no tests to confirm it with")
    predictor = Together(dict(using)) if isinstance(using, Mapping) else using
    found = fit.predict(tests, predictor)
    own = None if fit.using is None else fit.predict(tests)
    name = getattr(predictor, "name", type(predictor).__name__)
    return Confirmation(fit.law.name, name, tuple(_test(fit, found, own, k, h) for k, h in enumerate(tests)))


def doubtful(fit: Identification) -> bool:
    """Whether the guard of a surrogate doubts what it said of some test at the identified values."""
    return fit.using is not None and bool((fit.predict().status == Status.OUTSIDE_DOMAIN).any())


def _test(fit: Identification, found: Prediction, own: Prediction | None, k: int, history: History) -> ConfirmedTest:
    told = {o.output: o for m in fit.misfits if m.name == history.name for o in m.outputs}
    names = [name for name in found.outputs if name in history.outputs and usable(history, name).any()]
    fitted = {} if own is None else {name: _row(own, k, name) for name in names}
    outputs = tuple(_output(history, name, _row(found, k, name), fitted.get(name), told.get(name)) for name in names)
    return ConfirmedTest(history.name, Status(int(found.status[0, k])), float(found.end_times[0, k]), outputs)


def _row(found: Prediction, k: int, name: str) -> Floats:
    return found.of(k)[:, found.outputs.index(name)]


def _output(
    history: History, name: str, simulated: Floats, fitted: Floats | None, told: OutputMisfit | None
) -> ConfirmedOutput:
    used, noise = usable(history, name), noise_of(history, name)
    measured, sd = history.outputs[name][used], noise[used]
    met = errors(measured, simulated[used], sd)
    if fitted is None:
        return ConfirmedOutput(name, met, None if told is None else told.errors, float("nan"))
    known = sd > 0
    apart = ((simulated - fitted)[used] / np.where(known, sd, np.nan))[known]
    rms = float(np.sqrt(np.mean(apart**2))) if apart.size else float("nan")
    return ConfirmedOutput(name, met, errors(measured, fitted[used], sd), rms)
