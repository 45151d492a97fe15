"""The kits: one function for each kind of thing that a plugin can offer, and one for a whole plugin."""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import numpy as np

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, LawError, PluginError
from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit, time_factor
from creepkit.kernels.lowering import lower
from creepkit.language.law import CreepLaw
from creepkit.language.temperature_forms import TemperatureFactor, TemperatureForm
from creepkit.records import CameraFormat, Exporter, History, InstrumentFormat, Material, Predictor, Reader, Specimen
from creepkit.registry import Plugin, default_registry, kinds
from creepkit.testing import (
    camera_checks,
    exporter_checks,
    law_checks,
    material_checks,
    predictor_checks,
    reader_checks,
    specimen_checks,
)
from creepkit.testing.predictor_checks import PredictorCase, default_histories, law_of_check
from creepkit.testing.reports import ConformanceCheck, ConformanceReport, finding, run
from creepkit.testing.sample_points import draw_samples, with_numbers


@finding("declaration")
def check_declaration(declared: InstrumentFormat) -> str:
    """Units and the order of dates mean something; what else is declared was checked when the format was made."""
    unknown = [unit for unit in declared.units.values() if channel_unit(unit) is None]
    assert not unknown, f"'{unknown[0]}' is no unit of a channel; write one such as barg, psia, C"
    unit, order = declared.time_unit, declared.date_order
    assert not unit or time_factor(unit), f"'{unit}' is no unit of times; write one of {', '.join(TIME_UNITS)}"
    assert order in ("", *DATE_ORDERS), f"'{order}' is no order of dates; write one of {', '.join(DATE_ORDERS)}"
    return "units of channels and times, and the order of dates, are known"


REFERENCE = 1073.15
"""K, at which temperature forms leave a law as it is."""


TEMPERATURES = (900.0, 1000.0, 1200.0)
"""K, at which the rate of a law with a temperature form must be a number above zero."""


@finding("temperature form")
def check_form(form: Callable[..., Any]) -> str:
    """A function of T_ref gives a form or a factor, equal to one at T_ref, and finite rates elsewhere."""
    made, plain = form(T_ref=REFERENCE), default_registry().law("norton")
    assert isinstance(made, TemperatureForm | TemperatureFactor), (
        f"it returned a {type(made).__name__}; return a TemperatureForm or a TemperatureFactor"
    )
    if isinstance(made, TemperatureFactor):
        law = plain.times(made)
    else:
        try:  # of a parameter of log scale, or else of a linear one
            law = plain.with_temperature(A=made)
        except LawError:
            law = plain.with_temperature(n=made)
    own = {name: 0.1 * law.table[name].bounds[1] for name in law.names if name not in plain.names}
    values, kernel = law.center() | plain.center() | own, lower(law, "numpy")
    rates = {T: float(kernel.rate(values, stress=100.0, temperature=T)) for T in (REFERENCE, *TEMPERATURES)}
    gap = abs(rates[REFERENCE] / float(lower(plain, "numpy").rate(plain.center(), stress=100.0)) - 1.0)
    assert gap <= 1e-9, f"{gap:.1e}; the parameter must be its own value at T_ref"
    for T, rate in rates.items():
        assert np.isfinite(rate) and rate > 0, f"the rate at {T:g} K is {rate:g} 1/s"
    return f"{type(made).__name__}; {gap:.1e} off at T_ref, rates above zero at {len(rates)} temperatures"


NAME_OF_RECORD = re.compile(r"[a-z0-9]+([-_][a-z0-9]+)*")


@checked
def check_law(
    law: CreepLaw, samples: Annotated[int, limits.SOBOL_POINTS] = 64, seed: Annotated[int, limits.SEED] = 0
) -> ConformanceReport:
    """Run every check on a law; never raises for a law that fails one.

    samples : a power of two. Conditions of tests that it uses are at CHECKED_CONDITION.
    """
    try:
        lower(law, "numpy")
        checked_law = with_numbers(law)
    except CreepkitError as error:
        return ConformanceReport(law, (ConformanceCheck("lowering", False, str(error)),))
    drawn = draw_samples(checked_law, samples, seed)
    own = [law_checks.check_example] if law.conditions else []
    return ConformanceReport(law, (*run(law_checks, checked_law, drawn), *run(own, law, drawn)))


@checked
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
    default_registry().remember(specimen)
    return _predictor_report(specimen, histories, law, values, "specimen")


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
    return _predictor_report(predictor, histories, law, values, "predictor")


def _predictor_report(
    predictor: Any,
    histories: Sequence[History] | None,
    law: CreepLaw | str | None,
    values: Mapping[str, float] | None,
    kind: str,
) -> ConformanceReport:
    cases: list[PredictorCase] = []

    @finding("a planned test")
    def check_plan() -> str:
        tests = list(histories) if histories is not None else default_histories(predictor)
        if len(tests) == 1:
            tests = [*tests, tests[0].replace(name=f"{tests[0].name}, shorter", times=tests[0].times[:-1], outputs={})]
        chosen, usual = law_of_check(predictor, law, tests[0])
        cases.append(PredictorCase(predictor, chosen, chosen.to_internal(chosen.values(values or usual)), tests))
        return ", ".join(test.name for test in tests)

    found = run([check_record_name], predictor, kind) if kind == "specimen" else []
    planned = run([check_plan])
    if not cases:
        return ConformanceReport(predictor, (*found, *planned), kind)
    for module in (specimen_checks, predictor_checks) if kind == "specimen" else (predictor_checks,):
        found += run(module, cases[0])
    return ConformanceReport(predictor, tuple(found), kind)


@finding("name and title")
def check_record_name(subject: Any, kind: str) -> str:
    """Name and title are texts of the stated pattern, and no other plugin has the name."""
    name, title = subject.name, subject.title
    assert isinstance(name, str) and NAME_OF_RECORD.fullmatch(name), (
        f"{name!r} is not in small letters and digits joined by hyphens, such as four-point; rename it"
    )
    one_line = isinstance(title, str) and title.strip() and title.isprintable()
    assert one_line, f"{title!r} is not one line of text; say what it is"
    for plugin in default_registry().plugins():
        other = plugin.contributions.get(kind, {}).get(name)
        taken = other is not None and not _same_class(type(other), type(subject))
        assert not taken, f"'{name}' is taken, by {plugin.provenance}; give the {kind} another name"
    return f"{name}: {title}"


def _same_class(first: type, second: type) -> bool:
    """Whether two classes are one, or one of them is the other loaded from the same file as a plugin."""
    files = [getattr(sys.modules.get(one.__module__), "__file__", None) for one in (first, second)]
    same_file = None not in files and os.path.realpath(str(files[0])) == os.path.realpath(str(files[1]))
    return first is second or (first.__qualname__ == second.__qualname__ and same_file)


@checked
def check_reader(reader: Reader, path: str | Path | None = None) -> ConformanceReport:
    """Run every check on a reader.

    path : an example file or folder, whose histories must survive creepkit's own CSV files.
    """
    return _report(reader, "reader", reader_checks, None if path is None else Path(path))


@checked
def check_camera_format(format: CameraFormat, path: str | Path | None = None) -> ConformanceReport:
    """Run every check on a camera format: tables in its own words are read as they were meant, and taken by it alone.

    path : an example file or folder.
    """
    return _report(format, "camera format", camera_checks, None if path is None else Path(path))


@checked
def check_exporter(exporter: Exporter) -> ConformanceReport:
    """Run every check on an exporter, with every registered law."""
    return _report(exporter, "exporter", exporter_checks)


@checked
def check_instrument_format(format: InstrumentFormat) -> ConformanceReport:
    """Run every check on an instrument format: its name, the units of its channels, the order of its dates."""
    return _report(format, "instrument format", [check_declaration])


@checked
def check_material(material: Material) -> ConformanceReport:
    """Run every check on a published law of a material: its source, values and range, and the rates within it."""
    return _report(material, "material", material_checks)


def _report(subject: Any, kind: str, checks: ModuleType | list[Any], *further: Any) -> ConformanceReport:
    """Name and title of what was offered, then the checks of its kind."""
    found = run([check_record_name], subject, kind) + run(checks, subject, *further)
    return ConformanceReport(subject, tuple(found), kind)


def check_temperature_form(form: Callable[..., Any]) -> ConformanceReport:
    """Run every check on a temperature form or factor, a function of T_ref."""
    return ConformanceReport(form, tuple(run([check_form], form)), "temperature form")


def kit_of(kind: kinds.PluginKind[Any]) -> Callable[..., ConformanceReport]:
    """The kit of a kind; of one that has none the check of name and title."""
    kit = globals().get(f"check_{kind.label.replace(' ', '_')}")
    return kit or partial(_report, kind=kind.label, checks=[])


_KITS = {kind.label: kit_of(kind) for kind in kinds.KINDS}


_KINDS = " or ".join([", ".join([*_KITS][:-1]), [*_KITS][-1]])


def check_plugin(plugin: Plugin) -> list[ConformanceReport]:
    """Run the kit of each thing that a plugin offers; PluginError where it offers nothing that can be checked."""
    contributions = {kind: plugin.contributions.get(kind, {}).values() for kind in _KITS}
    if not any(contributions.values()):
        raise PluginError(
            f"{plugin.provenance} offers no {', '.join(_KITS)}; return one from a hook such as creepkit_laws"
        )
    return [_KITS[kind](one) for kind, offered in contributions.items() for one in offered]


def check_named(name: str) -> list[ConformanceReport]:
    """Run the kits of whatever is registered under a name; PluginError with the nearest name where nothing is."""
    registry = default_registry()
    offered = {kind.label: registry.all(kind) for kind in kinds.KINDS}
    reports = [_KITS[kind](known[name].value) for kind, known in offered.items() if name in known]
    if not reports:
        clashes = [sentence for sentence in registry.conflicts() if f"'{name}' is offered twice" in sentence]
        names = sorted({one for known in offered.values() for one in known})
        near = difflib.get_close_matches(name, names, n=1, cutoff=0.55)
        advice = f"did you mean '{near[0]}'?" if near else "'creepkit list' says what there is"
        raise PluginError(*clashes[:1] or [f"no {_KINDS} is called '{name}'; {advice}{registry.broken_hint()}"])
    return reports
