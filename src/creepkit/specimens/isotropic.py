"""Isotropic elasticity of a point in six components: compliance, and the stresses of a loading before any creep."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records import COMPONENTS, PointLoading

_SHEAR_WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


def compliance(elastic: tuple[float, float]) -> Floats:
    """(6, 6) tensor strains from stresses, 1/MPa; elastic : E, MPa, and nu."""
    E, nu = elastic
    matrix = (1.0 + nu) / E * np.eye(6)
    matrix[:3, :3] -= nu / E
    return matrix


def elastic_von_mises(loading: PointLoading, elastic: tuple[float, float] | None) -> Floats:
    """The von Mises stresses above zero at the breakpoints of a loading, if nothing crept, (levels,) MPa."""
    marks = np.unique(np.concatenate([p.times for p in (*loading.stress.values(), *loading.strain.values())]))
    stress = np.zeros((marks.size, 6))
    for name, program in loading.stress.items():
        stress[:, COMPONENTS.index(name)] = program.at(marks)
    if loading.strain:
        if elastic is None:
            raise SolveError(
                "a material point under prescribed strain needs elastic data; set elastic=Elastic(E=150e3)"
            )
        strain_controlled = [COMPONENTS.index(name) for name in loading.strain]
        flexibility = compliance(elastic)
        wanted = np.stack([p.at(marks) for p in loading.strain.values()], axis=-1) - stress @ flexibility[strain_controlled].T
        stress[:, strain_controlled] = np.linalg.solve(flexibility[np.ix_(strain_controlled, strain_controlled)], wanted.T).T
    deviator = stress - stress[:, :3].mean(axis=1)[:, None] * np.array([1, 1, 1, 0, 0, 0])
    levels = np.unique(np.sqrt(1.5 * (deviator**2 @ _SHEAR_WEIGHTS)))
    return np.asarray(levels[levels > 0])
