"""The class of laws that a surrogate was trained on, and why a law is outside it."""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.errors import SurrogateError
from creepkit.language import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES

VARIABLE_NAMES = {symbol: symbol.name.replace("_", " ") for symbol in POINT_VARIABLES}
"""{symbol: its name in a sentence}."""


@dataclass(frozen=True)
class LawClass:
    """The laws that a surrogate predicts: a property of its training and of what its network is given.

    variables : names of the variables of the point on which the creep rate may depend.
    states : whether internal variables may act back: enter the creep rate, or end the life at a limit.
    only_law : name of the only law, which is predicted with its reductions; "" for every law with such rates.
    """

    variables: tuple[str, ...]
    states: bool = False
    only_law: str = ""

    def __post_init__(self) -> None:
        unknown = sorted(set(self.variables) - {symbol.name for symbol in POINT_VARIABLES})
        if unknown:
            known = ", ".join(symbol.name for symbol in POINT_VARIABLES)
            raise SurrogateError(f"the law class of a surrogate names '{unknown[0]}'; allowed are {known}")

    @classmethod
    def of_law(cls, law: CreepLaw) -> LawClass:
        """One law alone, with whatever it depends on."""
        return cls(tuple(s.name for s in POINT_VARIABLES if law.uses(s)), bool(law.states), law.name)

    def reason_outside(self, law: CreepLaw) -> str:
        """Why the rates of a law are none of this class, to follow its name in a sentence; "" inside."""
        acting = acting_states(law)
        if acting and not self.states:
            return f"has internal variables that act back ({', '.join(acting)})"
        used = set().union(*(term.free_symbols for term in law.terms.values()))
        others = [VARIABLE_NAMES[s] for s in POINT_VARIABLES if s in used and s.name not in self.variables]
        return f"depends on the {' and the '.join(others)}" if others else ""

    def __str__(self) -> str:
        if self.only_law:
            return f"law '{self.only_law}', and that less some of its terms"
        *first, last = [VARIABLE_NAMES[s] for s in POINT_VARIABLES if s.name in self.variables]
        names = f"{', '.join(first)} and {last}" if first else last
        states = "" if self.states else " (no internal variables that act back)"
        return f"laws whose creep rate is a function of {names}{states}"


def acting_states(law: CreepLaw) -> tuple[str, ...]:
    """Names of the internal variables that change the strain: those that enter a term, or end the life at a limit.

    What enters the rate of such a variable alone acts through it; all others are mere outputs of the law.
    """
    used = set().union(*(term.free_symbols for term in law.terms.values()))
    return tuple(symbol.name for symbol, state in law.states.items() if symbol in used or state.limit is not None)
