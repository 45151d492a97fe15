"""The text of a law's generated module: three C functions over rows of points, and the exponents of time and strain."""

from __future__ import annotations

import re

import sympy

from creepkit.kernels.entries import KernelFunction, SymbolicKernel
from creepkit.kernels.interface import POINT_SIZE
from creepkit.kernels.leading import leading_exponents
from creepkit.kernels.printing import TARGET_FUNCTIONS, assignment_lines, law_comments, expression_source

_MODULE_HEADER = """# Kernel of a creep law; generated, do not edit.
{terms}

from math import isfinite

from numba import cfunc

from creepkit.kernels.interface import SIGNATURE
from creepkit.kernels.numba_functions import {functions}

COEFFICIENTS = {coefficients}

"""


def module_source(lowered: SymbolicKernel) -> str:
    """The generated module of a law."""
    functions = "\n\n".join(_function_source(e, lowered) for e in (lowered.rate, lowered.update, lowered.sensitivity))
    header = _MODULE_HEADER.format(
        terms="\n".join(law_comments(lowered.law)),
        functions=", ".join(_called_functions(functions)),
        coefficients=repr(lowered.form.coefficients),
    )
    return f"{header}{_exponents_source(lowered)}\n\n{functions}"


def _called_functions(text: str) -> list[str]:
    """The kernel functions that a text calls."""
    return sorted({*re.findall(r"\w+(?=\()", text)} & {*TARGET_FUNCTIONS})


def _exponents_source(lowered: SymbolicKernel) -> str:
    """A function of arrays: for each term the exponents of time and of strain at t -> 0+."""
    pairs = [[expression_source(lowered.names.printable(e)) for e in pair] for pair in leading_exponents(lowered.form)]
    rows = "".join(f"        ({time}, {strain}),\n" for time, strain in pairs)
    called = _called_functions(rows)
    lines = [f"def exponents({', '.join(s.name for s in lowered.names.inputs)}):"]
    if called:
        lines.append(f"    from creepkit.kernels.numpy_functions import {', '.join(called)}\n")
    return "\n".join([*lines, f"    return (\n{rows}    )\n"])


def _function_source(entry: KernelFunction, lowered: SymbolicKernel) -> str:
    """One C function; what depends on theta alone is done before the loop over rows."""
    states = len(lowered.law.states)
    width, size = POINT_SIZE + states, len(entry.outputs)
    point, theta = entry.inputs[:width], entry.inputs[width:]
    lines = [
        '@cfunc(SIGNATURE, cache=True, error_model="numpy")',
        f"def {entry.name}(rows, x, theta, out):",
        *(f"    {s} = theta[{k}]" for k, s in enumerate(theta) if s in entry.used_inputs),
        *assignment_lines(entry.constants, "    "),
        "    flags = 0",
        "    for row in range(rows):",
        *(f"        {s} = x[{width} * row + {k}]" for k, s in enumerate(point) if s in entry.used_inputs),
        *assignment_lines(entry.steps, "        "),
        *assignment_lines(_nonconstant_outputs(entry.outputs), "        "),
        *(f"        out[{size} * row + {k}] = {_output_text(k, e)}" for k, e in enumerate(entry.outputs)),
        *_finite_test(entry.outputs, range(1 + states), 1),
        *_finite_test(entry.outputs, range(1 + states, size), 2),
        "    return flags\n",
    ]
    return "\n".join(lines)


def _nonconstant_outputs(outputs: tuple[sympy.Expr, ...]) -> list[tuple[sympy.Symbol, sympy.Expr]]:
    return [(sympy.Symbol(f"y{k}"), e) for k, e in enumerate(outputs) if not e.is_number]


def _output_text(k: int, output: sympy.Expr) -> str:
    return expression_source(output) if output.is_number else f"y{k}"


def _finite_test(outputs: tuple[sympy.Expr, ...], columns: range, flag: int) -> list[str]:
    """Set a flag when an output is not finite: y - y is 0 for what is finite, NaN for what is not."""
    numbers = [f"y{k}" for k in columns if not outputs[k].is_number]
    if not numbers:
        return []
    if len(numbers) == 1:
        test = f"not isfinite({numbers[0]})"
    else:
        test = f"{' + '.join(f'({y} - {y})' for y in numbers)} != 0.0"
    return [f"        if {test}:", f"            flags |= {flag}"]
