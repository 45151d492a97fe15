"""Errors common to all tests under an imposed strain or displacement: of Young's modulus, and of what is imposed.

A bar under a held strain has the stress E (strain - creep strain): a modulus or a strain that is off moves the stress
of every test, from its first reading on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.composite_predictor import predict, predict_with_sensitivities, predictor_for, supports_nuisance
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.records import History, Program, RecordedLoading

IMPOSED_QUANTITIES = ("strain", "displacement")
"""Quantities of a loading under which the stress follows from the stiffness of the test piece."""


COMMON_MODULUS_ERROR = 0.02
"""Of Young's modulus, by which values of one alloy by different methods usually differ."""


COMMON_MOTION_ERROR = 0.01
"""Of an imposed strain or displacement, of an extensometer of class 1 by ISO 9513."""


MOTION_STEP = 1e-3
"""Relative, of central differences in what is imposed."""


def moves_stress(kind: str) -> bool:
    """Whether an error is one of these, by its kind."""
    return kind == "modulus" or kind.startswith("imposed ")


def imposed_motion_errors(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem
) -> list[tuple[str, float, str, Floats]]:
    """(kind, size, unit, change of the residuals (tests, observations)) of each error; x : (unknowns,).

    Nothing of a modulus for which a nuisance parameter common to tests stands, or that some specimen does not know.
    """
    moved = np.array([h.loading.quantity in IMPOSED_QUANTITIES for h in problem.histories])
    if not moved.any():
        return []
    modelled = {n.kind for n in problem.settings.nuisances if n.scope != "test"}
    known = all(
        supports_nuisance(predictor_for(problem.predictor, history), "modulus")
        for history, counts in zip(problem.histories, moved, strict=True)
        if counts
    )
    slopes = [("modulus", COMMON_MODULUS_ERROR, _modulus_slope)] if known and "modulus" not in modelled else []
    quantities = {h.loading.quantity for h in problem.histories} & set(IMPOSED_QUANTITIES)
    slopes.append((f"imposed {' and '.join(sorted(quantities))}", COMMON_MOTION_ERROR, _motion_slope))
    errors = []
    for kind, size, slope_of in slopes:
        slope = slope_of(problem, x)
        slope = np.where(np.isfinite(slope) & moved[:, None], slope, 0.0)
        errors.append((kind, 100 * size, "%", linear.residuals.offset_sensitivity * slope * size))
    return errors


def _modulus_slope(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(tests, observations) derivative of the outputs to the relative change of the modulus."""
    theta, nuisances = _values(problem, x)
    nuisances = {"modulus": np.zeros((1, len(problem.histories))), **nuisances}
    prediction = predict_with_sensitivities(problem.predictor, problem.law, theta, problem.histories, nuisances)
    return np.asarray(problem.observations.select_outputs(prediction.nuisance_jacobian["modulus"], prediction)[0])


def _motion_slope(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(tests, observations) derivative of the outputs to the relative change of what is imposed."""
    theta, nuisances = _values(problem, x)

    def outputs(change: float) -> Floats:
        histories = [_moved(history, change) for history in problem.histories]
        prediction = predict(problem.predictor, problem.law, theta[None], histories, nuisances=nuisances)
        return np.asarray(problem.observations.select_outputs(prediction.values, prediction)[0])

    with np.errstate(invalid="ignore"):  # of tests that end before
        return np.asarray((outputs(MOTION_STEP) - outputs(-MOTION_STEP)) / (2.0 * MOTION_STEP))


def _values(problem: LeastSquaresProblem, x: Floats) -> tuple[Floats, dict[str, Floats]]:
    """(parameters,) internal values and the explicit nuisances."""
    count = problem.parameter_count
    return problem.coordinates.theta(x[:count]), dict(problem.nuisance_parameters.predictor_values(x[count:]))


def _moved(history: History, change: float) -> History:
    """The history with all that is imposed larger by that share."""
    if history.loading.quantity not in IMPOSED_QUANTITIES:
        return history
    program = history.loading.program()
    loading = RecordedLoading(Program(program.times, program.values * (1.0 + change)), history.loading.quantity)
    return replace(history, loading=loading)
