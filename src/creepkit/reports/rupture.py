"""Text and JSON of a rupture assessment: verdict, methods, strengths with bounds, checks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.records.units import ZERO_CELSIUS, celsius_text
from creepkit.reports.blocks import Block, Items, Paragraph, Table, as_text, plural
from creepkit.reports.json_values import fields_to_json
from creepkit.reports.rupture_plot import rupture_figure
from creepkit.rupture_assessment.log_time_distributions import power_of_ten

if TYPE_CHECKING:
    from creepkit.reports.svg import PageFigures
    from creepkit.rupture_assessment.assessment import RuptureAssessment
    from creepkit.rupture_assessment.checks import AssessmentCheck
    from creepkit.rupture_assessment.rupture_fit import RuptureFit

SHOWN_WEIGHT = 1e-3
"""Fits of less weight do not count in what is said of the scatter."""

LEAST_SCATTER_SHOWN = 1e-3
"""Standard deviation of log10 of time: a quarter of a per cent of the time."""

SHOWN_EFFECTS = 6
"""Heats at each end of the list."""

CRITERIA = {"bic": "BIC", "aicc": "AICc"}
"""As they are written."""

PASSED = {True: "passes", False: "FAILS", None: "cannot be made"}


def rupture_text(assessment: RuptureAssessment) -> str:
    """The verdict, then methods, strengths and checks, and the notes."""
    return as_text([*strength_blocks(assessment), *rupture_blocks(assessment)])


def strength_blocks(assessment: RuptureAssessment) -> list[Block]:
    """The tests, the verdict, and the strengths of the average method in a table."""
    tests = assessment.tests
    span = f"{_range(tests.stress)} MPa, {_range(tests.temperature - ZERO_CELSIUS)} °C"
    heats = "".join(f", {len(set(v))} {_plural(group)}" for group, v in tests.groups.items())
    head = (
        f"{len(tests)} rupture tests, {int(tests.censored.sum())} of them run-outs, {span}, up to "
        f"{10 ** float(tests.log_time.max()):.4g} h{heats}"
    )
    table, note = _strengths(assessment)
    said = [Paragraph(note, "note")] if note else []
    return [Paragraph(assessment.verdict, "lead"), Paragraph(head), table, *said]


def rupture_blocks(assessment: RuptureAssessment, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """Methods with their weights and constants, checks and notes, and with `figures` the isotherms."""
    best, relation, groups = assessment.best, assessment.relation, assessment.tests.groups
    columns = (
        *("method", "weight", f"{CRITERIA[assessment.settings.criterion]} - best", "scatter of a test"),
        *(f"between {_plural(group)}" for group in groups),
    )
    rows = [
        (
            one.fit.name,
            f"{one.weight:.3f}",
            f"{one.excess:.1f}",
            f"factor {power_of_ten(one.fit.scale_corrected):.3g}",
            *(f"factor {power_of_ten(scatter):.3g}" for scatter in one.fit.scatter_corrected.values()),
        )
        for one in assessment.ranked
    ]
    blocks: list[Block] = [Table("methods by their weights", columns, rows, numeric=(1, 2))]
    if figures is not None:
        picture = figures.picture(
            lambda: rupture_figure(assessment),
            f"Rupture assessment{of}",
            "Isotherms of stress over rupture time with tests and bounds, the master curve, and predicted over "
            f"measured times of {plural(len(assessment.tests), 'test')}.",
            "Isotherms with tests and bounds; master curve; predicted against measured times. Broken lines lie beyond "
            "the stresses tested.",
        )
        blocks.append(picture)
    blocks += [Items([f"{name}: not ranked, for {why}" for name, why in assessment.rejected.items()])]
    blocks += [_constants(best), *(Paragraph(line) for line in _effect_lines(best))]
    if relation is not None:
        blocks += [Paragraph("not ranked, for they use minimum rates:")]
        blocks += [_constants(relation.times), _constants(relation.rates)]
    blocks += [Paragraph(f"checks of {best.name}:"), Items(list(map(check_text, assessment.checks)))]
    return [*blocks, Paragraph("notes:"), Items(assessment.notes)] if assessment.notes else blocks


def check_text(check: AssessmentCheck) -> str:
    """One check as a line: of one that fails what is wrong, in the place of its name."""
    named = check.fault if check.passed is False and check.fault else check.name
    return f"{PASSED[check.passed]}: {named}; {check.found}"


def _plural(group: str) -> str:
    return "laboratories" if group == "laboratory" else f"{group}s"


def _range(values: Any) -> str:
    low, high = f"{float(np.min(values)):.4g}", f"{float(np.max(values)):.4g}"
    return low if low == high else f"{low} to {high}"


def _constants(fit: RuptureFit) -> Table:
    from creepkit.rupture_assessment.methods import METHODS

    given = "".join(f", {name} = {value:.6g} given" for name, value in fit.fixed.items())
    rows = [(p.name, f"{p.value:.5g}", f"{p.low:.5g} to {p.high:.5g}", p.unit) for p in fit.parameters]
    caption = f"{fit.name}: {METHODS[fit.method].equation}{given}"
    return Table(caption, ("constant", "value", "95 % interval", "unit"), rows, numeric=(1, 2))


def _effect_lines(fit: RuptureFit) -> list[str]:
    """Heats and laboratories, the weakest first, where they scatter at all."""
    lines = []
    for group, effects in fit.effects.items():
        if fit.scatter[group] < LEAST_SCATTER_SHOWN:
            continue
        ordered = [f"{name} {10 ** effects[name]:.2f}" for name in sorted(effects, key=lambda name: effects[name])]
        if len(ordered) > 2 * SHOWN_EFFECTS:
            ordered = [*ordered[:SHOWN_EFFECTS], "...", *ordered[-SHOWN_EFFECTS:]]
        lines.append(f"times of {_plural(group)} over those of the average one: {', '.join(ordered)}")
    return lines


def _strengths(assessment: RuptureAssessment) -> tuple[Table, str]:
    """The strengths of the average method, and what is said of a new heat, "" for nothing."""
    level = f"{100 * assessment.settings.level:g} %"
    shown = [one for one in assessment.strengths if one.method == "average"]
    if assessment.relation is not None:
        shown += [one for one in assessment.strengths if one.method == assessment.relation.times.method]
    scattering = [g for g in assessment.tests.groups if _largest_scatter(assessment, g) >= LEAST_SCATTER_SHOWN]
    heads = ["method", "temperature", "time, h", "value", f"{level} of the mean"]
    heads += [f"of a new {' and '.join(scattering)}"] if scattering else []
    rows = []
    for one in shown:
        bounds = [one.bounds_of_mean, *([one.bounds_of_heat] if scattering else []), one.bounds_of_test]
        remarks = (one.extrapolation and f"extrapolated: {one.extrapolation}", one.reason)
        rows.append(
            (
                one.method,
                celsius_text(one.temperature),
                f"{one.hours:g}",
                "none" if one.value is None else f"{one.value:.1f}",
                *map(_pair, bounds),
                "; ".join(text for text in remarks if text),
            )
        )
    note = ""
    if not assessment.tests.groups:
        note = "no bounds of a new heat: the tests tell no heats or laboratories apart"
    elif not scattering:
        groups = " and ".join(map(_plural, assessment.tests.groups))
        note = f"a new heat has the bounds of the mean: no scatter between {groups} is found"
    columns = [*heads, "of one test", "remarks"]
    caption = "creep rupture strengths in MPa, with bounds in brackets"
    return Table(caption, columns, rows, numeric=(2, 3)), note


def _largest_scatter(assessment: RuptureAssessment, group: str) -> float:
    """Of the methods that count."""
    fits = [one.fit for one in assessment.ranked if one.weight >= SHOWN_WEIGHT]
    if assessment.relation is not None:
        fits.append(assessment.relation.times)
    return max(fit.scatter.get(group, 0.0) for fit in fits)


def _pair(ends: tuple[float | None, float | None]) -> str:
    low, high = ("none" if end is None else f"{end:.1f}" for end in ends)
    return f"[{low}, {high}]" if (low, high) != ("none", "none") else "none"


def rupture_to_json(assessment: RuptureAssessment) -> dict[str, Any]:
    """The assessment as JSON-able data, without the tests and covariances that its file holds."""
    return {
        "verdict": assessment.verdict,
        "decisive": assessment.decisive,
        "tests": len(assessment.tests),
        "run_outs": int(assessment.tests.censored.sum()),
        "methods": [
            {**_fit_to_json(one.fit), f"{assessment.settings.criterion}_excess": one.excess, "weight": one.weight}
            for one in assessment.ranked
        ],
        "rejected": dict(assessment.rejected),
        "relation": None
        if assessment.relation is None
        else [_fit_to_json(assessment.relation.times), _fit_to_json(assessment.relation.rates)],
        "strengths": [
            {
                "strength": one.value,
                **fields_to_json(one, "method hours temperature bounds_of_mean bounds_of_heat bounds_of_test"),
                **fields_to_json(one, "extrapolation reason"),
            }
            for one in assessment.strengths
        ],
        "checks": [fields_to_json(one, "name passed found fault") for one in assessment.checks],
        "level": assessment.settings.level,
        "notes": list(assessment.notes),
        "provenance": dict(assessment.provenance),
    }


def _fit_to_json(fit: RuptureFit) -> dict[str, Any]:
    return {
        **fields_to_json(fit, "method degree fixed log_likelihood"),
        "parameters": {p.name: fields_to_json(p, "value low high unit") for p in fit.parameters},
        "scale_log10": fit.scale,
        "scatter_log10": dict(fit.scatter),
        "effects_log10": {group: dict(effects) for group, effects in fit.effects.items()},
    }
