"""Ansys' implicit creep laws as Mechanical APDL commands: TB,CREEP with TBOPT 1, 2, 4, 8, 9, 10 and 11.

Mechanical APDL Material Reference, Implicit Creep Equations: creep strain e, stress s, time t, absolute temperature T.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from creepkit.exporters.creep_forms import (
    CodeInput,
    CreepForm,
    ElasticConstants,
    elastic_table,
    exp_in_range,
    format_number,
)
from creepkit.hookspecs import hookimpl
from creepkit.records import Exporter, LawWithValues

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
    """APDL commands of the material number 1: MP where moduli are given, TB,CREEP and TBDATA.

    lowest_temperature, highest_temperature : K, of a table of moduli where no tests are known.
    """

    code = "Ansys' TB,CREEP"
    alternative = "export it as 'c' or 'abaqus', and call that rate in a USERCREEP subroutine"
    marker = "!"
    serves = ("usercreep", "tb-creep", "apdl")
    name: str = "ansys"
    title: str = "Ansys Mechanical APDL commands with one of its implicit creep laws (TB,CREEP)"
    suffix: str = ".mac"
    lowest_temperature: float = 873.15
    highest_temperature: float = 1273.15

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
        moduli = elastic_table(source, (self.lowest_temperature, self.highest_temperature), step=50.0)
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


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [AnsysCards()]
