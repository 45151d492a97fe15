"""The law itself as a Fortran subroutine: ln of the rate, rates of internal variables, and every derivative."""

from __future__ import annotations

from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFunction

from creepkit.export.fortran.text import assignments, calls_in, declared, functions, number, statements, text_of
from creepkit.export.program import Program
from creepkit.language.symbols import POINT


def law_routine(program: Program, name: str) -> list[str]:
    """Return `subroutine NAME(x, out)` as lines of fixed-form Fortran.

    x : stress MPa, strain, time s, temperature K, largest principal and mean stress MPa, then internal variables.
    out : row by row (value, derivatives to x) of ln rate and of each state's rate, as creepkit's kernels put it out.
    """
    function = program.function("update")
    width = len(POINT) + len(program.states)
    logs = program.logarithms_in(function)
    own = [*(f"{ln} = log({plain})" for ln, plain in logs.items()), *assignments(function.steps)]
    results = [f"out({k + 1}) = {text_of(e)}" for k, e in enumerate(function.outputs)]
    places = {s: k + 1 for k, s in enumerate((*program.point, *program.states))}
    read = [f"{s} = x({places[s]})" for s in function.read]
    seen = set().union(*(e.free_symbols for e in (*(e for _, e in function.steps), *function.outputs)))
    used = [s for s in program.parameters if s in seen or s in logs.values()]
    switches = [str(s) for s, e in function.steps if isinstance(e, (Relational, BooleanFunction))]
    variables = [str(s) for s in (*function.read, *logs, *(s for s, _ in function.steps)) if str(s) not in switches]
    body = [*read, *own, *results]
    inner = functions(calls_in(body))
    return statements(
        [
            f"subroutine {name}(x, out)",
            "  implicit none",
            f"  double precision, intent(in) :: x({width})",
            f"  double precision, intent(out) :: out({len(function.outputs)})",
            *(f"  double precision, parameter :: {s} = {number(program.parameters[s])}" for s in used),
            *(f"  {line}" for line in declared(variables)),
            *(f"  logical {name}" for name in switches),
            *(f"  {line}" for line in body),
            *(["contains", *(f"  {line}" for line in inner)] if inner else []),
            f"end subroutine {name}",
        ]
    )
