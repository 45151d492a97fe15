"""Stages of what follows from tests and laws: rupture, forecasts, designs and exports; each with its locked numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import creepkit as ck
from creepkit.files.file_names import hashed_stem
from creepkit.files.record_codec import record_to_json
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.records import ZERO_CELSIUS, History
from creepkit.registry import default_registry
from creepkit.reports.contents import ExportedFile
from creepkit.studies import arguments
from creepkit.studies.inputs import TestGroup, resolve_paths
from creepkit.studies.planned_tests import check_forecast, planned_test
from creepkit.studies.stage import Results, Stage, StageKind, Tick, no_numbers, stage_name
from creepkit.studies.stage_inputs import StageInputs

if TYPE_CHECKING:
    from creepkit.experiments.planned_design import Design
    from creepkit.forecasts.forecast import Forecast
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.rupture_assessment.assessment import RuptureAssessment


def rupture_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The assessment of the rupture times of a group."""
    from creepkit.rupture_assessment.assessment import RuptureAssessment

    part = study.file.model.rupture
    assert part is not None
    changes = {name: getattr(part, name) for name in ("distribution", "criterion", "level")}
    changes = {name: value for name, value in changes.items() if value is not None}
    if part.degrees is not None:
        changes["degrees"] = tuple(part.degrees)
    with study.file.at("rupture"):
        settings = ck.RuptureSettings(fixed=part.fixed, seed=study.file.model.study.seed, **changes)
    how: dict[str, Any] = {} if part.times_h is None else {"hours": part.times_h}
    if part.temperatures_C is not None:
        how["temperatures"] = [T + ZERO_CELSIUS for T in part.temperatures_C]
    if part.tensile_strengths:
        how["tensile_strength"] = {s.temperature_C + ZERO_CELSIUS: s.strength_MPa for s in part.tensile_strengths}

    def make(results: Results, tick: Tick) -> RuptureAssessment:
        return ck.rupture(list(group.histories), part.methods, settings=settings, **how)

    described = [part.model_dump(), record_to_json(asdict(settings)), study.digests(group.histories)]
    name = stage_name("rupture", group.name)
    return Stage(name, "rupture", group.name, described, make, _numbers_of_rupture, record=RuptureAssessment)


def _numbers_of_rupture(assessment: RuptureAssessment) -> dict[str, Any]:
    """The strengths that there are."""
    return {
        f"{one.method} {one.hours:g} h {one.temperature:g} K": one.value
        for one in assessment.strengths
        if one.value is not None
    }


def forecast_stage(study: StageInputs, number: int) -> Stage:
    """The forecast of this number in the study file."""
    from creepkit.forecasts.forecast import Forecast

    part, place = study.file.model.forecast[number], ("forecast", number)
    check_forecast(study.file, number)
    groups = study.groups_of(place, part.group)
    if len(groups) > 1:
        names = " or ".join(f"'{group.name}'" for group in groups)
        raise study.file.error(place, f"there are several groups of tests; say by group which one: {names}")
    need = study.needed(place, "identification", groups[0])
    measured: list[History] = []
    if part.tests:
        paths = resolve_paths(study.file, (*place, "tests"), part.tests, study.root)
        with study.file.at(*place, "tests"):
            measured = ck.read_histories(paths)
    how: dict[str, Any] = {"level": part.level, "draws": part.draws}
    if part.targets:
        how["targets"] = arguments.numbers_by_output(study.file, (*place, "targets"), part.targets)
    if part.tolerances:
        how["tolerances"] = arguments.tolerances_of(study.file, number)
    how = {name: value for name, value in how.items() if value is not None}

    def make(results: Results, tick: Tick) -> Forecast:
        ranking: Ranking = results[need]
        tests = measured
        if not tests:
            low, high = ranking.best.ranges["temperature"]
            usual = 0.5 * (low + high) if high - low <= ISOTHERMAL_RANGE else None
            tests = [planned_test(study.file, number, usual)]
        return ck.forecast(ranking, tests, progress=tick, **how)

    described = [part.model_dump(), study.digests(measured)]
    return Stage(
        f"forecast of {part.name}", "forecast", groups[0].name, described, make, _numbers_of_forecast, (need,), Forecast
    )


def _numbers_of_forecast(forecast: Forecast) -> dict[str, Any]:
    """Outputs at the end of each test, and times with their intervals."""
    return {
        test.name: {
            **{name: float(output.value[-1]) for name, output in test.outputs.items()},
            **{time.event: [time.value, time.low, time.high] for time in test.times},
        }
        for test in forecast.tests
    }


def design_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The further tests that are proposed for a group."""
    from creepkit.experiments.planned_design import Design
    from creepkit.experiments.rig import rigs_of

    part = study.file.model.design
    assert part is not None
    need = study.needed(("design",), "identification", group)
    goal = arguments.goal_of(study.file)
    seed = study.file.model.study.seed

    def make(results: Results, tick: Tick) -> Design:
        best = results[need].best
        rigs = arguments.rigs_of_study(study.file, rigs_of(best.histories, best.predictor), best.predictor)
        return ck.design(results[need], rig=rigs, goal=goal, budget=part.budget_h, seed=seed, progress=tick)

    name = stage_name("design", group.name)
    return Stage(name, "design", group.name, [part.model_dump(), seed], make, _numbers_of_design, (need,), Design)


def _numbers_of_design(design: Design) -> dict[str, Any]:
    """The tests of the plan."""
    return {"plan": [test.description for test in design.plan]}


def export_stage(study: StageInputs, number: int, group: TestGroup) -> Stage:
    """The export of this number in the study file, for a group."""
    part, place = study.file.model.export[number], ("export", number)
    table: StageKind = "temperature" if part.law == "temperature" else "identification"
    need = study.needed(place, table, group)
    with study.file.at(*place, "target"):
        exporter = default_registry().exporter(part.target)
    several = len(study.groups_of(place, part.group)) > 1
    file = part.file or f"law{exporter.suffix}"
    if several:
        stem, dot, suffix = file.rpartition(".")
        file = f"{stem or suffix}_{hashed_stem(group.name)}{dot}{suffix if stem else ''}"
    units = {"stress": part.stress_unit, "time": part.time_unit}
    with study.file.at(*place):
        ck.Units(**units)
    elastic = None if part.modulus_GPa is None else ck.Elastic(1e3 * part.modulus_GPa, part.poisson)
    temperature = None if part.temperature_C is None else part.temperature_C + ZERO_CELSIUS

    def make(results: Results, tick: Tick) -> ExportedFile:
        source = results[need]
        law = source.temperature_law if part.law == "temperature" else source  # a ranking gives its verdict along
        record = ck.law_with_values(law, elastic=elastic, name=part.name or "")
        return ExportedFile(file, part.target, ck.export(record, part.target, units=units, temperature=temperature))

    name = f"export {number + 1}{f' of {group.name}' if group.name else ''}: {part.target}"
    described = [part.model_dump(), file]
    return Stage(name, "export", group.name, described, make, no_numbers, (need,), ExportedFile, file=file)
