"""Ansys' implicit creep laws as Mechanical APDL commands: TB,CREEP with TBOPT 1, 2, 4, 8, 9, 10 and 11.

Mechanical APDL Material Reference, Implicit Creep Equations: creep strain e, stress s, time t, absolute temperature T.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import (
    CreepForm,
    ElasticConstants,
    card_heading,
    creep_forms_of,
    elastic_table,
    exp_in_range,
    format_number,
)
from creepkit.hookspecs import hookimpl
from creepkit.records import Exporter, LawWithValues

_ALTERNATIVE = "export it as 'c' or 'abaqus', and call that rate in a USERCREEP subroutine"


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
class AnsysCards:
    """APDL commands of one material.

    lowest_temperature, highest_temperature : K, of a table of moduli where no tests are known.
    """

    serves = ("usercreep", "tb-creep", "apdl")
    name: str = "ansys"
    title: str = "Ansys Mechanical APDL commands with one of its implicit creep laws (TB,CREEP)"
    suffix: str = ".mac"
    lowest_temperature: float = 873.15
    highest_temperature: float = 1273.15

    def text(self, source: LawWithValues) -> str:
        """Return MP commands where moduli are given, TB,CREEP and TBDATA, of the material number 1."""
        forms = creep_forms_of(source, "Ansys' TB,CREEP", _ALTERNATIVE)
        option, constants = _option_and_constants(source, forms)
        comments = [f"Implicit creep, TBOPT = {option}: {_CREEP_OPTIONS[option]}."]
        if any(form.Q for form in forms):
            comments.append("T is absolute: in a model in C, write TOFFST,273.15.")
        if any(form.time_exponent for form in forms):
            comments.append("t is the analysis time, which must start with the load.")
        comments.append(f"Material number 1 is {source.name or source.law.name}.")
        moduli = elastic_table(source, (self.lowest_temperature, self.highest_temperature), step=50.0)
        lines = [*_elastic_commands(moduli)]
        lines += [f"TB,CREEP,1,1,{len(constants)},{option}"]
        lines += [f"TBDATA,{k + 1},{_comma_separated(constants[k : k + 6])}" for k in range(0, len(constants), 6)]
        return "\n".join([*card_heading(source, "!", comments), *lines]) + "\n"


def _option_and_constants(source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[int, list[float]]:
    """The number of Ansys' law and its constants."""
    for recogniser in (_single_term, _combined_time_hardening, _generalized_graham):
        result = recogniser(source, forms)
        if result is not None:
            return result
    terms = " + ".join(form.label for form in forms)
    raise ExportError(f"law '{source.law.name}' is none of Ansys' implicit creep laws ({terms}); {_ALTERNATIVE}")


def _single_term(source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[int, list[float]] | None:
    if len(forms) != 1 or (forms[0].strain_exponent and forms[0].time_exponent):
        return None
    form, energy = forms[0], forms[0].activation_temperature
    A = exp_in_range(form.log_coefficient, "C1", source)
    if form.stress_function == "power":
        if form.is_steady:
            return 10, [A, form.n, energy]
        return (
            (1, [A, form.n, form.strain_exponent, energy])
            if form.strain_exponent
            else (2, [A, form.n, form.time_exponent, energy])
        )
    if not form.is_steady:
        return None
    return (
        (8, [A, 1.0 / form.stress_scale, form.n, energy])
        if form.stress_function == "sinh"
        else (9, [A, form.stress_scale, energy])
    )


def _combined_time_hardening(source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[int, list[float]] | None:
    """A power law with t^C3, C3 > -1, and one without time."""
    if len(forms) != 2 or not all(form.stress_function == "power" and not form.strain_exponent for form in forms):
        return None
    transient, steady = sorted(forms, key=lambda form: not form.time_exponent)
    if steady.time_exponent or transient.time_exponent <= -1.0:
        return None
    transient_coefficient, steady_coefficient = (
        exp_in_range(form.log_coefficient, name, source) for form, name in ((transient, "C1"), (steady, "C5"))
    )
    return 11, [
        transient_coefficient,
        transient.n,
        transient.time_exponent,
        transient.activation_temperature,
        steady_coefficient,
        steady.n,
        steady.activation_temperature,
    ]


def _generalized_graham(source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[int, list[float]] | None:
    """Two or three powers of time with one stress exponent and one activation energy."""
    first, *others = forms
    same_exponents = all(
        (f.stress_function, f.n, f.strain_exponent, f.Q) == ("power", first.n, 0.0, first.Q) for f in forms
    )
    if not (same_exponents and 1 <= len(others) <= 2):
        return None
    constants = [exp_in_range(first.log_coefficient, "C1", source), first.n, first.time_exponent]
    for form in others:
        constants += [
            exp_in_range(form.log_coefficient - first.log_coefficient, "C4 or C6", source),
            form.time_exponent,
        ]
    return 4, [*constants, *[0.0] * (7 - len(constants)), first.activation_temperature]


def _elastic_commands(rows: Sequence[ElasticConstants]) -> Iterator[str]:
    """Young's modulus and Poisson's ratio, six temperatures a command where they depend on it."""
    temperatures = [m.T for m in rows if m.T is not None]
    labels = {"EX": [m.E for m in rows], "PRXY": [m.nu for m in rows]}
    if temperatures:
        yield "MPTEMP"
        yield from (f"MPTEMP,{k + 1},{_comma_separated(temperatures[k : k + 6])}" for k in range(0, len(rows), 6))
        for label, values in labels.items():
            yield from (
                f"MPDATA,{label},1,{k + 1},{_comma_separated(values[k : k + 6])}" for k in range(0, len(rows), 6)
            )
    elif rows:
        yield from (f"MP,{label},1,{format_number(value)}" for label, (value,) in labels.items())


def _comma_separated(values: Sequence[float]) -> str:
    return ",".join(map(format_number, values))


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [AnsysCards()]
