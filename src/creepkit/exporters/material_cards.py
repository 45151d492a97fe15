"""Creep laws that Abaqus, Ansys and code_aster have built in, as the input of these codes.

Abaqus: *CREEP with LAW=STRAIN, TIME, HYPERB, DOUBLE POWER, (TIME) POWER LAW. Abaqus Analysis User's Guide,
Rate-dependent plasticity: creep and swelling; Keywords Guide, *CREEP. Its strain hardening is written
(A q^n [(m+1) e]^m)^(1/(m+1)), which has other A, n and m than A s^n e^m.

Ansys: implicit creep laws as Mechanical APDL commands, TB,CREEP with TBOPT 1, 2, 4, 8, 9, 10 and 11. Mechanical APDL
Material Reference, Implicit Creep Equations: creep strain e, stress s, time t, absolute temperature T.

code_aster: DEFI_MATERIAU with LEMAITRE, whose limit UN_SUR_M = 0 is Norton's law. R5.03.08: rate =
(UN_SUR_K s / e^UN_SUR_M)^N, so that A s^n e^m has N = n, UN_SUR_K = A^(1/n), UN_SUR_M = -m/n. With an activation
energy, LEMAITRE_FO takes UN_SUR_K as a formula of TEMP.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import (
    CodeInput,
    CreepForm,
    ElasticConstants,
    constant_elasticity,
    elastic_expressions,
    elastic_table,
    elasticity_varies,
    exp_in_range,
    format_number,
    temperature_grid,
    temperature_span,
)
from creepkit.exporters.creep_subroutine import CALCULIX_CETOL
from creepkit.exporters.law_code import Identifiers
from creepkit.hookspecs import hookimpl
from creepkit.language.symbols import GAS_CONSTANT, mean_stress, principal_stress
from creepkit.records import Exporter, LawWithValues

_SMALLEST_COEFFICIENT = 1e-27
"""Below this A the manual warns of numerical difficulties with LAW=STRAIN and LAW=TIME."""


_CALCULIX_LEAST = 1e-20
"""The least A that ccx 2.20 takes: it creeps by it where less is written, without a word."""


_INTERPOLATION_TOLERANCE = 1e-3
"""Relative error of linear interpolation of A between the rows of a table."""


_TEMPERATURE_STEPS = (50.0, 25.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1)


_TABLE_OF_MODULI = (
    "*ELASTIC needs a row at each temperature of *CREEP in CalculiX, which else creeps by the first row at every one."
)


_TIME = "TIME=TOTAL counts all steps, TIME=CREEP those with creep: write the one that starts with the load"
_FORMULAS = {
    "STRAIN": "rate = (A q^n [(m+1) e]^m)^(1/(m+1)), of equivalent stress q and creep strain e",
    "TIME": f"rate = A q^n t^m, of equivalent stress q and time t. {_TIME}",
    "POWER LAW": "rate = e0 ((q/q0)^n [(m+1) e]^m)^(1/(m+1))",
    "TIME POWER LAW": f"rate = e0 (q/q0)^n (e0 t)^m, of time t. {_TIME}",
}
"""{LAW: its rate}, in Abaqus' older notation and in its newer one."""


CreepCards = tuple[list[str], list[str]]
"""Comments, and *CREEP with its data."""


@dataclass(frozen=True)
class AbaqusCards(CodeInput):
    """Material cards with one of Abaqus' own creep laws."""

    code, program = "Abaqus' *CREEP", "Abaqus"
    has_steady_arrhenius = True
    alternative = "export it as 'abaqus', a CREEP subroutine"
    marker = "**"
    name: str = "abaqus-cards"
    title: str = "Abaqus material cards with one of its own creep laws (*CREEP)"
    suffix: str = ".inp"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """*MATERIAL, *ELASTIC where moduli are given, and *CREEP."""
        creep_comments, creep = self._creep_cards(source, forms)
        names = Identifiers((), ignore_case=True, max_length=80)
        requested = source.name or source.law.name
        table = self._temperatures(source, forms)
        rows = elastic_table(source, step=25.0, at=table)
        elastic = ["*ELASTIC", *(_data_line(m.E, m.nu, m.T) for m in rows)] if rows else []
        cards = [f"*MATERIAL, NAME={names.unique(requested)}", *elastic, *creep]
        notes = [] if elastic else ["*ELASTIC is missing: no modulus was given; write it beside *CREEP."]
        notes += [_TABLE_OF_MODULI] if table else []
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
        rows, notes = self._rows(source, form)
        return _power_law(source, form, m, rows, notes)

    def _rows(self, source: LawWithValues, form: CreepForm) -> tuple[dict[float | None, float], list[str]]:
        """{K, or None: ln of the coefficient} of the rows, and the note on a table of them."""
        temperatures = self._temperatures(source, [form])
        if not temperatures:
            return {None: form.log_coefficient}, []
        low, high, step = temperatures[0], temperatures[-1], _temperature_step(form, temperatures[0])
        note = f"Table from {low:g} to {high:g} K in steps of {step:g} K: {self.program} interpolates linearly between "
        note += f"rows, which is within {_INTERPOLATION_TOLERANCE:.1%}, and keeps the end values outside."
        return {T: form.log_coefficient_at(T) for T in temperatures}, [note]

    def _temperatures(self, source: LawWithValues, forms: Sequence[CreepForm]) -> list[float]:
        """K, of the rows of a power law that depends on temperature; none of what needs no table."""
        if len(forms) > 1 or not forms[0].Q or (forms[0].is_steady and self.has_steady_arrhenius):
            return []
        low, high = temperature_span(source)
        return temperature_grid(low, high, _temperature_step(forms[0], low))


@dataclass(frozen=True)
class CalculixCards(AbaqusCards):
    """Material cards with the creep law that CalculiX has built in, of stress and time."""

    code, program = "CalculiX' *CREEP, LAW=NORTON", "CalculiX"
    has_steady_arrhenius = False
    alternative = "export it as 'calculix', a CREEP subroutine"
    unknown_there = (principal_stress, mean_stress)
    name: str = "calculix-cards"
    title: str = "CalculiX material cards with its own creep law (*CREEP, LAW=NORTON)"

    def _creep_cards(self, source: LawWithValues, forms: Sequence[CreepForm]) -> CreepCards:
        form = forms[0]
        if len(forms) > 1 or form.stress_function != "power" or form.strain_exponent:
            terms = " + ".join(one.label for one in forms)
            raise self.refusal(source, f" is not rate = A q^n t^m, the creep law that CalculiX has ({terms})")
        rows, notes = self._rows(source, form)
        least = min(rows.values())
        if least < math.log(_CALCULIX_LEAST):
            found = f"1e{least / math.log(10):.0f}, and CalculiX creeps by {_CALCULIX_LEAST:g} where less is written"
            remedy = "a model in GPa and h has larger ones: units={'stress': 'GPa', 'time': 'h'}"
            raise self.refusal(source, f": A would be as small as {found} ({remedy})")
        data = [_data_line(exp_in_range(ln, "A", source), form.n, form.time_exponent, T) for T, ln in rows.items()]
        formula = "rate = A q^n t^m, of equivalent stress q and total time t, which must start with the load. A, n, m."
        return [f"LAW=NORTON: {formula}", *notes, CALCULIX_CETOL], ["*CREEP, LAW=NORTON", *data]


def _power_law(
    source: LawWithValues, form: CreepForm, m: float, rows: Mapping[float | None, float], comments: list[str]
) -> CreepCards:
    """LAW=STRAIN or LAW=TIME; their newer notation where A would be too small.

    A s^N e^M has m = M/(1 - M), so that M = m/(m+1) and N = n/(m+1); A s^n t^m stands as it is.
    rows : {temperature in K or None: ln of A in A s^n e^M t^m}.
    """
    by_time, share = bool(form.time_exponent), m + 1.0
    counted = ", TIME=TOTAL" if by_time else ""
    law, n = ("TIME", form.n) if by_time else ("STRAIN", form.n * share)
    log_A = [ln if by_time else share * ln - m * math.log(share) for ln in rows.values()]
    if min(log_A) >= math.log(_SMALLEST_COEFFICIENT):
        data = [_data_line(exp_in_range(ln, "A", source), n, m, T) for ln, T in zip(log_A, rows, strict=True)]
        return [f"LAW={law}: {_FORMULAS[law]}. A, n, m.", *comments], [f"*CREEP, LAW={law}{counted}", *data]
    q0 = 100.0 / source.units.megapascals
    shifted = [ln + form.n * math.log(q0) for ln in rows.values()]
    log_rates = [ln / share if by_time else ln - form.strain_exponent * math.log(share) for ln in shifted]
    newer = "TIME POWER LAW" if by_time else "POWER LAW"
    reason = (
        f"A of LAW={law} would be below {_SMALLEST_COEFFICIENT:g}, against which the manual warns; LAW={newer} is in "
        f"the manual of 2022, not in that of 2017: {_FORMULAS[newer]}. q0, n, m, e0."
    )
    data = [_data_line(q0, n, m, exp_in_range(ln, "e0", source), T) for ln, T in zip(log_rates, rows, strict=True)]
    return [reason, *comments], [f"*CREEP, LAW={newer}{counted}", *data]


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


_CREEP_OPTIONS = {
    1: "strain hardening, rate = C1 s^C2 e^C3 exp(-C4/T)",
    2: "time hardening, rate = C1 s^C2 t^C3 exp(-C4/T)",
    4: "generalized Graham, rate = C1 s^C2 (t^C3 + C4 t^C5 + C6 t^C7) exp(-C8/T)",
    8: "generalized Garofalo, rate = C1 sinh(C2 s)^C3 exp(-C4/T)",
    9: "exponential form, rate = C1 exp(s/C2) exp(-C3/T)",
    10: "Norton, rate = C1 s^C2 exp(-C3/T)",
    11: "combined time hardening, strain = C1/(C3+1) s^C2 t^(C3+1) exp(-C4/T) + C5 s^C6 t exp(-C7/T)",
}
"""{TBOPT: what it is}."""


@dataclass(frozen=True)
class AnsysCards(CodeInput):
    """APDL commands of the material number 1: MP where moduli are given, TB,CREEP and TBDATA."""

    code = "Ansys' TB,CREEP"
    alternative = "export it as 'c' or 'abaqus', and call that rate in a USERCREEP subroutine"
    marker = "!"
    serves = ("usercreep", "tb-creep", "apdl")
    name: str = "ansys"
    title: str = "Ansys Mechanical APDL commands with one of its implicit creep laws (TB,CREEP)"
    suffix: str = ".mac"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """Comments and commands."""
        recognisers = (_single_term, _combined_time_hardening, _generalized_graham)
        found = next((result for recogniser in recognisers if (result := recogniser(source, forms))), None)
        if found is None:
            terms = " + ".join(form.label for form in forms)
            raise self.refusal(source, f" is none of Ansys' implicit creep laws ({terms})")
        option, constants = found
        comments = [f"Implicit creep, TBOPT = {option}: {_CREEP_OPTIONS[option]}."]
        if any(form.Q for form in forms):
            comments.append("T is absolute: in a model in C, write TOFFST,273.15.")
        if any(form.time_exponent for form in forms):
            comments.append("t is the analysis time, which must start with the load.")
        comments.append(f"Material number 1 is {source.name or source.law.name}.")
        moduli = elastic_table(source, step=50.0)
        creep = [f"TB,CREEP,1,1,{len(constants)},{option}", *_six_a_line("TBDATA", constants)]
        return comments, [*_elastic_commands(moduli), *creep]


OptionAndConstants = tuple[int, list[float]]
"""The number of Ansys' law and its constants."""


def _single_term(source: LawWithValues, forms: Sequence[CreepForm]) -> OptionAndConstants | None:
    form, energy = forms[0], forms[0].activation_temperature
    if len(forms) != 1 or (form.strain_exponent and form.time_exponent):
        return None
    A = exp_in_range(form.log_coefficient, "C1", source)
    if form.is_steady:
        return {
            "power": (10, [A, form.n, energy]),
            "sinh": (8, [A, 1.0 / form.stress_scale, form.n, energy]),
            "exponential": (9, [A, form.stress_scale, energy]),
        }[form.stress_function]
    if form.stress_function != "power":
        return None
    return 1 if form.strain_exponent else 2, [A, form.n, form.strain_exponent or form.time_exponent, energy]


def _combined_time_hardening(source: LawWithValues, forms: Sequence[CreepForm]) -> OptionAndConstants | None:
    """A power law with t^C3, C3 > -1, and one without time."""
    if len(forms) != 2 or not all(form.stress_function == "power" and not form.strain_exponent for form in forms):
        return None
    transient, steady = sorted(forms, key=lambda form: not form.time_exponent)
    if steady.time_exponent or transient.time_exponent <= -1.0:
        return None
    C1, C5 = (exp_in_range(f.log_coefficient, name, source) for f, name in ((transient, "C1"), (steady, "C5")))
    first = [C1, transient.n, transient.time_exponent, transient.activation_temperature]
    return 11, [*first, C5, steady.n, steady.activation_temperature]


def _generalized_graham(source: LawWithValues, forms: Sequence[CreepForm]) -> OptionAndConstants | None:
    """Two or three powers of time with one stress exponent and one activation energy."""
    first, *others = forms
    shared = ("power", first.n, 0.0, first.Q)
    if not 1 <= len(others) <= 2 or any((f.stress_function, f.n, f.strain_exponent, f.Q) != shared for f in forms):
        return None
    constants = [exp_in_range(first.log_coefficient, "C1", source), first.n, first.time_exponent]
    for form in others:
        ratio = exp_in_range(form.log_coefficient - first.log_coefficient, "C4 or C6", source)
        constants += [ratio, form.time_exponent]
    return 4, [*constants, *[0.0] * (7 - len(constants)), first.activation_temperature]


def _elastic_commands(rows: Sequence[ElasticConstants]) -> Iterator[str]:
    """Young's modulus and Poisson's ratio, six temperatures a command where they depend on it."""
    temperatures = [m.T for m in rows if m.T is not None]
    labels = {"EX": [m.E for m in rows], "PRXY": [m.nu for m in rows]}
    if temperatures:
        yield "MPTEMP"
        yield from _six_a_line("MPTEMP", temperatures)
        for label, values in labels.items():
            yield from _six_a_line(f"MPDATA,{label},1", values)
    elif rows:
        yield from (f"MP,{label},1,{format_number(value)}" for label, (value,) in labels.items())


def _six_a_line(command: str, values: Sequence[float]) -> Iterator[str]:
    """Commands with six values each, after the position of the first."""
    for k in range(0, len(values), 6):
        yield ",".join([command, str(k + 1), *map(format_number, values[k : k + 6])])


_FORMULA = "LEMAITRE: rate = (UN_SUR_K s / e^UN_SUR_M)^N, of equivalent stress s and creep strain e."


_RESERVED = (*keyword.kwlist, "_F", "DEFI_CONSTANTE", "DEFI_MATERIAU", "FORMULE")


class CodeAsterMaterial(CodeInput):
    """A material for COMPORTEMENT=_F(RELATION='LEMAITRE')."""

    code = "code_aster's LEMAITRE"
    alternative = "export it as 'mfront', which code_aster reads with RELATION='MFRONT'"
    marker = "#"
    first_lines = ("# -*- coding: utf-8 -*-",)
    """The file is Python, which else takes the encoding from what a title or note says (PEP 263)."""
    serves = ("aster",)
    name = "code_aster"
    title = "code_aster DEFI_MATERIAU with LEMAITRE (and Norton's law as its limit)"
    suffix = ".comm"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """DEFI_MATERIAU, with ELAS where moduli are given, and the formulas that it needs."""
        form = self._lemaitre_form(source, forms)
        names = Identifiers(_RESERVED, max_length=6)
        requested = source.name or source.law.name
        label = names.unique(requested)
        creep_formulas, creep_keyword = _creep_keyword(source, form, label)
        elastic_formulas, elastic_keywords = _elastic_keywords(source, label)
        formulas = [*elastic_formulas, *creep_formulas]
        comments = [_FORMULA, "Use it with COMPORTEMENT=_F(RELATION='LEMAITRE')."]
        comments += ["TEMP, a variable de commande of the material field, must be in K."] if formulas else []
        call = [f"{label} = DEFI_MATERIAU(", *(f"    {line}," for line in (*elastic_keywords, creep_keyword)), ")"]
        return [*comments, *names.renaming_notes([requested])], [*formulas, *call]

    def _lemaitre_form(self, source: LawWithValues, forms: Sequence[CreepForm]) -> CreepForm:
        """The one form that LEMAITRE has."""
        form = forms[0]
        if len(forms) > 1:
            reason = f"it is a sum ({' + '.join(f.label for f in forms)})"
        elif form.stress_function != "power":
            reason = f"{form.label} is a {form.stress_function} of stress"
        elif form.time_exponent:
            reason = f"{form.label} depends on time"
        elif not (form.n > 0.0 and form.strain_exponent <= 0.0):
            exponents = f"n = {form.n:g}, m = {form.strain_exponent:g}"
            reason = f"it asks for a positive stress exponent and hardening ({exponents})"
        else:
            return form
        raise self.refusal(source, f" is not code_aster's LEMAITRE: {reason}")


def _creep_keyword(source: LawWithValues, form: CreepForm, label: str) -> tuple[list[str], str]:
    """Formulas, and the keyword that reads them."""
    inverse_K = exp_in_range(form.log_coefficient / form.n, "UN_SUR_K", source)
    n, K, hardening = map(format_number, (form.n, inverse_K, abs(form.strain_exponent) / form.n))
    if not form.Q:
        return [], f"LEMAITRE=_F(N={n}, UN_SUR_K={K}, UN_SUR_M={hardening})"
    slope = format_number(-form.activation_temperature / form.n)
    formulas = [
        f"{label}_N = DEFI_CONSTANTE(VALE={n})",
        f"{label}_K = FORMULE(NOM_PARA='TEMP', VALE='{K} * exp({slope} / TEMP)')",
        f"{label}_M = DEFI_CONSTANTE(VALE={hardening})",
    ]
    return formulas, f"LEMAITRE_FO=_F(N={label}_N, UN_SUR_K={label}_K, UN_SUR_M={label}_M)"


def _elastic_keywords(source: LawWithValues, label: str) -> tuple[list[str], list[str]]:
    """Formulas of moduli that depend on temperature, and the keyword for the moduli."""
    elastic = source.elastic
    if elastic is None or not elasticity_varies(elastic):
        moduli = constant_elasticity(source)
        text = "" if moduli is None else f"ELAS=_F(E={format_number(moduli.E)}, NU={format_number(moduli.nu)})"
        return [], [text] if text else []
    texts = [sympy.sstr(e, full_prec=False) for e in elastic_expressions(source, elastic, "TEMP")]
    named_texts = zip((f"{label}_E", f"{label}_P"), texts, strict=True)
    formulas = [f"{name} = FORMULE(NOM_PARA='TEMP', VALE='{text}')" for name, text in named_texts]
    return formulas, [f"ELAS_FO=_F(E={label}_E, NU={label}_P)"]


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [AbaqusCards(), CalculixCards(), AnsysCards(), CodeAsterMaterial()]
