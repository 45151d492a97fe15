"""Laws that every compiled export must get right, with their values at Sobol points in 50 digits."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Callable
from dataclasses import dataclass

import mpmath
import numpy as np
import sympy

from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import (
    CreepLaw,
    Param,
    State,
    activated,
    arrhenius,
    linear,
    mean_stress,
    parameters,
    principal_stress,
    states,
    stress,
    temperature,
    time,
)
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import LawWithValues
from creepkit.testing import LawSamples, draw_samples
from creepkit.testing.parity import KernelTable, MultiprecisionReference, largest_differences
from creepkit.testing.sample_points import constraints_hold
from helpers.literature_laws import EQUATIONS
from helpers.registered_laws import laws_of_scalars

TOLERANCE = 1e-10
SETS, POINTS = 2, 8
"""How many sets of parameters a law has, and points each."""

A, B, n = parameters("A B n")
(omega,) = states("omega")
PIECES = CreepLaw(
    name="pieces",
    terms={
        "threshold": A * sympy.Max(stress - 10, 0) ** n,
        "switch": A * sympy.Piecewise((stress, temperature > 1000), (stress**2, True)),
        "multiaxial": A * sympy.exp(-mean_stress / 50),
        "between": A
        * sympy.Piecewise((1, sympy.And(stress > 5, time < 100)), (2, sympy.Or(stress < 1, time > 1e4)), (3, True)),
    },
    params={A: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0), n: Param("exponent", (1, 8))},
)

DIFFERENCES = CreepLaw(
    name="differences",
    terms={"cosh": A * sympy.cosh(stress / B) ** n},
    params={
        A: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0),
        B: Param("stress", (50, 1000), "MPa"),
        n: Param("exponent", (1, 8)),
    },
    states={omega: State(0.0, A * (sympy.exp(stress / B) - sympy.exp(omega)))},
)

MULTIAXIAL = CreepLaw(
    name="multiaxial",
    terms={"creep": A * stress * (principal_stress / stress) ** 2 * sympy.exp(mean_stress / B) / (1 - omega)},
    params={A: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0), B: Param("stress", (50, 1000), "MPa")},
    states={omega: State(0.0, A * sympy.exp(mean_stress / B + omega) * (principal_stress + stress), limit=0.99)},
)
"""The rate and the growth feel all three stresses about equally."""

LAWS: dict[str, CreepLaw] = {
    **{f"registered {name}": law for name, law in laws_of_scalars().items()},
    **{f"foreign {name}": law for name, law in EQUATIONS.items()},
    "pieces": PIECES,
    "multiaxial": MULTIAXIAL,
    "differences": DIFFERENCES,
    "sum": HYPERBOLIC_SINE + STRAIN_HARDENING,
    "sum with temperature": (HYPERBOLIC_SINE + STRAIN_HARDENING).times(arrhenius()).with_temperature(n_2=linear()),
    "combined with temperature": COMBINED.times(arrhenius()),
    "norton drifting with temperature": NORTON.with_temperature(n=linear(), A=activated(1100.0)),
    "combined in part": COMBINED.fix(A_3=0, n_1=2.5),
    "Kachanov with temperature": EQUATIONS["Kachanov-Rabotnov"].times(arrhenius()),
    "Liu-Murakami and more": EQUATIONS["Liu-Murakami"] + STRAIN_HARDENING,
}
"""{name: law}: laws of programs, installed and as others would write them, sums, laws with temperature and states."""


@dataclass(frozen=True)
class Case:
    """A law at points: sets[k] are the author's values at drawn.points[k]."""

    law: CreepLaw
    drawn: LawSamples
    sets: list[dict[str, float]]
    truth: MultiprecisionReference

    def worst(self, rows: np.ndarray, logs: np.ndarray) -> tuple[str, float]:
        """The largest relative difference of rows (samples, 1 + S, columns) from 50 digits, and where it is.

        Column 0 is the value, the next are derivatives to the point, as many as there are. Results that cancel count
        as right when their error is no more than the last bits of the inputs make.
        """
        truth = copy.copy(self.truth)
        truth.rows = [[row[: rows.shape[2]] for row in sample] for sample in self.truth.rows]
        with np.errstate(over="ignore", invalid="ignore"):
            differences = largest_differences(truth, KernelTable(rows, logs), allow_cancellation=True)
        found = max(differences, key=lambda difference: difference.size)
        return f"{self.law.name}: {found.size:.1e} in {truth.location_text(found)}", found.size

    @property
    def labels(self) -> list[str]:
        """A name for the values at each point, such as law3_1: of functions that have them as constants."""
        known: list[dict[str, float]] = []
        for values in self.sets:
            known += [] if values in known else [values]
        return [f"law{[*LAWS.values()].index(self.law)}_{known.index(values)}" for values in self.sets]

    def logs(self, rates: np.ndarray) -> np.ndarray:
        """ln of the rates found, (samples,); the truth's where no double holds the rate, so that others are judged."""
        exact = [rows[0][0] for rows in self.truth.rows]
        truth = [float(mpmath.log(rate)) if rate > 0 else -np.inf for rate in exact]
        held = np.array([1e-290 < rate < 1.7e308 for rate in exact])
        return np.log(rates, where=held, out=np.array(truth))

    def named(self, k: int) -> dict[str, float]:
        """Point k by the names of the law: the stress, variables that it uses, states."""
        law, pairs = self.law, zip((*POINT_VARIABLES, *self.law.states), self.drawn.points[k].tolist(), strict=True)
        return {s.name: value for s, value in pairs if s == stress or law.uses(s) or s in law.states}


def renamed(text: str) -> dict[str, str]:
    """{author's name: name in an exported text} where the text says that they differ."""
    return dict(re.findall(r"'(.+)' is called (\w+) here$", text, re.MULTILINE))


@functools.cache
def case(name: str) -> Case:
    """A law of LAWS at Sobol points of its bounds where its constraints hold."""
    law = LAWS[name]
    points, theta, sets = [], [], []
    drawn = draw_samples(law, 16, seed=5)
    for internal in drawn.theta[:SETS]:
        values = {n: p.from_internal(t) for (n, p), t in zip(law.table.items(), internal, strict=True)}
        again = [p.to_internal(values[n]) for n, p in law.table.items()]
        holds = constraints_hold(law, drawn.points, np.tile(again, (len(drawn), 1)))
        for point in drawn.points[holds][:POINTS]:
            points.append(point)
            theta.append(again)
            sets.append(values)
    samples = LawSamples(np.array(points), np.array(theta).reshape(len(points), -1))
    return Case(law, samples, sets, MultiprecisionReference(MultiprecisionLaw(law), samples))


def labelled_values() -> dict[str, LawWithValues]:
    """{label: law with values} of every set of values of every law."""
    triples = [
        (law, *pair) for name, law in LAWS.items() for pair in zip(case(name).labels, case(name).sets, strict=True)
    ]
    return {label: LawWithValues(law, values, name=label) for law, label, values in triples}


def disagreements(evaluate: Callable[[str, Case], tuple[np.ndarray, np.ndarray]]) -> list[str]:
    """Where programs differ from 50 digits over all laws, a line each.

    evaluate(name, case) : rows (samples, 1 + S, columns) and ln rate (samples,) by the program of a law.
    """
    found = [case(name).worst(*evaluate(name, case(name))) for name in LAWS]
    return [told for told, size in found if not size <= TOLERANCE]
