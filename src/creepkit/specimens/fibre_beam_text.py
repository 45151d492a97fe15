"""How beams of fibres are simulated, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.integration.time_discretisation import SDIRK4_TEXT

if TYPE_CHECKING:
    from creepkit.records import History
    from creepkit.specimens.fibre_beam import FibreBeam


def fibre_beam_text(beam: FibreBeam, histories: Sequence[History]) -> str:
    """Kinematics, discretisation and integration in time of a beam, in sentences for a paper."""
    sections, fibres = len(beam.beam_stations().moments), len(beam.section()[0])
    return (
        f"The beam has {sections} sections of {fibres} fibres each, all of them uniaxial material points; plane "
        "sections stay plane, deflections are small, shear is left out, and deflections follow from the curvatures by "
        f"virtual work. Fibres are integrated in time together by {SDIRK4_TEXT}, with a local error of at most "
        f"{beam.tolerance:g} in a step; the beam ruptures where a fibre reaches a creep strain of "
        f"{beam.strain_limit:g}."
    )
