"""Options of verbs as keywords for type checkers and editors; `python docs/schemas.py` writes this file."""

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from creepkit.inverse.settings import UsualErrors, Weights
from creepkit.records import Nuisance

class IdentificationSettingsKeywords(TypedDict, total=False):
    starts: int | None
    sobol_points: int | None
    frames: int | None
    seed: int | None
    nuisances: Nuisance | str | Sequence[Nuisance | str] | None
    weights: Weights | None
    suspect_frames: Literal["exclude", "keep"] | None
    further_laws: int | None
    rupture_times: Literal["auto", "use", "ignore"] | None
    usual_errors: UsualErrors | None

class DiscoveryOptionsKeywords(TypedDict, total=False):
    forms: Mapping[str, Sequence[str]] | Sequence[str] | None
    parameters: Sequence[str] | None
    moduli: bool | None
    within: float | None

class LawSearchOptionsKeywords(TypedDict, total=False):
    budget: float | None
    registered: bool | None

class RecordOptionsKeywords(TypedDict, total=False):
    time: str | None
    date: str | None
    time_unit: str | None
    date_order: Literal["month first", "day first", "year first"] | None
    time_zone: str | None
    channels: Sequence[str] | None
    units: Mapping[str, str] | None
    pressure_reference: Literal["gauge", "absolute"] | None
    ambient_pressure: float | None
