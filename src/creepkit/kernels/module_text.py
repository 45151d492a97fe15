"""The text of a law's generated module: three C functions over rows of points, and the exponents of time and strain."""

from __future__ import annotations

import re

import sympy

from creepkit.kernels.entries import Entry, Lowered
from creepkit.kernels.interface import POINT_SIZE
from creepkit.kernels.leading import exponents
from creepkit.kernels.printing import FUNCTIONS, assignments, described, text_of

_HEAD = """# Kernel of a creep law; generated, do not edit.
{terms}

from math import isfinite

from numba import cfunc

from creepkit.kernels.interface import SIGNATURE
from creepkit.kernels.numba_functions import {functions}

COEFFICIENTS = {coefficients}

"""


def module_text(lowered: Lowered) -> str:
    """The generated module of a law."""
    functions = "\n\n".join(_entry_text(e, lowered) for e in (lowered.rate, lowered.update, lowered.sensitivity))
    head = _HEAD.format(
        terms="\n".join(described(lowered.law)),
        functions=", ".join(_called(functions)),
        coefficients=repr(lowered.form.coefficients),
    )
    return f"{head}{_exponents_text(lowered)}\n\n{functions}"


def _called(text: str) -> list[str]:
    """The kernel functions that a text calls."""
    return sorted({*re.findall(r"\w+(?=\()", text)} & {*FUNCTIONS})


def _exponents_text(lowered: Lowered) -> str:
    """A function of arrays: for each term the exponents of time and of strain at t -> 0+."""
    pairs = [[text_of(lowered.names.renamed(e)) for e in pair] for pair in exponents(lowered.form)]
    rows = "".join(f"        ({time}, {strain}),\n" for time, strain in pairs)
    called = _called(rows)
    lines = [f"def exponents({', '.join(s.name for s in lowered.names.inputs)}):"]
    if called:
        lines.append(f"    from creepkit.kernels.numpy_functions import {', '.join(called)}\n")
    return "\n".join([*lines, f"    return (\n{rows}    )\n"])


def _entry_text(entry: Entry, lowered: Lowered) -> str:
    """One C function; what depends on theta alone is done before the loop over rows."""
    states = len(lowered.law.states)
    width, size = POINT_SIZE + states, len(entry.outputs)
    point, theta = entry.inputs[:width], entry.inputs[width:]
    lines = [
        '@cfunc(SIGNATURE, cache=True, error_model="numpy")',
        f"def {entry.name}(rows, x, theta, out):",
        *(f"    {s} = theta[{k}]" for k, s in enumerate(theta) if s in entry.read),
        *assignments(entry.constants, "    "),
        "    flags = 0",
        "    for row in range(rows):",
        *(f"        {s} = x[{width} * row + {k}]" for k, s in enumerate(point) if s in entry.read),
        *assignments(entry.steps, "        "),
        *assignments(_varying(entry.outputs), "        "),
        *(f"        out[{size} * row + {k}] = {_stored(k, e)}" for k, e in enumerate(entry.outputs)),
        *_flag(entry.outputs, range(1 + states), 1),
        *_flag(entry.outputs, range(1 + states, size), 2),
        "    return flags\n",
    ]
    return "\n".join(lines)


def _varying(outputs: tuple[sympy.Expr, ...]) -> list[tuple[sympy.Symbol, sympy.Expr]]:
    return [(sympy.Symbol(f"y{k}"), e) for k, e in enumerate(outputs) if not e.is_number]


def _stored(k: int, output: sympy.Expr) -> str:
    return text_of(output) if output.is_number else f"y{k}"


def _flag(outputs: tuple[sympy.Expr, ...], columns: range, flag: int) -> list[str]:
    """Set a flag when an output is not finite: y - y is 0 for what is finite, NaN for what is not."""
    numbers = [f"y{k}" for k in columns if not outputs[k].is_number]
    if not numbers:
        return []
    if len(numbers) == 1:
        test = f"not isfinite({numbers[0]})"
    else:
        test = f"{' + '.join(f'({y} - {y})' for y in numbers)} != 0.0"
    return [f"        if {test}:", f"            flags |= {flag}"]
