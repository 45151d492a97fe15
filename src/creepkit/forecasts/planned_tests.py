"""Planned tests: histories without outputs, of a load by steps, for forecasts; of the command line and of studies."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError
from creepkit.language import Elastic, elastic_of
from creepkit.limits import HOTTEST
from creepkit.options import GIGAPASCAL, HOURS, Options, option
from creepkit.readers.vocabulary import COMPONENT_LOADING_KINDS
from creepkit.records import (
    ZERO_CELSIUS,
    History,
    Load,
    Loading,
    PointLoading,
    Program,
    Specimen,
    StrainSteps,
    StressSteps,
    TwoLevels,
    known_specimens,
    loading_of,
    loads_of,
)


@checked
@dataclass(frozen=True)
class PlannedTestOptions(Options, title="options of a test"):
    """What is said of a test that is planned, beside its load and lengths.

    temperature : (start in s, C) of its levels. end : s. modulus : MPa. control : of a bar under stress. ramp : s in
    which each level of a load is reached.
    """

    end: float | None = option(None, "End of the test.", limits.HOURS, **HOURS)
    specimen: str | None = option(None, "By default one that takes the load; see 'creepkit list specimens'.")
    temperature: tuple[tuple[float, float], ...] = option(
        (), "Temperature, from S seconds on.", unit="C", metavar="[S:]C"
    )
    modulus: float | None = option(None, "Young's modulus; some specimens need it.", limits.GIGAPASCAL, **GIGAPASCAL)
    control: Literal["load", "stress"] | None = option(None, "Of a bar: the load or the true stress is held.")
    ramp: float | None = option(None, "s in which each level of a load is reached.", limits.RAMP, unit="s", flag="ramp")


@checked
@dataclass(frozen=True)
class ForecastOptions(Options, title="options of a forecast"):
    """How a forecast is made."""

    level: float = option(0.95, "Probability of bands and intervals.", limits.PROBABILITY)
    draws: int | None = option(None, "Of the law and all else; more make smoother bands.", limits.BAND_DRAWS)


PLANNED_FRAMES = 100
"""Of a planned test, half spread over time and half over its logarithm."""


COMPONENTS = "components"
"""The load of specimens under stresses and strains of several components."""


def specimen_taking(loads: Collection[str]) -> str:
    """The first specimen of a test under loads of these names, where none is named; of none that of a stress.

    Those of components, as stress_11, are of a material point.
    """
    names = {COMPONENTS if name in COMPONENT_LOADING_KINDS else name for name in loads}
    taking = {name: {load.name for load in loads_of(one)} for name, one in known_specimens().items()}
    of_stress = next(name for name, own in taking.items() if "stress" in own)
    return next((name for name, own in taking.items() if names & own), of_stress)


def stated_temperature(levels: Sequence[tuple[float, float]]) -> float | Program | None:
    """K, of (start in s, °C) of levels; None of none. SolveError for what no test can have."""
    if any(not -ZERO_CELSIUS < level < HOTTEST for _, level in levels):
        raise SolveError(f"{min(level for _, level in levels):g} °C is no temperature of a test")
    if levels and levels[0][0] != 0.0:
        raise SolveError("nothing is said of the temperature before; give its first level from 0 s on")
    kelvin = [(start, level + ZERO_CELSIUS) for start, level in levels]
    return Program.steps(kelvin) if len(kelvin) > 1 else kelvin[0][1] if kelvin else None


def stepped_load(
    name: str,
    load: Load | None,
    steps: Sequence[tuple[float, float]],
    *,
    control: str | None,
    ramp: float | None,
    end: float,
) -> Loading:
    """One load by steps, (start in s, value); its ramp, s, is the load's own where none is given.

    name, load : of it, and what the specimen says of it. control : of a stress, "load" or "stress". end : s.
    SolveError, beginning with what is wrong, for steps that no test can have.
    """
    if name == "stress":
        if control not in (None, "load", "stress"):
            raise SolveError(f"control {control} is not known; allowed are load and stress")
        held: Literal["load", "stress"] = "stress" if control == "stress" else "load"
        return StressSteps(tuple(steps), held)
    given = ramp if ramp is not None else 0.0 if load is None else load.ramp
    starts, values = [start for start, _ in steps], [value for _, value in steps]
    early = any(later - earlier < given for earlier, later in pairwise(starts))
    negative = load is not None and load.kind.low >= 0.0 and min(values) < 0.0
    if starts[0] != 0.0 or early or negative:
        raise SolveError(
            f"the first {name} starts at 0 s, none is negative, and each comes {given:g} s or more after the one "
            "before, for the ramp takes that long"
        )
    if given and len(steps) <= 2 and min(values) > 0.0 and (len(steps) == 1 or starts[1] > given):
        time = starts[1] if len(steps) == 2 else max(end, 2 * given)
        return loading_of(name, TwoLevels(values[0], values[-1], time), ramp=given, end=end)
    return loading_of(name, steps, ramp=given, end=end)


@dataclass(frozen=True)
class DescribedTest:
    """A test that is planned, as a command or a study describes it; from it follow its load and its history.

    loads : {name: ((start in s, level), ...)}, of a material point by component, as stress_11, at rest until its first
    step. lengths : mm of its test piece. temperature : K, None where nothing is said.
    """

    specimen: Specimen
    options: PlannedTestOptions
    loads: Mapping[str, Sequence[tuple[float, float]]]
    lengths: Mapping[str, float]
    temperature: float | Program | None = None

    @cached_property
    def loading(self) -> Loading:
        """The load; SolveError where the specimen is not loaded so."""
        own, options, label = {load.name: load for load in loads_of(self.specimen)}, self.options, self.specimen.name
        named = " and ".join(self.loads)
        unknown = ("control", "ramp") if COMPONENTS in own else ("ramp",) if "stress" in self.loads else ("control",)
        for key in (one for one in unknown if getattr(options, one) is not None):
            raise SolveError(f"{key} does not belong to {named} of specimen '{label}'; leave it out")
        if COMPONENTS in own:
            return self._components()
        if len(self.loads) > 1:
            raise SolveError(f"a test of specimen '{label}' has one load, found {named}; leave all but one out")
        ((name, steps),) = self.loads.items()
        if name not in own:
            raise SolveError(f"specimen '{label}' takes no {name} but {' or '.join(own) or 'none'}")
        end = float(options.end or 0.0)
        return stepped_load(name, own[name], steps, control=options.control, ramp=options.ramp, end=end)

    @property
    def elastic(self) -> Elastic | None:
        """Elastic data; SolveError where there is no curve without them: by the specimen, or for strain is imposed."""
        loading = self.loading
        imposed = isinstance(loading, StrainSteps) or (isinstance(loading, PointLoading) and bool(loading.strain))
        if self.options.modulus is None and (imposed or "modulus" in self.specimen.conditions):
            label = self.specimen.name
            raise SolveError(f"specimen '{label}' needs a modulus: give --modulus-gpa or modulus_GPa, such as 150")
        return elastic_of(self.options.modulus)

    def _components(self) -> PointLoading:
        parts: dict[str, dict[str, tuple[tuple[float, float], ...]]] = {"stress": {}, "strain": {}}
        for name, steps in self.loads.items():
            kind, _, component = name.partition("_")
            if sorted(steps) != list(steps):
                raise SolveError(f"the steps of {kind} {component} must follow one another in time")
            parts[kind][component] = tuple(steps) if steps[0][0] == 0.0 else ((0.0, 0.0), *steps)
        return PointLoading(**parts)

    def history(self, temperature: float | Program, name: str = "planned test") -> History:
        """The history of the test up to its end, without outputs; temperature : K, where the test says none."""
        half, end = PLANNED_FRAMES // 2, float(self.options.end or 0.0)
        return History(
            name=name,
            times=np.union1d(np.geomspace(1e-3 * end, end, half), np.linspace(end / half, end, half)),
            outputs={},
            loading=self.loading,
            temperature=temperature if self.temperature is None else self.temperature,
            specimen=self.specimen.name,
            elastic=self.elastic,
            geometry=self.lengths,
        )
