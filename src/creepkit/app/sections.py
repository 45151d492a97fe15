"""The section of a body in finite elements at several times, as numbers that a page draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from creepkit.app.documents import numbers
from creepkit.specimens.finite_element_run import FiniteElementRun

SECTION_TIMES = 9
"""At which a section is sent, the last at the end of the run."""


def section_document(run: FiniteElementRun) -> dict[str, Any]:
    """Nodes at rest (r, z in mm), elements by their sides, and for each time displacements and stresses of elements.

    Stresses are von Mises, MPa, the mean of an element's integration points; None of a reduced-order model.
    """
    model = run.model
    last = float(run.times[-1])
    times = last * np.linspace(0.0, 1.0, SECTION_TIMES)[1:]
    moved = run.simulation.at(run.simulation.displacements, times)
    stress: list[list[float | None]] | None = None
    if run.simulation.values is not None:
        values = run.field("stress", times).values.reshape(times.size, len(model.elements), -1).mean(axis=2)
        stress = [numbers(one) for one in values]
    return {
        "nodes": numbers(model.nodes),
        # corners and middles of the sides in turn, as they are met around an element
        "elements": model.elements[:, [0, 4, 1, 5, 2, 6, 3, 7]].tolist(),
        "times": numbers(times),
        "displacements": [numbers(one) for one in moved],
        "stress": stress,
    }
