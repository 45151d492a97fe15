"""A material point in six components: single stages, and the reduction of proportional loading to a scalar problem.

`tensor_point.hpp` states and solves the implicit stage. Tensors are vectors of the components 11, 22, 33, 12, 23, 13,
with tensor shear strains (half of the engineering ones).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.integration.core_structures import Axes
from creepkit.integration.time_discretisation import merge_programs
from creepkit.records import TENSOR_COMPONENTS, PointLoading, Program

EQUIVALENT_STRAIN = 6
"""Place of the equivalent creep strain in a point's vector: six creep strains, then this, then the states."""


_ROWS, _COLUMNS = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])


_PROPORTIONALITY_TOLERANCE = 1e-9
"""Of the largest stress: what differs by less is the same direction."""


_SHEAR_WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


_MEAN_DIRECTION = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def von_mises(stress: Floats) -> Floats:
    """The von Mises stress (...,), MPa, of tensors (..., 6)."""
    deviator = stress - stress[..., :3].mean(axis=-1)[..., None] * _MEAN_DIRECTION
    return np.asarray(np.sqrt(1.5 * (deviator**2 @ _SHEAR_WEIGHTS)))


class ProportionalLoading(NamedTuple):
    """A scalar problem.

    driving : von Mises stress if nothing crept, over time, MPa; stiffness : k, MPa; axes : of the scalar problem.
    flow : (6,) d(creep strain)/d(equivalent); along : (6,) stress by von Mises stress, where a strain is prescribed.
    """

    driving: Program
    stiffness: float
    axes: Axes
    flow: Floats
    along: Floats


def proportional_loading(
    loading: PointLoading, end: float, elastic: tuple[float, float] | None = None
) -> ProportionalLoading | None:
    """The scalar problem of a loading up to `end`, s; None where there is none. elastic : E, MPa, and nu."""
    if loading.strain:
        return None if elastic is None else _single_strain(loading, elastic)
    programs = [loading.stress.get(name, Program.constant(0.0)) for name in TENSOR_COMPONENTS]
    times, stresses = _segment_ends(programs, end)
    means = stresses[:, :3].mean(axis=1)
    deviators = stresses - means[:, None] * _MEAN_DIRECTION
    size, room = von_mises(stresses), _PROPORTIONALITY_TOLERANCE * max(float(np.abs(stresses).max()), 1e-300)
    along = deviators[np.argmax(size)] / size.max() if size.max() > room else np.zeros(6)
    level = 1.5 * (deviators * _SHEAR_WEIGHTS) @ along
    line = _line(level, means, room)
    if line is None or np.abs(deviators - level[:, None] * along).max() > room or level.min() < -room:
        return None
    offset, slope = line
    axes = Axes(offset, _largest_principal(along) + slope, offset, slope)
    return ProportionalLoading(Program(times, np.maximum(level, 0.0)), 0.0, axes, 1.5 * along, np.zeros(6))


def _single_strain(loading: PointLoading, elastic: tuple[float, float]) -> ProportionalLoading | None:
    """One strain that never falls, and no stress but its own."""
    if loading.stress or len(loading.strain) > 1:
        return None
    ((name, strain),) = loading.strain.items()
    if (np.diff(strain.values) < 0.0).any() or strain.values[0] < 0.0:
        return None
    (E, nu), shear = elastic, name[0] != name[1]
    along = np.where(np.arange(6) == TENSOR_COMPONENTS.index(name), 1.0 / np.sqrt(3.0) if shear else 1.0, 0.0)
    stiffness = 1.5 * E / (1.0 + nu) if shear else E
    driving = stiffness * strain.values * (2.0 / np.sqrt(3.0) if shear else 1.0)
    mean = float(along[:3].mean())
    axes = Axes(0.0, _largest_principal(along), 0.0, mean)
    deviator = along - mean * _MEAN_DIRECTION
    return ProportionalLoading(Program(strain.times, driving), stiffness, axes, 1.5 * deviator, along)


def _largest_principal(stress: Floats) -> float:
    """The largest eigenvalue of a tensor, (6,)."""
    tensor = np.empty((3, 3))
    tensor[_ROWS, _COLUMNS] = tensor[_COLUMNS, _ROWS] = stress
    return float(np.linalg.eigvalsh(tensor)[-1])


def _segment_ends(programs: list[Program], end: float) -> tuple[Floats, Floats]:
    """Times and values (times, programs) at both ends of every segment."""
    rows = merge_programs(*programs, end=end)
    if not len(rows):
        return np.zeros(1), np.array([[float(p.at(0.0)) for p in programs]])
    values = np.stack([rows[:, 2::2], rows[:, 3::2]], axis=1)
    return rows[:, :2].reshape(-1), values.reshape(-1, len(programs))


def _line(x: Floats, y: Floats, room: float) -> tuple[float, float] | None:
    """Offset and slope of y over x, where it is a straight line."""
    slope = float(np.polyfit(x, y, 1)[0]) if float(np.ptp(x)) > room else 0.0
    offset = float(np.mean(y - slope * x))
    return (offset, slope) if np.abs(y - offset - slope * x).max() <= 10 * room else None
