"""Conditioned coordinates: log rates of the terms at a reference point, and local stress exponents, as unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import LawError
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.kernels import ArrayKernel, lower, tension_point
from creepkit.language import CreepLaw, strain, stress, temperature
from creepkit.language.law_record import expression_size
from creepkit.language.symbols import POINT_VARIABLES, State

SAMPLE_POINTS = 64
"""Points within the bounds at which the derivative to a candidate parameter is evaluated."""


MINIMUM_DERIVATIVE = 0.2
"""Of dh/dp over the bounds: a parameter that the local exponent hardly depends on cannot replace it."""


LARGEST_EXPONENT = 30.0
"""Upper bound of local exponents."""


@dataclass(frozen=True)
class LocalExponent:
    """The local stress exponent of one term, h = a + b p, as an unknown in the place of parameter p.

    position : of p; others : positions of the parameters on which a and b depend.
    coefficients : point and internal parameters `others` to (a, b, da, db), the latter with one value for each of them.
    """

    position: int
    others: tuple[int, ...]
    coefficients: Callable[..., tuple[object, ...]]

    def evaluate(self, point: Sequence[float], theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """a, b (...,) and their derivatives to the internal parameters `others`, (..., others).

        point : of the reference; internal variables behind it are left alone, for no such term mentions them.
        theta : (..., parameters) internal values.
        """
        other_values = [theta[..., k] for k in self.others]
        with np.errstate(all="ignore"):
            evaluated = self.coefficients(*point[: len(POINT_VARIABLES)], *other_values)
        shape, count = theta.shape[:-1], len(self.others)
        broadcast = [np.broadcast_to(np.asarray(v, float), shape) for v in evaluated]
        da, db = (
            np.stack(broadcast[k : k + count], axis=-1) if count else np.zeros((*shape, 0)) for k in (2, 2 + count)
        )
        return broadcast[0], broadcast[1], da, db


def local_exponents(law: CreepLaw) -> tuple[LocalExponent, ...]:
    """Those of a law's terms that are worth a coordinate; none for terms that mention internal variables."""
    key = (law.fingerprint, law.names, tuple(param.bounds for param in law.params.values()))
    if key not in _CACHE:
        used_positions, exponents = set[int](), list[LocalExponent]()
        for term in law.terms.values():
            exponent = _exponent_of_term(law, term, used_positions)
            if exponent is not None:
                exponents.append(exponent)
                used_positions |= {exponent.position, *exponent.others}
        _CACHE[key] = tuple(exponents)
    return _CACHE[key]


_CACHE: dict[tuple[str, tuple[str, ...], tuple[tuple[float, float], ...]], tuple[LocalExponent, ...]] = {}
"""What was derived in this process, by fingerprint, order of parameters (that of a sum may differ), and bounds."""


SIMPLIFICATION_LIMIT = 750
"""Size of a term up to which sympy simplifies its exponent in seconds; others have none found."""


def _exponent_of_term(law: CreepLaw, term: sympy.Expr, used_positions: set[int]) -> LocalExponent | None:
    if term.free_symbols & set(law.states) or not term.has(stress):
        return None
    if expression_size(term) > SIMPLIFICATION_LIMIT:
        return None
    exponent = sympy.simplify(stress * sympy.diff(term, stress) / term)
    parameters = [symbol for symbol in law.params if symbol in exponent.free_symbols]
    if exponent in law.params or {law.names.index(s.name) for s in parameters} & used_positions:
        return None
    candidates = [p for p in parameters if law.params[p].scale != "log" and sympy.diff(exponent, p, 2) == 0]
    candidates = [p for p in candidates if not sympy.diff(exponent, p).has(temperature)]  # a slope may be 0 at T_ref
    scored = [(_smallest_derivative(law, exponent, p), p) for p in candidates]
    scored = [(score, p) for score, p in scored if score > MINIMUM_DERIVATIVE]
    if not scored:
        return None
    p = max(scored, key=lambda pair: pair[0])[1]
    return _compiled(law, exponent, p, [symbol for symbol in parameters if symbol != p])


def _compiled(law: CreepLaw, exponent: sympy.Expr, p: sympy.Symbol, others: list[sympy.Symbol]) -> LocalExponent:
    a, b = exponent.subs(p, 0), sympy.diff(exponent, p)
    internal = {s: sympy.exp(s) if law.params[s].scale == "log" else s for s in others}
    a, b = a.subs(internal, simultaneous=True), b.subs(internal, simultaneous=True)
    parts = [a, b, *(sympy.diff(a, s) for s in others), *(sympy.diff(b, s) for s in others)]
    smooth = [part.replace(sympy.DiracDelta, lambda *_: sympy.S.Zero) for part in parts]  # of a Max, off its corner
    function = sympy.lambdify((*POINT_VARIABLES, *others), smooth, "numpy", cse=True)
    names = law.names
    return LocalExponent(names.index(p.name), tuple(names.index(s.name) for s in others), function)


def _smallest_derivative(law: CreepLaw, exponent: sympy.Expr, p: sympy.Symbol) -> float:
    """The smallest |dh/dp| over the bounds, at 100 MPa, strain 0.01, 2e4 s, 1000 K."""
    derivative = sympy.diff(exponent, p)
    symbols = [s for s in law.params if s in derivative.free_symbols]
    function = sympy.lambdify((*POINT_VARIABLES, *symbols), derivative, "numpy")
    unit = qmc.Sobol(max(len(symbols), 1), seed=0).random(SAMPLE_POINTS)
    internal_bounds = [[law.params[s].to_internal(b) for b in law.params[s].bounds] for s in symbols]
    internal = [low + unit[:, k] * (high - low) for k, (low, high) in enumerate(internal_bounds)]
    sampled = [np.exp(v) if law.params[s].scale == "log" else v for s, v in zip(symbols, internal, strict=True)]
    with np.errstate(all="ignore"):
        magnitudes = np.abs(np.broadcast_to(function(100.0, 0.01, 2e4, 1000.0, 100.0, 33.0, *sampled), SAMPLE_POINTS))
    return float(np.min(magnitudes)) if np.isfinite(magnitudes).all() else 0.0


class Coordinates:
    """The map between internal parameters theta and conditioned coordinates u, both (..., parameters)."""

    def __init__(self, law: CreepLaw, reference: ReferencePoint) -> None:
        self.law, self.reference, self.names = law, reference, law.names
        self.law_there = law = reference.law_there(law)
        self._last: dict[str, tuple[object, Floats]] = {}
        self._rate_kernels: list[tuple[int, list[int], ArrayKernel]] = []
        for label in law.terms:
            single_term = law.only(label)
            position = _coefficient_position(law, single_term)
            if position is not None:
                self._rate_kernels.append(
                    (position, [law.names.index(n) for n in single_term.names], lower(single_term, "numpy"))
                )
        self.exponents = local_exponents(law)
        """Parameters whose place the local exponent of their term takes."""
        self.term_rates = tuple(k for k, _, _ in self._rate_kernels)
        """Positions of the coordinates that are log rates of terms."""
        damage = list[int]()
        for state, rate_law in _state_rate_laws(law):
            position = _coefficient_position(law, rate_law)
            kernel = lower(rate_law, "numpy")
            positions = [law.names.index(n) for n in rate_law.names]
            if position is not None and position not in self.term_rates and self._has_finite_rate(kernel, rate_law):
                self._rate_kernels.append((position, positions, kernel))
                damage += [position] if state.limit is not None else []
        self.state_rates = tuple(k for k, _, _ in self._rate_kernels if k not in self.term_rates)
        """Positions of the coordinates that are log rates of internal variables."""
        self._of_damage = tuple(damage)

    @property
    def penalised(self) -> tuple[int, ...]:
        """Positions of the parameters that are no coordinates themselves, so that penalties must hold their bounds."""
        return (*self.coefficients, *(local.position for local in self.exponents))

    @property
    def coefficients(self) -> tuple[int, ...]:
        """Positions of the coordinates that are log rates of terms and of internal variables."""
        return self.term_rates + self.state_rates

    @cached_property
    def damage_rates(self) -> tuple[int, ...]:
        """Positions of the internal parameters that are logarithms of how fast damage grows, if there are any.

        Those of internal variables that end the life of a material point; in a law without such, the exponents by which
        its rate grows with strain.
        """
        return self._of_damage or tuple(self.names.index(p.name) for p in _accelerations(self.law))

    @property
    def every_rate_has_coefficient(self) -> bool:
        """Whether each term and internal variable has a coordinate that is ln of its rate."""
        return len(self.coefficients) == len(self.law.terms) + len(self.law.states)

    def theta(self, u: Floats) -> Floats:
        """(..., parameters) internal parameters of conditioned coordinates u (..., parameters)."""
        return self._kept(self._theta, np.asarray(u, float))

    def _kept(self, function: Callable[[Floats], Floats], u: Floats) -> Floats:
        """A function of u (..., parameters); that of the last u is kept, for a fit asks for it several times."""
        key, kept = (u.shape, u.tobytes()), self._last.get(function.__name__)
        if kept is None or kept[0] != key:
            kept = self._last[function.__name__] = key, function(u)
        return kept[1].copy()

    def _theta(self, u: Floats) -> Floats:
        theta = np.array(u, float)
        for local in self.exponents:
            a, b, _, _ = local.evaluate(self._point(self.law_there), theta)
            theta[..., local.position] = (theta[..., local.position] - a) / b
        internal = theta.copy()
        for k, positions, kernel in self._rate_kernels:
            without_coefficient = internal.copy()
            without_coefficient[..., k] = 0.0
            theta[..., k] = u[..., k] - self._log_rate(kernel, without_coefficient[..., positions])
        return theta

    def values(self, u: Floats) -> dict[str, float]:
        """{parameter: value} in the author's units, of one u (parameters,)."""
        return {name: float(value) for name, value in self.law.from_internal(self.theta(u)).items()}

    def u(self, theta: Floats) -> Floats:
        """(..., parameters) conditioned coordinates of internal parameters theta (..., parameters)."""
        u = np.array(theta, float)
        for local in self.exponents:
            a, b, _, _ = local.evaluate(self._point(self.law_there), u)
            u[..., local.position] = a + b * u[..., local.position]
        for k, positions, kernel in self._rate_kernels:
            u[..., k] = self._log_rate(kernel, theta[..., positions])
        return u

    def within_bounds(self, u: Floats) -> Floats:
        """u (parameters,) itself, or where values lie beyond their bounds the nearest ones within, at the rates of u.

        Coefficients follow from the rates, so that no value moves by itself: what u says and what the values say agree.
        """
        low, high = self.law.internal_bounds
        theta = self.theta(u)
        if ((theta >= low) & (theta <= high)).all() or not np.isfinite(theta).all():
            return u
        within = self.u(np.clip(theta, low, high))
        within[list(self.coefficients)] = u[list(self.coefficients)]
        return self.u(np.clip(self.theta(within), low, high))

    def jacobian(self, u: Floats) -> Floats:
        """d theta / d u at u (..., parameters): (..., parameters, parameters)."""
        return self._kept(self._jacobian, np.asarray(u, float))

    def _jacobian(self, u: Floats) -> Floats:
        theta = self.theta(u)
        matrix = np.tile(np.eye(theta.shape[-1]), (*theta.shape[:-1], 1, 1))
        for k, positions, kernel in self._rate_kernels:
            internal = np.moveaxis(theta[..., positions], -1, 0)
            derivatives = kernel.internal_derivatives(*self._point(kernel.law), *internal)
            for name, position in zip(kernel.law.names, positions, strict=True):
                if position != k:
                    matrix[..., k, position] = -np.asarray(derivatives.params[name]) / np.asarray(derivatives.rate)
        return matrix @ self._exponents_jacobian(theta) if self.exponents else matrix

    def _exponents_jacobian(self, theta: Floats) -> Floats:
        """Derivatives of the parameters that local exponents stand for, (..., parameters, parameters)."""
        matrix = np.tile(np.eye(theta.shape[-1]), (*theta.shape[:-1], 1, 1))
        for local in self.exponents:
            _, b, da, db = local.evaluate(self._point(self.law_there), theta)
            matrix[..., local.position, local.position] = 1.0 / b
            for k, position in enumerate(local.others):
                matrix[..., local.position, position] = -(da[..., k] + db[..., k] * theta[..., local.position]) / b
        return matrix

    def _point(self, law: CreepLaw) -> tuple[float, ...]:
        r = self.reference
        return tension_point(law, r.stress, r.strain, r.time, r.temperature)

    def _has_finite_rate(self, kernel: ArrayKernel, rate_law: CreepLaw) -> bool:
        """Whether a virgin internal variable grows at all in the middle of the bounds."""
        central_theta = rate_law.internal_bounds.mean(axis=0)
        return bool(np.isfinite(self._log_rate(kernel, central_theta)))

    def _log_rate(self, kernel: ArrayKernel, theta: Floats) -> Floats:
        return np.asarray(kernel.internal_log_rate(*self._point(kernel.law), *np.moveaxis(theta, -1, 0)), float)


def _accelerations(law: CreepLaw) -> list[sympy.Symbol]:
    """Parameters p of a logarithmic scale by which a rate is exponential in strain: d ln rate / d strain is p > 0."""
    found = list[sympy.Symbol]()
    for term in law.terms.values():
        slope = sympy.diff(sympy.expand_log(sympy.log(term), force=True), strain)
        if slope != 0 and not slope.has(strain) and slope.subs(dict.fromkeys(slope.free_symbols, 1)) > 0:
            multiplying = (p for p, param in law.params.items() if slope.has(p) and param.scale == "log")
            found += [p for p in multiplying if not (slope / p).cancel().has(p)]
    return found


def _state_rate_laws(law: CreepLaw) -> list[tuple[State, CreepLaw]]:
    """Scalar internal variables, each with a law whose rate is how fast it moves; none where that has no logarithm.

    Only the coefficient's coordinate depends on it: without it, the coefficient is a coordinate itself.
    """
    rate_laws, rate_parameters = [], {p for state in law.states.values() for p in state.rate.free_symbols}
    state_parameters = {p: param for p, param in law.params.items() if p in rate_parameters}
    for symbol, state in ((s, z) for s, z in law.states.items() if s not in law.back_stresses):
        term_name = f"rate of {symbol}"
        signed_rate_laws = (
            replace(law, terms={term_name: sign * state.rate}, params=state_parameters, constraints=())
            for sign in (1, -1)
        )
        rate_laws += [(state, one) for one in filter(_has_log_form, signed_rate_laws)][:1]
    return rate_laws


def _has_log_form(rate_law: CreepLaw) -> bool:
    from creepkit.kernels.log_form import log_form

    try:
        log_form(rate_law)
    except LawError:
        return False
    return True


def _coefficient_position(law: CreepLaw, single_term: CreepLaw) -> int | None:
    """Position of the one log-scale parameter that multiplies this rate and stands in no other, if there is one."""
    from creepkit.kernels.log_form import log_form

    (coefficients,) = log_form(single_term).coefficients
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    for name in (single_term.names[k] for k in coefficients):
        if sum(law.symbol(name) in each.free_symbols for each in expressions) == 1:
            return law.names.index(name)
    return None
