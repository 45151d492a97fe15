"""A grammar of rate equations: sums of up to three products, each of a stress function and what strain and time do.

    sentence    = product [+ product [+ product]], [times Arrhenius' factor, of all or of each]
    product     = stress [* hardening] [* softening]
    stress      = power | sinh | exponential | threshold | double power
    hardening   = strain power | time power | strain saturation | time saturation | back stress, that recovers
    softening   = softening in strain | damage, that grows with time under stress

Every sentence is an ordinary law, made by the algebra of laws. By construction no rate is negative, each grows with
stress and vanishes without, and strain is finite from time zero on: the exponents of strain and time lie above -1. A
material has one damage, so that one product of a sum has it, and one back stress, which hardens by all strain, so that
a product with it stands alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product, starmap

import sympy

from creepkit.language import CreepLaw, Param, State, arrhenius, parameters, states, strain, stress, time
from creepkit.language.algebra import multiplied
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING

MOST_PRODUCTS = 3
"""Of a sum."""


A, B, D, H, Omega, b, chi, n, p, q, r, s_0, s_b, t_p = parameters("A B D H Omega b chi n p q r s_0 s_b t_p")
v, X = states("v X")


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


HARDENING = ("none", "strain power", "time power", "strain saturation", "time saturation", "back stress")


SOFTENING = ("none", "strain", "damage")


WITH_BACK_STRESS = ("power", "double power")
"""Stress functions that a back stress may stand in: a threshold is one that is constant."""


TEMPERATURE = ("none", "arrhenius", "arrhenius of each")


@dataclass(frozen=True, order=True)
class Product:
    """A product of the grammar: names of its factors."""

    stress: str = "power"
    hardening: str = "none"
    softening: str = "none"

    @classmethod
    def all(cls) -> list[Product]:
        """Every product of the grammar."""
        return [one for one in starmap(cls, product(STRESS, HARDENING, SOFTENING)) if one.allowed]

    @property
    def factors(self) -> int:
        """How many stand beside the stress function."""
        return (self.hardening != "none") + (self.softening != "none")

    @property
    def allowed(self) -> bool:
        """Whether the factors may stand together."""
        return self.hardening != "back stress" or self.stress in WITH_BACK_STRESS

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
            if allowed(products):
                yield replace(self, products=products)
        for name in temperatures:
            if name != self.temperature and not (name == "arrhenius of each" and len(self.products) == 1):
                yield replace(self, temperature=name)


def allowed(products: Sequence[Product]) -> bool:
    """Whether products may be a sum: two alike are one of them, or a double power; a material has one damage."""
    several = len(products) > 1 and any(one.hardening == "back stress" for one in products)
    once = len(set(products)) == len(products) and sum(one.softening == "damage" for one in products) < 2
    return once and not several and all(one.allowed for one in products)


@cache
def _law_of_sentence(sentence: Sentence) -> CreepLaw:
    laws = [one.law for one in sentence.products]
    if sentence.temperature == "arrhenius of each":
        laws = [law.times(arrhenius(sentence.T_ref)) for law in laws]
    law = sum(laws[1:], laws[0])
    return law.times(arrhenius(sentence.T_ref)) if sentence.temperature == "arrhenius" else law


@cache
def _law_of_product(of: Product) -> CreepLaw:
    """Those that are built in have their names; a factor that is none of theirs is named behind the stress function."""
    law = STRESS[of.stress]
    built_in = {"strain power": STRAIN_HARDENING, "time power": TIME_HARDENING}
    if of.hardening == "strain saturation":
        law = law.with_primary()
    elif of.stress == "power" and of.hardening in built_in:
        law = built_in[of.hardening]
    elif of.hardening in built_in:
        other = built_in[of.hardening]
        m = other.symbol("m")
        variable = strain if of.hardening == "strain power" else time
        law = multiplied(law, of.hardening, variable**m, {m: other.params[m]}, other.references[0])
    elif of.hardening == "time saturation":
        table = {
            b: Param("initial over steady rate, less one", bounds=(0.1, 300.0), scale="log", unit="1"),
            t_p: Param("time over which primary creep fades", bounds=(1e2, 1e8), scale="log", unit="s"),
        }
        reference = "Andrade (1910), Proc. R. Soc. A 84, 1; Garofalo (1965), Fundamentals of Creep"
        law = multiplied(law, of.hardening, 1 + b * sympy.exp(-time / t_p), table, reference)
    elif of.hardening == "back stress":
        source = "Bailey (1926), J. Inst. Metals 35, 27; Orowan (1946), J. West Scotl. Iron Steel Inst. 54, 45"
        terms = {label: term.xreplace({stress: sympy.Max(stress - X, 0)}) for label, term in law.terms.items()}
        law = replace(
            law,
            name=f"{law.name}*back-stress",
            title=f"{law.title} with back stress",
            terms=terms,
            states={X: State(0.0, H * sympy.Add(*terms.values()) - r * X, "back stress", "MPa")},
            params={
                **law.params,
                H: Param("hardening by strain", bounds=(1e2, 1e6), scale="log", unit="MPa"),
                r: Param("rate of recovery", bounds=(1e-12, 1e-2), scale="log", unit="1/s"),
            },
            references=(*law.references, source),
            examples=(),
        )
    if of.softening == "strain":
        table = {Omega: Param("acceleration by strain", unit="1", bounds=(0.5, 500.0), scale="log")}
        reference = "Prager (1995), J. Pressure Vessel Technol. 117, 95"
        law = multiplied(law, "softening", sympy.exp(Omega * strain), table, reference)
    elif of.softening == "damage":
        table = {
            D: Param("rate coefficient of damage", unit="1/s", bounds=(1e-60, 1e-3), scale="log"),
            chi: Param("stress exponent of damage", bounds=(1.0, 20.0)),
            q: Param("exponent of the rest of life", bounds=(0.05, 5.0)),
        }
        reference = "Kachanov (1958), Izv. Akad. Nauk SSSR, Otd. Tekh. Nauk 8, 26; Rabotnov (1969)"
        life = State(0.0, D * stress**chi, "share of life spent", limit=1 - 1e-8)
        law = multiplied(law, "damage", (1 - v) ** -q, table, reference, states={v: life})
        if X in law.states:  # what damage speeds up hardens too
            hardening = H * sympy.Add(*law.terms.values())
            law = replace(law, states={**law.states, X: replace(law.states[X], rate=hardening - r * X)})
    return law


def operations(law: CreepLaw) -> int:
    """Operations of the rate, and of those of internal variables, as they are written."""
    return int(sympy.count_ops([law.rate, *(state.rate for state in law.states.values())]))
