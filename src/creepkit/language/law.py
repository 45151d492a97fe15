"""CreepLaw: an immutable record of named sympy terms and a parameter table.

The rate of equivalent creep strain is the sum of the terms. Everything else (derivatives, kernels, LaTeX,
exports, reports) is derived from this record by functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

import sympy
from sympy.logic.boolalg import Boolean

from creepkit.errors import LawError, nearest
from creepkit.language.checks import validate_law, symbols_used
from creepkit.language.fingerprint import fingerprint_of
from creepkit.language.params import Param, State


@dataclass(frozen=True, eq=False)
class CreepLaw:
    """A creep law: rate of equivalent creep strain, in 1/s, as a sum of named terms.

    name : short, lower case, unique in the registry.
    title : one line for people.
    terms : {term name: sympy expression in 1/s}, kept in this order.
    params : {symbol: Param}, in the author's order; every parameter must be used and every symbol declared.
    states : {symbol: State}, internal variables.
    constraints : relations between parameters and point that must hold, such as n(t) >= 0.
    references : where the law was published.
    """

    name: str
    terms: Mapping[str, sympy.Expr]
    params: Mapping[sympy.Symbol, Param]
    title: str = ""
    states: Mapping[sympy.Symbol, State] = field(default_factory=dict)
    constraints: Sequence[Boolean] = ()
    references: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise LawError(f"a law needs a name in words, found {self.name!r}")
        if not isinstance(self.terms, Mapping) or not self.terms:
            raise LawError(f"law '{self.name}' has no terms: give terms={{'name': expression}}")
        terms = {}
        for label, expression in self.terms.items():
            try:
                terms[str(label)] = sympy.sympify(expression, strict=True)
            except sympy.SympifyError:
                raise LawError(
                    f"law '{self.name}', term '{label}': {expression!r} is not a sympy expression; "
                    "text is never evaluated, write the term with the symbols of creepkit.language"
                ) from None
        freeze = object.__setattr__
        freeze(self, "terms", MappingProxyType(terms))
        freeze(self, "params", MappingProxyType(dict(self.params)))
        freeze(self, "states", MappingProxyType(dict(self.states)))
        freeze(self, "constraints", tuple(self.constraints))
        references = (self.references,) if isinstance(self.references, str) else tuple(self.references)
        freeze(self, "references", references)
        validate_law(self)

    # ---- what the law is -------------------------------------------------------------------------------------------

    @property
    def rate(self) -> sympy.Expr:
        """The rate of equivalent creep strain, 1/s: the sum of the terms, unevaluated."""
        values = list(self.terms.values())
        return values[0] if len(values) == 1 else sympy.Add(*values)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters, in the author's order."""
        return tuple(symbol.name for symbol in self.params)

    @property
    def table(self) -> dict[str, Param]:
        """{parameter name: Param}, in the author's order."""
        return {symbol.name: param for symbol, param in self.params.items()}

    @property
    def fingerprint(self) -> str:
        """Identity of the law's mathematics: structure and a numeric signature, without titles and bounds."""
        cached = self.__dict__.get("_fingerprint")
        if cached is None:
            cached = fingerprint_of(self)
            object.__setattr__(self, "_fingerprint", cached)
        return str(cached)

    def uses(self, symbol: sympy.Symbol) -> bool:
        """Say whether a symbol of the point (stress, strain, time, temperature ...) enters a rate."""
        return symbol in symbols_used(self)

    def symbol(self, name: str) -> sympy.Symbol:
        """Return the symbol of the parameter called `name`, or raise LawError naming the nearest one."""
        for symbol in self.params:
            if symbol.name == name:
                return symbol
        raise LawError(f"law '{self.name}' has no parameter '{name}': {nearest(name, self.names)}")

    def center(self) -> dict[str, float]:
        """The middle of the bounds, each on its own scale: {name: value}."""
        return {name: param.center for name, param in self.table.items()}

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return `given` completed and in the law's order; every parameter must be there, finite, once."""
        for name in given:
            self.symbol(name)
        missing = [name for name in self.names if name not in given]
        if missing:
            raise LawError(f"law '{self.name}' needs a value for {', '.join(missing)}")
        values = {name: self.number(given[name], f"parameter '{name}'") for name in self.names}
        for name, value in values.items():
            if not abs(value) < float("inf"):
                raise LawError(f"law '{self.name}', parameter '{name}': {value} is not a finite number")
            if not self.table[name].is_physical(value):
                description = f"{value:g} is not physical, which is {self.table[name].physical_range_text}"
                raise LawError(f"law '{self.name}', parameter '{name}': {description}")
            if self.table[name].scale == "log" and value < 0:
                raise LawError(f"law '{self.name}', parameter '{name}': {value:g} is negative; it must be positive")
            if self.table[name].scale == "log" and value == 0 and self.table[name].off != 0:
                raise LawError(f"law '{self.name}', parameter '{name}': 0 is not allowed, it must be positive")
        return values

    def number(self, value: Any, what: str) -> float:
        """Return `value` as a float, or raise LawError saying that `what` is not a number."""
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            raise LawError(f"law '{self.name}', {what}: {value!r} is not a number") from None

    def latex(self) -> str:
        """The law as a LaTeX equation."""
        from creepkit.language.printing import law_latex

        return law_latex(self)

    # ---- algebra ---------------------------------------------------------------------------------------------------

    def __add__(self, other: CreepLaw) -> CreepLaw:
        """The additive law; terms stay apart by name, colliding parameters become A_1, A_2 ..."""
        from creepkit.language import algebra

        return algebra.add(self, other) if isinstance(other, CreepLaw) else NotImplemented

    def without(self, *terms: str) -> CreepLaw:
        """The law less the named terms and the parameters that only they used."""
        from creepkit.language import algebra

        return algebra.without(self, terms)

    def only(self, *terms: str) -> CreepLaw:
        """The law with the named terms alone."""
        from creepkit.language import algebra

        return algebra.only(self, terms)

    def fix(self, **values: float) -> CreepLaw:
        """The law with parameters at fixed numbers; m=0 makes strain hardening a power law."""
        from creepkit.language import algebra

        return algebra.fix(self, values)

    def times(self, factor: Any) -> CreepLaw:
        """The law with every term multiplied by a factor such as arrhenius(T_ref=1073)."""
        from creepkit.language import algebra

        return algebra.times(self, factor)

    def with_temperature(self, **forms: Any) -> CreepLaw:
        """The law with parameters made functions of temperature, such as n=linear(T_ref=1073)."""
        from creepkit.language import algebra

        return algebra.with_temperature(self, forms)

    def at(self, temperature: float) -> CreepLaw:
        """The law at one temperature, in K; parameters that no longer matter there are dropped."""
        from creepkit.language import algebra

        return algebra.at(self, temperature)

    def rename(self, name: str, title: str = "") -> CreepLaw:
        """The same law under another name."""
        return replace(self, name=name, title=title or self.title)

    # ---- value semantics -------------------------------------------------------------------------------------------

    def _key(self) -> tuple[Any, ...]:
        return (
            self.name,
            self.title,
            tuple(self.terms.items()),
            tuple(self.params.items()),
            tuple(self.states.items()),
            self.constraints,
            self.references,
        )

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, CreepLaw) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.name, tuple(self.terms.items()), self.names))

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        plain = {k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()}
        return _rebuild, (plain,)

    def __str__(self) -> str:
        from creepkit.language.printing import law_text

        return law_text(self)

    def __repr__(self) -> str:
        return f"<CreepLaw {self.name}: {len(self.terms)} term(s), parameters {', '.join(self.names) or 'none'}>"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def _rebuild(state: dict[str, Any]) -> CreepLaw:
    return CreepLaw(**state)
