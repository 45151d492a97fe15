"""One form for each parameter, through all points at once: generalised least squares, with pysindy on small libraries.

The rows are all parameters at all temperatures, multiplied by the inverse Cholesky factor of each temperature's
covariance; the columns are the functions of the libraries. pysindy regresses one on the other without threshold or
ridge: with ten per cent of temperature its functions are collinear, and a threshold on one wide library keeps all of
them with coefficients of +-1000. What stands inside exponentials is found by variable projection (Golub and Pereyra
(1973), SIAM J. Numer. Anal. 10, 413): the coefficients are solved for at each trial of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.discovery.libraries import CandidateForm, evaluate_forms
from creepkit.discovery.points import IsothermalEstimates
from creepkit.language import Param

SOBOL_STARTS = 8
"""Trials from which what is inside exponentials is searched."""
BOUND_TOLERANCE_SD = 2.0
"""Standard deviations that a number may lie outside its bounds."""


@dataclass(frozen=True, eq=False)
class Regression:
    """Forms of all parameters, fitted to the points.

    values : {name: value} of coefficients and of what is inside exponentials, internal (logarithm of a coefficient of
        log scale); covariance in the same order. curves : (temperatures, parameters) of theta. chi_square : of rows.
    """

    candidate_forms: tuple[CandidateForm, ...]
    values: Mapping[str, float]
    covariance: Floats
    fitted_theta: Floats
    chi_square: float
    rows: int

    @property
    def parameter_count(self) -> int:
        """How many numbers were found."""
        return len(self.values)

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its form}."""
        return {form.parameter: form.name for form in self.candidate_forms}

    @property
    def prior_odds(self) -> float:
        """Prior odds of the forms together."""
        return float(np.prod([form.prior_odds for form in self.candidate_forms]))

    @property
    def table(self) -> dict[str, Param]:
        """{name: Param} of its numbers."""
        return {name: form.table[name] for form in self.candidate_forms for name in form.parameter_names}

    def within_bounds(self) -> bool:
        """Whether its numbers lie within their bounds, or near."""
        standard_deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        for (name, value), standard_deviation in zip(self.values.items(), standard_deviations, strict=True):
            low, high = (self.table[name].to_internal(b) for b in self.table[name].bounds)
            if not low - BOUND_TOLERANCE_SD * standard_deviation <= value <= high + BOUND_TOLERANCE_SD * standard_deviation:
                return False
        return True


class _DesignMatrix:
    """The columns of all parameters' libraries, over temperatures."""

    def __init__(self, forms: Sequence[CandidateForm]) -> None:
        self.forms = tuple(forms)
        self.parameter_of_column = np.concatenate([np.full(len(form.terms), parameter_index) for parameter_index, form in enumerate(forms)])
        self.nonlinear_parameters: dict[sympy.Symbol, Param] = {s: p for one in forms for s, p in one.nonlinear_parameters.items()}

    def unweighted(self, T: Floats, nonlinear_values: Sequence[float] | Floats) -> tuple[Floats, Floats]:
        """Functions (temperatures, terms) and offsets (temperatures, parameters)."""
        basis, start = [], 0
        for form in self.forms:
            basis.append(form.basis_values(T, [float(v) for v in nonlinear_values[start : start + len(form.nonlinear_parameters)]]))
            start += len(form.nonlinear_parameters)
        return np.concatenate([p[:, :-1] for p in basis], axis=1), np.stack([p[:, -1] for p in basis], axis=1)

    def whitened(self, estimates: IsothermalEstimates, nonlinear_values: Sequence[float] | Floats) -> tuple[Floats, Floats]:
        """Features (temperatures * parameters, terms) and target (rows,) after multiplication by the whiteners."""
        functions, offsets = self.unweighted(estimates.temperatures, nonlinear_values)
        features = np.concatenate(estimates.whitening[:, :, self.parameter_of_column] * functions[:, None, :])
        return features, np.concatenate(np.einsum("kij,kj->ki", estimates.whitening, estimates.theta - offsets))


def regress(estimates: IsothermalEstimates, forms: Sequence[CandidateForm]) -> Regression:
    """The best numbers of one library for each parameter, with their covariance."""
    design = _DesignMatrix(forms)
    nonlinear_values = _variable_projection(design, estimates) if design.nonlinear_parameters else np.zeros(0)
    features, target = design.whitened(estimates, nonlinear_values)
    coefficients = solve_with_pysindy(features, target)
    sensitivities = np.concatenate([features, _nonlinear_sensitivities(design, estimates, nonlinear_values, coefficients)], axis=1)
    names = [name for form in forms for name in form.terms] + [s.name for s in design.nonlinear_parameters]
    values = dict(zip(names, map(float, (*coefficients, *nonlinear_values)), strict=True))
    return Regression(
        tuple(forms),
        values,
        _parameter_covariance(sensitivities, design),
        evaluate_forms(forms, values, estimates.temperatures),
        float(((target - features @ coefficients) ** 2).sum()),
        target.size,
    )


def solve_with_pysindy(features: Floats, target: Floats) -> Floats:
    """Coefficients (terms,) of target (rows,) on features (rows, terms), by pysindy; no term is dropped."""
    import pysindy

    column_norms = np.linalg.norm(features, axis=0)
    column_norms = np.where(column_norms > 0, column_norms, 1.0)
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.0, alpha=0.0), feature_library=pysindy.IdentityLibrary())
    model.fit(features / column_norms, t=np.arange(len(target), dtype=float), x_dot=target[:, None])
    return np.asarray(model.coefficients()[0] / column_norms, float)


def _variable_projection(design: _DesignMatrix, estimates: IsothermalEstimates) -> Floats:
    """What is inside exponentials, with the coefficients solved for at each trial."""
    low, high = (np.array([p.bounds[end] for p in design.nonlinear_parameters.values()]) for end in (0, 1))
    scale = high - low

    def residual(unit: Floats) -> Floats:
        white, target = design.whitened(estimates, low + unit * scale)
        scaled = white / np.linalg.norm(white, axis=0)
        return np.asarray(target - scaled @ np.linalg.lstsq(scaled, target, rcond=None)[0])

    trials = qmc.Sobol(low.size, seed=0).random(SOBOL_STARTS)
    start = min(trials, key=lambda unit: float((residual(unit) ** 2).sum()))
    solution = least_squares(residual, start, bounds=(0.0, 1.0), diff_step=1e-6, x_scale=0.1)
    return np.asarray(low + solution.x * scale)


def _nonlinear_sensitivities(design: _DesignMatrix, estimates: IsothermalEstimates, nonlinear_values: Floats, coefficients: Floats) -> Floats:
    """Derivatives of the white curves to what is inside exponentials, (rows, inner), by central differences."""
    sensitivities = np.zeros((estimates.theta.size, nonlinear_values.size))
    for k, param in enumerate(design.nonlinear_parameters.values()):
        step = np.zeros(nonlinear_values.size)
        step[k] = 1e-5 * (param.bounds[1] - param.bounds[0])
        (features_above, target_above), (features_below, target_below) = (design.whitened(estimates, nonlinear_values + s * step) for s in (1.0, -1.0))
        sensitivities[:, k] = ((features_above - features_below) @ coefficients - (target_above - target_below)) / (2 * step[k])
    return sensitivities


def _parameter_covariance(sensitivities: Floats, design: _DesignMatrix) -> Floats:
    """Of all numbers; what is inside exponentials has the variance of its bounds where the points say nothing."""
    information = sensitivities.T @ sensitivities
    for k, param in enumerate(design.nonlinear_parameters.values(), start=len(design.parameter_of_column)):
        information[k, k] += 12.0 / (param.bounds[1] - param.bounds[0]) ** 2
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.pinv(information / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale))
