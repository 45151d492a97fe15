"""Elasticity of bars and points: what the instrument shows of it, and the modulus of a prescribed strain."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records import History


def observed_strain(history: History, creep: Floats) -> Floats:
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


def isothermal_elasticity(history: History, specimen: str) -> tuple[float, float]:
    """E, MPa, and nu of a test whose strain is prescribed: they must be the same at all its temperatures."""
    where = history.source or f"history '{history.name}'"
    if history.elastic is None:
        raise SolveError(
            f"{where}: a {specimen} specimen under prescribed strain needs elastic data; set elastic=Elastic(E=150e3), "
            "in MPa"
        )
    result = [history.elastic.at(float(T)) for T in np.unique(history.temperature_program().values)]
    moduli = [float(one.E) for one in result]
    if max(moduli) - min(moduli) > 1e-12 * max(moduli):
        raise SolveError(
            f"{where}: the modulus changes from {moduli[0]:g} to {moduli[-1]:g} MPa with the temperature of the test; "
            f"a {specimen} specimen takes one modulus a test, such as elastic.at(T)"
        )
    return moduli[0], float(result[0].nu)
