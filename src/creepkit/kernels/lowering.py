"""lower(law, target): one law for NumPy, torch or compiled code."""

from __future__ import annotations

import linecache
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, overload

from creepkit.checked_arguments import checked
from creepkit.errors import LawError, refuse_unknown
from creepkit.kernels.kernel_functions import law_comments
from creepkit.kernels.symbolic_kernel import SymbolicKernel, symbolic_kernel
from creepkit.language.algebra import with_conditions_as_parameters
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw


KernelTarget = Literal["numpy", "torch", "compiled"]


@overload
def lower(law: CreepLaw, target: Literal["numpy", "torch"]) -> ArrayKernel: ...


@overload
def lower(law: CreepLaw, target: Literal["compiled"]) -> CompiledLaw: ...


@checked
def lower(law: CreepLaw, target: KernelTarget = "numpy") -> ArrayKernel | CompiledLaw:
    """Return the law as a numeric kernel for "numpy", "torch" or "compiled" (C functions, for solvers).

    Conditions of tests that it uses are parameters of the kernel, behind its own.
    """
    law = with_conditions_as_parameters(law)
    if target == "compiled":
        from creepkit.kernels.compilation import compile_law

        return compile_law(law)
    return _array_kernel(law, target)


@dataclass(frozen=True)
class RateDerivatives:
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


class ArrayKernel:
    """A law as functions of arrays (or tensors); everything broadcasts.

    Each method takes `values`, {parameter: number or array} in the author's units (0 switches a rate coefficient
    off), and the point by keyword: stress and mean_stress, principal_stress in MPa, strain, time in s, temperature
    in K, and states by name. Strain and time default to 0 (floored where they are bases of powers).

    Methods that begin with `internal` take the six variables of the point, the states, then the internal parameters
    (logarithms where the scale is log), by position, and check nothing.
    """

    def __init__(self, lowered: SymbolicKernel, target: ModuleType) -> None:
        law = lowered.law
        printed = (lowered.rate, lowered.log_rate, lowered.sensitivity, lowered.log_sensitivity)
        self.law = law
        self.source = "\n".join([*law_comments(law), "\n", *(entry.source for entry in printed)])
        self._target = target
        self._entries = target.broadcast_functions(self._execute_source(), len(lowered.names.inputs) - len(law.params))
        self._states = [s.name for s in law.states]
        self._variables = [*(s.name for s in POINT_VARIABLES), *self._states]

    def _execute_source(self) -> dict[str, Callable[..., Any]]:
        """Run the printed text, with lines that tracebacks can show."""
        name = f"<creepkit kernel {self.law.fingerprint} {self._target.__name__}>"
        linecache.cache[name] = (len(self.source), None, self.source.splitlines(True), name)
        namespace = dict(self._target.FUNCTIONS)
        exec(compile(self.source, name, "exec"), namespace)
        return {entry: namespace[entry] for entry in ("rate", "log_rate", "sensitivity", "log_sensitivity")}

    def rate(self, values: Mapping[str, Any], /, **point: Any) -> Any:
        """Rate of equivalent creep strain, 1/s; inf or 0 where it is beyond float64 (log_rate is finite there)."""
        return self._entries["rate"](*self._arguments(values, point))[0]

    def log_rate(self, values: Mapping[str, Any], /, **point: Any) -> Any:
        """Natural logarithm of the rate; finite where the rate itself over- or underflows, -1e30 where it is off."""
        return self._entries["log_rate"](*self._arguments(values, point))[0]

    def state_rates(self, values: Mapping[str, Any], /, **point: Any) -> dict[str, Any]:
        """Rates of the internal variables, 1/s."""
        out = self._entries["rate"](*self._arguments(values, point))
        return dict(zip(self._states, out[1:], strict=True))

    def derivatives(self, values: Mapping[str, Any], /, **point: Any) -> RateDerivatives:
        """The rate and its derivatives with respect to the point, the states and every internal parameter."""
        return self.internal_derivatives(*self._arguments(values, point))

    def internal_rates(self, *arguments: Any) -> Any:
        """The rate and every state rate, a tuple."""
        return self._entries["rate"](*arguments)

    def internal_log_rate(self, *arguments: Any) -> Any:
        """The logarithm of the rate."""
        return self._entries["log_rate"](*arguments)[0]

    def internal_derivatives(self, *arguments: Any) -> RateDerivatives:
        """The rate and its derivatives."""
        rows, size, names = 1 + len(self._states), len(self._variables), self.law.names
        out = iter(self._entries["sensitivity"](*arguments))
        values = list(islice(out, rows))
        point = [dict(zip(self._variables, islice(out, size), strict=True)) for _ in range(rows)]
        theta = [dict(zip(names, islice(out, len(names)), strict=True)) for _ in range(rows)]
        all_derivatives = [a | b for a, b in zip(point, theta, strict=True)]
        return RateDerivatives(values[0], point[0], theta[0], dict(zip(self._states, all_derivatives[1:], strict=True)))

    def _arguments(self, values: Mapping[str, Any], point: Mapping[str, Any]) -> Sequence[Any]:
        for name in point:
            refuse_unknown(name, self._variables, LawError, f"law '{self.law.name}' has no variable '{name}'")
        if "stress" not in point:
            raise LawError(f"law '{self.law.name}' needs a stress, in MPa")
        if self.law.uses(POINT_VARIABLES[3]) and "temperature" not in point:
            raise LawError(f"law '{self.law.name}' depends on temperature: give temperature in K")
        given = {name: self._target.as_array(value) for name, value in point.items()}
        defaults = {"principal_stress": given["stress"], "mean_stress": given["stress"] / 3.0, "temperature": 1.0}
        defaults |= {s.name: z.initial for s, z in self.law.states.items()}
        return [*(given.get(n, defaults.get(n, 0.0)) for n in self._variables), *self._internal_values(values)]

    def _internal_values(self, values: Mapping[str, Any]) -> list[Any]:
        for name in values:
            self.law.symbol(name)
        self.law.check_complete(values)
        log = self._target.FUNCTIONS["log_or_off"]
        numbers = {n: self._target.as_array(values[n]) for n in self.law.names}
        return [log(numbers[n]) if p.scale == "log" else numbers[n] for n, p in self.law.table.items()]


def tension_point(law: CreepLaw, stress: Any, strain: Any, time: Any, temperature: Any) -> tuple[Any, ...]:
    """What precedes the parameters in methods that begin with `internal`: simple tension, states as they begin."""
    return stress, strain, time, temperature, stress, stress / 3.0, *(s.initial for s in law.states.values())


@lru_cache(maxsize=256)
def _array_kernel(law: CreepLaw, target: KernelTarget) -> ArrayKernel:
    return ArrayKernel(symbolic_kernel(law), import_module(f"creepkit.kernels.{target}_functions"))
