"""Errors common to all tests: a thermocouple, a load cell or a micrometer whose calibration is off in every one.

Tests repeated on one rig do not average them out. With s(tests, observations) the change of the residuals by one such
error, the values move by the sum over tests of what each contributes, while independent errors add in quadrature (see
inverse.unmodelled_effects). A temperature or load that is off changes the creep rate of each test by its own factor. Of
tests under an imposed strain or displacement the modulus and what is imposed move the stress itself (see
inverse.imposed_motion_errors).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.imposed_motion_errors import imposed_motion_errors
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.uncertainty.quantities import local_exponent, log_rate
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.language import temperature

COMMON_TEMPERATURE_ERROR = 3.0
"""K, by which ISO 204 permits the temperature of a creep test to be off up to 600 °C; above, 4 or 5 K."""


COMMON_LOAD_ERROR = 0.01
"""Of the load, of a creep machine of class 1 by ISO 7500-2."""


LOADS = ("stress", "pressure", "force")
"""Quantities of a loading that an instrument sets."""


USUAL_ACTIVATION_ENERGY = 400e3
"""J/mol, of the rate of a law that knows no temperature: of nickel alloys and austenitic steels, within 30 %."""


LOWEST_USUAL_TEMPERATURE = 1000.0
"""K, below which the rate of a law that knows no temperature is taken to change by as much per K as there."""


GAS_CONSTANT = 8.314462618
"""J/(mol K)."""


@dataclass(frozen=True, eq=False)
class CommonError:
    """One error of all tests. change : (tests, observations) -, of the residuals, by its size in its unit."""

    kind: str
    size: float
    unit: str
    change: Floats


def common_errors(problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem) -> list[CommonError]:
    """Those of temperature and of load that no nuisance parameter common to tests stands for; x : (unknowns,)."""
    modelled = {n.kind for n in problem.settings.nuisances if n.scope != "test"}
    sensitivity = linear.residuals.log_rate_sensitivity
    errors = []
    if "temperature" not in modelled:
        by_test = np.array([log_rate_per_kelvin(problem, x, test) for test in range(len(problem.histories))])
        change = COMMON_TEMPERATURE_ERROR * by_test[:, None] * sensitivity
        errors.append(CommonError("temperature", COMMON_TEMPERATURE_ERROR, "K", change))
    loaded = np.array([h.loading.quantity in LOADS for h in problem.histories])
    if loaded.any():
        by_test = np.array(
            [_stress_exponent(problem, x, test) if known else 0.0 for test, known in enumerate(loaded)], float
        )
        change = COMMON_LOAD_ERROR * by_test[:, None] * sensitivity
        errors.append(CommonError("load", 100 * COMMON_LOAD_ERROR, "%", change))
    return [*errors, *(CommonError(*one) for one in imposed_motion_errors(problem, x, linear))]


def log_rate_per_kelvin(problem: LeastSquaresProblem, x: Floats, test: int | None = None) -> float:
    """d ln rate / dT, 1/K, of the law; of one that knows no temperature by the usual activation energy.

    x : (unknowns,). test : position of the test amid whose conditions it is, by default the reference point.
    """
    stress, T = _conditions(problem, test)
    if not problem.law.uses(temperature):
        return USUAL_ACTIVATION_ENERGY / (GAS_CONSTANT * max(T, LOWEST_USUAL_TEMPERATURE) ** 2)
    up, down = (_value(problem, x, log_rate(problem.coordinates, stress, T + step)) for step in (1.0, -1.0))
    return 0.5 * (up - down)


def activation_energy(problem: LeastSquaresProblem, x: Floats) -> tuple[float, bool]:
    """J/mol at the reference temperature, and whether it is a usual one, as the law knows no temperature.

    x : (unknowns,) internal values.
    """
    T = problem.coordinates.reference.temperature
    return log_rate_per_kelvin(problem, x) * GAS_CONSTANT * T**2, not problem.law.uses(temperature)


def _stress_exponent(problem: LeastSquaresProblem, x: Floats, test: int) -> float:
    return _value(problem, x, local_exponent(problem.coordinates, *_conditions(problem, test)))


def _conditions(problem: LeastSquaresProblem, test: int | None) -> tuple[float, float]:
    """MPa and K, of a test or of the reference point."""
    if test is None:
        return problem.coordinates.reference.stress, problem.coordinates.reference.temperature
    history = problem.histories[test]
    stresses = reference_stresses(history, problem.predictor)
    positive = stresses[stresses > 0]
    stress = float(np.median(positive)) if positive.size else problem.coordinates.reference.stress
    return stress, float(np.mean(history.temperature_program().values))


def _value(problem: LeastSquaresProblem, x: Floats, function: Callable[[Floats], Floats]) -> float:
    return float(function(x[: problem.parameter_count]))
