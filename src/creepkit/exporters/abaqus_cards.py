"""Abaqus' own creep laws as material cards: *CREEP with LAW=STRAIN, TIME, HYPERB, DOUBLE POWER, (TIME) POWER LAW.

Abaqus Analysis User's Guide, Rate-dependent plasticity: creep and swelling; Keywords Guide, *CREEP. Its strain
hardening is written (A q^n [(m+1) e]^m)^(1/(m+1)), which has other A, n and m than A s^n e^m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import (
    CreepForm,
    card_heading,
    creep_forms_of,
    elastic_table,
    exp_in_range,
    format_number,
    temperature_grid,
    temperature_span,
)
from creepkit.exporters.law_code import Identifiers
from creepkit.hookspecs import hookimpl
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import Exporter, LawWithValues

_ALTERNATIVE = "export it as 'abaqus', a CREEP subroutine"


_SMALLEST_COEFFICIENT = 1e-27
"""Below this A the manual warns of numerical difficulties with LAW=STRAIN and LAW=TIME."""


_INTERPOLATION_TOLERANCE = 1e-3
"""Relative error of linear interpolation of A between the rows of a table."""


_TEMPERATURE_STEPS = (50.0, 25.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1)


_TABLE_NOTE = (
    "Table from {low:g} to {high:g} K in steps of {step:g} K: Abaqus interpolates linearly between rows, which is "
    "within {tolerance:.1%}, and keeps the end values outside."
)


@dataclass(frozen=True)
class AbaqusCards:
    """Material cards with one of Abaqus' own creep laws.

    lowest_temperature, highest_temperature : K, of tables where no tests are known.
    """

    name: str = "abaqus-cards"
    title: str = "Abaqus material cards with one of its own creep laws (*CREEP)"
    suffix: str = ".inp"
    lowest_temperature: float = 873.15
    highest_temperature: float = 1273.15

    def text(self, source: LawWithValues) -> str:
        """Return *MATERIAL, *ELASTIC where moduli are given, and *CREEP."""
        forms = creep_forms_of(source, "Abaqus' *CREEP", _ALTERNATIVE)
        creep = self._creep_cards(source, forms)
        names = Identifiers((), ignore_case=True, max_length=80)
        requested = source.name or source.law.name
        label = names.unique(requested)
        rows = elastic_table(source, (self.lowest_temperature, self.highest_temperature), step=25.0)
        elastic = [_data_line(m.E, m.nu, *_optional_value(m.T)) for m in rows]
        cards = [f"*MATERIAL, NAME={label}", *(["*ELASTIC", *elastic] if elastic else []), *creep.cards]
        missing_elasticity = [] if elastic else ["*ELASTIC is missing: no modulus was given; write it beside *CREEP."]
        comments = [*names.renaming_notes([requested]), *creep.comments, *missing_elasticity]
        return "\n".join([*card_heading(source, "**", comments), *cards]) + "\n"

    def _creep_cards(self, source: LawWithValues, forms: Sequence[CreepForm]) -> _CreepCards:
        stress_functions = [form.stress_function for form in forms]
        is_power_law = all(form.stress_function == "power" and form.is_steady for form in forms)
        if is_power_law and (len(forms) == 2 or (len(forms) == 1 and forms[0].Q)):
            return _double_power(source, forms)
        if len(forms) > 1:
            terms = " + ".join(form.label for form in forms)
            raise _unsupported(source, f"a sum of {len(forms)} ({terms}) that is not one of two power laws")
        if stress_functions == ["sinh"] and forms[0].is_steady:
            return _hyperbolic_sine(source, forms[0])
        if stress_functions == ["power"]:
            return self._power_law_cards(source, forms[0])
        raise _unsupported(source, f"{forms[0].label}: its {stress_functions[0]} of stress does not stand alone there")

    def _power_law_cards(self, source: LawWithValues, form: CreepForm) -> _CreepCards:
        """LAW=STRAIN or LAW=TIME; their newer notation where A would be too small."""
        if form.strain_exponent and form.time_exponent:
            raise _unsupported(source, f"{form.label}: a power of strain times a power of time")
        m = form.strain_exponent / (1.0 - form.strain_exponent) if form.strain_exponent else form.time_exponent
        if not (-1.0 < m <= 0.0 and form.n > 0.0):
            raise _unsupported(
                source, f"{form.label}: Abaqus asks for n > 0 and -1 < m <= 0 (n = {form.n:g}, m = {m:g})"
            )
        notation = _time_hardening(form, m) if form.time_exponent else _strain_hardening(form, m)
        if not form.Q:
            return notation.cards(source, [(form.log_coefficient, None)])
        low, high = temperature_span(source, self.lowest_temperature, self.highest_temperature)
        step = _temperature_step(form, low)
        rows = [(form.log_coefficient_at(T), T) for T in temperature_grid(low, high, step)]
        table_note = _TABLE_NOTE.format(low=low, high=high, step=step, tolerance=_INTERPOLATION_TOLERANCE)
        return notation.cards(source, rows, table_note)


@dataclass(frozen=True)
class _CreepCards:
    """*CREEP with its data, and comments on it."""

    cards: list[str]
    comments: list[str]


def _unsupported(source: LawWithValues, reason: str) -> ExportError:
    return ExportError(f"law '{source.law.name}' is none of Abaqus' own creep laws, {reason}; {_ALTERNATIVE}")


# ---- power laws ----------------------------------------------------------------------------------------------------

CoefficientRows = Sequence[tuple[float, float | None]]
"""ln of A in A s^n e^m t^k, and the temperature in K or None."""


@dataclass(frozen=True)
class _PowerLawNotation:
    """A power law of stress with strain or time, in Abaqus' older and newer notations, with Abaqus' n and m.

    log_A(ln A) : of the older notation's A. log_rate(ln A, ln q0) : of the newer one's rate e0 at the stress q0.
    """

    law: str
    formula: str
    newer_law: str
    newer_formula: str
    n: float
    m: float
    log_A: Callable[[float], float]
    log_rate: Callable[[float, float], float]

    def cards(self, source: LawWithValues, rows: CoefficientRows, table_note: str = "") -> _CreepCards:
        """The older notation, or the newer where A is too small for it."""
        comments = [table_note] if table_note else []
        if min(self.log_A(log_coefficient) for log_coefficient, _ in rows) >= math.log(_SMALLEST_COEFFICIENT):
            data = [
                _data_line(exp_in_range(self.log_A(ln), "A", source), self.n, self.m, *_optional_value(T))
                for ln, T in rows
            ]
            return _CreepCards(
                [f"*CREEP, LAW={self.law}", *data], [f"LAW={self.law}: {self.formula}. A, n, m.", *comments]
            )
        q0 = 100.0 / source.units.megapascals
        rates = [(exp_in_range(self.log_rate(ln, math.log(q0)), "e0", source), T) for ln, T in rows]
        data = [_data_line(q0, self.n, self.m, rate, *_optional_value(T)) for rate, T in rates]
        reason = f"A of LAW={self.law} would be below {_SMALLEST_COEFFICIENT:g}, against which the manual warns"
        comments.insert(
            0,
            f"{reason}; LAW={self.newer_law} is in the manual of 2022, not in that of 2017: {self.newer_formula}. "
            "q0, n, m, e0.",
        )
        return _CreepCards([f"*CREEP, LAW={self.newer_law}", *data], comments)


def _strain_hardening(form: CreepForm, m: float) -> _PowerLawNotation:
    """A s^N e^M with M = m/(m+1) and N = n/(m+1)."""
    return _PowerLawNotation(
        "STRAIN",
        "rate = (A q^n [(m+1) e]^m)^(1/(m+1)), of equivalent stress q and creep strain e",
        "POWER LAW",
        "rate = e0 ((q/q0)^n [(m+1) e]^m)^(1/(m+1))",
        n=form.n * (m + 1.0),
        m=m,
        log_A=lambda ln: (m + 1.0) * ln - m * math.log(m + 1.0),
        log_rate=lambda ln, ln_q0: ln + form.n * ln_q0 - form.strain_exponent * math.log(m + 1.0),
    )


def _time_hardening(form: CreepForm, m: float) -> _PowerLawNotation:
    """A s^n t^m as it is."""
    return _PowerLawNotation(
        "TIME",
        "rate = A q^n t^m, of equivalent stress q and total time t, which must start with the load",
        "TIME POWER LAW",
        "rate = e0 (q/q0)^n (e0 t)^m, of total time t, which must start with the load",
        n=form.n,
        m=m,
        log_A=lambda ln: ln,
        log_rate=lambda ln, ln_q0: (ln + form.n * ln_q0) / (1.0 + m),
    )


def _double_power(source: LawWithValues, forms: Sequence[CreepForm]) -> _CreepCards:
    """Two power laws, or one with an activation energy as two equal halves."""
    q0 = 100.0 / source.units.megapascals
    halves = [*forms, *forms][:2]
    log_share = math.log(len(forms) / 2.0)
    data = []
    for form in halves:
        data += [
            exp_in_range(form.log_coefficient + log_share + form.n * math.log(q0), "A", source),
            form.activation_temperature,
            form.n,
        ]
    comments = [
        "LAW=DOUBLE POWER: rate = A1 exp(-B1/T) (q/q0)^C1 + A2 exp(-B2/T) (q/q0)^C2. A1, B1, C1, A2, B2, C2, q0."
    ]
    if len(forms) == 1:
        comments.append("One power law as two equal halves.")
    if any(form.Q for form in forms):
        comments.append(_ABSOLUTE_ZERO_NOTE)
    return _CreepCards(["*CREEP, LAW=DOUBLE POWER", _data_line(*data, q0)], comments)


_ABSOLUTE_ZERO_NOTE = (
    "T above absolute zero: in a model in K that is 0; in C write *PHYSICAL CONSTANTS, ABSOLUTE ZERO=-273.15."
)


def _hyperbolic_sine(source: LawWithValues, form: CreepForm) -> _CreepCards:
    comments = ["LAW=HYPERB: rate = A sinh(B q)^n exp(-dH/(R T)), of equivalent stress q. A, B, n, dH, R."]
    energy = [form.Q, GAS_CONSTANT] if form.Q else []
    comments += [f"dH in J/mol. {_ABSOLUTE_ZERO_NOTE}"] if energy else []
    A = exp_in_range(form.log_coefficient, "A", source)
    return _CreepCards(["*CREEP, LAW=HYPERB", _data_line(A, 1.0 / form.stress_scale, form.n, *energy)], comments)


# ---- tables and numbers --------------------------------------------------------------------------------------------


def _temperature_step(form: CreepForm, low: float) -> float:
    """The largest step, in K, over which linear interpolation of a rate ~ exp(-Q/(R T)) is good enough.

    The error is k^2 step^2/8 with k = Q/(R T^2); where e0 ~ rate^(1/(1+m)) is interpolated, it is 1/(1+m) times that.
    """
    curvature = (form.activation_temperature / low**2) ** 2 / (1.0 + form.time_exponent)
    return next(
        (step for step in _TEMPERATURE_STEPS if curvature * step**2 / 8.0 <= _INTERPOLATION_TOLERANCE),
        _TEMPERATURE_STEPS[-1],
    )


def _optional_value(T: float | None) -> list[float]:
    return [] if T is None else [T]


def _data_line(*values: float) -> str:
    """A data line; Abaqus reads at most 20 characters of a number."""
    return ", ".join(map(format_number, values))


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [AbaqusCards()]
