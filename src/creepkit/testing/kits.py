"""The kits: one function for each kind of thing that a plugin can offer, and one for a whole plugin."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from creepkit import limits
from creepkit.checked_arguments import checked, checked_with_own_words
from creepkit.errors import CreepkitError, ExportError, HistoryError, LawError, PluginError, SolveError, quoted
from creepkit.kernels.lowering import lower
from creepkit.language.law import CreepLaw
from creepkit.records import (
    CameraFormat,
    Exporter,
    History,
    InstrumentFormat,
    Predictor,
    Reader,
    Specimen,
    remember_specimen,
)
from creepkit.registry import Plugin, default_registry
from creepkit.testing import (
    camera_checks,
    exporter_checks,
    instrument_checks,
    law_behaviour,
    law_checks,
    law_declarations,
    predictor_checks,
    reader_checks,
    specimen_behaviour,
    specimen_checks,
)
from creepkit.testing.camera_checks import CameraFormatCase
from creepkit.testing.exporter_checks import ExporterCase
from creepkit.testing.predictor_checks import PredictorCase, default_histories
from creepkit.testing.reader_checks import ReaderCase
from creepkit.testing.reports import ConformanceCheck, ConformanceReport, findings
from creepkit.testing.sample_points import LawSamples, draw_samples
from creepkit.testing.temperature_form_checks import TemperatureFormCase
from creepkit.testing.usual_law import law_of_check

_FEWEST_SAMPLES = 8
"""Samples at which the constraints must hold for a verdict to mean something."""


_LAW_CHECKS: dict[str, Callable[[CreepLaw, LawSamples], Iterator[ConformanceCheck]]] = {
    "name": law_declarations.check_name,
    "table": law_checks.check_declarations,
    "references": law_declarations.check_references,
    "dimensions": law_declarations.check_units,
    "printing": law_checks.check_printing,
    "signs": law_checks.check_signs,
    "finite": law_checks.check_finite,
    "monotone": law_checks.check_monotonic,
    "continuity": law_behaviour.check_continuity,
    "temperature": law_declarations.check_temperature,
    "exponents of time": law_behaviour.check_time_exponents,
    "states": law_behaviour.check_states,
    "examples": law_declarations.check_examples,
    "parity": law_checks.check_parity,
    "torch gradients": law_checks.check_torch_gradients,
    "switches": law_checks.check_switches,
    "leading exponent": law_checks.check_leading_exponent,
}


@checked
def check_law(law: CreepLaw, samples: int = 64, seed: int = 0) -> ConformanceReport:
    """Run every check on a law; never raises for a law that fails one.

    samples : a power of two.
    """
    if not isinstance(law, CreepLaw):
        raise LawError(f"check_law() takes a creep law, found {law!r}; ck.law(name) returns a registered one")
    limits.check_number("samples", samples, limits.SOBOL_POINTS, LawError)
    limits.check_number("seed", seed, limits.SEED, LawError)
    try:
        lower(law, "numpy")
    except CreepkitError as error:
        return ConformanceReport(law, (ConformanceCheck("lowering", False, str(error)),))
    sampled = draw_samples(law, samples, seed)
    if len(sampled) < _FEWEST_SAMPLES:
        detail = f"the constraints hold at {len(sampled)} of the samples; widen them or narrow the bounds"
        return ConformanceReport(law, (ConformanceCheck("constraints", False, detail),))
    results: list[ConformanceCheck] = []
    for name, check in _LAW_CHECKS.items():
        results += _checks_of_property(name, check, law, sampled)
        if name == "signs" and not results[-1].passed:
            break  # the logarithm of a negative term means nothing
    return ConformanceReport(law, tuple(results))


def _checks_of_property(
    name: str, check: Callable[[CreepLaw, LawSamples], Iterator[ConformanceCheck]], law: CreepLaw, sampled: LawSamples
) -> list[ConformanceCheck]:
    """The findings of one promise; one that cannot even be examined is a finding too."""
    try:
        with np.errstate(all="ignore"):
            return list(check(law, sampled))
    except (CreepkitError, ArithmeticError, ValueError) as error:
        return [ConformanceCheck(name, False, f"{type(error).__name__}: {error}")]


@checked_with_own_words("specimen")
def check_specimen(
    specimen: Specimen,
    histories: Sequence[History] | None = None,
    *,
    law: CreepLaw | str | None = None,
    values: Mapping[str, float] | None = None,
) -> ConformanceReport:
    """Run every check on a specimen; what its code raises is a finding, too.

    histories : tests to check it with, of different lengths; by default planned from its loads and conditions.
    law, values : by default Norton's law with an activation energy, at a creep strain of half a per cent.
    """
    if isinstance(specimen, type) or not hasattr(specimen, "predict"):
        raise SolveError(f"check_specimen() takes a specimen, found {specimen!r}; ck.specimen(name) returns one")
    remember_specimen(specimen)
    record = findings("name and title", lambda: specimen_checks.check_record_name(specimen, "specimen"))
    case, problem = _case(specimen, histories, law, values, "specimen")
    if case is None:
        return ConformanceReport(specimen, (*record, problem), "specimen")
    checks = {
        "outputs": predictor_checks.check_outputs,
        "reference stress": specimen_checks.check_reference_stress,
        "frozen": specimen_behaviour.check_frozen,
        "loads": specimen_checks.check_loads,
        "steps of a load": specimen_behaviour.check_load_steps,
        "other laws": specimen_behaviour.check_other_laws,
        **_PREDICTOR_CHECKS,
        "lengths": specimen_checks.check_dimensions,
    }
    return ConformanceReport(specimen, (*record, *_all_findings(checks, case)), "specimen")


_PREDICTOR_CHECKS: dict[str, Callable[[PredictorCase], Iterator[ConformanceCheck]]] = {
    "shapes": predictor_checks.check_shapes,
    "batches": predictor_checks.check_batches,
    "sensitivities": predictor_checks.check_sensitivities,
    "nuisances": predictor_checks.check_nuisances,
    "related models": predictor_checks.check_related_models,
}


@checked
def check_predictor(
    predictor: Predictor,
    histories: Sequence[History] | None = None,
    *,
    law: CreepLaw | str | None = None,
    values: Mapping[str, float] | None = None,
) -> ConformanceReport:
    """Run every check on a predictor, such as a surrogate or a closed form; as check_specimen(), less the record.

    histories : tests that it can predict; by default those of its specimen. law, values : that it knows.
    """
    if isinstance(predictor, type) or not hasattr(predictor, "predict"):
        raise SolveError(f"check_predictor() takes a predictor, found {predictor!r}; it needs a method predict()")
    case, problem = _case(predictor, histories, law, values, "predictor")
    if case is None:
        return ConformanceReport(predictor, (problem,), "predictor")
    checks = {"outputs": predictor_checks.check_outputs, **_PREDICTOR_CHECKS}
    return ConformanceReport(predictor, tuple(_all_findings(checks, case)), "predictor")


@checked_with_own_words("reader")
def check_reader(reader: Reader, path: str | Path | None = None) -> ConformanceReport:
    """Run every check on a reader.

    path : an example file or folder, whose histories must survive creepkit's own CSV files.
    """
    if isinstance(reader, type) or not hasattr(reader, "accepts"):
        raise HistoryError(f"check_reader() takes a reader, found {reader!r}; it needs accepts() and read()")
    case = ReaderCase(reader, None if path is None else Path(path))
    checks = {
        "foreign files": reader_checks.check_foreign_files,
        "files of write_history()": reader_checks.check_own_files,
        "example file": reader_checks.check_example,
    }
    return _report(reader, "reader", checks, case)


@checked
def check_camera_format(format: CameraFormat, path: str | Path | None = None) -> ConformanceReport:
    """Run every check on a camera format: tables in its own words are read as they were meant, and taken by it alone.

    path : an example file or folder.
    """
    if not isinstance(format, CameraFormat):
        raise HistoryError(f"check_camera_format() takes a ck.CameraFormat, found {quoted(repr(format))}")
    case = CameraFormatCase(format, None if path is None else Path(path))
    checks = {
        "its own tables": camera_checks.check_own_tables,
        "foreign files": camera_checks.check_foreign_files,
        "example": camera_checks.check_example,
    }
    return _report(format, "camera format", checks, case)


@checked_with_own_words("exporter")
def check_exporter(exporter: Exporter) -> ConformanceReport:
    """Run every check on an exporter, with every registered law."""
    if isinstance(exporter, type) or not hasattr(exporter, "text"):
        raise ExportError(f"check_exporter() takes an exporter, found {exporter!r}; it needs a method text()")
    case = ExporterCase(exporter)
    checks = {
        "suffix": exporter_checks.check_interface,
        "text or a reason for every law": exporter_checks.check_every_law,
        "deterministic": exporter_checks.check_determinism,
        "notes and names": exporter_checks.check_hostile_texts,
    }
    return _report(exporter, "exporter", checks, case)


@checked
def check_instrument_format(format: InstrumentFormat) -> ConformanceReport:
    """Run every check on an instrument format: its name, the units of its channels, the order of its dates."""
    if not isinstance(format, InstrumentFormat):
        raise HistoryError(f"check_instrument_format() takes a ck.InstrumentFormat, found {quoted(repr(format))}")
    checks = {"declaration": instrument_checks.check_declaration}
    return _report(format, "instrument format", checks, format)


def check_temperature_form(name: str, form: Callable[..., Any]) -> ConformanceReport:
    """Run every check on a temperature form or factor, a function of T_ref."""
    subject = TemperatureFormCase(name, form)
    checks = {"temperature form": TemperatureFormCase.check}
    return ConformanceReport(subject, tuple(_all_findings(checks, subject)), "temperature form")


_KITS: dict[str, Callable[[Any], ConformanceReport]] = {
    "law": check_law,
    "specimen": check_specimen,
    "reader": check_reader,
    "camera format": check_camera_format,
    "exporter": check_exporter,
    "instrument format": check_instrument_format,
}


def check_plugin(plugin: Plugin) -> list[ConformanceReport]:
    """Run the kit of each thing that a plugin offers; PluginError where it offers nothing that can be checked."""
    reports = [
        _KITS[kind](value)
        for kind, offered in plugin.contributions.items()
        for value in offered.values()
        if kind in _KITS
    ]
    forms = plugin.contributions.get("temperature form", {})
    reports += [check_temperature_form(*named) for named in forms.items()]
    if not reports:
        raise PluginError(
            f"{plugin.provenance} offers no law, specimen, reader, camera format, instrument format, exporter or "
            "temperature form; return one from a hook such as creepkit_laws"
        )
    return reports


def check_named(name: str) -> list[ConformanceReport]:
    """Run the kits of whatever is registered under a name; PluginError with the nearest name where nothing is."""
    registry, forms = default_registry(), default_registry().temperature_forms()
    offered: dict[str, Mapping[str, Any]] = {
        "law": registry.laws(),
        "specimen": registry.specimens(),
        "reader": registry.readers(),
        "camera format": registry.cameras(),
        "exporter": registry.exporters(),
        "instrument format": registry.instruments(),
    }
    reports = [_KITS[kind](known[name].value) for kind, known in offered.items() if name in known]
    if name in forms:
        reports.append(check_temperature_form(name, forms[name].value))
    if not reports:
        clashes = [sentence for sentence in registry.conflicts() if f"'{name}' is offered twice" in sentence]
        known = sorted({one for names in (*offered.values(), forms) for one in names})
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.55)
        kinds = f"{', '.join(offered)} or temperature form"
        advice = f"did you mean '{near[0]}'?" if near else "'creepkit list' says what there is"
        raise PluginError(clashes[0] if clashes else f"no {kinds} is called '{name}'; {advice}{registry.broken_hint()}")
    return reports


def _report(
    subject: Any, kind: str, checks: Mapping[str, Callable[[Any], Iterable[ConformanceCheck]]], case: Any
) -> ConformanceReport:
    """Name and title of what was offered, then the checks of its kind."""
    named = findings("name and title", lambda: specimen_checks.check_record_name(subject, kind))
    return ConformanceReport(subject, (*named, *_all_findings(checks, case)), kind)


def _all_findings(checks: Mapping[str, Callable[[Any], Iterable[ConformanceCheck]]], case: Any) -> list[Any]:
    return [found for name, check in checks.items() for found in findings(name, partial(check, case))]


def _case(
    predictor: Any,
    histories: Sequence[History] | None,
    law: CreepLaw | str | None,
    values: Mapping[str, float] | None,
    kind: str,
) -> tuple[PredictorCase | None, ConformanceCheck]:
    """What a predictor is checked with; or why there is nothing."""
    cases: list[PredictorCase] = []

    def made() -> Iterator[ConformanceCheck]:
        tests = list(histories) if histories is not None else default_histories(predictor)
        if len(tests) == 1:
            tests = [*tests, tests[0].replace(name=f"{tests[0].name}, shorter", times=tests[0].times[:-1], outputs={})]
        chosen, usual = law_of_check(predictor, law, tests[0])
        given = values or usual
        cases.append(PredictorCase(predictor, chosen, chosen.to_internal(chosen.values(given)), tests, kind))
        yield ConformanceCheck("a planned test", True, ", ".join(test.name for test in tests))

    found = findings("a planned test", made)
    return (cases[0] if cases else None), found[-1]
