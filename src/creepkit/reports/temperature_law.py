"""Text of temperature laws, studies and moduli, and the plot of parameters against temperature with plausible forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE, delta_method
from creepkit.records.units import ZERO_CELSIUS, celsius_text, time_text
from creepkit.reports.answer import equations, symbols_of, value_cells
from creepkit.reports.blocks import Block, Cell, Formula, Items, Paragraph, Table, Verbatim, as_text
from creepkit.reports.description import rejected
from creepkit.reports.figures import panel_grid, place_legend, span

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.discovery.combinations import FormWeight
    from creepkit.discovery.discover import ModulusEstimates, TemperatureStudy
    from creepkit.discovery.regression import FormCombination
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.reports.svg import PageFigures


MAX_PANELS_PER_ROW = 3


MIN_WEIGHT_SHOWN = 0.02
"""Combinations of less weight are not drawn, but those that a parameter's set names."""


def temperature_law_figure(temperature_law: TemperatureLaw) -> Figure:
    """One panel a parameter: estimates with 95 % intervals, and curves; a coefficient is shown by its rate.

    The rate is that at the reference stress: coefficients themselves move with their exponents.
    """
    figure, panels = panel_grid(len(temperature_law.isothermal_law.names), MAX_PANELS_PER_ROW, 5.2, 3.7)
    for k, axes in enumerate(panels):
        draw_parameter(axes, temperature_law, k)
    title = temperature_law.law.title or temperature_law.law.name
    figure.suptitle(f"{title}, judged by the {temperature_law.criterion_data}", fontsize=10)
    return figure


def draw_parameter(axes: Axes, temperature_law: TemperatureLaw, k: int = 0) -> None:
    """A parameter of the law, by its position, over temperature."""
    law, estimates = temperature_law.isothermal_law, temperature_law.isothermal_estimates
    coordinates = Coordinates(law, estimates.reference)
    name, is_rate = law.names[k], k in coordinates.coefficients
    scale = 1 / np.log(10.0) if is_rate or law.table[name].scale == "log" else 1.0

    def shown_of(theta: Floats) -> Floats:
        return np.asarray((coordinates.u(theta) if is_rate else theta)[..., k] * scale)

    values = shown_of(estimates.theta)
    pairs = zip(estimates.theta, estimates.covariance, strict=True)
    deviations = np.array([delta_method(shown_of, *pair)[1] for pair in pairs], float)
    half_widths = NORMAL_QUANTILE * deviations
    bounds = [law.table[name].to_internal(b) * scale for b in law.table[name].bounds]
    low, high = (-np.inf, np.inf) if is_rate else bounds  # beyond which no interval goes
    error_bars = np.maximum([np.minimum(half_widths, values - low), np.minimum(half_widths, high - values)], 0.0)
    axes.errorbar(
        estimates.temperatures - ZERO_CELSIUS, values, error_bars, fmt="o", ms=4, color="0.25", capsize=2, lw=1
    )
    T, drawn = np.linspace(*temperature_law.temperature_range, 60), {"": values}
    celsius = T - ZERO_CELSIUS
    for candidate in temperature_law.candidates:
        form = candidate.forms[name]
        if form in drawn or (candidate.weight < MIN_WEIGHT_SHOWN and len(drawn) > 1):
            continue
        first, curve = len(drawn) == 1, shown_of(candidate.theta(T))
        drawn[form] = curve
        axes.plot(
            celsius, curve, lw=1.8 if first else 1.0, label=f"{form} {_form_weight(temperature_law, k, form):.2f}"
        )
        if first:
            from scipy.stats import t as student

            quantile = float(student.ppf(0.975, candidate.degrees_of_freedom))
            half = quantile * _curve_standard_deviations(shown_of, candidate, T)
            axes.fill_between(celsius, curve - half, curve + half, color="C0", alpha=0.15, lw=0)
    every = np.concatenate([*drawn.values()])
    lowest, highest = float(every.min()), float(every.max())
    widths = min(1.2 * float(np.median(half_widths)), highest - lowest)
    margin = max(0.15 * (highest - lowest), widths, 0.02 * abs(highest) + 1e-9)
    beyond = 0.03 * float(np.ptp(T))
    span(axes, "x", celsius[0] - beyond, celsius[-1] + beyond)
    span(axes, "y", lowest - margin, highest + margin, most=8)
    axes.set(xlabel="temperature, °C")
    axes.set_title(_panel_title(temperature_law, coordinates, k, name), fontsize=9)
    place_legend(axes, "form, weight", size=7)


def _form_weight(temperature_law: TemperatureLaw, k: int, form: str) -> float:
    forms = temperature_law.plausible_forms[temperature_law.isothermal_law.names[k]]
    return next((form_weight.weight for form_weight in forms if form_weight.name == form), 0.0)


def _panel_title(temperature_law: TemperatureLaw, coordinates: Coordinates, k: int, name: str) -> str:
    param, reference = temperature_law.isothermal_law.table[name], temperature_law.isothermal_estimates.reference
    if k in coordinates.coefficients:
        return f"log10 of the rate of {name} (1/s) at {reference.stress:.3g} MPa, {time_text(reference.time)}"
    unit = "" if param.unit == "1" else f", {param.unit}"
    return f"{'log10 of ' if param.scale == 'log' else ''}{name}: {param.meaning}{unit}"


def _curve_standard_deviations(function: Callable[[Floats], Floats], candidate: FormCombination, T: Floats) -> Floats:
    """(temperatures,) standard deviations of a function of theta along a candidate's curve."""
    names = list(candidate.values)

    def along(values: Floats) -> Floats:
        displaced = replace(candidate, values=dict(zip(names, map(float, values), strict=True)))
        return function(displaced.theta(T))

    return delta_method(along, np.array(list(candidate.values.values())), candidate.covariance)[1]


MAX_COMBINATIONS_LISTED = 6


CRITERION = {"points": "the quasi AICc of the estimates", "histories": "the evidence of the tests"}


EQUIVALENCE_NOTE = {
    "points": "=: these data cannot tell it from the best",
    "histories": "=: not refitted; these data cannot tell it from one that was",
}


def temperature_law_text(temperature_law: TemperatureLaw) -> str:
    """The law, its numbers, the forms that remain for each parameter, and the combinations."""
    return as_text([Paragraph(temperature_law.law.title or temperature_law.law.name), *law_blocks(temperature_law)])


def law_blocks(law: TemperatureLaw, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """Verdict, equations, values, and with `figures` the parameters over temperature; forms and combinations."""
    low, high = law.temperature_range
    adequacy, count = law.adequacy, law.isothermal_estimates.temperatures.size
    of_law = "; what follows are values and trends of a law that does not fit the tests" if rejected(law) else ""
    blocks: list[Block] = [] if adequacy is None else [Paragraph(f"the law {adequacy}{of_law}")]
    blocks += [Formula(one) for one in equations(law.law)]
    chosen = ", ".join(f"{parameter} {form}" for parameter, form in law.forms.items())
    found = f"found from {count} temperatures, {celsius_text(low, high)}, and valid between them"
    blocks.append(Paragraph(f"{found}: the parameters follow these forms best: {chosen}; T_ref = {law.T_ref:.2f} K"))
    said = "the law does not fit" if rejected(law) else ""
    symbols = symbols_of(law.law)
    rows: list[dict[str, Cell]] = [
        {"parameter": symbols[e.name], **value_cells(law.law, e), "by these tests": said or e.verdict}
        for e in law.estimates
    ]
    blocks.append(Table.of("values of the temperature law", rows))
    if figures is not None:
        picture = figures.picture(
            lambda: temperature_law_figure(law),
            f"Parameters over temperature{of}",
            f"Isothermal estimates with 95 % intervals at {count} temperatures from {celsius_text(low, high)}, and the "
            f"curves of the forms that remain. Best forms: {chosen}.",
            "Parameters at each temperature with 95 % intervals, and the forms that remain with their weights.",
        )
        blocks.append(picture)
    data = law.criterion_data
    forms = [(name, ", ".join(map(_form_text, weights))) for name, weights in law.plausible_forms.items()]
    caption = f"forms that remain, weighed by {CRITERION[data]} ({EQUIVALENCE_NOTE[data]})"
    blocks += [Table(caption, ("parameter", "forms with their weights"), forms), _combinations(law)]
    return [*blocks, Items(law.notes)]


def _form_text(form: FormWeight) -> str:
    if form.equivalent:
        return f"={form.name} {form.weight:.2f}" if form.weight > 0 else f"={form.name}"
    return f"{form.name} {form.weight:.2f}"


def _combinations(law: TemperatureLaw) -> Table:
    """The best combinations: forms, numbers, criterion less the best, weight."""
    rows = [
        {
            "forms": ", ".join(f"{name}:{form}" for name, form in one.forms.items()),
            "numbers": str(len(one.values)),
            "criterion - best": f"{one.criterion_difference:.1f}",
            "weight": f"{one.weight:.3f}",
        }
        for one in law.candidates[:MAX_COMBINATIONS_LISTED]
    ]
    more = len(law.candidates) - MAX_COMBINATIONS_LISTED
    caption = f"combinations, the best first{f'; {more} more are not listed' if more > 0 else ''}"
    return Table.of(caption, rows)


def temperature_study_text(study: TemperatureStudy) -> str:
    """The moduli, the law of all tests at once and the temperature law, one below the other, then the notes."""
    parts = [study.moduli_fit, study.joint_fit, study.temperature_law]
    texts = [str(part) for part in parts if part is not None]
    return "\n\n".join([*texts, *(f"note: {note}" for note in study.notes)])


def study_blocks(study: TemperatureStudy, figures: PageFigures, of: str = "") -> list[Block]:
    """The temperature law, where there is one, the moduli, and the notes; that the joint fit is rejected, if it is."""
    law, fit = study.temperature_law, study.joint_fit
    blocks: list[Block] = []
    if law is not None and law.adequacy is None and fit is not None and rejected(fit):
        blocks.append(Paragraph(f"the law {fit.adequacy}; what follows are values and trends of that law alone"))
    blocks += [] if law is None else law_blocks(law, figures, of)
    blocks += [] if study.moduli_fit is None else [Verbatim("Young's modulus", str(study.moduli_fit))]
    return [*blocks, Items(study.notes)]


def modulus_estimates_text(estimates: ModulusEstimates) -> str:
    """The modulus of each test with its standard deviation, and the form through them."""
    rows = zip(estimates.names, estimates.temperatures, estimates.values, estimates.sd, strict=True)
    lines = [f"  {name}: {E / 1e3:.1f} +- {sd / 1e3:.1f} GPa at {T:.1f} K" for name, T, E, sd in rows]
    form = estimates.elastic.E if estimates.elastic else "-"
    return "\n".join(["modulus from the first frames", *lines, f"  E(T) = {form}"])
