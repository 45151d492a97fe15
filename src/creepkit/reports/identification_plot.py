"""Plot of an identification: tests over time with bands, creep rates over stress, times to rupture; and its curves.

With y(x) a predicted output, x = (u, e) the unknowns (coordinates of the law and nuisance parameters of the tests) and
C their covariance, its standard deviation is sqrt(dy/dx C dy/dx'). One prediction with sensitivities gives y and dy/dx.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.defect_correction import with_correction_at_frames
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, usable_frames
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.records import SECONDS_PER_HOUR, Prediction, is_logarithmic
from creepkit.records.conditions import condition_values
from creepkit.reports.compared_values import judged_readings, once
from creepkit.reports.condition_colours import ColourScale, stress_scale, temperature_scale
from creepkit.reports.figures import empty_figure, panel_grid, set_range, shortened, span, wrapped
from creepkit.reports.rate_panels import draw_rates, draw_ruptures, has_rates, rupture_rows
from creepkit.reports.wording import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification
    from creepkit.records import History


SHOWN_STRAIN_RATIO = 1e-3
"""Of the largest strain: the lower end of a logarithmic axis of strain."""


DRAWN_STRAIN_RATIO = 1.5
"""Of the largest measured strain of a test: where its identified curve and band end."""


DOTS_ABOVE_LINES = 100
"""Up to so many frames lie above the identified curve; more would hide it."""


BAND_OPACITY = 0.2
"""Of the bands of one condition."""


PANEL_WIDTH, PANEL_HEIGHT = 4.1, 3.4
"""Inches of a panel of an answer: so small that a telephone shows it as it was drawn."""


LABEL_SIZE, LABEL_PLACES = np.array([19.0, 9.0]), np.array([(2.0, -3.0), (-9.0, 4.0), (-9.0, -11.0), (-21.0, -3.0)])
"""Points of a label, and where it may stand beside a point of its curve: right, above, below, left."""


LABEL_CLEAR, LABEL_STEP = 4.0, 8
"""Points that it is clear of others and of curves, beyond which further is no better; and between places tried."""


MOST_LABELLED = 16
"""Tests whose stress stands beside their curve, where colours are temperatures."""


def identification_figure(fit: Identification) -> Figure:
    """Draw the tests over time with bands, creep rates over stress, and times to rupture."""
    drawn = [*summary_panels(fit).values()]
    figure, panels = panel_grid(len(drawn), len(drawn), PANEL_WIDTH, PANEL_HEIGHT)
    for draw, axes in zip(drawn, panels, strict=True):
        draw(axes)
    figure.suptitle(wrapped(fit.headline, float(figure.get_size_inches()[0])), fontsize=10)
    return figure


def draw_identification(axes: Axes, fit: Identification) -> None:
    """The tests over time with bands; of tests without frames creep rates over stress."""
    leading = leading_outputs(fit)
    if leading:
        _draw_leading(axes, fit, leading, _curve_scale(fit))
    else:
        draw_rates(axes, fit)


def leading_outputs(fit: Identification) -> dict[str, list[int]]:
    """{output that grows with creep: positions of the tests of which it is the first}."""
    outputs: dict[str, list[int]] = {}
    for k, test in enumerate(fit.tests):
        if test.outputs:
            outputs.setdefault(test.outputs[0].output, []).append(k)
    return outputs


def summary_panels(fit: Identification) -> dict[str, Callable[[Axes], None]]:
    """{what a panel shows: how it is drawn}: curves coloured by stress or temperature; rates over stress; lives."""
    if not fit.histories:
        what = "this identification was loaded from a file without its tests"
        raise FitError(f"{what}: draw fit.with_histories(ck.read_histories(...))")
    scale, leading = _curve_scale(fit), leading_outputs(fit)
    panels: dict[str, Callable[[Axes], None]] = {}
    if leading:
        panels["curves over time"] = partial(_draw_leading, fit=fit, leading=leading, scale=scale, bar=True)
    if has_rates(fit):
        panels["creep rate over stress"] = partial(draw_rates, fit=fit)
    if rupture_rows(fit):
        panels["times to rupture"] = partial(draw_ruptures, fit=fit, colours=scale.colours)
    return panels


def summary_figures(fit: Identification) -> dict[str, Figure]:
    """{what it shows: figure} of each panel, which a page sets side by side, or one below the other."""
    figures = {}
    for name, draw in summary_panels(fit).items():
        figures[name] = empty_figure(PANEL_WIDTH, PANEL_HEIGHT)
        draw(figures[name].subplots())
    return figures


def _curve_scale(fit: Identification) -> ColourScale:
    """Colours by temperature where it varies, else by a condition of the material that does, else by stress."""
    by_temperature = temperature_scale(fit.histories)
    stated = zip(fit.law.conditions, condition_values(fit.law, fit.histories).T, strict=True)
    varied = [(f"{one.name.replace('_', ' ')}, {one.unit}", values) for one, values in stated if np.ptp(values) > 0]
    scales = [by_temperature] if np.ptp(by_temperature.values) > ISOTHERMAL_RANGE else []
    scales += [ColourScale(label, values, logarithmic=bool((values > 0).all())) for label, values in varied]
    return [*scales, stress_scale(fit.histories, fit.predictor)][0]


def _draw_leading(
    axes: Axes, fit: Identification, leading: dict[str, list[int]], scale: ColourScale, *, bar: bool = False
) -> None:
    """The curves of the output that most tests have, their stresses beside them where colours are temperatures.

    bar : whether the scale of colours stands beside them.
    """
    output, tests = max(leading.items(), key=lambda pair: len(pair[1]))
    _draw_curves(axes, fit, fitted_curves(fit), output, tests, scale.colours)
    by_stress = stress_scale(fit.histories, fit.predictor)
    levels, unit = by_stress.values, "MPa"
    if all(h.loading.quantity == "strain" for h in fit.histories):  # whose stress is what was measured
        levels, unit = np.array([100.0 * np.abs(h.load_levels).max() for h in fit.histories]), "% strain"
    labelled = scale.label != by_stress.label and len(tests) <= MOST_LABELLED
    beside = f"; beside: {unit}" * labelled
    axes.set_title(f"dots: measured; lines: law, 95 %{beside}", fontsize=9)
    if bar and np.ptp(scale.values) > 0:
        scale.add_bar(axes)
    if labelled:
        _label_curves(
            axes, [f"{level:.{2 + (unit == 'MPa')}g}" for level in levels[tests]], [scale.colours[k] for k in tests]
        )


def _label_curves(axes: Axes, labels: Sequence[str], colours: Sequence[Any]) -> None:
    """A label beside each curve where it is clear of others; none where no place is.

    Of all places beside points of the curve the clearest one, of equal ones that nearest to its end.
    """
    figure: Any = axes.get_figure(root=True)
    figure.draw_without_rendering()  # axes have their places from here on
    scale, taken = 72.0 / figure.dpi, list[Floats]()
    (left, bottom), (right, top) = axes.get_window_extent().get_points() * scale
    every, curves = np.arange(left, right), []
    for line in (one for one in axes.lines if one.get_linestyle() != "None"):
        points = np.asarray(line.get_xydata())
        points = axes.transData.transform(points[np.isfinite(points).all(axis=1)]) * scale
        heights = np.interp(every, points[:, 0], points[:, 1], left=np.nan, right=np.nan)
        curve = np.column_stack([every, heights])
        curves.append(curve[(curve[:, 1] >= bottom) & (curve[:, 1] <= top)])
    drawn = np.concatenate(curves)
    for label, colour, curve in zip(labels, colours, curves, strict=True):
        best, clearest = None, 0.0
        for anchor in curve[::-LABEL_STEP]:
            for corner in anchor + LABEL_PLACES:
                beside = np.maximum(np.maximum(corner - drawn, drawn - corner - LABEL_SIZE), 0.0)
                clear = min(float(np.hypot(*beside.T).min(initial=LABEL_CLEAR)), LABEL_CLEAR)
                free = all((abs(corner - one) > LABEL_SIZE + LABEL_CLEAR).any() for one in taken)
                if free and clear > clearest and corner[0] > left and corner[1] + LABEL_SIZE[1] < top:
                    best, clearest = corner, clear
        if best is not None:
            taken.append(best)
            x, y = axes.transData.inverted().transform(best / scale)
            axes.text(float(x), float(y), label, fontsize=8, color=colour)


def draw_curve(
    axes: Axes, curve: TestCurve, colour: Any, style: str = "-", dots: Any = None, opacity: float = BAND_OPACITY
) -> None:
    """One output of one test: measured (in the colour of `dots`, if given), identified, and the 95 % band."""
    if dots is not None:
        plotted = curve.measured > 0 if curve.logarithmic else np.isfinite(curve.measured)
        above = int(plotted.sum()) <= DOTS_ABOVE_LINES
        axes.plot(
            *(curve.hours[plotted], curve.measured[plotted], "."),
            ms=3,
            color=dots,
            alpha=0.55,
            zorder=3 if above else 1,
        )
    from matplotlib.collections import PolyCollection

    # beyond the strains of the test a curve towards rupture says nothing of its frames
    end = _drawn_end(curve)
    axes.add_collection(PolyCollection(curve.bands(end), color=colour, alpha=opacity, lw=0), autolim=False)
    axes.plot(curve.hours, np.where(curve.identified <= end, curve.identified, np.nan), style, lw=1.2, color=colour)


def _drawn_end(curve: TestCurve) -> float:
    """The strain, %, at which the curve of a test ends; infinite where no strain above zero was measured."""
    largest = float(np.nanmax(curve.measured, initial=0.0))
    return DRAWN_STRAIN_RATIO * largest if curve.logarithmic and largest > 0 else float("inf")


def _draw_curves(
    axes: Axes, fit: Identification, curves: FittedCurves, output: str, tests: Sequence[int], colours: Sequence[Any]
) -> None:
    """An output of tests in one panel."""
    drawn = [curve_of_test(fit, curves, k, output) for k in tests]
    for k, curve in zip(tests, drawn, strict=True):
        alike = sum(fit.tests[other].condition == fit.tests[k].condition for other in tests)
        opacity = 1.0 - (1.0 - BAND_OPACITY) ** (1.0 / alike)  # bands of one condition lie upon each other
        draw_curve(axes, curve, colours[k], "-", colours[k], opacity)
    set_curve_ranges(axes, drawn, output)
    axes.set(xlabel="time, h", ylabel=drawn[0].label)


def set_curve_ranges(axes: Axes, drawn: Sequence[TestCurve], output: str) -> None:
    """Axes from the measured and identified values of what is drawn of an output."""
    values = np.concatenate([v for c in drawn for v in (c.measured, c.identified[c.identified <= _drawn_end(c)])])
    largest, logarithmic = float(np.nanmax(values, initial=0.0)), all(one.logarithmic for one in drawn)
    if logarithmic and largest > 0:
        shown = values[values >= SHOWN_STRAIN_RATIO * largest]
        span(axes, "y", shown, 1.1 * largest, logarithmic=True, most=8)
    else:
        span(axes, "y", values, zero=True, most=8)
    hours = np.concatenate([c.hours for c in drawn])
    logarithmic |= output.startswith("stress")  # where creep spans decades of time: also stresses that relax
    set_range(axes, "x", float(hours.min()) if logarithmic else 0.0, float(hours.max()), logarithmic=logarithmic)


# ---- tests one by one ------------------------------------------------------------------------------------------------


SIDE_BY_SIDE, WIDTH, HEIGHT = 3, 11.0, 2.7
"""Tests side by side, inches of the figure and of a row of them."""


def small_multiples(fit: Identification, tests: Sequence[int]) -> Figure:
    """Measured and identified over time of each output of tests, and its residuals; tests : positions."""
    curves, colours = fitted_curves(fit), stress_scale(fit.histories, fit.predictor).colours
    drawn = [(k, one.output) for k in tests for one in fit.tests[k].outputs]
    columns = min(SIDE_BY_SIDE, len(drawn))
    rows = -(-len(drawn) // columns)
    figure = empty_figure(WIDTH * columns / SIDE_BY_SIDE, HEIGHT * rows)
    cells = figure.add_gridspec(rows, columns)
    for place, (k, output) in enumerate(drawn):
        cell = cells[place // columns, place % columns].subgridspec(2, 1, height_ratios=(2.2, 1.0), hspace=0.04)
        above = figure.add_subplot(cell[0])
        below = figure.add_subplot(cell[1], sharex=above)
        curve = curve_of_test(fit, curves, k, output)
        draw_curve(above, curve, colours[k], dots="0.25")
        set_curve_ranges(above, [curve], output)
        _draw_residuals(below, fit, curve, output, (k, colours[k]))
        above.set_title(f"{shortened(fit.tests[k].name)}: {fit.histories[k].condition}", fontsize=8)
        above.set_ylabel(curve.label, fontsize=8)
        above.tick_params(labelbottom=False, labelsize=7)
        below.tick_params(labelsize=7)
        below.set_xlabel("time, h" if place // columns == rows - 1 else "", fontsize=8)
    return figure


# ---- residuals -------------------------------------------------------------------------------------------------------


NOISE_BAND = 2.0
"""Standard deviations of the noise of a reading that are shaded."""


LEAST_RANGE = 3.5
"""Standard deviations that the axis shows at least to either side."""


SHOWN_QUANTILE = 0.99
"""Of the sizes of the residuals of a test, what the axis shows."""


def _draw_residuals(axes: Axes, fit: Identification, curve: TestCurve, output: str, test: tuple[int, Any]) -> None:
    """What the law leaves of the readings of a test; test : its position and colour.

    Over the noise of each reading, with the test's own rate, life and offset, as the law is judged; where the noise
    is not known, measured less identified. Readings beyond the axis are marked at its edge.
    """
    (k, colour), readings = test, judged_readings(fit)
    known = np.isfinite(curve.residuals)
    hours, values = curve.hours[known], curve.residuals[known]
    judged = readings is not None and bool(readings.mask(k, output).any())
    if judged and readings is not None:
        times, values = readings.residuals(k, output)
        order = np.argsort(times, kind="stable")
        hours, values = times[order] / SECONDS_PER_HOUR, values[order]
        axes.axhspan(-NOISE_BAND, NOISE_BAND, color="black", alpha=0.1, lw=0)
    reach = 1.15 * float(np.quantile(np.abs(values), SHOWN_QUANTILE)) if values.size else 0.0
    limit = max(reach, LEAST_RANGE if judged else 0.0) or 1.0
    axes.plot(hours, values, lw=0.9, color=colour, alpha=0.85)
    for sign, marker in ((1.0, "^"), (-1.0, "v")):
        outside = sign * values > limit
        if outside.any():  # a line without points would collapse the layout
            edge = np.full(int(outside.sum()), sign * limit)
            axes.plot(hours[outside], edge, marker, ms=3.5, color=colour, mec="none", clip_on=False, zorder=4)
    axes.axhline(0, color="black", lw=0.8)
    span(axes, "y", -limit, limit)
    axes.set_ylim(-limit, limit)
    plain = "100 ln ratio, ≈ %" if is_logarithmic(output) else shown_unit(output)[1]
    axes.set_ylabel("noise sd" if judged else plain, fontsize=7)


def residual_caption(fit: Identification) -> str:
    """What panels of residuals show, for captions."""
    if judged_readings(fit) is None:
        return "measured less identified"
    return (
        "measured less identified over the noise of the reading, the test's own rate, life and offset taken out; "
        "grey: two standard deviations"
    )


# ---- fitted curves and their bands -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FittedCurves:
    """What an identification predicts of its own tests, at their own nuisances and offsets, as it was compared.

    Where the predictor was corrected by a more exact one, the prediction is the corrected one.

    half_width : (tests, times, outputs) half width of the 95 % band from the covariance of the law's parameters and of
        explicit nuisance parameters, in the output's unit. Noise, the scatter of rates between tests and the offsets'
        uncertainty are not in it. growth : (tests, times, outputs) derivative to ln time; 0 of no strains.
    """

    prediction: Prediction
    half_width: Floats
    growth: Floats

    def of(self, test: int, output: str) -> tuple[Floats, Floats, Floats]:
        """Curve, half width of the band and growth, (times,) each, of an output of a test, in the output's unit."""
        position, length = self.prediction.outputs.index(output), int(self.prediction.lengths[test])
        band, growth = (of[test, :length, position] for of in (self.half_width, self.growth))
        return self.prediction.of(test)[:, position], band, growth


BEFORE = 1e-4
"""Of a time: how much earlier a curve is predicted for its slope, which its frames do not show before a rupture."""


@once
def fitted_curves(fit: Identification) -> FittedCurves:
    """The curves of the fitted tests with their bands: one prediction with sensitivities, made once."""
    if fit.predictor is None or not fit.histories:
        raise FitError(
            "this identification was loaded without its histories: attach them with "
            "fit.with_histories(histories, using)"
        )
    histories, coordinates = fit.histories, fit.coordinates
    nuisances = fit.nuisance_values(histories)
    prediction = fit.predictor.predict(
        fit.law, coordinates.theta(fit.u)[None], histories, nuisances=nuisances, sensitivities=True
    )
    assert prediction.jacobian is not None
    with np.errstate(invalid="ignore"):
        jacobian = prediction.jacobian[0] @ coordinates.jacobian(fit.u)
    jacobian = np.concatenate([jacobian, _nuisance_jacobian(fit, prediction)], axis=-1)
    variance = np.einsum("...i,ij,...j->...", jacobian, joint_covariance(fit), jacobian)
    growth = np.zeros_like(prediction.values[0])
    if any(map(is_logarithmic, prediction.outputs)):
        before = [replace(one, times=(1.0 - BEFORE) * one.times) for one in histories]
        values = fit.predictor.predict(fit.law, coordinates.theta(fit.u)[None], before, nuisances=nuisances).values
        growth = (prediction.values - values)[0] / BEFORE
    if fit.numerical_error is not None:
        prediction = with_correction_at_frames(fit.least_squares_problem, histories, prediction)
    for k, test in enumerate(fit.tests):
        for output_fit in test.outputs:
            prediction.values[:, k, :, prediction.outputs.index(output_fit.output)] += output_fit.offset
    return FittedCurves(prediction, NORMAL_QUANTILE * np.sqrt(np.maximum(variance, 0.0)), growth)


def _nuisance_jacobian(fit: Identification, prediction: Prediction) -> Floats:
    """(tests, times, outputs, nuisances) derivatives of the outputs to the nuisance parameters that were estimated."""
    shape = prediction.values.shape[1:]
    if not fit.nuisances:
        return np.zeros((*shape, 0))
    by_kind = {kind: values[0].reshape(shape[0], -1) for kind, values in prediction.nuisance_jacobian.items()}
    jacobian = fit.least_squares_problem.nuisance_parameters.jacobian(by_kind)
    return jacobian.reshape(*shape, len(fit.nuisances))


def joint_covariance(fit: Identification) -> Floats:
    """(unknowns, unknowns) covariance of x = (u, e): that of u as it was identified, and what e does given u.

    A curve is known better than the law where a parameter and a nuisance parameter can only move it together. With
    P = J'J the precision at the optimum, e given u has the mean -P_ee^-1 P_eu u and the covariance P_ee^-1.
    """
    count, size = fit.u.size, len(fit.nuisances)
    if not size:
        return fit.covariance
    whitened = fit.least_squares_problem.jacobian(fit.x)
    precision = whitened.T @ whitened
    inverse = np.linalg.pinv(precision[count:, count:], hermitian=True)
    gain = -inverse @ precision[count:, :count]
    lift = np.concatenate([np.eye(count), gain])
    covariance = lift @ fit.covariance @ lift.T
    covariance[count:, count:] += inverse
    return np.asarray(covariance)


# ---- as they are drawn -----------------------------------------------------------------------------------------------


WIDEST, WIDE_SHARE = 3.0, 0.1
"""Factor to either side within which bands are drawn, and the share of a curve that may be beyond."""


PLOTTED_STRAIN_RATIO = 0.02
"""Differences of logarithms of strains are taken where a test's strain exceeds this share of its last one."""


@dataclass(frozen=True, eq=False)
class TestCurve:
    """One output of one test, as it is drawn.

    hours : (frames,) h.
    measured, identified : (frames,) in the unit of the axis, offsets taken off where the axis is logarithmic.
    half_width : (frames,) of the 95 % band, in the same unit; of the logarithm where the axis is logarithmic.
        NaN where the law predicts nothing, as after a rupture. slope : (frames,) of the logarithm over that of time.
    residuals : (frames,) measured less identified, in the unit of the axis, or 100 times the difference of their
        logarithms where the axis is logarithmic; NaN where that would be noise alone.
    label : of the axis.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    hours: Floats
    measured: Floats
    identified: Floats
    half_width: Floats
    slope: Floats
    residuals: Floats
    label: str
    logarithmic: bool

    def bands(self, end: float = np.inf) -> list[Floats]:
        """Outlines (points, 2) of the 95 % band, hours and values, where the curve lies below `end`.

        Logarithmic curves have it across themselves: of values where they are flat, of times where they are steep, as
        before a rupture, whose time is what is uncertain. To first order both are the same: with s the slope of ln
        value over ln time and h the half width, a point moves by h / (1 + s^2) up and by s h / (1 + s^2) back. A curve
        of which more than WIDE_SHARE moves further than WIDEST has no band: first order says nothing of it.
        """
        known = np.isfinite(self.identified + self.half_width + self.slope) & (self.identified <= end)
        up = self.half_width
        upper, lower = (np.column_stack([self.hours, self.identified + side * up]) for side in (1.0, -1.0))
        if self.logarithmic:
            up = self.half_width / (1.0 + np.square(self.slope))
            near = up * np.sqrt(1.0 + np.square(self.slope)) <= np.log(WIDEST)
            known &= near & ((known & ~near).sum() <= WIDE_SHARE * known.sum())
            up = np.where(known, up, 0.0)
            upper, lower = (
                np.column_stack([self.hours * np.exp(-side * self.slope * up), self.identified * np.exp(side * up)])
                for side in (1.0, -1.0)
            )
        runs = np.split(np.arange(known.size), np.flatnonzero(np.diff(known)) + 1)
        return [np.concatenate([upper[run], lower[run][::-1]]) for run in runs if known[run].all() and run.size > 1]


def curve_of_test(fit: Identification, curves: FittedCurves, test: int, output: str) -> TestCurve:
    """One output of one test of an identification, as it is drawn."""
    history = fit.histories[test]
    identified, half_width, growth = curves.of(test, output)
    used = usable_frames(history, output)
    hours, measured = history.times[used] / SECONDS_PER_HOUR, history.outputs[output][used]
    identified, half_width, growth = identified[used], half_width[used], growth[used]
    side, label = side_of(history), axis_label(output, history)
    if not (is_logarithmic(output) and side):
        factor = shown_unit(output)[0]
        measured, identified, half_width, growth = factor * np.stack([measured, identified, half_width, growth])
        return TestCurve(hours, measured, identified, half_width, growth, measured - identified, label, False)
    offset, growth = fit.tests[test][output].offset, side * growth
    measured, identified = 100 * side * (measured - offset), 100 * side * (identified - offset)
    divisor = np.where(identified > 0, identified, np.nan)
    last = measured[-1] if measured.size else 0.0
    shown = np.where(measured > max(PLOTTED_STRAIN_RATIO * last, 0.0), measured, np.nan)
    half_width, slope, residuals = 100 * half_width / divisor, 100 * growth / divisor, 100 * np.log(shown / divisor)
    return TestCurve(hours, measured, divisor, half_width, slope, residuals, label, True)


def side_of(history: History) -> int:
    """1 of tests in tension, -1 of those in compression, 0 of both, whose strains have no logarithm to be drawn."""
    loads = np.zeros(1) if history.loading.quantity == "components" else history.loading.program().values
    return 1 if loads.min() >= 0.0 else -1 if loads.max() <= 0.0 else 0


def axis_label(output: str, history: History) -> str:
    """Name and unit of an output."""
    side = "compressive " * (is_logarithmic(output) and side_of(history) < 0)
    return side + ", ".join(filter(None, (output.replace("_", " "), shown_unit(output)[1])))
