"""Primary creep by algebra: the rate of a steady law, higher at first and falling exponentially with strain."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import sympy

from creepkit.errors import LawError
from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import Param, strain, time
from creepkit.language.temperature_factors import unused_name

Law = TypeVar("Law", bound=LawRecord)

REFERENCE = "Garofalo (1965), Fundamentals of Creep and Creep-Rupture in Metals, Macmillan"


def with_primary(law: Law) -> Law:
    """Multiply the rates of all terms by 1 + b exp(-strain / e_p); see CreepLaw.with_primary."""
    if law.states or any(term.has(strain, time) for term in law.terms.values()):
        raise LawError(
            f"law '{law.name}' has primary or tertiary creep of its own: with_primary() takes a law of stress and "
            "temperature alone, such as law('hyperbolic-sine')"
        )
    b = sympy.Symbol(unused_name("b", set(law.names)), real=True)
    e_p = sympy.Symbol(unused_name("e_p", set(law.names)), real=True)
    params = {
        b: Param("initial over steady rate, less one", bounds=(0.1, 300.0), scale="log", unit="1"),
        e_p: Param("strain over which primary creep fades", bounds=(1e-5, 0.05), scale="log", unit="1"),
    }
    factor = 1 + b * sympy.exp(-strain / e_p)
    return replace(
        law,
        name=f"{law.name}*primary",
        title=f"{law.title or law.name} with primary creep",
        terms={label: term * factor for label, term in law.terms.items()},
        params={**law.params, **params},
        references=tuple(dict.fromkeys((*law.references, REFERENCE))),
        examples=(),
    )
