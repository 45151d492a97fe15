"""A whole study of temperature: moduli first, then creep, jointly and temperature by temperature, then its forms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.discovery.discover import discover
from creepkit.discovery.points import check_temperatures
from creepkit.discovery.trend import TemperatureLaw
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.moduli import FRAMES, Moduli, identify_moduli
from creepkit.inverse.settings import Settings
from creepkit.inverse.warmth import ONE_TEMPERATURE, reference_temperature, with_arrhenius
from creepkit.language import CreepLaw, temperature
from creepkit.records import History, Predictor

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class TemperatureStudy:
    """The answer of temperature_study().

    tests : with the moduli found, where they were. moduli : None where no modulus could be asked for.
    joint : the law times Arrhenius' factor, from all tests at once. alone : one identification a temperature.
    trend : None where there are too few temperatures, which notes then say.
    """

    tests: tuple[History, ...]
    moduli: Moduli | None
    joint: Identification
    alone: tuple[Identification, ...]
    trend: TemperatureLaw | None
    notes: tuple[str, ...]

    def __str__(self) -> str:
        parts = [self.moduli, self.joint, self.trend]
        told = [str(part) for part in parts if part is not None]
        return "\n\n".join([*told, *(f"note: {note}" for note in self.notes)])


def temperature_study(
    law: CreepLaw, tests: Sequence[History], using: Predictor, *, moduli: bool | None = None,
    within: float = ONE_TEMPERATURE, forms: Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    prior: Mapping[str, Mapping[str, float]] | None = None,
    settings: Settings | None = None, progress: Progress | None = None,
) -> TemperatureStudy:  # fmt: skip
    """Identify moduli, then the law times Arrhenius, then each temperature alone, and discover forms of temperature.

    law : without temperature. moduli : whether to find them from the first 15 frames of each test; by default where
    every test states one and the predictor knows that effect. within : K, tests that near to the coldest of a group
    are at one temperature. forms, prior : as discover() takes them. A temperature that cannot be identified alone is
    noted and left out of the forms.
    """
    if law.uses(temperature):
        raise FitError(f"law '{law.name}' depends on temperature already; give it without: forms are what is sought")
    if not tests:
        raise FitError("there are no histories to study")
    settings, histories, notes = settings or Settings(), list(tests), []
    stage = None
    if moduli if moduli is not None else _has_moduli(histories, using):
        stage = identify_moduli(with_arrhenius(law, histories), histories, using, frames=FRAMES)
        if stage.elastic is not None:
            histories = [h.replace(elastic=stage.elastic) for h in histories]
    joint = identify(with_arrhenius(law, histories), histories, using, settings=settings, progress=progress)
    alone, failed = _alone(law, histories, using, within, settings, progress)
    notes += failed
    trend = None
    try:
        check_temperatures([fit.reference.temperature for fit in alone] or [reference_temperature(histories)])
    except FitError as error:
        notes.append(str(error))
    else:
        trend = discover(
            alone, forms=forms, prior=prior, histories=histories, using=using, settings=settings, progress=progress
        )
    return TemperatureStudy(tuple(histories), stage, joint, tuple(alone), trend, tuple(notes))


def grouped(tests: Sequence[History], within: float = ONE_TEMPERATURE) -> list[list[History]]:
    """Tests by temperature, ascending; each within so many K of the coldest of its group."""
    groups: list[list[History]] = []
    for test in sorted(tests, key=_warmth):
        if groups and _warmth(test) - _warmth(groups[-1][0]) <= within:
            groups[-1].append(test)
        else:
            groups.append([test])
    return groups


def _alone(
    law: CreepLaw, tests: Sequence[History], using: Predictor, within: float, settings: Settings,
    progress: Progress | None,
) -> tuple[list[Identification], list[str]]:  # fmt: skip
    found, failed = [], []
    groups = grouped(tests, within)
    for k, group in enumerate(groups):
        try:
            found.append(identify(law, group, using, settings=settings))
        except CreepkitError as error:
            failed.append(f"at {_warmth(group[0]):.0f} K alone: {error}")
        if progress is not None:
            progress("temperature", k + 1, len(groups))
    return found, failed


def _has_moduli(tests: Sequence[History], using: Predictor) -> bool:
    known = "modulus" in getattr(using, "effects", ())
    return known and all(h.elastic is not None and "amplitude" in h.outputs for h in tests)


def _warmth(history: History) -> float:
    return float(np.mean(history.temperature_program().values))
