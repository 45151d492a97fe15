"""The time to rupture for other programs: a function in C or Fortran, and a table with bounds."""

from __future__ import annotations

import csv
import io
from textwrap import wrap
from typing import Any

import numpy as np
import sympy

from creepkit.errors import FitError
from creepkit.records import ZERO_CELSIUS
from creepkit.rupture_assessment.methods import LN10, METHODS, Conditions

STRESSES = 25
"""Rows of a table at each temperature, over the stresses tested."""


class _Variable(sympy.Symbol):  # type: ignore[misc]  # sympy has no types
    """A symbol in an array, of which numpy takes the logarithm."""

    def log10(self) -> Any:
        """For numpy.log10()."""
        return sympy.log(self) / LN10


def written_times(assessment: Any, suffix: str) -> str:
    """The text of a file of this suffix: .c or .f90 for the best method, .csv for the average with its bounds.

    assessment : a RuptureAssessment, whose module imports this one.
    """
    if suffix == ".csv":
        return _table(assessment)
    fit, tests = assessment.best, assessment.tests
    if METHODS[fit.method].needs:
        needed = METHODS[fit.method].needs.replace("_", " ")
        raise FitError(f"{fit.name} needs the {needed} beside stress and temperature; write the table, a .csv file")
    stress, T, unknown = _Variable("stress"), _Variable("T"), np.array([np.nan], object)
    at = Conditions(np.array([stress], object), np.array([T], object), unknown, unknown)
    log_hours = sympy.sympify(fit.location(at)[0])
    constants = ", ".join(f"{p.name} = {p.value:.6g} {p.unit}".strip() for p in fit.parameters)
    lines = [
        f"Time to rupture in h, of stress in MPa and T in K: {METHODS[fit.method].equation}.",
        f"{fit.name}: {constants}. The median of the average heat; one test of it scatters by a factor of "
        f"{10**fit.scale_corrected:.3g} (one standard deviation).",
        f"Tested: {tests.stress.min():.4g} to {tests.stress.max():.4g} MPa, {tests.temperature.min():.4g} to "
        f"{tests.temperature.max():.4g} K, up to {10 ** tests.log_time.max():.4g} h. {assessment.verdict}.",
    ]
    said = [piece for line in lines for piece in wrap(line.encode("ascii", "replace").decode(), 100)]
    if suffix == ".c":
        head = ["/*", *(f" * {line}" for line in said), " */", "#include <math.h>", ""]
        body = f"    return pow(10.0, {sympy.ccode(log_hours)});"
        return "\n".join([*head, "double rupture_hours(double stress, double T)", "{", body, "}", ""])
    code = sympy.fcode(10**log_hours, assign_to="rupture_hours", source_format="free", standard=95)
    declared = ["function rupture_hours(stress, T)", "  implicit none", "  double precision :: rupture_hours"]
    declared += ["  double precision, intent(in) :: stress, T"]
    return "\n".join([*(f"! {line}" for line in said), *declared, code, "end function", ""])


def _table(assessment: Any) -> str:
    """Times at stresses tested, a block a temperature; bounds of the mean, of a new heat and of one test of it."""
    file, tests = io.StringIO(), assessment.tests
    kinds = ("mean", "new_heat", "one_test")
    ends = [f"{end}_of_{kind}_h" for kind in kinds for end in ("low", "high")]
    rows = csv.writer(file, lineterminator="\n")
    rows.writerow(["temperature_C", "stress_MPa", "median_h", *ends, "extrapolation"])
    temperatures = dict.fromkeys([one.temperature for one in assessment.strengths] or tests.isotherms)
    for T in temperatures:
        for stress in np.geomspace(tests.stress.min(), tests.stress.max(), STRESSES):
            life = assessment.life(float(stress), float(T))
            bounds = (*life.bounds_of_mean, *life.bounds_of_heat, *life.bounds_of_test)
            numbers = (T - ZERO_CELSIUS, stress, life.hours, *bounds)
            rows.writerow([*(f"{number:.6g}" for number in numbers), life.extrapolation])
    return file.getvalue()
