"""A grammar of rate equations: sums of up to three products, each of a stress function and what strain and time do.

    sentence    = product [+ product [+ product]], [times Arrhenius' factor, of all or of each]
    product     = stress [* hardening] [* softening]
    stress      = power | sinh | exponential | threshold | double power
    hardening   = strain power | time power | strain saturation | time saturation
    softening   = softening in strain

Every sentence is an ordinary law, made by the algebra of laws. By construction no rate is negative, each grows with
stress and vanishes without, and strain is finite from time zero on: the exponents of strain and time lie above -1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import sympy

from creepkit.language import CreepLaw, Param, arrhenius, parameters, strain, stress, time
from creepkit.language.algebra import multiplied
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING

MOST_PRODUCTS = 3
"""Of a sum."""


A, B, Omega, b, n, p, s_0, s_b, t_p = parameters("A B Omega b n p s_0 s_b t_p")


_RATE, _EXPONENT = (NORTON.params[NORTON.symbol(name)] for name in ("A", "n"))


def _steady(name: str, title: str, rate: sympy.Expr, reference: str, table: Mapping[sympy.Symbol, Param]) -> CreepLaw:
    return CreepLaw(
        name=name,
        title=title,
        terms={name.replace("-", " "): rate},
        params={A: _RATE, **table},
        references=(reference,),
    )


STRESS: Mapping[str, CreepLaw] = {
    "power": NORTON,
    "sinh": HYPERBOLIC_SINE,
    "exponential": _steady(
        "exponential",
        "Exponential of stress",
        A * (sympy.exp(stress / B) - 1),
        "Dorn (1954), J. Mech. Phys. Solids 3, 85",
        {B: Param("stress by which the rate grows e times", unit="MPa", bounds=(1.0, 1e3), scale="log")},
    ),
    "threshold": _steady(
        "threshold",
        "Power law above a threshold stress",
        A * sympy.Max(stress - s_0, 0) ** n,
        "Williams and Wilshire (1973), Met. Sci. J. 7, 176",
        {n: _EXPONENT, s_0: Param("threshold stress", unit="MPa", bounds=(0.0, 500.0), off=0.0)},
    ),
    "double power": _steady(
        "rising-exponent",
        "Power law whose exponent rises at a stress",
        A * stress**n * (1 + (stress / s_b) ** p),
        "Naumenko and Altenbach (2007), Modeling of Creep for Structural Analysis, Springer",
        {
            n: _EXPONENT,
            s_b: Param("stress above which the exponent is higher", unit="MPa", bounds=(1.0, 1e4), scale="log"),
            p: Param("rise of the stress exponent", bounds=(0.5, 12.0)),
        },
    ),
}
"""Stress functions, as laws of steady creep."""


HARDENING = ("none", "strain power", "time power", "strain saturation", "time saturation")


SOFTENING = ("none", "strain")


TEMPERATURE = ("none", "arrhenius", "arrhenius of each")


@dataclass(frozen=True, order=True)
class Product:
    """A product of the grammar: names of its factors."""

    stress: str = "power"
    hardening: str = "none"
    softening: str = "none"

    @property
    def law(self) -> CreepLaw:
        """The product as a law."""
        return _law_of_product(self)


@dataclass(frozen=True)
class Sentence:
    """A sentence of the grammar: its products, in order, and how rates depend on temperature, about T_ref in K."""

    products: tuple[Product, ...]
    temperature: str = "none"
    T_ref: float = 1073.15

    def __post_init__(self) -> None:
        object.__setattr__(self, "products", tuple(sorted(self.products)))

    @property
    def law(self) -> CreepLaw:
        """The sentence as a law."""
        return _law_of_sentence(self)

    def neighbours(self, temperatures: Sequence[str] = TEMPERATURE) -> Iterator[Sentence]:
        """The sentences that one change leads to: a factor exchanged, a product dropped or added."""
        changed: dict[tuple[Product, ...], None] = {}
        for k, one in enumerate(self.products):
            rest = self.products[:k] + self.products[k + 1 :]
            exchanged = [replace(one, stress=name) for name in STRESS]
            exchanged += [replace(one, hardening=name) for name in HARDENING]
            exchanged += [replace(one, softening=name) for name in SOFTENING]
            changed |= dict.fromkeys((*rest, other) for other in exchanged if other != one)
            changed |= {rest: None} if rest else {}
        if len(self.products) < MOST_PRODUCTS:
            changed |= dict.fromkeys((*self.products, Product("power", name)) for name in HARDENING)
        for products in changed:
            if len(set(products)) == len(products):  # a sum of two alike is one of them, or a double power
                yield replace(self, products=products)
        for name in temperatures:
            if name != self.temperature and not (name == "arrhenius of each" and len(self.products) == 1):
                yield replace(self, temperature=name)


@cache
def _law_of_sentence(sentence: Sentence) -> CreepLaw:
    laws = [product.law for product in sentence.products]
    if sentence.temperature == "arrhenius of each":
        laws = [law.times(arrhenius(sentence.T_ref)) for law in laws]
    law = sum(laws[1:], laws[0])
    return law.times(arrhenius(sentence.T_ref)) if sentence.temperature == "arrhenius" else law


@cache
def _law_of_product(product: Product) -> CreepLaw:
    """Those that are built in have their names; a factor that is none of theirs is named behind the stress function."""
    law = STRESS[product.stress]
    built_in = {"strain power": STRAIN_HARDENING, "time power": TIME_HARDENING}
    if product.hardening == "strain saturation":
        law = law.with_primary()
    elif product.stress == "power" and product.hardening in built_in:
        law = built_in[product.hardening]
    elif product.hardening in built_in:
        other = built_in[product.hardening]
        m = other.symbol("m")
        variable = strain if product.hardening == "strain power" else time
        law = multiplied(law, product.hardening, variable**m, {m: other.params[m]}, other.references[0])
    elif product.hardening == "time saturation":
        table = {
            b: Param("initial over steady rate, less one", bounds=(0.1, 300.0), scale="log", unit="1"),
            t_p: Param("time over which primary creep fades", bounds=(1e2, 1e8), scale="log", unit="s"),
        }
        reference = "Andrade (1910), Proc. R. Soc. A 84, 1; Garofalo (1965), Fundamentals of Creep"
        law = multiplied(law, product.hardening, 1 + b * sympy.exp(-time / t_p), table, reference)
    if product.softening == "strain":
        table = {Omega: Param("acceleration by strain", unit="1", bounds=(0.5, 500.0), scale="log")}
        reference = "Prager (1995), J. Pressure Vessel Technol. 117, 95"
        law = multiplied(law, "softening", sympy.exp(Omega * strain), table, reference)
    return law


def operations(law: CreepLaw) -> int:
    """Operations of the rate, and of those of internal variables, as they are written."""
    return int(sympy.count_ops([law.rate, *(state.rate for state in law.states.values())]))
