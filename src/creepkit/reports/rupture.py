"""Text and JSON of a rupture assessment: verdict, methods, strengths with bounds, checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.evidence import CREDIBLE_WEIGHT
from creepkit.records.units import ZERO_CELSIUS, celsius_text
from creepkit.reports.answer import interval_text, known_bounds, rupture_figures
from creepkit.reports.blocks import Answer, Block, Items, Paragraph, Table, ends, listed, plural, plural_of
from creepkit.reports.condition_colours import ColourScale
from creepkit.reports.figures import draw_parity, empty_figure, panels_of, place_legend, span, wrapped
from creepkit.reports.words import RUPTURE
from creepkit.rupture_assessment.checks import BAND_FACTOR
from creepkit.rupture_assessment.fitting import conditions_of
from creepkit.rupture_assessment.methods import METHODS, THERMAL, Conditions
from creepkit.rupture_assessment.rupture_fit import power_of_ten
from creepkit.rupture_assessment.strength import LONGEST_EXTRAPOLATION, LifeEstimate, bound_curves, mixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.reports.svg import PageFigures
    from creepkit.rupture_assessment.assessment import RuptureAssessment
    from creepkit.rupture_assessment.checks import AssessmentCheck
    from creepkit.rupture_assessment.observed_tests import RuptureTests
    from creepkit.rupture_assessment.rupture_fit import RuptureFit


SHOWN_WEIGHT = 1e-3
"""Fits of less weight do not count in what is said of the scatter."""

LEAST_SCATTER_SHOWN = 1e-3
"""Standard deviation of log10 of time: a quarter of a per cent of the time."""

SHOWN_EFFECTS = 6
"""Heats at each end of the list."""

PASSED = {True: "passes", False: "FAILS", None: "cannot be made"}


def assessment_blocks(assessment: RuptureAssessment, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The verdict, then methods, strengths and checks, and the notes."""
    return [*strength_blocks(assessment), *rupture_blocks(assessment, figures, of)]


def rupture_verdict(assessment: RuptureAssessment) -> str:
    """The method to use, or those that the tests cannot tell apart, and the checks that the best fails."""
    weights, best = assessment.methods, assessment.best.method
    credible = [name for name, weight in weights.items() if weight > CREDIBLE_WEIGHT]
    kind = "several" if len(credible) > 1 else "decisive" if assessment.decisive else "single"
    said = RUPTURE["only" if len(weights) == 1 else kind].format(best=best, names=listed(credible))
    return "; ".join([said, *_fails(assessment)])


def _fails(assessment: RuptureAssessment) -> list[str]:
    failed = [one.fault or one.name for one in assessment.checks if one.passed is False]
    return [RUPTURE["fails"].format(best=assessment.best.method, check=check) for check in failed]


def rupture_answer(assessment: RuptureAssessment, picture: Block | None = None) -> Answer:
    """It in few lines."""
    longest, warned = 10 ** float(assessment.tests.log_time.max()), _fails(assessment)
    stated = [one for one in assessment.strengths if one.method == "average" and one.value is not None]
    far = max((one.hours for one in stated), default=0.0)
    beyond = far > LONGEST_EXTRAPOLATION * longest
    following = "longer" if beyond else "check" if warned else "strengths"
    said = RUPTURE["extrapolated"].format(hours=f"{far:g}", longest=f"{longest:.4g}")
    shown = rupture_figures(assessment)[: len(assessment.lives) if picture is None else None]
    figures = [(one.name, one.where, one.text, one.remark) for one in shown]
    for T in dict.fromkeys(one.temperature for one in stated) if picture is None else ():  # of which a page has tables
        alike = [one for one in stated if one.temperature == T]
        texts = [interval_text((one.value or 0.0, *known_bounds(one))) for one in alike]
        hours = ", ".join(f"{one.hours:g}" for one in alike)
        figures.append(("strength", celsius_text(T, digits=0), f"{', '.join(texts)} MPa", f"at {hours} h"))
    return Answer(
        assessment.verdict.partition("; ")[0],
        _tests_text(assessment),
        figures=figures,
        cautions=[*warned, *[said] * beyond],
        next_step=RUPTURE[following].format(hours=f"{float(f'{far / LONGEST_EXTRAPOLATION:.2g}'):g}"),
        picture=picture,
        more=".details(), or creepkit rupture --json",
    )


def strength_blocks(assessment: RuptureAssessment, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The tests, the verdict, times to rupture, and the strengths of the average method and by minimum rates.

    figures : of a page, where the answer with the isotherms stands in the place of the verdict.
    """
    relation, groups = assessment.relation, assessment.tests.groups
    scattering = [group for group in groups if _largest_scatter(assessment, group) >= LEAST_SCATTER_SHOWN]
    note = "no bounds of a new heat: the tests tell no heats or laboratories apart"
    if groups:
        note = f"a new heat has the bounds of the mean: no scatter between {listed([*map(plural_of, groups)])} is found"
    of_heat, level = f"of a new {' and '.join(scattering)}" * bool(scattering), assessment.settings.level
    tables = [_bounds("times to rupture in h", assessment.lives, of_heat, level)] if assessment.lives else []
    for method in ("average", *([] if relation is None else [relation.times.method])):
        by = "" if method == "average" else f" by {method}"
        shown = [one for one in assessment.strengths if one.method == method]
        tables.append(_bounds(f"creep rupture strengths in MPa{by}", shown, of_heat, level))
    head: list[Block] = [Paragraph(assessment.verdict, "lead"), Paragraph(_tests_text(assessment))]
    if figures is not None:
        caption = "Isotherms with tests, run-outs and bounds; grey: beyond three times the longest test."
        drawn = figures.picture(lambda: isotherms_figure(assessment), f"Rupture strength{of}", caption, caption)
        head = [rupture_answer(assessment, drawn)]
    return [*head, *tables, *([] if scattering else [Paragraph(note, "note")])]


def _bounds(caption: str, found: Sequence[Any], of_heat: str, level: float) -> Table:
    """Strengths at times, or times at stresses, with their bounds; of_heat : what those of a new heat are called."""
    rows = []
    for one in found:
        is_life = isinstance(one, LifeEstimate)
        at, value, digits = ("stress, MPa", one.hours, ".3g") if is_life else ("time, h", one.value, ".1f")
        beyond = one.extrapolation and f"extrapolated: {one.extrapolation}"
        row = {
            "temperature": celsius_text(one.temperature),
            at: f"{one.stress if is_life else one.hours:g}",
            "median": "none" if value is None else f"{value:{'.4g' if is_life else digits}}",
            f"{100 * level:g} % of the mean": _pair(one.bounds_of_mean, digits),
            of_heat: _pair(one.bounds_of_heat, digits),
            "of one test": _pair(one.bounds_of_test, digits),
            "remarks": "; ".join(filter(None, (beyond, "" if is_life else one.reason))),
        }
        rows.append({name: cell for name, cell in row.items() if name})
    return Table.of(f"{caption}, with bounds in brackets", rows)


def _tests_text(assessment: RuptureAssessment) -> str:
    """How many tests of what, and until when."""
    tests = assessment.tests
    span = f"{ends(tests.stress)} MPa, {ends(tests.temperature - ZERO_CELSIUS)} °C"
    heats = "".join(f", {len(set(v))} {plural_of(group)}" for group, v in tests.groups.items())
    run_outs = int(tests.censored.sum())
    of = f"{len(tests)} rupture tests{f', {run_outs} run-outs' if run_outs else ''}"
    return f"{of}, {span}, to {10 ** float(tests.log_time.max()):.4g} h{heats}"


def rupture_blocks(assessment: RuptureAssessment, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """Methods with their weights and constants, checks and notes, and with `figures` the isotherms."""
    best, relation, groups = assessment.best, assessment.relation, assessment.tests.groups
    rows = []
    for one in assessment.ranked:
        found = {f"between {plural_of(group)}": one.fit.scatter_corrected[group] for group in groups}
        scatter = {"scatter of a test": one.fit.scale_corrected, **found}
        factors = {name: f"factor {power_of_ten(value):.3g}" for name, value in scatter.items()}
        row = {"method": one.fit.name, "weight": f"{one.weight:.3f}", "BIC - best": f"{one.excess:.1f}"}
        rows.append({**row, **factors})
    blocks: list[Block] = [Table.of("methods by their weights", rows)]
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
    checks = Items(list(map(check_text, assessment.checks)), f"checks of {best.name}:")
    return [*blocks, checks, Items(assessment.notes, "notes:")]


def check_text(check: AssessmentCheck) -> str:
    """One check as a line: of one that fails what is wrong, in the place of its name."""
    named = check.fault if check.passed is False and check.fault else check.name
    return f"{PASSED[check.passed]}: {named}; {check.found}"


def _constants(fit: RuptureFit) -> Table:
    given = "".join(f", {name} = {value:.6g} given" for name, value in fit.fixed.items())
    rows = [(p.name, f"{p.value:.5g}", f"{p.low:.5g} to {p.high:.5g}", p.unit) for p in fit.parameters]
    caption = f"{fit.name}: {METHODS[fit.method].equation}{given}"
    return Table(caption, ("constant", "value", "95 % interval", "unit"), rows)


def _effect_lines(fit: RuptureFit) -> list[str]:
    """Heats and laboratories, the weakest first, where they scatter at all."""
    lines = []
    for group, effects in fit.effects.items():
        if fit.scatter[group] < LEAST_SCATTER_SHOWN:
            continue
        ordered = [f"{name} {10 ** effects[name]:.2f}" for name in sorted(effects, key=lambda name: effects[name])]
        if len(ordered) > 2 * SHOWN_EFFECTS:
            ordered = [*ordered[:SHOWN_EFFECTS], "...", *ordered[-SHOWN_EFFECTS:]]
        lines.append(f"times of {plural_of(group)} over those of the average one: {', '.join(ordered)}")
    return lines


def _largest_scatter(assessment: RuptureAssessment, group: str) -> float:
    """Of the methods that count."""
    fits = [one.fit for one in assessment.ranked if one.weight >= SHOWN_WEIGHT]
    if assessment.relation is not None:
        fits.append(assessment.relation.times)
    return max(fit.scatter.get(group, 0.0) for fit in fits)


def _pair(ends: tuple[float | None, float | None], digits: str) -> str:
    low, high = ("none" if end is None else f"{end:{digits}}" for end in ends)
    return f"[{low}, {high}]" if (low, high) != ("none", "none") else "none"


# ---- figure ----------------------------------------------------------------------------------------------------------


MOST_ISOTHERMS = 8
"""In one panel."""

RUN_OUT = "$\\rightarrow$"
"""Marker of tests that did not break."""

POINTS = 181
ISOTHERMS_WIDTH, ISOTHERMS_HEIGHT = 4.6, 4.0
"""Inches of the isotherms alone."""

LONGEST_HOURS = 1e5
"""Up to which isotherms are drawn at least."""


def rupture_figure(assessment: RuptureAssessment) -> Figure:
    """Isotherms of the average of methods beside its best method's master curve and predicted times.

    Broken lines are beyond the stresses tested, the shaded part of the time axis beyond three times the longest test.
    """
    figure = empty_figure(12.5, 6.2)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.7, 1.0])
    places = (grid[:, 0], grid[0, 1], grid[1, 1])
    isotherms, master, compared = map(figure.add_subplot, places)
    draw_isotherms(isotherms, assessment)
    _draw_master_curve(master, assessment)
    _draw_predicted(compared, assessment)
    handles, labels = isotherms.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6), fontsize=8)
    figure.suptitle(wrapped(assessment.verdict, 12.5), fontsize=10)
    return figure


def isotherms_figure(assessment: RuptureAssessment) -> Figure:
    """The isotherms alone."""
    figure, axes = panels_of(ISOTHERMS_WIDTH, ISOTHERMS_HEIGHT)
    draw_isotherms(axes, assessment)
    place_legend(axes, below=True)
    return figure


def _draw_tests(axes: Axes, tests: RuptureTests, x: Floats, y: Floats, size: float) -> None:
    """The tests in the colours of their temperatures, run-outs as arrows; x, y : (tests,) their places."""
    colours = _colours(tests)
    for k, (T, censored) in enumerate(zip(tests.temperature, tests.censored, strict=True)):
        marker, ms, edge = (RUN_OUT, 9.0, colours(T)) if censored else ("o", size, "white")
        axes.plot(x[k], y[k], ls="", marker=marker, ms=ms, color=colours(T), mec=edge, mew=0.4, zorder=5)


def _colours(tests: RuptureTests) -> ColourScale:
    return ColourScale("temperature, K", tests.temperature, colour_map="plasma")


def draw_isotherms(axes: Axes, assessment: RuptureAssessment) -> None:
    """Isotherms with their bounds, and the tests."""
    tests = assessment.tests
    longest = 10.0 ** float(tests.log_time.max())
    hours = 10.0 ** float(tests.log_time.min()) / 2.0, max(3.0 * LONGEST_EXTRAPOLATION * longest, LONGEST_HOURS)
    stresses = 0.6 * float(tests.stress.min()), 1.3 * float(tests.stress.max())
    for T in tests.isotherms[:: -(-len(tests.isotherms) // MOST_ISOTHERMS)]:
        _draw_isotherm(axes, assessment, T, stresses, hours, _colours(tests)(T))
    _draw_tests(axes, tests, 10.0**tests.log_time, tests.stress, 4.0)
    axes.axvspan(LONGEST_EXTRAPOLATION * longest, 2 * hours[1], color="#d9d9d9", alpha=0.6, lw=0, zorder=0)
    span(axes, "x", hours, logarithmic=True, most=8)
    span(axes, "y", stresses, logarithmic=True, most=8)
    axes.set(xlim=hours, ylim=stresses, xlabel="time to rupture, h", ylabel="stress, MPa")
    per_cent = f"{100 * assessment.settings.level:g} %"
    axes.plot([], [], "o", color="0.3", ms=4, label="test that broke")
    axes.plot([], [], ls="", marker=RUN_OUT, color="0.3", ms=9, label="run-out")
    axes.fill_between([], [], [], color="0.3", alpha=0.35, lw=0, label=f"{per_cent} of the mean")
    axes.fill_between([], [], [], color="0.3", alpha=0.13, lw=0, label=f"{per_cent} of one test")
    axes.plot([], [], "--", color="0.3", lw=1.2, label="beyond the stresses tested at this temperature")
    axes.fill_between([], [], [], color="#d9d9d9", label="beyond 3 times the longest test")


def _draw_isotherm(
    axes: Axes,
    assessment: RuptureAssessment,
    temperature: float,
    stresses: tuple[float, float],
    hours: tuple[float, float],
    colour: Any,
) -> None:
    tests, models = assessment.tests, assessment.models()
    limit = float(assessment.tensile(np.array([temperature]))[0])
    needs = [METHODS[m.method].needs for m, _ in models if hasattr(m, "method")]
    if "tensile_strength" in needs and not np.isfinite(limit):
        return
    stress = np.geomspace(stresses[0], min(stresses[1], 0.99 * limit if np.isfinite(limit) else np.inf), POINTS)
    at = _points(stress, temperature, limit)
    curves = bound_curves(models, at, assessment.settings.level)
    for of, alpha in (("test", 0.13), ("mean", 0.35)):
        low, high = (np.clip(10.0**v, 1e-3 * hours[0], 1e3 * hours[1]) for (kind, _), v in curves.items() if kind == of)
        axes.fill_betweenx(stress, low, high, color=colour, alpha=alpha, lw=0)
    times = 10.0 ** mixed(models, at, "mean").quantile(0.5)
    near = np.abs(tests.temperature - temperature) <= 5.0
    tested = (stress >= 0.99 * tests.stress[near].min()) & (stress <= 1.01 * tests.stress[near].max())
    axes.plot(times, stress, "--", color=colour, lw=1.2)
    axes.plot(np.where(tested, times, np.nan), stress, color=colour, lw=1.8)
    shown = np.flatnonzero(tested & (times > hours[0]) & (times < 0.8 * hours[1]))
    if shown.size:  # above the isotherm at the highest stress tested, where bands are narrow
        place, box = (times[shown[-1]], stress[shown[-1]]), {"boxstyle": "square,pad=0.1", "color": "white", "lw": 0}
        label = axes.annotate(
            celsius_text(temperature, digits=0), place, (7, 3), textcoords="offset points", fontsize=8
        )
        label.set(fontweight="bold", color=colour, zorder=6, bbox={**box, "alpha": 0.8})


def _points(stress: Floats, temperature: float, limit: float) -> Conditions:
    shape = stress.shape
    return Conditions(stress, np.full(shape, temperature), np.full(shape, limit), np.full(shape, np.nan))


def _draw_master_curve(axes: Axes, assessment: RuptureAssessment) -> None:
    """Stress over the time-temperature parameter of the best fit; of Wilshire's the normalised stress."""
    fit, tests = assessment.best, assessment.tests
    at, T = conditions_of(tests, assessment.tensile), float(tests.temperature.mean())
    normalised, limit = fit.method == "wilshire", float(assessment.tensile(np.array([T]))[0])
    value, label = _parameter(assessment, at, tests.log_time)
    scale = at.tensile_strength if normalised else np.ones_like(at.stress)
    stress, unit = at.stress / scale, limit if normalised else 1.0
    _draw_tests(axes, tests, value, stress, 3.5)
    grid = np.geomspace(stress.min(), stress.max(), POINTS)
    points = _points(grid * unit, T, limit)
    axes.plot(_parameter(assessment, points, fit.location(points))[0], grid, color="black", lw=1.2)
    span(axes, "y", stress, logarithmic=True, margin=1.05)
    _dress(axes, label, "stress / tensile strength" if normalised else "stress, MPa", f"{fit.name}: master curve")


def _dress(axes: Axes, x: str, y: str, title: str) -> None:
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.set_title(title, fontsize=9)
    axes.tick_params(labelsize=7)


def _parameter(assessment: RuptureAssessment, at: Conditions, log_time: Floats) -> tuple[Floats, str]:
    """The time-temperature parameter of conditions and log10 of times in hours, and what it is."""
    fit = assessment.best
    values = {p.name: p.value for p in fit.parameters} | dict(fit.fixed)
    if fit.method == "larson-miller":
        return at.temperature * (values["C"] + log_time) / 1000.0, f"T ({values['C']:.2f} + log t) / 1000, K, h"
    if fit.method in ("orr-sherby-dorn", "wilshire"):
        label = f"log t - {values['Q'] / 1000:.0f} kJ/mol / (R T ln 10), h"
        return log_time - values["Q"] / (THERMAL * at.temperature), label
    if fit.method == "manson-haferd":
        t_a, T_a = values["log10 t_a"], values["T_a"]
        return (log_time - t_a) / (at.temperature - T_a), f"(log t - {t_a:.2f}) / (T - {T_a:.0f} K), h"
    return log_time, "log t, h"


def _draw_predicted(axes: Axes, assessment: RuptureAssessment) -> None:
    fit, tests = assessment.best, assessment.tests
    measured, predicted = 10.0**tests.log_time, 10.0 ** fit.location(conditions_of(tests, assessment.tensile))
    draw_parity(axes, measured, predicted, logarithmic=True, margin=1.8, factor=BAND_FACTOR)
    _draw_tests(axes, tests, measured, predicted, 3.5)
    _dress(axes, "measured, h (grey: a factor of 2)", "predicted, h", f"{fit.name}: predicted against measured")
