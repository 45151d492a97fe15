"""What an identification found of single tests: how well each is met, and what is off about it."""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.errors import FitError
from creepkit.inverse.measures import OutputErrors


@dataclass(frozen=True)
class OutputFit:
    """One output of one test.

    errors : over all used frames of the history, with the test's own offset and nuisances.
    offset : estimated offset that the law does not explain (loading strain), in the output's unit.
    noise : typical standard deviation of a frame, in the output's unit.
    """

    output: str
    errors: OutputErrors
    offset: float = 0.0
    noise: float = 0.0


@dataclass(frozen=True)
class RuptureComparison:
    """The end of one test.

    measured : s, when it ruptured, or how long it lasted where it was `stopped` before.
    predicted : s, by the law alone; infinite where the law never breaks it.
    low, high : 95 % interval for a single test, from the parameters and the scatter between tests.
    """

    measured: float
    censored: bool
    predicted: float
    low: float
    high: float

    @property
    def ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted / self.measured


@dataclass(frozen=True)
class TestFit:
    """One test in the fit.

    frames : how many entries count (strains above twice the floor of their scale, all frames of other outputs).
    rms, bias : root mean square and mean of ln((predicted + offset) / measured) over its fitted strains, else NaN.
        For a test compared over its whole life, of its distance in ln strain and ln time (see inverse.distance).
    rate_factor : estimated factor of this test's creep rate on the law's (heat-to-heat scatter).
    weight : of the test in the fit; below one where test_loss="student" found it far from the others.
    rupture : its end, where that is known and predicted.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    name: str
    condition: str
    frames: int
    log_strain_rms: float
    log_strain_bias: float
    rate_factor: float = 1.0
    weight: float = 1.0
    outputs: tuple[OutputFit, ...] = ()
    rupture: RuptureComparison | None = None

    def __getitem__(self, output: str) -> OutputFit:
        for one in self.outputs:
            if one.output == output:
                return one
        raise FitError(
            f"test '{self.name}' has no output '{output}'; it has {', '.join(o.output for o in self.outputs)}"
        )

    @property
    def offset(self) -> float:
        """Offset of its first output."""
        return self.outputs[0].offset if self.outputs else 0.0


@dataclass(frozen=True)
class NuisanceEstimate:
    """What was found of one explicit nuisance of one test, alloy or all tests.

    member : name of the test or alloy, or "all". value, sd : estimate and its standard deviation, in the kind's unit.
    mean, spread : of the prior; a spread that was to be estimated, as it was.
    """

    kind: str
    scope: str
    owner: str
    value: float
    sd: float
    prior_mean: float
    prior_sd: float
