"""Subroutine CREEP for Abaqus/Standard and CalculiX: a law as fixed-form Fortran, one file that compiles alone.

The increment is integrated inside (templates/increment.f): an implicit step at constant stress in the transformed time
in which the law starts smoothly, with the derivative of the converged update. Both codes keep the stress at the end of
their increment, so that their own step is of first order in time.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from string import Template
from typing import ClassVar

from creepkit.errors import ExportError
from creepkit.exporters.fortran_code import FORTRAN_RESERVED, fortran_number, law_subroutine, wrapped_lines
from creepkit.exporters.law_code import Identifiers, LawCode
from creepkit.exporters.law_description import comment_lines, comment_safe, heading
from creepkit.hookspecs import hookimpl
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, mean_stress, principal_stress, temperature, time
from creepkit.records import Exporter, LawWithValues

_MAX_NAME_LENGTH = 31
"""Characters of a name by any standard since Fortran 90; a longer one might not fit into a line either."""


_MAX_STEM_LENGTH = 20
"""Characters of a routine's stem; with its endings it stays a name."""


class CreepSubroutine:
    """The exporter of one of the two codes."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ".f"
    solver: ClassVar[str]
    """The code in words."""
    state_template: ClassVar[str] = ""
    """Template that stores internal variables between increments, for a code that does not."""

    def text(self, source: LawWithValues) -> str:
        """Return the file's text; ExportError where CREEP is not given what the law needs."""
        source = source.without_inactive_terms()
        self._check_inputs(source.law)
        stems = Identifiers(("creep",), ignore_case=True, max_length=_MAX_STEM_LENGTH)
        stem = stems.unique(source.name or source.law.name)
        reserved = FORTRAN_RESERVED | {f"{stem}_law"}
        code = LawCode(source, Identifiers(reserved, ignore_case=True, max_length=_MAX_NAME_LENGTH))
        substitutions = self._template_values(code, stem.lower())
        header = heading(code.source, mentions_floors=True)
        header_lines = [*header, *code.renaming_notes(), "", *self.usage_notes(code)]
        templates = [f"{self.name}.f", "increment.f", *([self.state_template] if code.states else [])]
        routines = [Template(_template_text(name)).substitute(substitutions) for name in filter(None, templates)]
        parts = [
            *comment_lines(map(comment_safe, header_lines), "!", 71),
            "!",
            *(line for text in routines for line in wrapped_lines(text)),
            "!",
            "! The law: ln of the rate and each state's rate, 1/s, then their",
            "! derivatives to stress, strain, time, temperature, largest",
            "! principal stress, mean stress and states, row by row.",
            *law_subroutine(code, f"{substitutions['id']}_law"),
        ]
        return "\n".join(parts) + "\n"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """What a user of the code must put into the input file."""
        raise NotImplementedError

    def _check_inputs(self, law: CreepLaw) -> None:
        if law.uses(principal_stress):
            raise ExportError(
                f"law '{law.name}' needs the largest principal stress, which {self.solver} does not pass to "
                "CREEP; export it as 'mfront', or choose a law of the von Mises stress"
            )

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        """How internal variables come and go: statements for the template."""
        raise NotImplementedError

    def _template_values(self, code: LawCode, stem: str) -> dict[str, str]:
        law, units = code.law, code.source.units
        states = list(law.states.values())
        starts = [0.0, *(s.initial for s in states)]
        ends = [1e308, *(1e308 if s.limit is None else s.limit for s in states)]
        return {
            "id": stem,
            "ny": str(1 + len(states)),
            "ns": str(len(states)),
            "nx": str(len(POINT_VARIABLES) + len(states)),
            "beta": fortran_number(code.leading_time_exponent()),
            "shift_origin": "" if law.uses(time) else "        if (.not. strain > 0.0d0) origin = max(start, 0.0d0)\n",
            "mpa": fortran_number(units.megapascals),
            "seconds": fortran_number(units.seconds),
            "stress": units.stress,
            "time": units.time,
            "limits": "\n".join(f"        ends({k}) = {fortran_number(end)}" for k, end in enumerate(ends, 1)),
            "initial": "\n".join(f"      initial({k}) = {fortran_number(v)}" for k, v in enumerate(starts, 1)),
            **self._state_statements(stem, len(states)),
        }


class AbaqusCreepSubroutine(CreepSubroutine):
    """Subroutine CREEP of Abaqus/Standard."""

    name = "abaqus"
    serves = ("umat", "creep")
    title = "Abaqus/Standard user subroutine CREEP (fixed-form Fortran)"
    solver = "Abaqus"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """Lines for the head of the file."""
        yield "Abaqus/Standard: *CREEP, LAW=USER in the material, *VISCO, CETOL=... as the step."
        yield from _time_notes(code)
        if code.states:
            state_list = ", ".join(f"{k} {s.name}" for k, s in enumerate(code.law.states, 1))
            yield f"*DEPVAR needs {len(code.states)}: {state_list} (less its initial value, so nil is a fresh start)."
        yield "Creep is isotropic, by the von Mises stress; swelling is nil."

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        indices = range(2, 2 + count)
        return {
            "fetch": "".join(f"      y({k}) = y({k}) + statev({k - 1})\n" for k in indices),
            "store": "".join(f"      statev({k - 1}) = y({k}) - initial({k})\n" for k in indices),
        }


class CalculixCreepSubroutine(CreepSubroutine):
    """Subroutine CREEP of CalculiX."""

    name = "calculix"
    serves = ("umat", "creep", "ccx")
    title = "CalculiX creep.f (fixed-form Fortran)"
    solver = "CalculiX"
    state_template = "calculix_states.f"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """Lines for the head of the file."""
        yield "CalculiX: replace creep.f of its source, or preload it as a shared library before a ccx that is built as"
        yield "one; an ordinary ccx, one program as Debian has it, ignores a preloaded CREEP without a word (PEEQ stays"
        yield "0). *CREEP, LAW=USER in the material without TYPE=ORTHO, by which ccx runs a law of its own, and *VISCO,"
        yield "CETOL=... as the step, which insists on CETOL. It insists on *INITIAL CONDITIONS, TYPE=TEMPERATURE"
        yield "whether or not the law depends on temperature."
        if code.states:
            state_list = ", ".join(s.name for s in code.law.states)
            yield (
                f"Internal variables ({state_list}) are kept in the routine itself, so a restart of ccx begins afresh."
            )
        yield from _time_notes(code)

    def _check_inputs(self, law: CreepLaw) -> None:
        super()._check_inputs(law)
        if law.uses(mean_stress):
            raise ExportError(
                f"law '{law.name}' needs the mean stress, which CalculiX does not pass to CREEP; export it as 'mfront'"
            )

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        if count == 0:
            return {"fetch": "", "store": ""}
        arguments = "noel, npt, start, finish"
        return {
            "fetch": f"      call {stem}_stored({arguments}, .false., first(2:))\n      first = first + initial\n",
            "store": f"      y(2:) = y(2:) - initial(2:)\n      call {stem}_stored({arguments}, .true., y(2:))\n",
        }


def _time_notes(code: LawCode) -> Iterator[str]:
    if code.law.uses(time):
        yield "Time is the total time, TIME(2), less t_first below: set t_first where loading is not at time zero."
    if code.law.uses(temperature):
        yield "TEMP is taken as K; set to_kelvin = 273.15d0 below where it is in C."


def _template_text(name: str) -> str:
    return resources.files("creepkit.exporters").joinpath("templates", name).read_text(encoding="utf-8")


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [AbaqusCreepSubroutine(), CalculixCreepSubroutine()]
