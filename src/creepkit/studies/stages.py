"""All stages of a study, in the order of their kinds; the functions that make them stand in files of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from creepkit.studies.inputs import TestGroup
from creepkit.studies.law_stages import identification_stage, quality_stage, temperature_stage
from creepkit.studies.result_stages import design_stage, export_stage, forecast_stage, rupture_stage
from creepkit.studies.stage import STAGE_KINDS, Stage, StageKind
from creepkit.studies.stage_inputs import StageInputs


def stages_of(study: StageInputs) -> list[Stage]:
    """The stages of the tables that a study has, in the order in which they are made; none without tests.

    Those of cameras and records give the tests themselves (see camera_stages); the report is made at the end.
    """
    if not study.inputs.groups:  # of cameras whose stages failed
        return []
    return [stage for kind in STAGE_KINDS if kind in STAGES for stage in STAGES[kind](study)]


def _quality(study: StageInputs) -> list[Stage]:
    return [quality_stage(study)] if study.file.model.data.check_quality else []


def _of_each_group(
    table: StageKind, make: Callable[[StageInputs, TestGroup], Stage]
) -> Callable[[StageInputs], list[Stage]]:
    """The stages of a table that stands once in the file and holds for every group, or for the one that it names."""

    def stages(study: StageInputs) -> list[Stage]:
        part = getattr(study.file.model, table)
        if part is None:
            return []
        return [make(study, group) for group in study.groups_of((table,), getattr(part, "group", None))]

    return stages


def _forecasts(study: StageInputs) -> list[Stage]:
    return [forecast_stage(study, k) for k in range(len(study.file.model.forecast))]


def _exports(study: StageInputs) -> list[Stage]:
    return [
        export_stage(study, k, group)
        for k, part in enumerate(study.file.model.export)
        for group in study.groups_of(("export", k), part.group)
    ]


STAGES: Mapping[StageKind, Callable[[StageInputs], list[Stage]]] = {
    "quality": _quality,
    "identification": _of_each_group("identification", identification_stage),
    "temperature": _of_each_group("temperature", temperature_stage),
    "rupture": _of_each_group("rupture", rupture_stage),
    "forecast": _forecasts,
    "design": _of_each_group("design", design_stage),
    "export": _exports,
}
"""{kind: its stages of a study}; STAGE_KINDS says in which order they are made."""
