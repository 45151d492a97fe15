"""Step control: what a step's error may be, and how long the next step is."""

from __future__ import annotations

from math import inf, isfinite, isnan, sqrt
from typing import NamedTuple

from numba import njit

from creepkit.integration.dense import dense_value, local_error
from creepkit.integration.segments import Segment
from creepkit.integration.step import StressControl, StepWorkspace
from creepkit.integration.tableau import Tableau

_SAFETY, _LEAST, _MOST = 0.9, 0.1, 8.0

_SENSITIVITY_SLACK = 10.0
"""Sensitivities are of the order of ten strains: d(strain)/d(exponent) = strain ln(stress)."""

INITIAL_ERROR_FACTOR = 10.0
"""From a virgin state strain is a sum of broken powers of s, on which the first step is of order 1 and its error is up
to 2.5 times the estimate; afterwards the estimate exceeds the error some twenty times."""


class IntegrationSettings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history.
    first, longest : first and longest step, as shares of a segment (in the position of its clock).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2


@njit(cache=True, error_model="numpy")
def newton_tolerance(settings: IntegrationSettings) -> float:
    """Newton's last correction; its square, the error left, is a thousandth of the step's tolerance."""
    return min(sqrt(1e-3 * settings.rtol), 1e-3)


@njit(cache=True, error_model="numpy")
def strain_error(
    tableau: Tableau,
    drive: StressControl,
    segment: Segment,
    work: StepWorkspace,
    settings: IntegrationSettings,
    h: float,
    ahead: float,
    slope: float,
) -> float:
    """Largest local error of the step and of its dense output over what is allowed.

    Infinite when creep strain falls, which it never does. Under prescribed strain the stress counts as well.
    ahead : the first output's position over that of the step's end: until then only the strain there matters.
    slope : dp/ds at the start of the step, NaN when not known; with it, Hermite's cubic checks the dense output.
    """
    if work.new_value[0] < work.value[0]:
        return inf
    reach = work.new_value[0] * ahead
    if drive.stiffness > 0.0:
        stress = segment.end_stress - drive.stiffness * work.new_value[0]
        reach = min(reach, abs(stress) / drive.stiffness)
    worst = local_error(tableau, work, h, 0)
    if not isnan(slope):
        hermite = work.value[0] + work.new_value[0] + 0.25 * h * (slope - work.slopes[tableau.c.size - 1, 0])
        worst = max(worst, abs(dense_value(tableau, work, h, 0.5, 0) - 0.5 * hermite))
    worst /= settings.rtol * (reach + settings.smallest)
    for v in range(1, work.value.size):
        reach = max(abs(work.value[v]), abs(work.new_value[v])) + settings.smallest
        worst = max(worst, local_error(tableau, work, h, v) / (settings.rtol * reach))
    return worst if isfinite(worst) else inf


@njit(cache=True, error_model="numpy")
def sensitivity_error(tableau: Tableau, work: StepWorkspace, settings: IntegrationSettings, h: float, ahead: float) -> float:
    """Largest local error of the sensitivities of strain over what is allowed: of ten strains, or of themselves.

    Before a rupture they grow without end, for there strain is vertical over time.
    """
    worst, reach = 0.0, _SENSITIVITY_SLACK * (work.new_value[0] * ahead + settings.smallest)
    for p in range(work.change.shape[1]):
        total = 0.0
        for i in range(tableau.c.size):
            total += tableau.error[i] * work.slope_changes[i, 0, p]
        worst = max(worst, abs(h * total) / (settings.rtol * max(reach, abs(work.new_change[0, p]))))
    return worst if isfinite(worst) else inf


@njit(cache=True, error_model="numpy")
def step_factor(tableau: Tableau, error: float, growing: bool) -> float:
    """Factor on the step after an error; a step that follows a rejection does not grow."""
    if not isfinite(error):
        return _LEAST
    factor = _SAFETY * max(error, 1e-12) ** (-1.0 / (tableau.error_order + 1))
    return float(min(max(factor, _LEAST), _MOST if growing else 1.0))


class AcceptedStep(NamedTuple):
    """The last accepted step: its length (0: none yet), and its error over what was allowed."""

    length: float
    error: float


@njit(cache=True, error_model="numpy")
def predictive_step_factor(tableau: Tableau, before: AcceptedStep, h: float, error: float) -> float:
    """Factor, at most one, on the step after one that had to be tried again.

    On the way to a singularity every step must be shorter than the last. That goes on: predictive control, Gustafsson
    (1994), ACM Trans. Math. Softw. 20, 496.
    """
    if not before.length > 0.0:
        return 1.0
    ratio = (max(before.error, 1e-12) / max(error, 1e-12)) ** (1.0 / (tableau.error_order + 1))
    return float(min(max(ratio * h / before.length, _LEAST), 1.0))


@njit(cache=True, error_model="numpy")
def bounded_step(s: float, h: float, longest: float) -> float:
    """The step, not too long, and ending at 1 rather than just before it."""
    h = min(h, longest)
    return 1.0 - s if s + 1.001 * h > 1.0 else h
