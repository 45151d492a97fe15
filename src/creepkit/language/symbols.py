"""The symbols of the language: what a rate equation may mention.

Plain real sympy symbols throughout: sympy orders its arguments by class name, so a subclass of Symbol would
change printed laws, and assumptions such as `positive` would let sympy rewrite what the author wrote.

`stress` is the von Mises stress of the Cauchy stress over 1 MPa, `strain` the accumulated equivalent creep
strain (logarithmic), `time` the time since the first load ramp began over 1 s, `temperature` in K.
`principal_stress` and `mean_stress` (both over 1 MPa) serve multiaxial damage laws.
"""

from __future__ import annotations

import sympy

stress = sympy.Symbol("stress", real=True)
strain = sympy.Symbol("strain", real=True)
time = sympy.Symbol("time", real=True)
temperature = sympy.Symbol("temperature", real=True)
principal_stress = sympy.Symbol("principal_stress", real=True)
mean_stress = sympy.Symbol("mean_stress", real=True)

POINT_VARIABLES = (stress, strain, time, temperature, principal_stress, mean_stress)
"""The symbols that describe a material point, in the order of every compiled kernel."""

GAS_CONSTANT = 8.314462618
"""R in J/(mol K), CODATA 2018; the paper used 8.31."""

LATEX_SYMBOLS = {
    stress: r"\sigma_e",
    strain: r"\varepsilon_{cr}",
    time: "t",
    temperature: "T",
    principal_stress: r"\sigma_1",
    mean_stress: r"\sigma_m",
}


def parameters(names: str) -> tuple[sympy.Symbol, ...]:
    """Return one plain real symbol for each name in `names`, always as a tuple.

    >>> A, n = parameters("A n")
    """
    return tuple(sympy.Symbol(name, real=True) for name in names.replace(",", " ").split())


def states(names: str) -> tuple[sympy.Symbol, ...]:
    """Return the symbols of internal variables, named in `names`, as a tuple."""
    return parameters(names)
