"""Well-conditioned coordinates: the log rate of each term and state at a reference point instead of its coefficient.

A and n are correlated to -0.99999 in raw form; ln of the term's rate at the middle of the measured stresses, and n,
are nearly independent. With theta the internal parameters, u equals theta but for each term's coefficient ln A_i,
which becomes u_i = ln f_i(reference; theta). The map is linear in ln A_i, so it inverts at once. The coefficient of an
internal variable's rate becomes, likewise, the ln of that rate for the virgin material. Where a term's stress exponent
is not a parameter itself, as that of sinh, the local exponent at the reference takes the place of one (see
inverse.local_exponents).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import LawError
from creepkit.inverse.local_exponents import local_exponents
from creepkit.inverse.nominal import reference_end_strain, reference_stresses
from creepkit.kernels import ArrayKernel, lower
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor


@dataclass(frozen=True)
class ReferencePoint:
    """The point at which term rates are stated: stress MPa, strain, time s, temperature K."""

    stress: float
    strain: float
    time: float
    temperature: float

    @classmethod
    def from_histories(cls, histories: Sequence[History], predictor: Predictor | None = None) -> ReferencePoint:
        """The middle of what was measured: geometric means of stress and time, of half the end strain; median T.

        using : where it states reference stresses, they count (see inverse.nominal).
        """
        mean_stresses = [float(np.exp(np.mean(np.log(np.maximum(reference_stresses(h, predictor), 1e-6))))) for h in histories]
        times = [float(h.times[h.used][-1]) for h in histories]
        strains = [reference_end_strain(h, predictor) for h in histories]
        temperatures = [float(np.mean(h.temperature_program().values)) for h in histories]
        central_values = [float(np.exp(np.mean(np.log(v)))) for v in (mean_stresses, strains, times)]
        return cls(central_values[0], 0.5 * central_values[1], 0.5 * central_values[2], float(np.median(temperatures)))


class Coordinates:
    """The map between internal parameters theta and conditioned coordinates u, both (..., parameters)."""

    def __init__(self, law: CreepLaw, reference: ReferencePoint) -> None:
        self.law, self.reference = law, reference
        self.names = law.names
        self._rate_kernels: list[tuple[int, list[int], ArrayKernel]] = []
        for label in law.terms:
            single_term = law.only(label)
            position = _coefficient_position(law, single_term)
            if position is not None:
                self._rate_kernels.append((position, [law.names.index(n) for n in single_term.names], lower(single_term, "numpy")))
        self.exponents = local_exponents(law)
        """Parameters whose place the local exponent of their term takes."""
        self.term_rates = tuple(k for k, _, _ in self._rate_kernels)
        """Positions of the coordinates that are log rates of terms."""
        for rate_law in _state_rate_laws(law):
            position = _coefficient_position(law, rate_law)
            kernel = lower(rate_law, "numpy")
            positions = [law.names.index(n) for n in rate_law.names]
            if position is not None and position not in self.term_rates and self._has_finite_rate(kernel, rate_law):
                self._rate_kernels.append((position, positions, kernel))
        self.state_rates = tuple(k for k, _, _ in self._rate_kernels if k not in self.term_rates)
        """Positions of the coordinates that are log rates of internal variables."""

    @property
    def penalised(self) -> tuple[int, ...]:
        """Positions of the parameters that are no coordinates themselves, so that walls must hold their bounds."""
        return (*self.coefficients, *(local.position for local in self.exponents))

    @property
    def coefficients(self) -> tuple[int, ...]:
        """Positions of all of them."""
        return self.term_rates + self.state_rates

    def theta(self, u: Floats) -> Floats:
        """Internal parameters of conditioned coordinates."""
        theta = np.array(u, float)
        for local in self.exponents:
            a, b, _, _ = local.evaluate(self._point(self.law), theta)
            theta[..., local.position] = (theta[..., local.position] - a) / b
        internal = theta.copy()
        for k, positions, kernel in self._rate_kernels:
            without_coefficient = internal.copy()
            without_coefficient[..., k] = 0.0
            theta[..., k] = u[..., k] - self._log_rate(kernel, without_coefficient[..., positions])
        return theta

    def values(self, u: Floats) -> dict[str, float]:
        """{parameter: value} in the author's units, of one u."""
        theta = self.theta(u)
        return {
            name: float(param.from_internal(t)) for (name, param), t in zip(self.law.table.items(), theta, strict=True)
        }

    def u(self, theta: Floats) -> Floats:
        """Conditioned coordinates of internal parameters."""
        u = np.array(theta, float)
        for local in self.exponents:
            a, b, _, _ = local.evaluate(self._point(self.law), u)
            u[..., local.position] = a + b * u[..., local.position]
        for k, positions, kernel in self._rate_kernels:
            u[..., k] = self._log_rate(kernel, theta[..., positions])
        return u

    def jacobian(self, u: Floats) -> Floats:
        """d theta / d u at u (..., parameters): (..., parameters, parameters)."""
        theta = self.theta(u)
        matrix = np.zeros((*theta.shape, theta.shape[-1])) + np.eye(theta.shape[-1])
        for k, positions, kernel in self._rate_kernels:
            internal = np.moveaxis(theta[..., positions], -1, 0)
            derivatives = kernel.internal_derivatives(*self._point(kernel.law), *internal)
            for name, position in zip(kernel.law.names, positions, strict=True):
                if position != k:
                    matrix[..., k, position] = -np.asarray(derivatives.params[name]) / np.asarray(derivatives.rate)
        return matrix @ self._exponents_jacobian(theta) if self.exponents else matrix

    def _exponents_jacobian(self, theta: Floats) -> Floats:
        """Derivatives of the parameters that local exponents stand for, (..., parameters, parameters)."""
        matrix = np.zeros((*theta.shape, theta.shape[-1])) + np.eye(theta.shape[-1])
        for local in self.exponents:
            _, b, da, db = local.evaluate(self._point(self.law), theta)
            matrix[..., local.position, local.position] = 1.0 / b
            for k, position in enumerate(local.others):
                matrix[..., local.position, position] = -(da[..., k] + db[..., k] * theta[..., local.position]) / b
        return matrix

    def _point(self, law: CreepLaw) -> list[float]:
        r = self.reference
        return [
            r.stress,
            r.strain,
            r.time,
            r.temperature,
            r.stress,
            r.stress / 3,
            *(z.initial for z in law.states.values()),
        ]

    def _has_finite_rate(self, kernel: ArrayKernel, rate_law: CreepLaw) -> bool:
        """Whether a virgin internal variable grows at all in the middle of the bounds."""
        central_theta = [0.5 * (p.to_internal(p.bounds[0]) + p.to_internal(p.bounds[1])) for p in rate_law.params.values()]
        return bool(np.isfinite(self._log_rate(kernel, np.array(central_theta))))

    def _log_rate(self, kernel: ArrayKernel, theta: Floats) -> Floats:
        return np.asarray(kernel.internal_log_rate(*self._point(kernel.law), *np.moveaxis(theta, -1, 0)), float)


def _state_rate_laws(law: CreepLaw) -> list[CreepLaw]:
    """A law for each internal variable, its rate being how fast that one moves; none where that has no logarithm.

    Only the coefficient's coordinate hangs on it: without, the coefficient is a coordinate itself.
    """
    rate_laws, rate_parameters = [], {p for state in law.states.values() for p in state.rate.free_symbols}
    state_parameters = {p: param for p, param in law.params.items() if p in rate_parameters}
    for symbol, state in law.states.items():
        term_name = f"rate of {symbol}"
        signed_rate_laws = (replace(law, terms={term_name: sign * state.rate}, params=state_parameters, constraints=()) for sign in (1, -1))
        rate_laws += list(filter(_has_log_form, signed_rate_laws))[:1]
    return rate_laws


def _has_log_form(rate_law: CreepLaw) -> bool:
    from creepkit.kernels.logform import log_form

    try:
        log_form(rate_law)
    except LawError:
        return False
    return True


def _coefficient_position(law: CreepLaw, single_term: CreepLaw) -> int | None:
    """Position of the one log-scale parameter that multiplies this rate and stands in no other, if there is one."""
    from creepkit.kernels.logform import log_form

    (coefficients,) = log_form(single_term).coefficients
    names = [single_term.names[k] for k in coefficients]
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    occurrences = [sum(symbol in each.free_symbols for each in expressions) for symbol in (law.symbol(n) for n in names)]
    unshared = [n for n, count in zip(names, occurrences, strict=True) if count == 1]
    return law.names.index(unshared[0]) if unshared else None
