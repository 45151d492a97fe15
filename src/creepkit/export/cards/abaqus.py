"""Abaqus' own creep laws as input cards: *CREEP with LAW=STRAIN, TIME, HYPERB, DOUBLE POWER, (TIME) POWER LAW.

Abaqus Analysis User's Guide, Rate-dependent plasticity: creep and swelling; Keywords Guide, *CREEP. Its strain
hardening is written (A q^n [(m+1) e]^m)^(1/(m+1)), which has other A, n and m than A s^n e^m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.forms import Form, forms_of
from creepkit.export.cards.text import figure, grid, moduli, number, top, warmth
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import ValuedLaw

_INSTEAD = "export it as 'abaqus', a CREEP subroutine"
_SMALLEST = 1e-27
"""Below this A the manual warns of numerical difficulties with LAW=STRAIN and LAW=TIME."""

_INTERPOLATION = 1e-3
"""Relative error of linear interpolation of A between the rows of a table."""

_STEPS = (50.0, 25.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1)

_TABLE = (
    "Table from {low:g} to {high:g} K in steps of {step:g} K: Abaqus interpolates linearly between rows, which is "
    "within {tolerance:.1%}, and keeps the end values outside."
)


@dataclass(frozen=True)
class AbaqusCards:
    """Material cards with one of Abaqus' own creep laws; low, high : K, of tables where no tests are known."""

    name: str = "abaqus-cards"
    title: str = "Abaqus material cards with one of its own creep laws (*CREEP)"
    suffix: str = ".inp"
    low: float = 873.15
    high: float = 1273.15

    def text(self, source: ValuedLaw) -> str:
        """Return *MATERIAL, *ELASTIC where moduli are given, and *CREEP."""
        forms = forms_of(source, "Abaqus' *CREEP", _INSTEAD)
        creep = self._creep(source, forms)
        names = Identifiers((), ignore_case=True, longest=80)
        wanted = source.name or source.law.name
        label = names.name(wanted)
        rows = moduli(source, grid(*warmth(source, self.low, self.high), 25.0))
        elastic = [_data(m.E, m.nu, *_listed(m.T)) for m in rows]
        cards = [f"*MATERIAL, NAME={label}", *(["*ELASTIC", *elastic] if elastic else []), *creep.cards]
        missing = [] if elastic else ["*ELASTIC is missing: no modulus was given; write it beside *CREEP."]
        about = [*names.told([wanted]), *creep.about, *missing]
        return "\n".join([*top(source, "**", about), *cards]) + "\n"

    def _creep(self, source: ValuedLaw, forms: Sequence[Form]) -> _Creep:
        shapes = [form.shape for form in forms]
        plain = all(form.shape == "power" and form.steady for form in forms)
        if plain and (len(forms) == 2 or (len(forms) == 1 and forms[0].Q)):
            return _double_power(source, forms)
        if len(forms) > 1:
            told = " + ".join(form.label for form in forms)
            raise _refused(source, f"a sum of {len(forms)} ({told}) that is not one of two power laws")
        if shapes == ["sinh"] and forms[0].steady:
            return _hyperbolic(source, forms[0])
        if shapes == ["power"]:
            return self._power(source, forms[0])
        raise _refused(source, f"{forms[0].label}: its {shapes[0]} of stress does not stand alone there")

    def _power(self, source: ValuedLaw, form: Form) -> _Creep:
        """LAW=STRAIN or LAW=TIME; their newer notation where A would be too small."""
        if form.strain and form.time:
            raise _refused(source, f"{form.label}: a power of strain times a power of time")
        m = form.strain / (1.0 - form.strain) if form.strain else form.time
        if not (-1.0 < m <= 0.0 and form.n > 0.0):
            raise _refused(source, f"{form.label}: Abaqus asks for n > 0 and -1 < m <= 0 (n = {form.n:g}, m = {m:g})")
        notation = _time(form, m) if form.time else _strain(form, m)
        if not form.Q:
            return notation.creep(source, [(form.log_coefficient, None)])
        low, high = warmth(source, self.low, self.high)
        step = _spacing(form, low)
        rows = [(form.at(T), T) for T in grid(low, high, step)]
        told = _TABLE.format(low=low, high=high, step=step, tolerance=_INTERPOLATION)
        return notation.creep(source, rows, told)


@dataclass(frozen=True)
class _Creep:
    """*CREEP with its data, and comments on it."""

    cards: list[str]
    about: list[str]


def _refused(source: ValuedLaw, what: str) -> ExportError:
    return ExportError(f"law '{source.law.name}' is none of Abaqus' own creep laws, {what}; {_INSTEAD}")


# ---- power laws ----------------------------------------------------------------------------------------------------

Rows = Sequence[tuple[float, float | None]]
"""ln of A in A s^n e^m t^k, and the temperature in K or None."""


@dataclass(frozen=True)
class _Notation:
    """A power law of stress with strain or time, in Abaqus' older and newer notations, with Abaqus' n and m.

    log_A(ln A) : of the older notation's A. log_rate(ln A, ln q0) : of the newer one's rate e0 at the stress q0.
    """

    law: str
    formula: str
    newer: str
    newer_formula: str
    n: float
    m: float
    log_A: Callable[[float], float]
    log_rate: Callable[[float, float], float]

    def creep(self, source: ValuedLaw, rows: Rows, told: str = "") -> _Creep:
        """The older notation, or the newer where A is too small for it."""
        about = [told] if told else []
        if min(self.log_A(ln) for ln, _ in rows) >= math.log(_SMALLEST):
            data = [_data(number(self.log_A(ln), "A", source), self.n, self.m, *_listed(T)) for ln, T in rows]
            return _Creep([f"*CREEP, LAW={self.law}", *data], [f"LAW={self.law}: {self.formula}. A, n, m.", *about])
        q0 = 100.0 / source.units.megapascals
        rates = [(number(self.log_rate(ln, math.log(q0)), "e0", source), T) for ln, T in rows]
        data = [_data(q0, self.n, self.m, rate, *_listed(T)) for rate, T in rates]
        why = f"A of LAW={self.law} would be below {_SMALLEST:g}, against which the manual warns; LAW={self.newer}"
        about.insert(0, f"{why} is in the manual of 2022, not in that of 2017: {self.newer_formula}. q0, n, m, e0.")
        return _Creep([f"*CREEP, LAW={self.newer}", *data], about)


def _strain(form: Form, m: float) -> _Notation:
    """A s^N e^M with M = m/(m+1) and N = n/(m+1)."""
    return _Notation(
        "STRAIN",
        "rate = (A q^n [(m+1) e]^m)^(1/(m+1)), of equivalent stress q and creep strain e",
        "POWER LAW",
        "rate = e0 ((q/q0)^n [(m+1) e]^m)^(1/(m+1))",
        n=form.n * (m + 1.0),
        m=m,
        log_A=lambda ln: (m + 1.0) * ln - m * math.log(m + 1.0),
        log_rate=lambda ln, ln_q0: ln + form.n * ln_q0 - form.strain * math.log(m + 1.0),
    )


def _time(form: Form, m: float) -> _Notation:
    """A s^n t^m as it is."""
    return _Notation(
        "TIME",
        "rate = A q^n t^m, of equivalent stress q and total time t, which must start with the load",
        "TIME POWER LAW",
        "rate = e0 (q/q0)^n (e0 t)^m, of total time t, which must start with the load",
        n=form.n,
        m=m,
        log_A=lambda ln: ln,
        log_rate=lambda ln, ln_q0: (ln + form.n * ln_q0) / (1.0 + m),
    )


def _double_power(source: ValuedLaw, forms: Sequence[Form]) -> _Creep:
    """Two power laws, or one with an activation energy as two equal halves."""
    q0 = 100.0 / source.units.megapascals
    halves = [*forms, *forms][:2]
    share = math.log(len(forms) / 2.0)
    data = []
    for form in halves:
        data += [number(form.log_coefficient + share + form.n * math.log(q0), "A", source), form.per_kelvin, form.n]
    about = ["LAW=DOUBLE POWER: rate = A1 exp(-B1/T) (q/q0)^C1 + A2 exp(-B2/T) (q/q0)^C2. A1, B1, C1, A2, B2, C2, q0."]
    if len(forms) == 1:
        about.append("One power law as two equal halves.")
    if any(form.Q for form in forms):
        about.append(_ZERO)
    return _Creep(["*CREEP, LAW=DOUBLE POWER", _data(*data, q0)], about)


_ZERO = "T above absolute zero: in a model in K that is 0; in C write *PHYSICAL CONSTANTS, ABSOLUTE ZERO=-273.15."


def _hyperbolic(source: ValuedLaw, form: Form) -> _Creep:
    about = ["LAW=HYPERB: rate = A sinh(B q)^n exp(-dH/(R T)), of equivalent stress q. A, B, n, dH, R."]
    energy = [form.Q, GAS_CONSTANT] if form.Q else []
    about += [f"dH in J/mol. {_ZERO}"] if energy else []
    A = number(form.log_coefficient, "A", source)
    return _Creep(["*CREEP, LAW=HYPERB", _data(A, 1.0 / form.B, form.n, *energy)], about)


# ---- tables and numbers --------------------------------------------------------------------------------------------


def _spacing(form: Form, low: float) -> float:
    """The largest step, in K, over which linear interpolation of a rate ~ exp(-Q/(R T)) is good enough.

    The error is k^2 step^2/8 with k = Q/(R T^2); where e0 ~ rate^(1/(1+m)) is interpolated, it is 1/(1+m) times that.
    """
    curvature = (form.per_kelvin / low**2) ** 2 / (1.0 + form.time)
    return next((step for step in _STEPS if curvature * step**2 / 8.0 <= _INTERPOLATION), _STEPS[-1])


def _listed(T: float | None) -> list[float]:
    return [] if T is None else [T]


def _data(*values: float) -> str:
    """A data line; Abaqus reads at most 20 characters of a number."""
    return ", ".join(map(figure, values))
