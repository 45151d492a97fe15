"""Subroutine CREEP for Abaqus/Standard and CalculiX: a law as fixed-form Fortran, one file that compiles alone.

The increment is that of the stress update (templates/stress_update.txt) at a stress that is given, with the derivatives
of the steps that were taken. Both codes keep the stress at the end of their increment, so that their own step is of
first order in time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from string import Template

from creepkit.errors import ExportError
from creepkit.exporters.fortran import FORTRAN_RESERVED
from creepkit.exporters.law_code import Identifiers, LawCode
from creepkit.exporters.law_description import heading, refuse_conditions
from creepkit.exporters.user_materials import (
    MAX_FORTRAN_NAME,
    fortran_update,
    outside_statements,
    read_template,
    update_constants,
)
from creepkit.hookspecs import hookimpl
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import mean_stress, principal_stress, temperature, time
from creepkit.records import Exporter, LawWithValues

_MAX_STEM_LENGTH = 20
"""Characters of a routine's stem; with its endings it stays a name."""

_STORED = "noel, npt, start, start + dtime"
"""What says to which increment of which point internal variables belong."""


@dataclass(frozen=True)
class CreepSubroutine:
    """A target: CREEP as one of the two codes calls it.

    solver : the code in words. before : the temperature where the increment begins, of what the code passes.
    templates : of what it calls, and of what stores internal variables for a code that does not.
    usage : what a user of the code must put into the input file, in the head.
    """

    name: str
    title: str
    solver: str
    before: str
    templates: tuple[str, ...]
    usage: Callable[[LawCode], Iterator[str]]
    serves: tuple[str, ...]
    suffix: str = ".f"

    def text(self, source: LawWithValues) -> str:
        """Return the file's text; ExportError where CREEP is not given what the law needs."""
        source = source.without_inactive_terms()
        self._check_inputs(source.law)
        stem = (
            Identifiers(("creep",), ignore_case=True, max_length=_MAX_STEM_LENGTH)
            .unique(source.name or source.law.name)
            .lower()
        )
        reserved = FORTRAN_RESERVED | {f"{stem}_law"}
        code = LawCode(source, Identifiers(reserved, ignore_case=True, max_length=MAX_FORTRAN_NAME))
        law, units = code.law, code.source.units
        substitutions = {
            "id": stem,
            "ny": 1 + len(code.states),
            "ns": len(code.states),
            "no": 1 + len(code.conditions),
            "time": units.time,
            "typical": f"{100.0 / units.megapascals!r}".replace("e", "d"),
            "fetch": f"      call {stem}_stored({_STORED}, .false., first(2:))\n" if code.states else "",
            "store": f"      call {stem}_stored({_STORED}, .true., y(2:))\n" if code.states else "",
            "outside": outside_statements(code, self.before, "temp", "predef({k}) - dpred({k})", "predef({k})"),
        }
        routine, *storage = self.templates
        files = [routine, *(storage if code.states else ())]
        wrapper = "\n".join(Template(read_template(name)).substitute(substitutions).rstrip() for name in files)
        lines = [*heading(code.source, mentions_floors=True), *code.renaming_notes(), "", *self.usage(code)]
        constants = {
            **update_constants(code),
            **{"HELD": True, "ND": 0, "NT": 2, "NV": 1 + len(code.states), "MOST": -34.6},
            **{"BETA": code.leading_time_exponent(), "VIRGIN": not law.uses(time)},
            **{"TOLERANCE": 2e-3, "TICKS": 4096, "FIRST": 16},
        }
        return fortran_update(code, stem, lines, wrapper, constants, "increment")

    def _check_inputs(self, law: CreepLaw) -> None:
        if law.uses(principal_stress):
            raise ExportError(
                f"law '{law.name}' needs the largest principal stress, which {self.solver} does not pass to "
                f"CREEP; export it as '{self.name}-umat' or 'mfront', or choose a law of the von Mises stress"
            )
        if self is CALCULIX_CREEP:
            refuse_conditions(law, "CREEP of CalculiX, which is given no fields,")
            if law.uses(mean_stress):
                raise ExportError(
                    f"law '{law.name}' needs the mean stress, which CalculiX does not pass to CREEP; export it as "
                    "'calculix-umat'"
                )


def _abaqus_usage(code: LawCode) -> Iterator[str]:
    yield "Abaqus/Standard: *CREEP, LAW=USER in the material, *VISCO, CETOL=... as the step."
    yield from _time_notes(code)
    if code.conditions:
        fields = ", ".join(f"{k} {one.name} in {one.unit}" for k, one in enumerate(code.law.conditions, 1))
        yield f"Predefined fields (*INITIAL CONDITIONS, TYPE=FIELD, VARIABLE=number): {fields}."
    if code.states:
        state_list = ", ".join(f"{k} {s.name}" for k, s in enumerate(code.law.states, 1))
        yield f"*DEPVAR needs {len(code.states)}: {state_list} (less its initial value, so nil is a fresh start)."
    yield "Creep is isotropic, by the von Mises stress; swelling is nil."


CALCULIX_CETOL = (
    "CETOL is a strain, the difference that the rates at both ends of an increment may make: one above what an "
    "increment creeps limits nothing, so 1e-2 and 1e-4 may give one run. Bound increments where the rate falls fast."
)


def _calculix_usage(code: LawCode) -> Iterator[str]:
    yield (
        "CalculiX: replace creep.f of its source, or preload it as a shared library before a ccx that is built as "
        "one; an ordinary ccx, one program as Debian has it, ignores a preloaded CREEP without a word (PEEQ: 0)."
    )
    yield (
        "*CREEP, LAW=USER in the material without TYPE=ORTHO, by which ccx runs a law of its own, and *VISCO, "
        f"CETOL=... as the step, which insists on CETOL. {CALCULIX_CETOL}"
    )
    yield "It insists on *INITIAL CONDITIONS, TYPE=TEMPERATURE whether or not the law depends on temperature."
    if code.states:
        state_list = ", ".join(s.name for s in code.law.states)
        yield f"Internal variables ({state_list}) are kept in the routine itself, so a restart of ccx begins afresh."
    yield from _time_notes(code)


def _time_notes(code: LawCode) -> Iterator[str]:
    if code.law.uses(time):
        yield "Time is the total time, TIME(2), less t_first below: set t_first where loading is not at time zero."
    if code.law.uses(temperature):
        yield "TEMP is taken as K; set to_kelvin = 273.15d0 below where it is in C."


ABAQUS_CREEP = CreepSubroutine(
    name="abaqus",
    title="Abaqus/Standard user subroutine CREEP (fixed-form Fortran)",
    solver="Abaqus",
    before="temp - dtemp",
    templates=("abaqus.f",),
    usage=_abaqus_usage,
    serves=("creep",),
)

CALCULIX_CREEP = CreepSubroutine(
    name="calculix",
    title="CalculiX creep.f (fixed-form Fortran)",
    solver="CalculiX",
    before="temp",
    templates=("calculix.f", "calculix_states.f"),
    usage=_calculix_usage,
    serves=("creep", "ccx"),
)


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [ABAQUS_CREEP, CALCULIX_CREEP]
