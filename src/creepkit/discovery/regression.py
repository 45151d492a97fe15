"""Regression of parameters on temperature: estimates at single temperatures, and one form for each parameter.

A coefficient and its exponent are correlated to -0.99999 at one temperature, so that estimates with separate error bars
would mislead: all parameters of one temperature stay together, with their whole covariance. The rows of the generalised
least squares are all parameters at all temperatures, multiplied by the inverse Cholesky factor of each temperature's
covariance; the columns are the functions of the forms. No term is dropped unless an optimizer of pysindy is given: over
ten per cent of temperature the functions are collinear, and a threshold on one wide library keeps all of them with
coefficients of +-1000. Parameters inside exponentials are found by variable projection
(Golub and Pereyra (1973), SIAM J. Numer. Anal. 10, 413): the coefficients are solved for at each trial of them.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Bools, Floats
from creepkit.discovery.forms import CandidateForm, evaluate_forms
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, ReferencePoint
from creepkit.inverse.uncertainty.laplace_approximation import lies_at_bound
from creepkit.language import CreepLaw, Param, temperature
from creepkit.records import ZERO_CELSIUS

UNDETERMINED_WIDTH = 0.15
"""Standard deviation over the width of the bounds above which a parameter counts as undetermined; that of the uniform
distribution over them is 0.29."""


INFINITE_FREEDOM = 1e9
"""Degrees of freedom of a normal distribution."""


MIN_TEMPERATURES = 3
"""Temperatures: two give a slope, which any form can have."""


@dataclass(frozen=True, eq=False)
class IsothermalEstimates:
    """One law's parameters at several temperatures.

    temperatures : (fits,) K. theta : (fits, parameters) internal values (the logarithm where the scale is log).
    covariance : (fits, parameters, parameters) of theta, that of the normal distribution with the same 95 % intervals
        where an identification has few degrees of freedom; wide where a bound holds the value.
    reference : the point where rates are compared.
    ranges : {"stress", "temperature", "strain", "time": (low, high)} that they cover together.
    fits : the identifications that they come from, in the same order.
    """

    law: CreepLaw
    temperatures: Floats
    theta: Floats
    covariance: Floats
    reference: ReferencePoint
    ranges: dict[str, tuple[float, float]]
    fits: tuple[Identification, ...] = ()

    @classmethod
    def from_identifications(cls, fits: Sequence[Identification]) -> IsothermalEstimates:
        """The estimates of identifications of one law, each at one temperature; FitError where they are not that."""
        check_identifications(fits)
        order = np.argsort([fit.reference.temperature for fit in fits])
        ordered = [fits[int(k)] for k in order]
        ends = {name: zip(*(fit.ranges[name] for fit in ordered), strict=True) for name in ordered[0].ranges}
        return cls(
            ordered[0].law,
            np.array([fit.reference.temperature for fit in ordered]),
            np.stack([fit.coordinates.theta(fit.u) for fit in ordered]),
            np.stack([_theta_covariance(fit) for fit in ordered]),
            _central_reference([fit.reference for fit in ordered]),
            {name: (min(low), max(high)) for name, (low, high) in ends.items()},
            tuple(ordered),
        )

    @cached_property
    def whitening(self) -> Floats:
        """(fits, parameters, parameters) inverse Cholesky factors of the covariances."""
        sd = np.sqrt(np.einsum("kii->ki", self.covariance))
        scaled = self.covariance / (sd[:, :, None] * sd[:, None, :])
        return np.asarray(np.linalg.inv(np.linalg.cholesky(scaled)) / sd[:, None, :])

    @cached_property
    def has_undetermined_parameters(self) -> bool:
        """Whether some parameter, rate coefficients aside, is undetermined at most temperatures."""
        coordinates = Coordinates(self.law, self.reference)
        widths = np.ptp(self.law.internal_bounds, axis=0)
        determined = np.sqrt(np.einsum("kii->ki", self.covariance)) < UNDETERMINED_WIDTH * widths
        determined[:, list(coordinates.coefficients)] = True
        return bool((np.median(determined, axis=0) < 0.5).any())


def check_identifications(fits: Sequence[Identification]) -> None:
    """Identifications of one law without temperature, at three temperatures or more."""
    if not fits:
        raise FitError("discover() takes a list of identifications, one for each temperature")
    law = fits[0].law
    if law.uses(temperature):
        raise FitError(
            f"law '{law.name}' depends on temperature already; identify it without, at each temperature by itself"
        )
    other = next((fit.law.name for fit in fits if fit.law.fingerprint != law.fingerprint), None)
    if other is not None:
        raise FitError(f"the identifications are of '{law.name}' and of '{other}'; give those of one law")
    for fit in fits:
        low, high = fit.ranges["temperature"]
        # furnaces drift within tests whose means lie this near to one another: the range of all readings may be twice
        spans = [float(np.ptp(h.followed_temperatures)) for h in fit.histories]
        spans.append(float(np.ptp([h.mean_temperature for h in fit.histories])) if fit.histories else high - low)
        if max(spans) > ISOTHERMAL_RANGE:
            raise FitError(
                f"an identification of '{law.name}' spans {low:.0f} to {high:.0f} K; identify each temperature alone"
            )
    check_temperatures([fit.reference.temperature for fit in fits])


def check_temperatures(temperatures: Sequence[float]) -> None:
    """Say what fewer than three temperatures leave unknown."""
    distinct = [temperatures[group[0]] for group in isothermal_groups(temperatures)]
    if len(distinct) == 1:
        raise FitError(
            f"all tests are at {distinct[0]:.0f} K: from one temperature neither an activation energy nor how any "
            "other parameter depends on temperature can be known; add tests at two other temperatures or more"
        )
    if len(distinct) < MIN_TEMPERATURES:
        raise FitError(
            f"the tests are at {distinct[0]:.0f} and {distinct[1]:.0f} K alone: two temperatures give an activation "
            "energy but no form; identify the law times arrhenius(), or add a third temperature"
        )


def isothermal_groups(temperatures: Sequence[float], tolerance: float = ISOTHERMAL_RANGE) -> list[list[int]]:
    """Positions of temperatures in groups that ascend; each within `tolerance` K of the lowest of its group.

    temperatures : (n,) K.
    """
    groups: list[list[int]] = []
    for k in sorted(range(len(temperatures)), key=temperatures.__getitem__):
        if groups and temperatures[k] - temperatures[groups[-1][0]] <= tolerance:
            groups[-1].append(k)
        else:
            groups.append([k])
    return groups


def _theta_covariance(fit: Identification) -> Floats:
    """(parameters, parameters) by the tests alone: what is off alike at every temperature tells no forms apart.

    An estimate at its bound, which says nothing but that, has the variance of its bounds beside.
    """
    jacobian, covariance = fit.coordinates.jacobian(fit.u), fit.by_tests_alone.covariance
    at_bound = [lies_at_bound(fit.law.table[e.name], e) for e in fit.estimates]
    of_bounds = np.where(at_bound, np.ptp(fit.law.internal_bounds, axis=0) ** 2 / 12.0, 0.0)
    return np.asarray(jacobian @ covariance @ jacobian.T + np.diag(of_bounds))


def _central_reference(references: Sequence[ReferencePoint]) -> ReferencePoint:
    stress, strain, time = (
        float(np.exp(np.mean([np.log(getattr(r, name)) for r in references]))) for name in ("stress", "strain", "time")
    )
    celsius = float(np.median([r.temperature for r in references])) - ZERO_CELSIUS
    return ReferencePoint(stress, strain, time, float(round(celsius / 10.0) * 10.0 + ZERO_CELSIUS))


SOBOL_STARTS = 8
"""Trials from which what is inside exponentials is searched."""


BOUND_TOLERANCE_SD = 2.0
"""Standard deviations that a number may lie outside its bounds."""


@dataclass(frozen=True, eq=False)
class FormCombination:
    """A form for each parameter with its numbers, found by regression on estimates or, once refitted, from the tests.

    values : {name: internal value} of coefficients and of what is inside exponentials (the logarithm of a coefficient
        of log scale). covariance : (numbers, numbers) in the same order, of so many degrees of freedom.
    fitted_theta : (temperatures, parameters) internal values on the curves of the regression. chi_square : of its
        `rows` residuals.
    criterion_difference : its criterion less that of the best that it was compared with. weight : its Akaike weight.
    fit : the identification of the law with these forms, once refitted.
    """

    candidate_forms: tuple[CandidateForm, ...]
    values: Mapping[str, float]
    covariance: Floats
    fitted_theta: Floats
    chi_square: float
    rows: int
    degrees_of_freedom: float = INFINITE_FREEDOM
    criterion_difference: float = 0.0
    weight: float = 1.0
    fit: Identification | None = None

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

    def theta(self, T: Floats) -> Floats:
        """(temperatures, parameters) internal values.

        T : (temperatures,) K.
        """
        return evaluate_forms(self.candidate_forms, self.values, T)

    def standard_deviation(self, name: str) -> float:
        """Standard deviation of the internal value of one number."""
        k = list(self.values).index(name)
        return float(np.sqrt(max(self.covariance[k, k], 0.0)))

    def within_bounds(self) -> bool:
        """Whether its numbers lie within their bounds, or near."""
        margin = BOUND_TOLERANCE_SD * np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        params, values = [self.table[name] for name in self.values], np.array([*self.values.values()])
        low, high = np.array([[p.to_internal(b) for b in p.bounds] for p in params]).reshape(-1, 2).T
        return bool(((values >= low - margin) & (values <= high + margin)).all())


class _DesignMatrix:
    """The columns of all parameters' libraries over temperatures; those without nonlinear parameters are made once."""

    def __init__(self, forms: Sequence[CandidateForm], T: Floats) -> None:
        self.forms, self.T = tuple(forms), T
        self.parameter_of_column = np.concatenate(
            [np.full(len(form.terms), parameter_index) for parameter_index, form in enumerate(forms)]
        )
        self.nonlinear_parameters: dict[sympy.Symbol, Param] = {
            s: p for one in forms for s, p in one.nonlinear_parameters.items()
        }
        self._basis = [None if one.nonlinear_parameters else one.basis_values(T, ()) for one in forms]

    def unweighted(self, nonlinear_values: Sequence[float] | Floats) -> tuple[Floats, Floats]:
        """Functions (temperatures, terms) and offsets (temperatures, parameters)."""
        basis, start = [], 0
        for form, fixed in zip(self.forms, self._basis, strict=True):
            values = [float(v) for v in nonlinear_values[start : start + len(form.nonlinear_parameters)]]
            basis.append(form.basis_values(self.T, values) if fixed is None else fixed)
            start += len(form.nonlinear_parameters)
        return np.concatenate([p[:, :-1] for p in basis], axis=1), np.stack([p[:, -1] for p in basis], axis=1)

    def whitened(
        self, estimates: IsothermalEstimates, nonlinear_values: Sequence[float] | Floats
    ) -> tuple[Floats, Floats]:
        """Features (temperatures * parameters, terms) and target (rows,) after multiplication by the whiteners."""
        functions, offsets = self.unweighted(nonlinear_values)
        features = np.concatenate(estimates.whitening[:, :, self.parameter_of_column] * functions[:, None, :])
        return features, np.concatenate(np.einsum("kij,kj->ki", estimates.whitening, estimates.theta - offsets))


@dataclass(frozen=True, eq=False)
class WhitenedSystem:
    """The linear system y = X c that regression on temperature solves, with residuals of variance 1.

    X : (rows, terms) functions of temperature; y : (rows,). A row is a parameter at a temperature, after multiplication
    by the inverse Cholesky factor of the covariance of that temperature. covariance : (rows, rows) of the estimates
    before, in internal values. terms : what the columns are. rows : (parameter, temperature in K) each.
    """

    X: Floats
    y: Floats
    covariance: Floats
    terms: tuple[str, ...]
    rows: tuple[tuple[str, float], ...]


def whitened_system(
    estimates: IsothermalEstimates, candidates: Mapping[str, Sequence[CandidateForm]]
) -> WhitenedSystem:
    """The system of all functions of the candidates side by side, without those that have nonlinear parameters."""
    columns, terms, names, T = [], [], estimates.law.names, estimates.temperatures
    for k, name in enumerate(names):
        basis = {name: np.ones_like(T)}
        for form in candidates[name]:
            if not form.nonlinear_parameters and form.offset == 0:
                own = form.basis_values(T, ())[:, :-1].T
                basis |= {f"{c} ({form.name})": v for c, v in zip(form.terms, own, strict=True) if c != name}
        columns += [(estimates.whitening[:, :, k] * values[:, None]).ravel() for values in basis.values()]
        terms += list(basis)
    target = np.einsum("kij,kj->ki", estimates.whitening, estimates.theta).ravel()
    rows = tuple((name, float(one)) for one in T for name in names)
    return WhitenedSystem(np.stack(columns, axis=1), target, block_diag(*estimates.covariance), tuple(terms), rows)


def regress(estimates: IsothermalEstimates, forms: Sequence[CandidateForm], optimizer: Any = None) -> FormCombination:
    """The best numbers of one library for each parameter, with their covariance.

    optimizer : of pysindy, which drops terms first; the parameters' values at T_ref stay.
    """
    design = _DesignMatrix(forms, estimates.temperatures)
    nonlinear_values = _variable_projection(design, estimates) if design.nonlinear_parameters else np.zeros(0)
    features, target = design.whitened(estimates, nonlinear_values)
    if optimizer is not None:
        names = [name for form in forms for name in form.terms]
        is_value = [name == form.parameter for form in forms for name in form.terms]
        kept = _kept_terms(features, target, is_value, optimizer)
        dropped = {name for name, is_kept in zip(names, kept, strict=True) if not is_kept}
        if dropped:
            return regress(estimates, [form.without(dropped) for form in forms])
    coefficients = solve_least_squares(features, target)
    sensitivities = np.concatenate(
        [features, _nonlinear_sensitivities(design, estimates, nonlinear_values, coefficients)], axis=1
    )
    names = [name for form in forms for name in form.terms] + [s.name for s in design.nonlinear_parameters]
    values = dict(zip(names, map(float, (*coefficients, *nonlinear_values)), strict=True))
    return FormCombination(
        tuple(forms),
        values,
        _parameter_covariance(sensitivities, design),
        evaluate_forms(forms, values, estimates.temperatures),
        float(((target - features @ coefficients) ** 2).sum()),
        target.size,
    )


def solve_least_squares(features: Floats, target: Floats) -> Floats:
    """Coefficients (terms,) of target (rows,) on features (rows, terms) in units of their norms; no term is dropped."""
    column_norms = np.linalg.norm(features, axis=0)
    column_norms = np.where(column_norms > 0, column_norms, 1.0)
    return np.asarray(np.linalg.lstsq(features / column_norms, target, rcond=None)[0] / column_norms, float)


def _kept_terms(features: Floats, target: Floats, always: Sequence[bool], optimizer: Any) -> Bools:
    """(terms,) which an optimizer of pysindy keeps, on columns of norm 1 without what those kept always can say."""
    fixed, free = features[:, np.array(always)], features[:, ~np.array(always)]
    kept = np.array(always)
    if free.shape[1]:
        basis = np.linalg.qr(fixed / np.linalg.norm(fixed, axis=0))[0]
        columns, values = (array - basis @ (basis.T @ array) for array in (free, target))
        kept[~kept] = _solved(columns, values, optimizer) != 0.0
    return kept


def _solved(features: Floats, target: Floats, optimizer: Any) -> Floats:
    """Coefficients (terms,) by an optimizer of pysindy, which sees columns of norm 1."""
    norms = np.linalg.norm(features, axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    solver = deepcopy(optimizer)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that every term was dropped, which is an answer
        solver.fit(features / norms, target[:, None])
    return np.asarray(np.ravel(solver.coef_) / norms, float)


def _variable_projection(design: _DesignMatrix, estimates: IsothermalEstimates) -> Floats:
    """Values of the nonlinear parameters; the coefficients are solved for at each trial."""
    low, high = (np.array([p.bounds[end] for p in design.nonlinear_parameters.values()]) for end in (0, 1))
    scale = high - low

    def residual(unit: Floats) -> Floats:
        white, target = design.whitened(estimates, low + unit * scale)
        return np.asarray(target - white @ solve_least_squares(white, target))

    trials = qmc.Sobol(low.size, seed=0).random(SOBOL_STARTS)
    start = min(trials, key=lambda unit: float((residual(unit) ** 2).sum()))
    solution = least_squares(residual, start, bounds=(0.0, 1.0), diff_step=1e-6, x_scale=0.1, ftol=1e-6, xtol=1e-5)
    return np.asarray(low + solution.x * scale)


def _nonlinear_sensitivities(
    design: _DesignMatrix, estimates: IsothermalEstimates, nonlinear_values: Floats, coefficients: Floats
) -> Floats:
    """Derivatives of the white curves to what is inside exponentials, (rows, inner), by central differences."""
    sensitivities = np.zeros((estimates.theta.size, nonlinear_values.size))
    for k, param in enumerate(design.nonlinear_parameters.values()):
        step = np.zeros(nonlinear_values.size)
        step[k] = 1e-5 * (param.bounds[1] - param.bounds[0])
        (features_above, target_above), (features_below, target_below) = (
            design.whitened(estimates, nonlinear_values + s * step) for s in (1.0, -1.0)
        )
        sensitivities[:, k] = ((features_above - features_below) @ coefficients - (target_above - target_below)) / (
            2 * step[k]
        )
    return sensitivities


def _parameter_covariance(sensitivities: Floats, design: _DesignMatrix) -> Floats:
    """Covariance of all numbers; undetermined nonlinear parameters have the variance of their bounds."""
    information = sensitivities.T @ sensitivities
    for k, param in enumerate(design.nonlinear_parameters.values(), start=len(design.parameter_of_column)):
        information[k, k] += 12.0 / (param.bounds[1] - param.bounds[0]) ** 2
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.pinv(information / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale))
