"""The methods of a report: citations in order, what every material shares said once, and numbers from the records."""

from __future__ import annotations


def test_a_law_has_one_form_in_mathml_and_latex() -> None:
    """exp(-c s) is a factor in both, and no denominator in one of them."""
    import sympy

    from creepkit.exporters.latex import equations_in_latex
    from creepkit.exporters.mathml import law_equations
    from creepkit.language import CreepLaw, Param, parameters, strain, stress

    A, c = parameters("A c")
    rate = A * sympy.exp(strain * sympy.exp(-c * stress))
    params = {A: Param("a", unit="1/s", bounds=(1e-9, 1.0), scale="log"), c: Param("b", unit="1/MPa", bounds=(0, 1))}
    law = CreepLaw(name="x", terms={"x": rate}, params=params)
    (mathml,) = law_equations(law)
    assert "<mfrac>" not in mathml
    assert mathml.count("<mi>exp</mi>") == "\n".join(equations_in_latex(law)).count(r"\exp") == 2
