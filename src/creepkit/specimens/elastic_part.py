"""What the instrument of a uniaxial test shows: the measure of strain, and the elastic part."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.records import History


def observed(history: History, creep: Floats) -> Floats:
    """The strain that a history's instrument shows, (candidates, times), from logarithmic creep strain."""
    strain = np.expm1(creep) if history.strain_measure == "engineering" else creep
    return strain + elastic_strain(history) if history.includes_elastic else strain


def elastic_strain(history: History) -> Floats:
    """Nominal stress over the modulus at each time, (times,)."""
    if history.elastic is None:
        return np.zeros(history.times.size)
    temperatures, which = np.unique(history.temperature_program().at(history.times), return_inverse=True)
    moduli = np.array([float(history.elastic.at(float(T)).E) for T in temperatures])
    return np.asarray(history.loading.program().at(history.times) / moduli[which])
