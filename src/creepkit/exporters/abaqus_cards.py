"""Abaqus' own creep laws as material cards: *CREEP with LAW=STRAIN, TIME, HYPERB, DOUBLE POWER, (TIME) POWER LAW.

Abaqus Analysis User's Guide, Rate-dependent plasticity: creep and swelling; Keywords Guide, *CREEP. Its strain
hardening is written (A q^n [(m+1) e]^m)^(1/(m+1)), which has other A, n and m than A s^n e^m.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import (
    CodeInput,
    CreepForm,
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

_SMALLEST_COEFFICIENT = 1e-27
"""Below this A the manual warns of numerical difficulties with LAW=STRAIN and LAW=TIME."""


_INTERPOLATION_TOLERANCE = 1e-3
"""Relative error of linear interpolation of A between the rows of a table."""


_TEMPERATURE_STEPS = (50.0, 25.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1)


_TABLE_NOTE = (
    "Table from {low:g} to {high:g} K in steps of {step:g} K: Abaqus interpolates linearly between rows, which is "
    "within {tolerance:.1%}, and keeps the end values outside."
)


_TABLE_OF_MODULI = (
    "*ELASTIC needs a row at each temperature of *CREEP in CalculiX, which else creeps by the first row at every one."
)


_FORMULAS = {
    "STRAIN": "rate = (A q^n [(m+1) e]^m)^(1/(m+1)), of equivalent stress q and creep strain e",
    "TIME": "rate = A q^n t^m, of equivalent stress q and total time t, which must start with the load",
    "POWER LAW": "rate = e0 ((q/q0)^n [(m+1) e]^m)^(1/(m+1))",
    "TIME POWER LAW": "rate = e0 (q/q0)^n (e0 t)^m, of total time t, which must start with the load",
}
"""{LAW: its rate}, in Abaqus' older notation and in its newer one."""


CreepCards = tuple[list[str], list[str]]
"""Comments, and *CREEP with its data."""


@dataclass(frozen=True)
class AbaqusCards(CodeInput):
    """Material cards with one of Abaqus' own creep laws.

    lowest_temperature, highest_temperature : K, of tables where no tests are known.
    """

    code = "Abaqus' *CREEP"
    alternative = "export it as 'abaqus', a CREEP subroutine"
    marker = "**"
    name: str = "abaqus-cards"
    title: str = "Abaqus material cards with one of its own creep laws (*CREEP)"
    suffix: str = ".inp"
    lowest_temperature: float = 873.15
    highest_temperature: float = 1273.15

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """*MATERIAL, *ELASTIC where moduli are given, and *CREEP."""
        creep_comments, creep = self._creep_cards(source, forms)
        names = Identifiers((), ignore_case=True, max_length=80)
        requested = source.name or source.law.name
        table = self._temperatures(source, forms)
        rows = elastic_table(source, (self.lowest_temperature, self.highest_temperature), step=25.0, at=table)
        elastic = ["*ELASTIC", *(_data_line(m.E, m.nu, m.T) for m in rows)] if rows else []
        cards = [f"*MATERIAL, NAME={names.unique(requested)}", *elastic, *creep]
        notes = [] if elastic else ["*ELASTIC is missing: no modulus was given; write it beside *CREEP."]
        notes += [_TABLE_OF_MODULI] if elastic and table else []
        return [*names.renaming_notes([requested]), *creep_comments, *notes], cards

    def _creep_cards(self, source: LawWithValues, forms: Sequence[CreepForm]) -> CreepCards:
        form, functions = forms[0], {form.stress_function for form in forms}
        is_power_law = functions == {"power"} and all(form.is_steady for form in forms)
        if is_power_law and (len(forms) == 2 or (len(forms) == 1 and form.Q)):
            return _double_power(source, forms)
        if len(forms) > 1:
            terms = " + ".join(form.label for form in forms)
            raise self._unsupported(source, f"a sum of {len(forms)} ({terms}) that is not one of two power laws")
        if functions == {"sinh"} and form.is_steady:
            return _hyperbolic_sine(source, form)
        if functions == {"power"}:
            return self._power_law_cards(source, form)
        raise self._unsupported(
            source, f"{form.label}: its {form.stress_function} of stress does not stand alone there"
        )

    def _unsupported(self, source: LawWithValues, reason: str) -> ExportError:
        return self.refusal(source, f" is none of Abaqus' own creep laws, {reason}")

    def _power_law_cards(self, source: LawWithValues, form: CreepForm) -> CreepCards:
        """A power law with strain or time, as a table where temperature enters."""
        if form.strain_exponent and form.time_exponent:
            raise self._unsupported(source, f"{form.label}: a power of strain times a power of time")
        m = form.strain_exponent / (1.0 - form.strain_exponent) if form.strain_exponent else form.time_exponent
        if not (-1.0 < m <= 0.0 and form.n > 0.0):
            raise self._unsupported(
                source, f"{form.label}: Abaqus asks for n > 0 and -1 < m <= 0 (n = {form.n:g}, m = {m:g})"
            )
        if not form.Q:
            return _power_law(source, form, m, {None: form.log_coefficient}, [])
        temperatures = self._temperatures(source, [form])
        rows: dict[float | None, float] = {T: form.log_coefficient_at(T) for T in temperatures}
        low, high, step = temperatures[0], temperatures[-1], _temperature_step(form, temperatures[0])
        note = _TABLE_NOTE.format(low=low, high=high, step=step, tolerance=_INTERPOLATION_TOLERANCE)
        return _power_law(source, form, m, rows, [note])

    def _temperatures(self, source: LawWithValues, forms: Sequence[CreepForm]) -> list[float]:
        """K, of the rows of a power law that hardens and depends on temperature; none of what needs no table."""
        if len(forms) > 1 or not forms[0].Q or forms[0].is_steady:
            return []
        low, high = temperature_span(source, self.lowest_temperature, self.highest_temperature)
        return temperature_grid(low, high, _temperature_step(forms[0], low))


def _power_law(
    source: LawWithValues, form: CreepForm, m: float, rows: Mapping[float | None, float], comments: list[str]
) -> CreepCards:
    """LAW=STRAIN or LAW=TIME; their newer notation where A would be too small.

    A s^N e^M has m = M/(1 - M), so that M = m/(m+1) and N = n/(m+1); A s^n t^m stands as it is.
    rows : {temperature in K or None: ln of A in A s^n e^M t^m}.
    """
    by_time, share = bool(form.time_exponent), m + 1.0
    law, n = ("TIME", form.n) if by_time else ("STRAIN", form.n * share)
    log_A = [ln if by_time else share * ln - m * math.log(share) for ln in rows.values()]
    if min(log_A) >= math.log(_SMALLEST_COEFFICIENT):
        data = [_data_line(exp_in_range(ln, "A", source), n, m, T) for ln, T in zip(log_A, rows, strict=True)]
        return [f"LAW={law}: {_FORMULAS[law]}. A, n, m.", *comments], [f"*CREEP, LAW={law}", *data]
    q0 = 100.0 / source.units.megapascals
    shifted = [ln + form.n * math.log(q0) for ln in rows.values()]
    log_rates = [ln / share if by_time else ln - form.strain_exponent * math.log(share) for ln in shifted]
    newer = "TIME POWER LAW" if by_time else "POWER LAW"
    reason = (
        f"A of LAW={law} would be below {_SMALLEST_COEFFICIENT:g}, against which the manual warns; LAW={newer} is in "
        f"the manual of 2022, not in that of 2017: {_FORMULAS[newer]}. q0, n, m, e0."
    )
    data = [_data_line(q0, n, m, exp_in_range(ln, "e0", source), T) for ln, T in zip(log_rates, rows, strict=True)]
    return [reason, *comments], [f"*CREEP, LAW={newer}", *data]


def _double_power(source: LawWithValues, forms: Sequence[CreepForm]) -> CreepCards:
    """Two power laws, or one with an activation energy as two equal halves."""
    q0 = 100.0 / source.units.megapascals
    log_share, data = math.log(len(forms) / 2.0), []
    for form in [*forms, *forms][:2]:
        A = exp_in_range(form.log_coefficient + log_share + form.n * math.log(q0), "A", source)
        data += [A, form.activation_temperature, form.n]
    comments = [
        "LAW=DOUBLE POWER: rate = A1 exp(-B1/T) (q/q0)^C1 + A2 exp(-B2/T) (q/q0)^C2. A1, B1, C1, A2, B2, C2, q0."
    ]
    if len(forms) == 1:
        comments.append("One power law as two equal halves.")
    if any(form.Q for form in forms):
        comments.append(_ABSOLUTE_ZERO_NOTE)
    return comments, ["*CREEP, LAW=DOUBLE POWER", _data_line(*data, q0)]


_ABSOLUTE_ZERO_NOTE = (
    "T above absolute zero: in a model in K that is 0; in C write *PHYSICAL CONSTANTS, ABSOLUTE ZERO=-273.15."
)


def _hyperbolic_sine(source: LawWithValues, form: CreepForm) -> CreepCards:
    comments = ["LAW=HYPERB: rate = A sinh(B q)^n exp(-dH/(R T)), of equivalent stress q. A, B, n, dH, R."]
    energy = [form.Q, GAS_CONSTANT] if form.Q else []
    comments += [f"dH in J/mol. {_ABSOLUTE_ZERO_NOTE}"] if energy else []
    A = exp_in_range(form.log_coefficient, "A", source)
    return comments, ["*CREEP, LAW=HYPERB", _data_line(A, 1.0 / form.stress_scale, form.n, *energy)]


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


def _data_line(*values: float | None) -> str:
    """A data line; Abaqus reads at most 20 characters of a number, and takes None, a temperature, as left out."""
    return ", ".join(format_number(value) for value in values if value is not None)


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [AbaqusCards()]
