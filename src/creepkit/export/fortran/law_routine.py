"""The law itself as a Fortran subroutine: ln of the rate, rates of internal variables, and every derivative."""

from __future__ import annotations

from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFunction

from creepkit.export.fortran.text import fortran_assignments, called_names, double_declarations, stable_function_definitions, fortran_number, fortran_statements, fortran_expression
from creepkit.export.program import LawCode
from creepkit.language.symbols import POINT_VARIABLES


def law_subroutine(code: LawCode, name: str) -> list[str]:
    """Return `subroutine NAME(x, out)` as lines of fixed-form Fortran.

    x : stress MPa, strain, time s, temperature K, largest principal and mean stress MPa, then internal variables.
    out : row by row (value, derivatives to x) of ln rate and of each state's rate, as creepkit's kernels put it out.
    """
    function = code.function("update")
    width = len(POINT_VARIABLES) + len(code.states)
    logs = code.logarithms_used(function)
    definitions = [*(f"{ln} = log({plain})" for ln, plain in logs.items()), *fortran_assignments(function.assignments)]
    results = [f"out({k + 1}) = {fortran_expression(e)}" for k, e in enumerate(function.outputs)]
    input_positions = {s: k + 1 for k, s in enumerate((*code.point, *code.states))}
    input_lines = [f"{s} = x({input_positions[s]})" for s in function.inputs]
    used_symbols = set().union(*(e.free_symbols for e in (*(e for _, e in function.assignments), *function.outputs)))
    parameters_used = [s for s in code.parameters if s in used_symbols or s in logs.values()]
    logical_names = [str(s) for s, e in function.assignments if isinstance(e, (Relational, BooleanFunction))]
    variables = [str(s) for s in (*function.inputs, *logs, *(s for s, _ in function.assignments)) if str(s) not in logical_names]
    body = [*input_lines, *definitions, *results]
    internal_functions = stable_function_definitions(called_names(body))
    return fortran_statements(
        [
            f"subroutine {name}(x, out)",
            "  implicit none",
            f"  double precision, intent(in) :: x({width})",
            f"  double precision, intent(out) :: out({len(function.outputs)})",
            *(f"  double precision, parameter :: {s} = {fortran_number(code.parameters[s])}" for s in parameters_used),
            *(f"  {line}" for line in double_declarations(variables)),
            *(f"  logical {name}" for name in logical_names),
            *(f"  {line}" for line in body),
            *(["contains", *(f"  {line}" for line in internal_functions)] if internal_functions else []),
            f"end subroutine {name}",
        ]
    )
