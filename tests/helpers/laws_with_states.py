"""Laws with internal variables, written as a user would, with values that make a dimple creep visibly in half a day."""

import sympy

from creepkit.language import CreepLaw, Param, State, parameters, principal_stress, states, stress

A, n, B, h, r, k, rho_0, H, k_1, k_2, alpha = parameters("A n B h r k rho_0 H k_1 k_2 alpha")
b, rho, eta, omega, spent = states("b rho eta omega spent")

COEFFICIENT = Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-2), scale="log", off=0.0)
EXPONENT = Param("stress exponent", bounds=(1, 12))


def positive(meaning, unit="1", low=1e-6, high=1e6):
    return Param(meaning, unit=unit, bounds=(low, high), scale="log")


_above = A * sympy.Max(stress - b, 0) ** n
BACK_STRESS = CreepLaw(
    "back-stress",
    {"creep above the back stress": _above},
    {A: COEFFICIENT, n: EXPONENT, h: positive("hardening modulus", "MPa"), r: positive("rate of recovery")},
    title="Power law of the stress above a back stress that hardens with strain and recovers",
    states={b: State(0.0, _above * (h - r * b), "back stress")},
)
"""db/d(strain) = h - r b: b rises to h/r."""

DISLOCATION_DENSITY = CreepLaw(
    "dislocation-density",
    {"glide": A * stress**n / (1 + rho)},
    {A: COEFFICIENT, n: EXPONENT, k_1: positive("multiplication"), k_2: positive("annihilation")},
    title="Glide that the growth of the dislocation density slows down",
    states={rho: State(0.0, A * stress**n / (1 + rho) * (k_1 - k_2 * rho), "density over the initial one, less 1")},
)
"""Kocks and Mecking: d(rho)/d(strain) = k_1 - k_2 rho."""

_dyson = A * sympy.sinh(stress * (1 - eta) / B) * (1 + omega)
DYSON_MCLEAN = CreepLaw(
    "dyson-mclean",
    {"creep": _dyson},
    {
        A: COEFFICIENT,
        B: positive("stress of the hyperbolic sine", "MPa"),
        H: Param("transferred share of the stress at saturation", bounds=(0.0, 0.9)),
        h: positive("hardening modulus", "MPa"),
        k_2: positive("softening by mobile dislocations"),
    },
    title="Dyson and McLean: stress transfer hardens, mobile dislocations soften",
    states={
        eta: State(0.0, h / stress * _dyson * (H - eta), "share of the stress that hard regions carry"),
        omega: State(0.0, k_2 * _dyson, "softening"),
    },
    references=("Dyson and McLean (1983), Acta Metall. 31, 17",),
)

COUNTED = CreepLaw(
    "counted-life",
    {"creep": A * stress**n},
    {A: COEFFICIENT, n: EXPONENT, k: positive("rate of counting", "1/s", 1e-12)},
    title="Norton's law with a fraction of life that is counted and changes nothing",
    states={spent: State(0.0, k * stress, "life that is spent")},
)
"""Its state enters no term and has no limit."""

ENDING = CreepLaw(
    "ending-life",
    COUNTED.terms,
    COUNTED.params,
    title="The same, which breaks when the life is spent",
    states={spent: State(0.0, k * stress, "life that is spent", limit=1.0)},
)

PRINCIPAL = CreepLaw(
    "principal-norton",
    {"creep": A * (alpha * sympy.Max(principal_stress, 0) + (1 - alpha) * stress) ** n},
    {A: COEFFICIENT, n: EXPONENT, alpha: Param("share of the largest principal stress", bounds=(0, 1), off=0.0)},
    title="Norton's law of a mixture of the von Mises and the largest principal stress",
)

TENSION_ONLY = CreepLaw(
    "tension-only",
    {"creep": A * sympy.Max(principal_stress, 0) ** n},
    {A: COEFFICIENT, n: EXPONENT},
    title="Norton's law of the largest principal stress: compression does not creep",
)

VALUES = {
    BACK_STRESS: {"A": 1e-7 / 100.0**4, "n": 4.0, "h": 5e3, "r": 100.0},
    DISLOCATION_DENSITY: {"A": 2e-7 / 100.0**4, "n": 4.0, "k_1": 400.0, "k_2": 60.0},
    DYSON_MCLEAN: {"A": 2e-8, "B": 40.0, "H": 0.4, "h": 1e4, "k_2": 100.0},
    COUNTED: {"A": 1e-7 / 120.0**5, "n": 5.0, "k": 1e-9},
    ENDING: {"A": 1e-7 / 120.0**5, "n": 5.0, "k": 1e-9},
    PRINCIPAL: {"A": 1e-7 / 120.0**5, "n": 5.0, "alpha": 0.5},
    TENSION_ONLY: {"A": 1e-7 / 120.0**5, "n": 5.0},
}
"""{law: values}, for 8 then 10 MPa on the paper's dimple."""
