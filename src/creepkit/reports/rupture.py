"""Text and JSON of a rupture assessment: verdict, methods, strengths with bounds, checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.records.units import celsius_text
from creepkit.rupture_assessment.log_time_distributions import power_of_ten

if TYPE_CHECKING:
    from creepkit.rupture_assessment.assessment import RuptureAssessment
    from creepkit.rupture_assessment.checks import AssessmentCheck
    from creepkit.rupture_assessment.rupture_fit import RuptureFit
    from creepkit.rupture_assessment.strength import StrengthEstimate

SHOWN_WEIGHT = 1e-3
"""Fits of less weight do not count in what is said of the scatter."""

LEAST_SCATTER_SHOWN = 1e-3
"""Standard deviation of log10 of time: a quarter of a per cent of the time."""

SHOWN_EFFECTS = 6
"""Heats at each end of the list."""

CRITERIA = {"bic": "BIC", "aicc": "AICc"}
"""As they are written."""

PASSED = {True: "passes", False: "FAILS", None: "cannot be made"}


def rupture_text(assessment: RuptureAssessment, *, strengths: bool = True) -> str:
    """The verdict, then tables of methods, strengths (where wanted) and checks, and the notes."""
    tests = assessment.tests
    span = f"{_range(tests.stress)} MPa, {_range(tests.temperature - 273.15)} °C"
    heats = "".join(f", {len(set(v))} {_plural(group)}" for group, v in tests.groups.items())
    head = (
        f"{len(tests)} rupture tests, {int(tests.censored.sum())} of them run-outs, {span}, up to "
        f"{10 ** float(tests.log_time.max()):.4g} h{heats}"
    )
    best = assessment.best
    lines = [
        head,
        assessment.verdict,
        "",
        *_aligned(
            (
                "method",
                "weight",
                f"{CRITERIA[assessment.settings.criterion]} - best",
                "scatter of a test",
                *(f"between {_plural(group)}" for group in tests.groups),
            ),
            _method_rows(assessment),
        ),
        *(f"{name}: not ranked, for {why}" for name, why in assessment.rejected.items()),
        "",
        *_constants(best),
        *_effect_lines(best),
    ]
    if assessment.relation is not None:
        lines += ["not ranked, for they use minimum rates:", *_constants(assessment.relation.times)]
        lines += _constants(assessment.relation.rates)
    lines += ["", *_strength_lines(assessment)] if strengths else []
    lines += ["", f"checks of {best.name}:"]
    lines += [f"- {check_text(check)}" for check in assessment.checks]
    lines += [f"note: {note}" for note in assessment.notes]
    return "\n".join(lines)


def check_text(check: AssessmentCheck) -> str:
    """One check as a line: of one that fails what is wrong, in the place of its name."""
    named = check.fault if check.passed is False and check.fault else check.name
    return f"{PASSED[check.passed]}: {named}; {check.found}"


def _plural(group: str) -> str:
    return "laboratories" if group == "laboratory" else f"{group}s"


def _range(values: Any) -> str:
    low, high = f"{float(np.min(values)):.4g}", f"{float(np.max(values)):.4g}"
    return low if low == high else f"{low} to {high}"


def _aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[k]) for row in [heads, *rows]) for k in range(len(heads))]
    return ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in [heads, *rows]]


def _method_rows(assessment: RuptureAssessment) -> list[tuple[str, ...]]:
    return [
        (
            one.fit.name,
            f"{one.weight:.3f}",
            f"{one.excess:.1f}",
            f"factor {power_of_ten(one.fit.scale_corrected):.3g}",
            *(f"factor {power_of_ten(scatter):.3g}" for scatter in one.fit.scatter_corrected.values()),
        )
        for one in assessment.ranked
    ]


def _constants(fit: RuptureFit) -> list[str]:
    from creepkit.rupture_assessment.methods import METHODS

    given = "".join(f", {name} = {value:.6g} given" for name, value in fit.fixed.items())
    head = f"{fit.name}: {METHODS[fit.method].equation}{given}"
    return [
        head,
        *(f"  {p.name} = {p.value:.5g} [{p.low:.5g}, {p.high:.5g}] {p.unit}".rstrip() for p in fit.parameters),
    ]


def _effect_lines(fit: RuptureFit) -> list[str]:
    """Heats and laboratories, the weakest first, where they scatter at all."""
    lines = []
    for group, effects in fit.effects.items():
        if fit.scatter[group] < LEAST_SCATTER_SHOWN:
            continue
        ordered = [f"{name} {10 ** effects[name]:.2f}" for name in sorted(effects, key=lambda name: effects[name])]
        if len(ordered) > 2 * SHOWN_EFFECTS:
            ordered = [*ordered[:SHOWN_EFFECTS], "...", *ordered[-SHOWN_EFFECTS:]]
        lines.append(f"  times of {_plural(group)} over those of the average one: {', '.join(ordered)}")
    return lines


def strength_rows(assessment: RuptureAssessment) -> tuple[list[str], list[tuple[str, ...]], str]:
    """Heads of columns, rows of the strengths of the average method, and what is said of a new heat, "" for nothing."""
    level = f"{100 * assessment.settings.level:g} %"
    shown = [one for one in assessment.strengths if one.method == "average"]
    if assessment.relation is not None:
        shown += [one for one in assessment.strengths if one.method == assessment.relation.times.method]
    scattering = [g for g in assessment.tests.groups if _largest_scatter(assessment, g) >= LEAST_SCATTER_SHOWN]
    heads = ["strength, MPa", "temperature", "time, h", "value", f"{level} of the mean"]
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
    return [*heads, "of one test", ""], rows, note


def _strength_lines(assessment: RuptureAssessment) -> list[str]:
    heads, rows, note = strength_rows(assessment)
    return [*_aligned(heads, rows), *([note] if note else [])]


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
        "strengths": [_strength_to_json(one) for one in assessment.strengths],
        "checks": [{"name": c.name, "passed": c.passed, "found": c.found, "fault": c.fault} for c in assessment.checks],
        "level": assessment.settings.level,
        "notes": list(assessment.notes),
        "provenance": dict(assessment.provenance),
    }


def _fit_to_json(fit: RuptureFit) -> dict[str, Any]:
    return {
        "method": fit.method,
        "degree": fit.degree,
        "parameters": {
            p.name: {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit} for p in fit.parameters
        },
        "fixed": dict(fit.fixed),
        "scale_log10": fit.scale,
        "scatter_log10": dict(fit.scatter),
        "effects_log10": {group: dict(effects) for group, effects in fit.effects.items()},
        "log_likelihood": fit.log_likelihood,
    }


def _strength_to_json(one: StrengthEstimate) -> dict[str, Any]:
    bounds = {of: list(getattr(one, of)) for of in ("bounds_of_mean", "bounds_of_heat", "bounds_of_test")}
    return {
        "method": one.method,
        "hours": one.hours,
        "temperature": one.temperature,
        "strength": one.value,
        **bounds,
        "extrapolation": one.extrapolation,
        "reason": one.reason,
    }
