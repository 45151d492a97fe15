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
from creepkit.inverse.nominal import end_strain, stresses
from creepkit.kernels import Kernel, lower
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor


@dataclass(frozen=True)
class Reference:
    """The point at which term rates are stated: stress MPa, strain, time s, temperature K."""

    stress: float
    strain: float
    time: float
    temperature: float

    @classmethod
    def of(cls, histories: Sequence[History], using: Predictor | None = None) -> Reference:
        """The middle of what was measured: geometric means of stress and time, of half the end strain; median T.

        using : where it states reference stresses, they count (see inverse.nominal).
        """
        levels = [float(np.exp(np.mean(np.log(np.maximum(stresses(h, using), 1e-6))))) for h in histories]
        times = [float(h.times[h.used][-1]) for h in histories]
        strains = [end_strain(h, using) for h in histories]
        warmth = [float(np.mean(h.temperature_program().values)) for h in histories]
        middle = [float(np.exp(np.mean(np.log(v)))) for v in (levels, strains, times)]
        return cls(middle[0], 0.5 * middle[1], 0.5 * middle[2], float(np.median(warmth)))


class Coordinates:
    """The map between internal parameters theta and conditioned coordinates u, both (..., parameters)."""

    def __init__(self, law: CreepLaw, reference: Reference) -> None:
        self.law, self.reference = law, reference
        self.names = law.names
        self._terms: list[tuple[int, list[int], Kernel]] = []
        for label in law.terms:
            single = law.only(label)
            k = _coefficient(law, single)
            if k is not None:
                self._terms.append((k, [law.names.index(n) for n in single.names], lower(single, "numpy")))
        self.exponents = local_exponents(law)
        """Parameters whose place the local exponent of their term takes."""
        self.rates = tuple(k for k, _, _ in self._terms)
        """Positions of the coordinates that are log rates of terms."""
        for growth in _growths(law):
            k = _coefficient(law, growth)
            kernel = lower(growth, "numpy")
            positions = [law.names.index(n) for n in growth.names]
            if k is not None and k not in self.rates and self._is_finite(kernel, growth):
                self._terms.append((k, positions, kernel))
        self.growths = tuple(k for k, _, _ in self._terms if k not in self.rates)
        """Positions of the coordinates that are log rates of internal variables."""

    @property
    def walled(self) -> tuple[int, ...]:
        """Positions of the parameters that are no coordinates themselves, so that walls must hold their bounds."""
        return (*self.coefficients, *(local.p for local in self.exponents))

    @property
    def coefficients(self) -> tuple[int, ...]:
        """Positions of all of them."""
        return self.rates + self.growths

    def theta(self, u: Floats) -> Floats:
        """Internal parameters of conditioned coordinates."""
        theta = np.array(u, float)
        for local in self.exponents:
            a, b, _, _ = local.at(self._point(self.law), theta)
            theta[..., local.p] = (theta[..., local.p] - a) / b
        inner = theta.copy()
        for k, positions, kernel in self._terms:
            part = inner.copy()
            part[..., k] = 0.0
            theta[..., k] = u[..., k] - self._log_rate(kernel, part[..., positions])
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
            a, b, _, _ = local.at(self._point(self.law), u)
            u[..., local.p] = a + b * u[..., local.p]
        for k, positions, kernel in self._terms:
            u[..., k] = self._log_rate(kernel, theta[..., positions])
        return u

    def jacobian(self, u: Floats) -> Floats:
        """d theta / d u at u (..., parameters): (..., parameters, parameters)."""
        theta = self.theta(u)
        matrix = np.zeros((*theta.shape, theta.shape[-1])) + np.eye(theta.shape[-1])
        for k, positions, kernel in self._terms:
            own = np.moveaxis(theta[..., positions], -1, 0)
            found = kernel.internal_derivatives(*self._point(kernel.law), *own)
            for name, position in zip(kernel.law.names, positions, strict=True):
                if position != k:
                    matrix[..., k, position] = -np.asarray(found.params[name]) / np.asarray(found.rate)
        return matrix @ self._exponents_jacobian(theta) if self.exponents else matrix

    def _exponents_jacobian(self, theta: Floats) -> Floats:
        """Derivatives of the parameters that local exponents stand for, (..., parameters, parameters)."""
        matrix = np.zeros((*theta.shape, theta.shape[-1])) + np.eye(theta.shape[-1])
        for local in self.exponents:
            _, b, da, db = local.at(self._point(self.law), theta)
            matrix[..., local.p, local.p] = 1.0 / b
            for k, position in enumerate(local.others):
                matrix[..., local.p, position] = -(da[..., k] + db[..., k] * theta[..., local.p]) / b
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

    def _is_finite(self, kernel: Kernel, growth: CreepLaw) -> bool:
        """Whether a virgin internal variable grows at all in the middle of the bounds."""
        middle = [0.5 * (p.to_internal(p.bounds[0]) + p.to_internal(p.bounds[1])) for p in growth.params.values()]
        return bool(np.isfinite(self._log_rate(kernel, np.array(middle))))

    def _log_rate(self, kernel: Kernel, theta: Floats) -> Floats:
        return np.asarray(kernel.internal_log_rate(*self._point(kernel.law), *np.moveaxis(theta, -1, 0)), float)


def _growths(law: CreepLaw) -> list[CreepLaw]:
    """A law for each internal variable, its rate being how fast that one moves; none where that has no logarithm.

    Only the coefficient's coordinate hangs on it: without, the coefficient is a coordinate itself.
    """
    found, inner = [], {p for state in law.states.values() for p in state.rate.free_symbols}
    own = {p: param for p, param in law.params.items() if p in inner}
    for symbol, state in law.states.items():
        label = f"rate of {symbol}"
        grown = (replace(law, terms={label: sign * state.rate}, params=own, constraints=()) for sign in (1, -1))
        found += list(filter(_has_logarithm, grown))[:1]
    return found


def _has_logarithm(growth: CreepLaw) -> bool:
    from creepkit.kernels.logform import log_form

    try:
        log_form(growth)
    except LawError:
        return False
    return True


def _coefficient(law: CreepLaw, single: CreepLaw) -> int | None:
    """Position of the one log-scale parameter that multiplies this rate and stands in no other, if there is one."""
    from creepkit.kernels.logform import log_form

    (own,) = log_form(single).coefficients
    names = [single.names[k] for k in own]
    everything = [*law.terms.values(), *(state.rate for state in law.states.values())]
    shared = [sum(symbol in each.free_symbols for each in everything) for symbol in (law.symbol(n) for n in names)]
    alone = [n for n, count in zip(names, shared, strict=True) if count == 1]
    return law.names.index(alone[0]) if alone else None
