"""Results as JSON-able data, for programs: an object for each record, with names of its fields in Python as keys."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from creepkit.records.presentable import function_of_reports

SHOWN = {
    "AlloyResult": "alloy failure verdict decisive credible_laws equivalents laws",
    "Channel": "name quantity reference written_unit missing",
    "CreepLaw": "name title fingerprint references constraints latex",
    "Design": "* sentence",
    "Forecast": "laws level rejected tests",
    "FormCombination": "forms criterion_difference weight",
    "History": "name source specimen alloy strain_measure includes_elastic minimum_rate rupture_time unruptured "
    "geometry labels condition temperature=mean_temperature",
    "Identification": "law=law.name rms errors adequacy numerical_error nuisances noise_model notes=remarks",
    "InstrumentRecord": "name source notes rows=times.size interval start gaps",
    "LawMisfit": "factor stress temperature log_factor",
    "Material": "name title form source law values ranges covariance",
    "PlannedTest": "description hours information_per_hour at_draws histories expectation",
    "Plugin": "name=provenance.name from=provenance.origin problem",
    "Ranking": "headline=best.headline verdict decisive adequacy further failed challenges laws",
    "RankedLaw": "excess weight chi_square",
    "Registered": "",
    "RuptureAssessment": "verdict decisive methods=ranked rejected relation strengths lives checks "
    "level=settings.level notes provenance",
    "RuptureFit": "method degree fixed log_likelihood scale_log10=scale scatter_log10=scatter effects_log10=effects",
    "ScreeningResult": "alloys=results law_fractions failures notes",
    "Specimen": "name title outputs nuisances",
    "StrengthEstimate": "strength=value hours temperature method bounds_of_mean bounds_of_heat bounds_of_test "
    "extrapolation reason",
    "StudyResult": "title stages exclusions report",
    "TemperatureLaw": "law=law.name criterion_data temperature_range T_ref forms plausible_forms candidates notes",
    "TestForecast": "name condition=history.condition outputs times includes extrapolation notes caution misfit inside",
}
"""{class: what is said of its records, "*" for all fields, "key=path" for what stands elsewhere}; of others all fields.
What can be called is called without arguments."""


def _specimen(one: Any) -> Mapping[str, Any]:
    from creepkit.records import outputs_of  # heavy, and a list of laws needs none of it

    units = {str(output): output.unit for output in outputs_of(one)}
    loads, lengths = {load.name: load.unit for load in one.loads}, {d.name: d.default for d in one.dimensions}
    return {"units": units, "loads": loads, "lengths_mm": lengths}


def _unit(output: str, specimen: str = "") -> str:
    from creepkit.records import output_unit

    return output_unit(output, specimen)


def _history(one: Any) -> Mapping[str, Any]:
    program = {} if one.loading.quantity == "components" else {"program": one.loading.program()}
    return {
        "frames": one.times.size,
        "used_frames": int(np.sum(one.used)),
        "times": one.times[[0, -1]],
        "outputs": {
            name: {"unit": _unit(name, one.specimen), "first": values[0], "last": values[-1]}
            for name, values in one.outputs.items()
        },
        "loading": {"quantity": one.loading.quantity, **program},
    }


def _registered(one: Any) -> Mapping[str, Any]:
    """All of a law, specimen or material; name and title of others."""
    value, shown = one.value, {"provenance": str(one.provenance)}
    if _listed(value, SHOWN) is not None:
        return {**document(value), **shown}
    return {"name": getattr(value, "name", None) or value.__name__, "title": getattr(value, "title", ""), **shown}


ALSO: dict[str, Callable[[Any], Mapping[str, Any]]] = {
    "Challenge": lambda one: {"sentence": function_of_reports("verdicts.challenge_text")(one)},
    "Channel": lambda one: {
        "ends": [float(end(one.values)) for end in (np.nanmin, np.nanmax) if one.missing < one.values.size]
    },
    "CreepLaw": lambda law: {
        "terms": law.terms,
        "parameters": law.table,
        "states": {symbol.name: state for symbol, state in law.states.items()},
    },
    "History": _history,
    "Identification": lambda fit: {"parameters": {one.name: one for one in fit.estimates}},
    "InstrumentRecord": lambda one: {"duration": np.ptp(one.times), "channels": [*one.channels.values()]},
    "OutputForecast": lambda one: {"unit": _unit(one.output)},
    "Plugin": lambda one: {
        "status": "broken" if one.problem else "ok",
        "offers": {word: [*things] for word, things in one.contributions.items()},
    },
    "RankedLaw": lambda one: document(one.fit),
    "Registered": _registered,
    "RuptureAssessment": lambda one: {"tests": len(one.tests), "run_outs": one.tests.censored.sum()},
    "RuptureFit": lambda fit: {"parameters": {one.name: one for one in fit.parameters}},
    "Specimen": _specimen,
    "StudyResult": lambda one: {"verdicts": {name: ranking.verdict for name, ranking in one.rankings.items()}},
    "TemperatureLaw": lambda law: {"parameters": {one.name: one for one in law.estimates}},
}
"""{class: what is worked out of its records}."""


def document(value: Any) -> Any:
    """A result, or whatever one holds: null for numbers that are infinite or not known, texts of expressions."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, np.ndarray | np.generic):
        return document(value.tolist())
    if isinstance(value, Mapping):
        return {name if isinstance(name, str) else str(name): document(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [*map(document, value)]
    shown, also = _listed(value, SHOWN), _listed(value, ALSO)
    if shown is None and not is_dataclass(value):
        return str(value)
    return {**_fields(value, "*" if shown is None else shown), **document({} if also is None else also(value))}


def _listed(record: object, table: Mapping[str, Any]) -> Any:
    """What a table holds of a class, or of the nearest that it is made from; None of others."""
    return next((table[kind.__name__] for kind in type(record).__mro__ if kind.__name__ in table), None)


def _fields(record: Any, names: str) -> dict[str, Any]:
    """{key: value} of these names."""
    found: dict[str, Any] = {}
    for name in names.replace("*", " ".join(one.name for one in fields(record)) if "*" in names else "").split():
        key, _, path = name.partition("=")
        value = attrgetter(path or key)(record)
        found[key] = document(value() if callable(value) else value)
    return found
