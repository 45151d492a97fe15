"""LawChanges: what is changed of candidate laws before they are fitted; SearchOptions: how they are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, nearest
from creepkit.inverse.reference_conditions import with_arrhenius
from creepkit.language import CreepLaw
from creepkit.options import Options, option
from creepkit.records import History


@checked
@dataclass(frozen=True)
class LawChanges(Options, title="changes of laws"):
    """temperature : "auto", a factor of Arrhenius where tests span several temperatures, or "none".

    fix, bounds : of parameters, in the laws' units, where a law has them.
    """

    temperature: Literal["auto", "none"] = option(
        "auto", "Of laws without temperature; auto: times an Arrhenius factor where tests span several temperatures."
    )
    fix: Mapping[str, float] = option(dict, "Fix a parameter, in the law's unit, where a law has it.", example="n=5")
    bounds: Mapping[str, tuple[float, float]] = option(
        dict, "Bounds of a parameter, in the law's unit.", flag="bound", example="n=1:8"
    )

    def applied(self, laws: Sequence[CreepLaw], histories: Sequence[History]) -> list[CreepLaw]:
        """The laws as they are fitted to tests; FitError for a parameter that none of them has."""
        if self.temperature == "auto" and histories:
            laws = [with_arrhenius(law, histories) for law in laws]
        known = {name for law in laws for name in law.names}
        for argument, changes in (("bounds", self.bounds), ("fix", self.fix)):
            for name in changes:
                if name not in known:
                    names = ", ".join(law.name for law in laws)
                    raise FitError(f"{argument}: no parameter of {names} is called '{name}'; {nearest(name, known)}")
        return [
            law.with_bounds(**{n: (low, high) for n, (low, high) in self.bounds.items() if n in law.names}).fix(
                **{n: value for n, value in self.fix.items() if n in law.names}
            )
            for law in laws
        ]


@checked
@dataclass(frozen=True)
class SearchOptions(Options, title="options of a search"):
    """What identify() and select() take as objects or arguments of their own.

    penalty : on the terms of a sum. sums : whether sums of two laws are tried; None where no candidate explains the
    tests.
    """

    penalty: Literal["l2", "subsets"] | None = option(None, "Keep those terms of a sum that the tests need.")
    sums: bool | None = option(None, "Whether sums of two laws are tried; by default where no law explains the tests.")
