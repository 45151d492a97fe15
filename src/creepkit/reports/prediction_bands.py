"""The identified curves of tests with what the estimates leave uncertain of them.

With y(x) a predicted output, x = (u, e) the unknowns (coordinates of the law and nuisance parameters of the tests) and
C their covariance, its standard deviation is sqrt(dy/dx C dy/dx'). One prediction with sensitivities gives y and dy/dx.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.defect_correction import with_correction_at_frames
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import usable_frames
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.records import SECONDS_PER_HOUR, Prediction, is_logarithmic
from creepkit.reports.compared_values import once
from creepkit.reports.figures import set_range
from creepkit.reports.wording import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification
    from creepkit.records import History


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
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    hours: Floats
    measured: Floats
    identified: Floats
    half_width: Floats
    slope: Floats
    residuals: Floats
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
    if not is_logarithmic(output) or is_compressed(history):
        factor = shown_unit(output)[0]
        measured, identified, half_width, growth = factor * np.stack([measured, identified, half_width, growth])
        return TestCurve(hours, measured, identified, half_width, growth, measured - identified, logarithmic=False)
    offset = fit.tests[test][output].offset
    measured, identified = 100 * (measured - offset), 100 * (identified - offset)
    divisor = np.where(identified > 0, identified, np.nan)
    last = measured[-1] if measured.size else 0.0
    shown = np.where(measured > max(PLOTTED_STRAIN_RATIO * last, 0.0), measured, np.nan)
    half_width, slope, residuals = 100 * half_width / divisor, 100 * growth / divisor, 100 * np.log(shown / divisor)
    return TestCurve(hours, measured, divisor, half_width, slope, residuals, logarithmic=True)


def is_compressed(history: History) -> bool:
    """Whether a load is ever below zero, so that strains are not drawn over a logarithmic axis."""
    return history.loading.quantity != "components" and bool(history.loading.program().values.min() < 0.0)


def axis_label(output: str) -> str:
    """Name and unit of an output."""
    return ", ".join(filter(None, (output.replace("_", " "), shown_unit(output)[1])))


def set_time_range(axes: Axes, hours: Floats, *, logarithmic: bool) -> None:
    """Logarithmic where creep spans decades of time: strains, and stresses that relax. hours : (readings,)."""
    set_range(axes, "x", float(hours.min()) if logarithmic else 0.0, float(hours.max()), logarithmic=logarithmic)
