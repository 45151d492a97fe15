"""Contributions of the terms of a law at the evaluation points: the stresses, strains and times of the tests.

    c_i = [ mean_G (f_i / sum_j f_j)^2 ]^(1/2)

with f_i the rate of term i and G the evaluation points: 0.5, 0.8, 1 and 1.3 times the reference stress at each time of
each test, which is about the range of stress in a specimen. Strain is estimated from the measured outputs. A
coefficient A_i alone does not show this: its unit depends on the exponents, and its size on all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.frame_noise import usable_frames
from creepkit.inverse.observation_vector import selected_frames
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import growth_per_strain, reference_end_strain, reference_stresses
from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor, growing_output, is_logarithmic, output_named

STRESS_FACTORS = (0.5, 0.8, 1.0, 1.3)


TIMES_PER_TEST = 16
"""Times that are evaluated in each test."""


MIN_STRAIN_FRACTION = 0.1
"""Of linear growth to the end strain: least strain at a time, as smaller ones are noise or loading strain."""


@dataclass(frozen=True, eq=False)
class EvaluationPoints:
    """Points at which rates of terms are compared.

    stress, strain, time, temperature, weight : (points,) MPa, -, s, K, -; weights add up to one.
    All tests weigh alike, however many frames they have.
    """

    stress: Floats
    strain: Floats
    time: Floats
    temperature: Floats
    weight: Floats

    @classmethod
    def from_histories(cls, histories: Sequence[History], predictor: Predictor | None = None) -> EvaluationPoints:
        """The evaluation points of histories; the predictor may state reference stresses."""
        points_by_test = [_points_of_test(h, predictor) for h in histories]
        loaded_tests = [p for p in points_by_test if p.shape[1]]
        if not loaded_tests:
            raise FitError("no test is ever under load: terms of a law cannot be weighed against one another")
        weights = [np.full(p.shape[1], 1.0 / (len(loaded_tests) * p.shape[1])) for p in loaded_tests]
        stress, strain, time, temperature = np.concatenate(loaded_tests, axis=1)
        return cls(stress, strain, time, temperature, np.concatenate(weights))


def _points_of_test(history: History, predictor: Predictor | None) -> Floats:
    """(4, points) stress, strain, time, temperature of one test, without those where it bears no load."""
    frames = selected_frames(history, TIMES_PER_TEST)
    time = history.times[frames]
    strain, temperature = strain_history(history, predictor)[frames], history.temperature_program().at(time)
    stress = stress_history(history, predictor, time)
    stresses = np.multiply.outer(stress, STRESS_FACTORS)
    broadcast = (np.broadcast_to(v[:, None, None], stresses.shape) for v in (strain, time, temperature))
    points = np.stack([stresses, *broadcast]).reshape(4, -1)
    return np.asarray(points[:, points[0] > 0])


def stress_history(history: History, predictor: Predictor | None, times: Floats) -> Floats:
    """(times, stresses) reference stresses at each time, MPa; times : (times,) s.

    A bulge test has one for each level of pressure, between which it is linear; a specimen whose stress moves by
    itself, as in relaxation, has all of its reference stresses at all times.
    """
    program, test_stresses = history.loading.program(), reference_stresses(history, predictor)
    levels = np.unique(program.values[program.values > 0])
    load = program.at(times)
    if history.loading.quantity == "stress" and test_stresses.size == program.values.size:
        return np.asarray(load[:, None])
    if test_stresses.size == levels.size:
        return np.asarray(np.interp(load, [0.0, *levels], [0.0, *np.sort(test_stresses)])[:, None])
    return np.broadcast_to(test_stresses, (times.size, test_stresses.size))


def strain_history(history: History, predictor: Predictor | None) -> Floats:
    """(frames,) - creep strain of the test, estimated from its outputs; never decreasing, never zero."""
    times, final_strain = history.times, reference_end_strain(history, predictor)
    lower_limit = MIN_STRAIN_FRACTION * final_strain * times / times[-1]
    output = growing_output(history)
    is_used = usable_frames(history, output) if output else np.zeros(times.size, bool)
    if is_used.sum() > 1 and output_named(output, history.specimen).grows:
        measured = np.interp(times, times[is_used], history.outputs[output][is_used])
        start = 0.0 if is_logarithmic(output) else measured[is_used][0]
        scale = 1.0 if is_logarithmic(output) else growth_per_strain(history, predictor)
        lower_limit = np.maximum(lower_limit, np.minimum((measured - start) / scale, final_strain))
    else:
        lower_limit = final_strain * times / times[-1]
    return np.asarray(np.maximum.accumulate(np.maximum(lower_limit, 1e-12)))


DIFFERENCE_STEP = 1e-6
"""Of differences, in conditioned coordinates: the ln of rates is smooth in them."""


LOG_ZERO_RATE = -1e30
"""ln of a rate of zero."""


class TermContributions:
    """Contributions of terms as functions of conditioned coordinates u, for any sum of terms.

    terms : names of the terms, in the order of the last axis of all arrays.
    """

    def __init__(self, law: CreepLaw, coordinates: Coordinates, points: EvaluationPoints) -> None:
        self.law, self.coordinates, self.points = law, coordinates, points
        self.terms = tuple(law.terms)
        singles = [law.only(label) for label in self.terms]
        self._terms = [([law.names.index(name) for name in single.names], lower(single, "numpy")) for single in singles]

    @classmethod
    def from_problem(cls, problem: LeastSquaresProblem) -> TermContributions:
        """Those of the law of a problem, over its histories."""
        points = EvaluationPoints.from_histories(problem.histories, problem.predictor)
        return cls(problem.law, problem.coordinates, points)

    def log_rates(self, u: Floats) -> Floats:
        """ln of the rate of each term at each point, (candidates, points, terms), of u (candidates, parameters)."""
        points = self.points
        point = (points.stress, points.strain, points.time, points.temperature, points.stress, points.stress / 3.0)
        columns = np.moveaxis(self.coordinates.theta(u), -1, 0)[..., None]
        log_rates = np.empty((len(u), points.stress.size, len(self._terms)))
        for k, (positions, kernel) in enumerate(self._terms):
            initial_states = [state.initial for state in kernel.law.states.values()]
            log_rates[..., k] = kernel.internal_log_rate(*point, *initial_states, *columns[positions])
        return np.asarray(np.maximum(np.nan_to_num(log_rates, nan=LOG_ZERO_RATE), LOG_ZERO_RATE))

    def fractions(self, u: Floats) -> Floats:
        """f_i / sum_j f_j, (candidates, points, terms), of u (candidates, parameters); they do not overflow."""
        log_rates = self.log_rates(u)
        rates = np.exp(log_rates - log_rates.max(axis=-1, keepdims=True))
        return np.asarray(rates / rates.sum(axis=-1, keepdims=True))

    def values(self, u: Floats) -> Floats:
        """c, (candidates, terms), of u (candidates, parameters)."""
        return np.asarray(np.sqrt(np.einsum("p,cpt->ct", self.points.weight, self.fractions(u) ** 2)))

    def jacobian(self, u: Floats) -> Floats:
        """dc/du at one u (parameters,), (terms, parameters), by central differences in one batch."""
        steps = DIFFERENCE_STEP * np.eye(u.size)
        above, below = np.split(self.values(np.concatenate([u + steps, u - steps])), 2)
        return np.asarray((above - below).T / (2 * DIFFERENCE_STEP))

    def by_term(self, u: Floats) -> dict[str, float]:
        """{term: c} of one u (parameters,)."""
        return dict(zip(self.terms, map(float, self.values(u[None])[0]), strict=True))
