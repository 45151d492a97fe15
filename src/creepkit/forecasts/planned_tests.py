"""Planned tests: histories without outputs, of a load by steps, for forecasts; of the command line and of studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit import limits
from creepkit.errors import SolveError
from creepkit.options import GIGAPASCAL, HOURS, Options, option
from creepkit.records import (
    History,
    Loading,
    PointLoading,
    Program,
    Specimen,
    StrainSteps,
    StressSteps,
    TwoLevels,
    loading_of,
)

if TYPE_CHECKING:
    from creepkit.language import Elastic
    from creepkit.records import Load


@dataclass(frozen=True)
class PlannedTestOptions(Options, title="options of a test", error=SolveError):
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


@dataclass(frozen=True)
class ForecastOptions(Options, title="options of a forecast"):
    """How a forecast is made."""

    level: float = option(0.95, "Probability of bands and intervals.", limits.PROBABILITY)
    draws: int | None = option(None, "Of the law and all else; more make smoother bands.", limits.BAND_DRAWS)


PLANNED_FRAMES = 100
"""Of a planned test, half spread over time and half over its logarithm."""


COMPONENTS = "components"
"""The load of specimens under stresses and strains of several components."""


def needs_modulus(specimen: Specimen, loading: Loading) -> bool:
    """Whether a planned test has no curve without Young's modulus: by its specimen, or because strain is prescribed."""
    prescribed = isinstance(loading, StrainSteps) or (isinstance(loading, PointLoading) and bool(loading.strain))
    return prescribed or "modulus" in specimen.conditions


def load_of_components(components: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]]) -> PointLoading:
    """The load of a material point, {"stress" or "strain": {component: steps}}; a component is at rest until then."""
    from_rest = {
        kind: {name: tuple(steps) if steps[0][0] == 0.0 else ((0.0, 0.0), *steps) for name, steps in given.items()}
        for kind, given in components.items()
    }
    return PointLoading(**from_rest)


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


def planned_history(
    specimen: Specimen,
    loading: Loading,
    end: float,
    *,
    temperature: float | Program,
    elastic: Elastic | None = None,
    lengths: Mapping[str, float] | None = None,
    name: str = "planned test",
) -> History:
    """The history of a test that ends at `end`, s, without outputs; temperature : K, lengths : mm."""
    half = PLANNED_FRAMES // 2
    return History(
        name=name,
        times=np.union1d(np.geomspace(1e-3 * end, end, half), np.linspace(end / half, end, half)),
        outputs={},
        loading=loading,
        temperature=temperature,
        specimen=specimen.name,
        elastic=elastic,
        geometry=lengths or {},
    )
