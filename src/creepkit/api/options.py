"""Options of exports, forecasts and planned tests, which commands and study files share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from creepkit.errors import ExportError, SolveError
from creepkit.limits import BAND_DRAWS, HOURS, POISSON, PROBABILITY, RAMP
from creepkit.limits import CELSIUS as CELSIUS_LIMITS
from creepkit.limits import GIGAPASCAL as GIGAPASCAL_LIMITS
from creepkit.options import CELSIUS, GIGAPASCAL, Options, option
from creepkit.options import HOURS as IN_HOURS

if TYPE_CHECKING:
    from creepkit.language import Elastic


def elastic_of(modulus: float | None, poisson: float = 0.3) -> Elastic | None:
    """Elastic data of Young's modulus, MPa; None without it."""
    from creepkit.language import Elastic

    return None if modulus is None else Elastic(E=modulus, nu=poisson)


@dataclass(frozen=True)
class ExportOptions(Options, title="options of an export", error=ExportError):
    """What is said of an export beside its target. temperature : K, modulus : MPa."""

    name: str = option("", "What the target is to call the law.")
    stress_unit: str = option("MPa", "MPa, Pa, kPa, GPa, psi or ksi.")
    time_unit: str = option("s", "s, min, h, day or year.")
    temperature: float | None = option(None, "A number in the place of the temperature.", CELSIUS_LIMITS, **CELSIUS)
    modulus: float | None = option(None, "Young's modulus, for targets that state it.", GIGAPASCAL_LIMITS, **GIGAPASCAL)
    poisson: float = option(0.3, "Poisson's ratio, beside the modulus.", POISSON)

    def text(
        self, source: Any, target: str, values: Mapping[str, float] | None = None, to: str | Path | None = None
    ) -> str:
        """The export of what has a law with values, and written to a file if asked."""
        import creepkit as ck

        record = ck.law_with_values(source, values, elastic=elastic_of(self.modulus, self.poisson), name=self.name)
        units = {"stress": self.stress_unit, "time": self.time_unit}
        return ck.export(record, target, units=units, temperature=self.temperature, to=to)


@dataclass(frozen=True)
class PlannedTestOptions(Options, title="options of a test", error=SolveError):
    """What is said of a test that is planned, beside its load and lengths.

    temperature : (start in s, C) of its levels. end : s. modulus : MPa. control : of a bar under stress. ramp : s in
    which each level of a load is reached.
    """

    end: float | None = option(None, "End of the test.", HOURS, **IN_HOURS)
    specimen: str | None = option(None, "By default one that takes the load; see 'creepkit list specimens'.")
    temperature: tuple[tuple[float, float], ...] = option(
        (), "Temperature, from S seconds on.", unit="C", metavar="[S:]C"
    )
    modulus: float | None = option(None, "Young's modulus; some specimens need it.", GIGAPASCAL_LIMITS, **GIGAPASCAL)
    control: Literal["load", "stress"] | None = option(None, "Of a bar: the load or the true stress is held.")
    ramp: float | None = option(None, "s in which each level of a load is reached.", RAMP, unit="s", flag="ramp")


@dataclass(frozen=True)
class ForecastOptions(Options, title="options of a forecast"):
    """How a forecast is made."""

    level: float = option(0.95, "Probability of bands and intervals.", PROBABILITY)
    draws: int | None = option(None, "Of the law and all else; more make smoother bands.", BAND_DRAWS)
