"""Ansys' implicit creep laws as Mechanical APDL commands: TB,CREEP with TBOPT 1, 2, 4, 8, 9, 10 and 11.

Mechanical APDL Material Reference, Implicit Creep Equations: creep strain e, stress s, time t, absolute temperature T.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.forms import Form, forms_of
from creepkit.export.cards.text import Moduli, figure, grid, moduli, number, top, warmth
from creepkit.records import ValuedLaw

_INSTEAD = "export it as 'c' or 'abaqus', and call that rate in a USERCREEP subroutine"

_LAWS = {
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
    """APDL commands of one material; low, high : K, of a table of moduli against temperature."""

    name: str = "ansys"
    title: str = "Ansys Mechanical APDL commands with one of its implicit creep laws (TB,CREEP)"
    suffix: str = ".mac"
    low: float = 873.15
    high: float = 1273.15

    def text(self, source: ValuedLaw) -> str:
        """Return MP commands where moduli are given, TB,CREEP and TBDATA, of the material number 1."""
        forms = forms_of(source, "Ansys' TB,CREEP", _INSTEAD)
        option, constants = _constants(source, forms)
        about = [f"Implicit creep, TBOPT = {option}: {_LAWS[option]}."]
        if any(form.Q for form in forms):
            about.append("T is absolute: in a model in C, write TOFFST,273.15.")
        if any(form.time for form in forms):
            about.append("t is the analysis time, which must start with the load.")
        about.append(f"Material number 1 is {source.name or source.law.name}.")
        lines = [*_elastic(moduli(source, grid(*warmth(source, self.low, self.high), 50.0)))]
        lines += [f"TB,CREEP,1,1,{len(constants)},{option}"]
        lines += [f"TBDATA,{k + 1},{_listed(constants[k : k + 6])}" for k in range(0, len(constants), 6)]
        return "\n".join([*top(source, "!", about), *lines]) + "\n"


def _constants(source: ValuedLaw, forms: Sequence[Form]) -> tuple[int, list[float]]:
    """The number of Ansys' law and its constants."""
    for attempt in (_single, _combined, _graham):
        found = attempt(source, forms)
        if found is not None:
            return found
    told = " + ".join(form.label for form in forms)
    raise ExportError(f"law '{source.law.name}' is none of Ansys' implicit creep laws ({told}); {_INSTEAD}")


def _single(source: ValuedLaw, forms: Sequence[Form]) -> tuple[int, list[float]] | None:
    if len(forms) != 1 or (forms[0].strain and forms[0].time):
        return None
    form, energy = forms[0], forms[0].per_kelvin
    A = number(form.log_coefficient, "C1", source)
    if form.shape == "power":
        if form.steady:
            return 10, [A, form.n, energy]
        return (1, [A, form.n, form.strain, energy]) if form.strain else (2, [A, form.n, form.time, energy])
    if not form.steady:
        return None
    return (8, [A, 1.0 / form.B, form.n, energy]) if form.shape == "sinh" else (9, [A, form.B, energy])


def _combined(source: ValuedLaw, forms: Sequence[Form]) -> tuple[int, list[float]] | None:
    """A power law with t^C3, C3 > -1, and one without time."""
    if len(forms) != 2 or not all(form.shape == "power" and not form.strain for form in forms):
        return None
    first, second = sorted(forms, key=lambda form: not form.time)
    if second.time or first.time <= -1.0:
        return None
    one, two = (number(form.log_coefficient, name, source) for form, name in ((first, "C1"), (second, "C5")))
    return 11, [one, first.n, first.time, first.per_kelvin, two, second.n, second.per_kelvin]


def _graham(source: ValuedLaw, forms: Sequence[Form]) -> tuple[int, list[float]] | None:
    """Two or three powers of time with one stress exponent and one activation energy."""
    first, *others = forms
    alike = all((f.shape, f.n, f.strain, f.Q) == ("power", first.n, 0.0, first.Q) for f in forms)
    if not (alike and 1 <= len(others) <= 2):
        return None
    constants = [number(first.log_coefficient, "C1", source), first.n, first.time]
    for form in others:
        constants += [number(form.log_coefficient - first.log_coefficient, "C4 or C6", source), form.time]
    return 4, [*constants, *[0.0] * (7 - len(constants)), first.per_kelvin]


def _elastic(rows: Sequence[Moduli]) -> Iterator[str]:
    """Young's modulus and Poisson's ratio, six temperatures a command where they depend on it."""
    warmth = [m.T for m in rows if m.T is not None]
    labels = {"EX": [m.E for m in rows], "PRXY": [m.nu for m in rows]}
    if warmth:
        yield "MPTEMP"
        yield from (f"MPTEMP,{k + 1},{_listed(warmth[k : k + 6])}" for k in range(0, len(rows), 6))
        for label, values in labels.items():
            yield from (f"MPDATA,{label},1,{k + 1},{_listed(values[k : k + 6])}" for k in range(0, len(rows), 6))
    elif rows:
        yield from (f"MP,{label},1,{figure(value)}" for label, (value,) in labels.items())


def _listed(values: Sequence[float]) -> str:
    return ",".join(map(figure, values))
