"""Which nuisances of a test cannot be told apart: the correlation of what they do to its outputs.

With s_a, s_b the derivatives of a test's residuals to two nuisances, in standard deviations of the noise, and the part
that an offset of each output takes up removed where there is one, the correlation is s_a . s_b / (|s_a| |s_b|).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.problem import LeastSquaresProblem

HIGH_CORRELATION = 0.99
"""In the median test: nuisances that correlate by more are named."""


EXACT_CORRELATION = 1.0 - 1e-9
"""In every test: nuisances without a prior that correlate by more have no estimate."""


def nuisance_correlation_notes(problem: LeastSquaresProblem, residuals: Residuals) -> list[str]:
    """One sentence for each pair of nuisances of one scope that cannot be told apart; FitError without their priors."""
    directions = _directions(problem, residuals)
    free = {n.key for n in problem.settings.nuisances if n.sd == np.inf}
    scopes = {n.key: n.scope for n in problem.settings.nuisances}
    sentences = []
    for first, second in combinations(directions, 2):
        tests = directions[first].keys() & directions[second].keys()
        correlations = [abs(_correlation(directions[first][t], directions[second][t])) for t in tests]
        if not correlations or scopes[first] != scopes[second]:
            continue
        if {first, second} <= free and min(correlations) > EXACT_CORRELATION:
            raise FitError(
                f"nuisances '{first}' and '{second}' do the same to every test, and neither has a prior; leave one "
                "of them out, or give it sd="
            )
        if np.median(correlations) > HIGH_CORRELATION:
            sentences.append(
                f"nuisances '{first}' and '{second}' cannot be told apart: what they do to a test correlates by "
                f"{np.median(correlations):.3f} in the median; their priors divide it between them, so leave one of "
                "them out or state its prior"
            )
    return sentences


def _directions(problem: LeastSquaresProblem, residuals: Residuals) -> dict[str, dict[int, Floats]]:
    """{key: {test: (observations,)}} derivatives to the nuisances of each test, in standard deviations of the noise."""
    settings, observations = problem.settings, problem.observations
    kinds = {n.kind for n in settings.nuisances}
    by_key = {"rate": residuals.log_rate_sensitivity} if "rate" in kinds else {}
    tests_of = {"rate": list(range(len(residuals.values)))}
    nuisances = problem.nuisance_parameters
    if nuisances.size and residuals.jacobian is not None:
        columns = residuals.jacobian[..., -nuisances.size :]
        for key, index in nuisances.test_index.items():
            tests_of[key] = [int(t) for t in np.flatnonzero(index >= 0)]
            by_key[key] = np.stack([columns[t, :, index[t]] for t in range(len(index))])
    noise = np.abs(residuals.offset_sensitivity) * observations.noise[residuals.output_index] * residuals.relative_noise
    result: dict[str, dict[int, Floats]] = {key: {} for key in by_key}
    for key, derivatives in by_key.items():
        for t in tests_of[key]:
            mask = residuals.present[t] & (noise[t] > 0)
            scaled = derivatives[t, mask] / noise[t, mask]
            if "offset" in kinds:
                scaled = _without_offsets(scaled, residuals.output_index[t, mask], residuals.relative_noise[t, mask])
            if np.linalg.norm(scaled) > 0:
                result[key][t] = scaled
    return result


def _without_offsets(scaled: Floats, output: Floats, relative_noise: Floats) -> Floats:
    """The part orthogonal to an offset of each output; all (observations,)."""
    result = scaled.copy()
    for position in np.unique(output):
        offset = np.where(output == position, 1.0 / relative_noise, 0.0)
        result -= offset * (offset @ scaled) / (offset @ offset)
    return result


def _correlation(first: Floats, second: Floats) -> float:
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
