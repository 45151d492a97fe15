"""Subroutine CREEP, for Abaqus/Standard and for CalculiX: a law as fixed-form Fortran, one file that compiles alone.

The increment is integrated inside (templates/increment.f): an implicit step at constant stress in the clock in which
the law starts smoothly, with the derivative of the converged update. Both codes keep the stress at the end of their
increment, so that their own step is of first order in time.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from string import Template
from typing import ClassVar

from creepkit.errors import ExportError
from creepkit.export.fortran.law_routine import law_routine
from creepkit.export.fortran.text import RESERVED, fitted, number
from creepkit.export.heading import comments, heading
from creepkit.export.identifiers import Identifiers
from creepkit.export.program import Program
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT, mean_stress, principal_stress, temperature, time
from creepkit.records import ValuedLaw

_LONGEST = 31
"""Characters of a name by any standard since Fortran 90; a longer one might not fit into a line either."""

_LONGEST_ID = 20
"""Characters of a routine's stem; with its endings it stays a name."""


class CreepRoutine:
    """The exporter of one of the two codes."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ".f"
    code: ClassVar[str]
    """The code in words."""
    keeps: ClassVar[str] = ""
    """Template that keeps internal variables between increments, for a code that does not."""

    def text(self, source: ValuedLaw) -> str:
        """Return the file's text; ExportError where CREEP is not told what the law needs."""
        self._check(source.law)
        stem = Identifiers(("creep",), ignore_case=True, longest=_LONGEST_ID).name(source.name or source.law.name)
        reserved = RESERVED | {f"{stem}_law"}
        program = Program(source, Identifiers(reserved, ignore_case=True, longest=_LONGEST))
        given = self._given(program, stem.lower())
        head = [*heading(program.source, floors=True), *program.renamed(), "", *self.usage(program)]
        templates = [f"{self.name}.f", "increment.f"]
        if program.states and self.keeps:
            templates.append(self.keeps)
        parts = [
            "\n".join(comments(head, "!", 71)),
            "!",
            *(line for name in templates for line in fitted(Template(_template(name)).substitute(given))),
            "!",
            "! The law: ln of the rate and each state's rate, 1/s, then their",
            "! derivatives to stress, strain, time, temperature, largest",
            "! principal stress, mean stress and states, row by row.",
            *law_routine(program, f"{given['id']}_law"),
        ]
        return "\n".join(parts) + "\n"

    def usage(self, program: Program) -> Iterator[str]:
        """What a user of the code must put into the input file."""
        raise NotImplementedError

    def _check(self, law: CreepLaw) -> None:
        if law.uses(principal_stress):
            raise ExportError(
                f"law '{law.name}' needs the largest principal stress, which {self.code} does not pass to "
                "CREEP; write it as mfront, or choose a law of the von Mises stress"
            )

    def _states(self, stem: str, count: int) -> dict[str, str]:
        """How internal variables come and go: statements for the template."""
        raise NotImplementedError

    def _given(self, program: Program, stem: str) -> dict[str, str]:
        law, units = program.law, program.source.units
        states = list(law.states.values())
        limits = [f"        ends({k}) = {number(1e308 if s is None else s)}" for k, s in enumerate(_limits(law), 1)]
        initial = [f"      initial({k}) = {number(v)}" for k, v in enumerate([0.0, *(s.initial for s in states)], 1)]
        return {
            "id": stem,
            "ny": str(1 + len(states)),
            "ns": str(len(states)),
            "nx": str(len(POINT) + len(states)),
            "beta": number(program.leading()),
            "late": "" if law.uses(time) else "        if (.not. strain > 0.0d0) origin = max(start, 0.0d0)\n",
            "mpa": number(units.megapascals),
            "seconds": number(units.seconds),
            "stress": units.stress,
            "time": units.time,
            "limits": "\n".join(limits),
            "initial": "\n".join(initial),
            **self._states(stem, len(states)),
        }


class AbaqusCreep(CreepRoutine):
    """Subroutine CREEP of Abaqus/Standard."""

    name = "abaqus"
    title = "Abaqus/Standard user subroutine CREEP (fixed-form Fortran)"
    code = "Abaqus"

    def usage(self, program: Program) -> Iterator[str]:
        """Lines for the head of the file."""
        yield "Abaqus/Standard: *CREEP, LAW=USER in the material, *VISCO, CETOL=... as the step."
        yield from _about_time(program)
        if program.states:
            listed = ", ".join(f"{k} {s.name}" for k, s in enumerate(program.law.states, 1))
            yield f"*DEPVAR needs {len(program.states)}: {listed} (less its initial value, so nil is a fresh start)."
        yield "Creep is isotropic, by the von Mises stress; swelling is nil."

    def _states(self, stem: str, count: int) -> dict[str, str]:
        places = range(2, 2 + count)
        return {
            "fetch": "".join(f"      y({k}) = y({k}) + statev({k - 1})\n" for k in places),
            "store": "".join(f"      statev({k - 1}) = y({k}) - initial({k})\n" for k in places),
        }


class CalculixCreep(CreepRoutine):
    """Subroutine CREEP of CalculiX."""

    name = "calculix"
    title = "CalculiX creep.f (fixed-form Fortran)"
    code = "CalculiX"
    keeps = "calculix_states.f"

    def usage(self, program: Program) -> Iterator[str]:
        """Lines for the head of the file."""
        yield "CalculiX: replace creep.f of its source, or preload it as a shared library before a shared ccx;"
        yield "*CREEP, LAW=USER in the material, *VISCO as the step. It insists on *INITIAL CONDITIONS,"
        yield "TYPE=TEMPERATURE whether or not the law depends on temperature."
        if program.states:
            listed = ", ".join(s.name for s in program.law.states)
            yield f"Internal variables ({listed}) are kept in the routine itself, so a restart of ccx begins afresh."
        yield from _about_time(program)

    def _check(self, law: CreepLaw) -> None:
        super()._check(law)
        if law.uses(mean_stress):
            raise ExportError(f"law '{law.name}' needs the mean stress, which CalculiX does not pass to CREEP")

    def _states(self, stem: str, count: int) -> dict[str, str]:
        if count == 0:
            return {"fetch": "", "store": ""}
        given = "noel, npt, start, finish"
        return {
            "fetch": f"      call {stem}_kept({given}, .false., first(2:))\n      first = first + initial\n",
            "store": f"      y(2:) = y(2:) - initial(2:)\n      call {stem}_kept({given}, .true., y(2:))\n",
        }


def _about_time(program: Program) -> Iterator[str]:
    if program.law.uses(time):
        yield "Time is the total time, TIME(2), less t_first below: set t_first where loading is not at time zero."
    if program.law.uses(temperature):
        yield "TEMP is taken as K; set to_kelvin = 273.15d0 below where it is in C."


def _limits(law: CreepLaw) -> list[float | None]:
    return [None, *(state.limit for state in law.states.values())]


def _template(name: str) -> str:
    return resources.files("creepkit.export.fortran").joinpath("templates", name).read_text(encoding="utf-8")
