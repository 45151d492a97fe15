"""The symbols of the language, and the parameters and internal variables of a law's table.

Real sympy symbols throughout: assumptions such as `positive` would let sympy rewrite what the author wrote. sympy
orders its arguments by class name, so that a subclass of another name would change printed laws.

`stress` is the von Mises stress of the Cauchy stress over 1 MPa, `strain` the accumulated equivalent creep
strain (logarithmic), `time` the time since the first load ramp began over 1 s, `temperature` in K.
`principal_stress` and `mean_stress` (both over 1 MPa) serve multiaxial damage laws.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, Self

import sympy
from sympy.core.sympify import converter

from creepkit.checked_arguments import checked
from creepkit.errors import LawError


class Symbol(sympy.Symbol):  # type: ignore[misc]  # sympy has no types
    """A real symbol that subs() finds by its name as well: law.rate.subs(fit.values), law.rate.subs("n", 4).

    It equals sympy.Symbol(name, real=True).
    """

    __slots__ = ()

    def __new__(cls, name: str, **_: bool) -> Self:
        """The symbol of a name."""
        symbol: Self = super().__new__(cls, name, real=True)
        return symbol

    def __eq__(self, other: object) -> bool:
        if isinstance(other, sympy.Symbol) and not isinstance(other, sympy.Dummy | sympy.Wild):
            return bool(self._hashable_content() == other._hashable_content())
        return False

    __hash__ = sympy.Symbol.__hash__

    def _eval_subs(self, old: Any, new: Any) -> Any:
        """What sympy asks where `old` is not this symbol itself, such as Symbol("n") which it makes of "n"."""
        return new if isinstance(old, sympy.Symbol) and old.name == self.name else None


class ConditionSymbol(Symbol):
    """A number that each test states and a law may use: grain size, content of an element, dose.

    unit : that of its number in the law, "1" for none.
    """

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, name: str, unit: str = "1", **_: bool) -> Self:
        """The symbol of a name and a unit."""
        symbol: Self = cls.__xnew__(cls, name, real=True)
        symbol.unit = unit
        return symbol

    def __getnewargs_ex__(self) -> tuple[tuple[str, str], dict[str, bool]]:
        return (self.name, self.unit), {}

    def _hashable_content(self) -> tuple[Any, ...]:
        return (*super()._hashable_content(), self.unit)


stress = Symbol("stress")


strain = Symbol("strain")


time = Symbol("time")


temperature = Symbol("temperature")


principal_stress = Symbol("principal_stress")


mean_stress = Symbol("mean_stress")


POINT_VARIABLES = (stress, strain, time, temperature, principal_stress, mean_stress)
"""The symbols that describe a material point, in the order of every compiled kernel."""


GAS_CONSTANT = 8.314462618
"""R in J/(mol K), CODATA 2018; the paper used 8.31."""


LATEX_SYMBOLS = {
    stress: r"\sigma_e",
    strain: r"\varepsilon_{cr}",
    time: "t",
    temperature: "T",
    principal_stress: r"\sigma_1",
    mean_stress: r"\sigma_m",
}


class SymbolTuple(tuple[sympy.Symbol, ...]):
    """The symbols of parameters() or states(); where they are taken for one symbol, the error says how to unpack them.

    maker : the function that gave them.
    """

    maker = "parameters"

    def refuse(self, _: object = None) -> Any:
        """LawError that says how to unpack them."""
        names = " ".join(symbol.name for symbol in self)
        targets = ", ".join(symbol.name for symbol in self) if len(self) > 1 else f"({names},)"
        raise LawError(f'{self.maker}("{names}") is a tuple of {len(self)}; write {targets} = {self.maker}("{names}")')

    def __add__(self, other: Any) -> Any:
        return super().__add__(other) if isinstance(other, tuple) else self.refuse()

    __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = refuse
    __pow__ = __rpow__ = __neg__ = __pos__ = __abs__ = refuse


converter[SymbolTuple] = SymbolTuple.refuse  # as an argument of a function of sympy, which takes tuples


class _StateTuple(SymbolTuple):
    maker = "states"


@checked
def parameters(names: str) -> tuple[sympy.Symbol, ...]:
    """Return one plain real symbol for each name in `names`, always as a tuple.

    >>> A, n = parameters("A n")
    >>> (B,) = parameters("B")
    """
    return SymbolTuple(_symbols(names))


def _symbols(names: str) -> list[sympy.Symbol]:
    return [Symbol(name) for name in names.replace(",", " ").split()]


@checked
def states(names: str) -> tuple[sympy.Symbol, ...]:
    """Return the symbols of internal variables, named in `names`, as a tuple: (damage,) = states("damage")."""
    return _StateTuple(_symbols(names))


class _ConditionTuple(SymbolTuple):
    maker = "conditions"


@checked
def conditions(names: str, *, unit: str = "1") -> tuple[sympy.Symbol, ...]:
    """Return the symbols of conditions, numbers that each test states beside its load and temperature, as a tuple.

    unit : of the numbers in the law; tests may state others of its kind (um where a law has mm).

    >>> (d,) = conditions("grain_size", unit="mm")
    """
    _check_text("condition", names, unit)
    return _ConditionTuple(ConditionSymbol(name, unit) for name in names.replace(",", " ").split())


ParameterScale = Literal["linear", "log"]


@checked
@dataclass(frozen=True)
class Param:
    """One parameter of a law: its meaning, unit, bounds and how it is to be searched.

    meaning : what the parameter is, in words.
    unit : its unit ("1" for none); a parameter of log scale must state one.
    bounds : (low, high) of the fitted range, in `unit`.
    scale : "log" when the search and the kernels should use its logarithm.
    off : a value, usually outside the bounds, that switches the parameter off ({0} of the paper's Table 1).
    limits : (low, high) of what is physical, such as (0, math.inf) of a modulus or (0, 1) of a fraction; no value
        outside is ever taken but `off`. The bounds lie within. None where anything goes.
    widens : whether a search that ends at a bound goes on beyond it, within the limits: the bounds are where it begins,
        and no knowledge. Not where they are stated, as by law.with_bounds().
    """

    meaning: str
    bounds: tuple[float, float]
    unit: str = ""
    scale: ParameterScale = "linear"
    off: float | None = None
    limits: tuple[float, float] | None = None
    widens: bool = False

    def __post_init__(self) -> None:
        _check_text("parameter", self.meaning, self.unit)
        low, high = map(float, self.bounds)
        if not (math.isfinite(low) and math.isfinite(high)):
            raise LawError(f"parameter '{self.meaning}': bounds ({low:g}, {high:g}) must be finite")
        if low >= high:
            raise LawError(
                f"parameter '{self.meaning}': bounds are reversed or empty, ({low:g}, {high:g}); write (low, high)"
            )
        if self.scale == "log" and low <= 0:
            raise LawError(f"parameter '{self.meaning}': a log scale needs bounds above zero, found low = {low:g}")
        if self.scale == "log" and not self.unit:
            raise LawError(f'parameter \'{self.meaning}\': missing unit; write unit="1/s", or unit="1" if it has none')
        object.__setattr__(self, "bounds", (low, high))
        object.__setattr__(self, "unit", self.unit or "1")
        if self.off is not None:
            if not math.isfinite(self.off):
                raise LawError(f"parameter '{self.meaning}': off = {self.off} must be a finite number")
            object.__setattr__(self, "off", float(self.off))
        if self.limits is not None:
            object.__setattr__(self, "limits", _checked_limits(self.meaning, self.limits, self.bounds))

    @property
    def center(self) -> float:
        """The middle of the bounds on the parameter's own scale, in `unit`."""
        low, high = self.bounds
        return math.sqrt(low) * math.sqrt(high) if self.scale == "log" else 0.5 * (low + high)

    def to_internal(self, value: float) -> float:
        """Return the kernel's form of `value`: its natural logarithm on a log scale (off: -inf)."""
        if self.scale == "linear":
            return float(value)
        return math.log(value) if value > 0 else -math.inf

    def from_internal(self, value: float) -> float:
        """Return the author's value of a kernel's parameter."""
        return math.exp(value) if self.scale == "log" else float(value)

    def is_physical(self, value: float) -> bool:
        """Say whether `value` is physical: within the limits, if there are any, or the off value."""
        if self.limits is None or (self.off is not None and value == self.off):
            return True
        return self.limits[0] <= value <= self.limits[1]

    @property
    def physical_range_text(self) -> str:
        """The limits in words."""
        low, high = self.limits or (-math.inf, math.inf)
        off = "" if self.off is None else f" (or {self.off:g}, off)"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"from {low:g} to {high:g}{unit}{off}"

    def within_bounds(self, value: float, relative_tolerance: float = 1e-9) -> bool:
        """Say whether `value` lies within the bounds (to a relative tolerance) or is the off value."""
        if self.off is not None and value == self.off:
            return True
        low, high = self.bounds
        if self.scale == "log":
            return low * (1 - relative_tolerance) <= value <= high * (1 + relative_tolerance)
        tolerance = relative_tolerance * max(abs(low), abs(high))
        return low - tolerance <= value <= high + tolerance


StateKind = Literal["scalar", "back stress"]


@checked
@dataclass(frozen=True)
class State:
    """One internal variable of a law: how it starts, how it grows, and where the material ends.

    initial : value at time zero.
    rate : sympy expression for its rate, per second.
    limit : value at which the material point has failed (rupture), or None.
    kind : "scalar", or "back stress", MPa, which has a direction: X of a law of stress - X, a bar of which flows in the
        direction of stress - X. Its rate is that of its component along the flow, such as
        (C - gamma * X) * creep - r * X with creep = A * (stress - X)**n.
    """

    initial: float
    rate: sympy.Expr
    meaning: str = "internal variable"
    unit: str = "1"
    limit: float | None = None
    kind: StateKind = "scalar"

    def __post_init__(self) -> None:
        _check_text("state", self.meaning, self.unit)
        if self.kind == "back stress" and (self.unit != "MPa" or self.limit is not None):
            raise LawError(f"state '{self.meaning}': a back stress has unit=\"MPa\" and no limit")
        for name in ("initial", "limit"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(float(value)):
                raise LawError(f"state '{self.meaning}': {name} = {value!r} must be a finite number")
        object.__setattr__(self, "unit", self.unit or "1")
        object.__setattr__(self, "initial", float(self.initial))
        object.__setattr__(self, "limit", None if self.limit is None else float(self.limit))
        if self.limit == self.initial:
            raise LawError(
                f"state '{self.meaning}': it starts at its limit, {self.limit:g}, so the material would never last; "
                "write limit=None for a state without one"
            )


def _checked_limits(meaning: str, given: tuple[float, float], bounds: tuple[float, float]) -> tuple[float, float]:
    """Limits as floats, around the bounds."""
    low, high = map(float, given)
    if not low <= bounds[0] < bounds[1] <= high:
        description = f"bounds ({bounds[0]:g}, {bounds[1]:g}) must lie within the limits ({low:g}, {high:g})"
        raise LawError(f"parameter '{meaning}': {description}")
    return low, high


def _check_text(what: str, meaning: str, unit: str) -> None:
    if not isinstance(meaning, str) or not meaning.strip():
        raise LawError(f"a {what} has an empty meaning: say in words what it is")
    if not meaning.isprintable() or not unit.isprintable():
        raise LawError(f"{what} {meaning!r}: meaning and unit must each be one line of text")
