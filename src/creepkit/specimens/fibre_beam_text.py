"""How beams of fibres are simulated, in words."""

from __future__ import annotations

from creepkit.integration.time_discretisation import SDIRK4_TEXT


def fibre_beam_text(sections: int, fibres: int, tolerance: float, strain_limit: float) -> str:
    """Kinematics, discretisation and integration in time of a beam, in sentences for a paper.

    sections : along the beam. fibres : of a section. tolerance : of a step. strain_limit : of a fibre that breaks.
    """
    return (
        f"The beam has {sections} sections of {fibres} fibres each, all of them uniaxial material points; plane "
        "sections stay plane, deflections are small, shear is left out, and deflections follow from the curvatures by "
        f"virtual work. Fibres are integrated in time together by {SDIRK4_TEXT}, with a local error of at most "
        f"{tolerance:g} in a step; the beam ruptures where a fibre reaches a creep strain of {strain_limit:g}."
    )
