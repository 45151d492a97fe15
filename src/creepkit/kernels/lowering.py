"""lower(law, target): one law for NumPy, torch or compiled code."""

from __future__ import annotations

import linecache
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from creepkit.errors import LawError, nearest
from creepkit.kernels.entries import Lowered, entries
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw

Target = Literal["numpy", "torch", "numba"]


@overload
def lower(law: CreepLaw, target: Literal["numpy", "torch"]) -> Kernel: ...
@overload
def lower(law: CreepLaw, target: Literal["numba"]) -> CompiledLaw: ...
def lower(law: CreepLaw, target: Target = "numpy") -> Kernel | CompiledLaw:
    """Return the law as a numeric kernel for "numpy", "torch" or "numba" (compiled, for integrators)."""
    if target == "numba":
        from creepkit.kernels.compiled import compiled

        return compiled(law)
    if target not in ("numpy", "torch"):
        raise LawError(f"no kernel target '{target}': {nearest(str(target), ('numpy', 'torch', 'numba'))}")
    return _kernel(law, target)


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of the rate, 1/s per unit; every entry has the broadcast shape of the inputs.

    params : with respect to the internal parameter, the natural logarithm where the scale is log.
    state_rates : {state: Derivatives-like mapping {variable or parameter: array}}.
    """

    rate: Any
    point: Mapping[str, Any]
    params: Mapping[str, Any]
    state_rates: Mapping[str, Mapping[str, Any]]

    def __getitem__(self, name: str) -> Any:
        """The derivative with respect to a variable of the point, a state or a parameter."""
        return self.point[name] if name in self.point else self.params[name]


class Kernel:
    """A law as functions of arrays (or tensors); everything broadcasts.

    Each method takes `values`, {parameter: number or array} in the author's units (0 switches a rate coefficient
    off), and the point by keyword: stress and mean_stress, principal_stress in MPa, strain, time in s, temperature
    in K, and states by name. Strain and time default to 0 (floored at 1e-30 where they are bases of powers).
    """

    def __init__(self, lowered: Lowered, target: str, functions: ModuleType) -> None:
        from creepkit.kernels.printing import array_function

        law = lowered.law
        parts = (lowered.rate, lowered.log_rate, lowered.sensitivity)
        self.law, self.target = law, target
        self.source = f'"""Kernel of {law.name!r} for {target}; generated."""\n\n' + "\n\n".join(map(array_function, parts))
        name = f"<creepkit kernel {law.fingerprint} {target}>"
        linecache.cache[name] = (len(self.source), None, self.source.splitlines(True), name)
        self._namespace: dict[str, Any] = {k: getattr(functions, k) for k in functions.__all__}
        exec(compile(self.source, name, "exec"), self._namespace)
        self._states = [s.name for s in law.states]

    def rate(self, values: Mapping[str, Any], **point: Any) -> Any:
        """Rate of equivalent creep strain, 1/s; inf or 0 where it is beyond float64 (log_rate is finite there)."""
        return self._call("rate", self._arguments(values, point))[0]

    def log_rate(self, values: Mapping[str, Any], **point: Any) -> Any:
        """Natural logarithm of the rate; finite where the rate itself over- or underflows."""
        return self._call("log_rate", self._arguments(values, point))[0]

    def state_rates(self, values: Mapping[str, Any], **point: Any) -> dict[str, Any]:
        """Rates of the internal variables, 1/s."""
        out = self._call("rate", self._arguments(values, point))
        return dict(zip(self._states, out[1:], strict=True))

    def derivatives(self, values: Mapping[str, Any], **point: Any) -> Derivatives:
        """The rate and its derivatives with respect to the point, the states and every internal parameter."""
        return self.internal_derivatives(*self._arguments(values, point))

    def internal_rate(self, *arguments: Any) -> Any:
        """The rate from the six variables of the point, the states, then internal parameters, positionally."""
        return self._call("rate", arguments)[0]

    def internal_rates(self, *arguments: Any) -> Any:
        """The rate and every state rate, a tuple, from internal parameters, positionally."""
        return self._call("rate", arguments)

    def internal_log_rate(self, *arguments: Any) -> Any:
        """The log rate from the six variables of the point, the states, then internal parameters, positionally."""
        return self._call("log_rate", arguments)[0]

    def internal_derivatives(self, *arguments: Any) -> Derivatives:
        """Derivatives from the six variables of the point, the states, then internal parameters, positionally."""
        out = self._call("sensitivity", arguments)
        states, names = self._states, self.law.names
        point = [*(s.name for s in POINT), *states]
        rows, start = 1 + len(states), 1 + len(states)
        table = [out[start + k * len(point) : start + (k + 1) * len(point)] for k in range(rows)]
        start += rows * len(point)
        theta = [out[start + k * len(names) : start + (k + 1) * len(names)] for k in range(rows)]
        inner = {
            state: dict(zip((*point, *names), (*table[k], *theta[k]), strict=True))
            for k, state in enumerate(states, start=1)
        }
        return Derivatives(
            out[0], dict(zip(point, table[0], strict=True)), dict(zip(names, theta[0], strict=True)), inner
        )

    def _call(self, entry: str, arguments: Sequence[Any]) -> Any:
        with np.errstate(over="ignore", under="ignore", divide="ignore"):
            return self._namespace[entry](*arguments)

    def _arguments(self, values: Mapping[str, Any], point: Mapping[str, Any]) -> Sequence[Any]:
        known = [*(s.name for s in POINT), *self._states]
        for name in point:
            if name not in known:
                raise LawError(f"law '{self.law.name}' has no variable '{name}': {nearest(name, known)}")
        if "stress" not in point:
            raise LawError(f"law '{self.law.name}' needs a stress, in MPa")
        if self.law.uses(POINT[3]) and "temperature" not in point:
            raise LawError(f"law '{self.law.name}' depends on temperature: give temperature in K")
        stress = point["stress"]
        defaults = {"principal_stress": stress, "mean_stress": stress / 3.0, "temperature": 1.0}
        defaults |= {s.name: z.initial for s, z in self.law.states.items()}
        variables = [point.get(name, defaults.get(name, 0.0)) for name in known]
        return [*variables, *self._theta(values)]

    def _theta(self, values: Mapping[str, Any]) -> list[Any]:
        missing = [name for name in self.law.names if name not in values]
        if missing:
            raise LawError(f"law '{self.law.name}' needs a value for {', '.join(missing)}")
        log = self._namespace["log"]
        with np.errstate(divide="ignore"):
            return [log(values[n]) if p.scale == "log" else values[n] for n, p in self.law.table.items()]


@lru_cache(maxsize=256)
def _kernel(law: CreepLaw, target: str) -> Kernel:
    if target == "torch":
        from creepkit.kernels import torch_functions as functions
    else:
        from creepkit.kernels import numpy_functions as functions  # type: ignore[no-redef]
    return Kernel(entries(law), target, functions)
