"""CreepLaw: the record of a law with its algebra (sums, reductions, temperature) and its notation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from creepkit.checked_arguments import checked
from creepkit.language import algebra
from creepkit.language.algebra import times
from creepkit.language.law_record import LawRecord
from creepkit.language.printing import LatexLawPrinter, latex_equations, law_expression, law_text


@checked
@dataclass(frozen=True, eq=False)
class CreepLaw(LawRecord):
    """A creep law: rate of equivalent creep strain, in 1/s, as a sum of named terms; its fields are LawRecord's.

    Every operation takes ordinary laws and gives an ordinary law.
    """

    def __add__(self, other: CreepLaw) -> CreepLaw:
        """The additive law; terms stay apart by name, colliding parameters become A_1, A_2 ..."""
        return algebra.add(self, other) if isinstance(other, CreepLaw) else NotImplemented

    def __radd__(self, other: Any) -> CreepLaw:
        """For sum(laws)."""
        return self if isinstance(other, int) and other == 0 else NotImplemented

    def __rmul__(self, factor: float) -> CreepLaw:
        """The law with a creep rate of so many times its own, as 2 * law; internal variables go on as before."""
        name, terms = f"{factor:g}*{self.name}", {label: factor * term for label, term in self.terms.items()}
        return replace(self, name=name, title=self.title and f"{factor:g}*{self.title}", terms=terms, examples=())

    __mul__ = __rmul__

    def without(self, *terms: str) -> CreepLaw:
        """The law less the named terms and the parameters that only they used."""
        return algebra.without(self, terms)

    def only(self, *terms: str) -> CreepLaw:
        """The law with the named terms alone."""
        return algebra.only(self, terms)

    def fix(self, /, **values: float) -> CreepLaw:
        """The law with parameters at fixed numbers; m=0 makes strain hardening a power law."""
        return algebra.fix(self, values)

    def with_bounds(self, /, **bounds: tuple[float, float]) -> CreepLaw:
        """The law with other bounds of parameters, (low, high) each in the parameter's unit; n=(3, 8)."""
        return algebra.with_bounds(self, bounds)

    def times(
        self,
        factor: Any,
        *,
        terms: Iterable[str] | None = None,
        states: Iterable[str] | None = None,
        shared: bool = False,
    ) -> CreepLaw:
        """The law with every rate multiplied by a factor such as arrhenius(T_ref=1073), as Eq. (5) does.

        All terms share one activation energy, Q. A rate of an internal variable that is a multiple of the creep rate
        (of a term's rate coefficient) takes the same factor; one with a rate coefficient of its own, such as the
        damage rate B s^chi, has an activation energy of its own, Q_B, unless it has one already.
        terms, states : names of those to multiply, by default all; states=() leaves damage without temperature.
        shared : whether internal variables share Q.
        """
        return times(self, factor, terms, states, shared=shared)

    def with_primary(self) -> CreepLaw:
        """The law with primary creep: every rate times 1 + b exp(-strain / e_p), which falls to the rate it had.

        For laws of stress, temperature and damage alone, whose hardening with time, if any, is switched off; damage
        grows as it did. b is the initial over the steady rate, less one, and e_p the strain over which it fades.
        """
        return algebra.with_primary(self)

    def with_temperature(self, /, **forms: Any) -> CreepLaw:
        """The law with parameters made functions of temperature, such as n=linear(T_ref=1073)."""
        return algebra.with_temperature(self, forms)

    @checked
    def at(self, temperature: float | None = None, /, **conditions: float) -> CreepLaw:
        """The law at one temperature, K, and at conditions, in its units; parameters that no longer matter are dropped.

        law.at(1073.15), law.at(grain_size=0.02)
        """
        return algebra.at(self, temperature, conditions)

    @property
    def expr(self) -> Any:
        """The rate for sympy as it is written: R and T_ref of Arrhenius factors are symbols.

        Values enter by name, law.expr.subs(fit.values).
        """
        return law_expression(self)

    def latex(self) -> str:
        """The law as LaTeX equations: of its rate with one summand a term, then of its internal variables."""
        equations = latex_equations(self, LatexLawPrinter(self))
        return r",\quad ".join(f"{left} = {' + '.join(right)}" for left, right in equations)

    def __str__(self) -> str:
        return law_text(self)

    def __repr__(self) -> str:
        return f"<CreepLaw {self.name}: {len(self.terms)} term(s), parameters {', '.join(self.names) or 'none'}>"

    def _repr_html_(self) -> str:
        """For notebooks."""
        from creepkit.reports.html.notebook import notebook_html

        return notebook_html(self)
