"""Models of fibres: uniaxial material points that share a few generalised strains, such as a section of a beam.

    sigma = sum_l load_l(t) (stress_l + E strain_l) + E (modes u - c),        u = projection c

c is the signed creep strain of the fibres, tension positive, and E the modulus. Given the loads, everything but creep
is linear: `stress` and `strain` are what a unit of each load does to the elastic model, and `modes` are the strains by
which the model gives way to creep. A model whose total strains are prescribed has no modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen
from creepkit.errors import SolveError


@dataclass(frozen=True, eq=False)
class FibreModel:
    """m fibres under L loads, with r modes, of which weighted sums of the creep strains are recorded.

    stress, strain : (L, m) MPa, and strain, of each fibre for a unit of each load, in the elastic model.
    modes : (m, r) strains; projection : (r, m), the amplitudes u of the modes from the creep strains.
    observed : (rows, m) weights of the creep strains in what is recorded.
    SolveError for arrays that do not fit together.
    """

    stress: Floats
    strain: Floats
    modes: Floats
    projection: Floats
    observed: Floats

    def __post_init__(self) -> None:
        for field in fields(self):
            object.__setattr__(self, field.name, frozen(np.atleast_2d(getattr(self, field.name))))
        loads, fibres = self.stress.shape
        wanted = {
            "strain": (loads, fibres),
            "modes": (fibres, self.modes.shape[1]),
            "projection": (self.modes.shape[1], fibres),
            "observed": (self.observed.shape[0], fibres),
        }
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise SolveError(
                    f"a model of {fibres} fibres under {loads} loads: {name} has shape {getattr(self, name).shape}; "
                    f"it needs {shape}"
                )
        for field in fields(self):
            if not np.isfinite(getattr(self, field.name)).all():
                raise SolveError(f"a model of fibres: {field.name} must hold finite numbers only")

    @classmethod
    def section(cls, places: ArrayLike, areas: ArrayLike) -> FibreModel:
        """A section under an axial force, N, and a bending moment, N mm; strain of a fibre = e - curvature y.

        Recorded are the axial strain and the curvature, 1/mm, by creep, of the axis through the centroid.
        places : (fibres,) mm, y; areas : (fibres,) mm^2. A positive moment compresses fibres at positive y.
        """
        y, areas, area, inertia = _centred(places, areas)
        projection = np.stack([areas / area, -areas * y / inertia])
        stress = np.stack([np.full_like(y, 1.0 / area), -y / inertia])
        return cls(stress, np.zeros_like(stress), np.stack([np.ones_like(y), -y], axis=1), projection, projection)

    @classmethod
    def side_by_side(cls, models: Sequence[FibreModel]) -> FibreModel:
        """Independent models under the same loads as one; what they record is added up."""
        sizes, ranks = [m.stress.shape[1] for m in models], [m.modes.shape[1] for m in models]
        modes, projection = np.zeros((sum(sizes), sum(ranks))), np.zeros((sum(ranks), sum(sizes)))
        i = r = 0
        for model, size, rank in zip(models, sizes, ranks, strict=True):
            modes[i : i + size, r : r + rank] = model.modes
            projection[r : r + rank, i : i + size] = model.projection
            i, r = i + size, r + rank
        stress, strain, observed = (
            np.concatenate([getattr(m, name) for m in models], axis=1) for name in ("stress", "strain", "observed")
        )
        return cls(stress, strain, modes, projection, observed)

    @property
    def fibres(self) -> int:
        """How many fibres."""
        return int(self.stress.shape[1])

    def observing(self, rows: ArrayLike) -> FibreModel:
        """The same model that records other sums of the creep strains; rows : (rows, fibres) weights."""
        return FibreModel(self.stress, self.strain, self.modes, self.projection, np.asarray(rows, float))


@dataclass(frozen=True, eq=False)
class FibreInput:
    """An input of a test of fibres, such as a length, by the derivatives of the model to it.

    stress, strain : (L, m) MPa, and strain; modes : (m, r); projection : (r, m): derivatives of those of the model.
    temperature : K, and modulus : relative change, for a unit of the input.
    """

    stress: Floats
    strain: Floats
    modes: Floats
    projection: Floats
    temperature: float = 0.0
    modulus: float = 0.0

    @classmethod
    def of_difference(cls, up: FibreModel, down: FibreModel, change: float) -> FibreInput:
        """From two models between which the input changes by so much."""
        names = ("stress", "strain", "modes", "projection")
        return cls(*((getattr(up, name) - getattr(down, name)) / change for name in names))

    @classmethod
    def uniform(cls, model: FibreModel, temperature: float = 0.0, modulus: float = 0.0) -> FibreInput:
        """An input that changes no array of the model: a temperature, K, or a relative change of the modulus."""
        stress, strain, modes, projection = (
            np.zeros_like(a) for a in (model.stress, model.strain, model.modes, model.projection)
        )
        return cls(stress, strain, modes, projection, temperature, modulus)


@lru_cache(maxsize=64)
def gauss_points(count: int) -> tuple[Floats, Floats]:
    """Points and weights of Gauss-Legendre quadrature from 0 to 1, (count,) each."""
    x, weights = np.polynomial.legendre.leggauss(count)
    return frozen(0.5 * (x + 1.0)), frozen(0.5 * weights)


def gauss_fibres(height: float, fibres: int) -> tuple[Floats, Floats]:
    """Places from the middle, mm, and lengths, mm, of `fibres` Gauss points in each half of a height, (2 fibres,).

    Stresses in steady creep are powers of the distance from the neutral axis, which ends both halves.
    """
    points, weights = gauss_points(fibres)
    half, lengths = 0.5 * height * points, 0.5 * height * weights
    return np.concatenate([-half[::-1], half]), np.concatenate([lengths[::-1], lengths])


def _centred(places: ArrayLike, areas: ArrayLike) -> tuple[Floats, Floats, float, float]:
    """Places from the centroid, areas, their sum and the second moment of area."""
    y, weights = np.asarray(places, float), np.asarray(areas, float)
    if y.ndim != 1 or y.shape != weights.shape or y.size == 0 or not (weights > 0).all():
        raise SolveError(
            f"a section of fibres needs as many areas above zero as places, found {weights.size} and {y.size}"
        )
    area = float(weights.sum())
    y = y - float(weights @ y) / area
    inertia = float(weights @ y**2)
    if not inertia > 0:
        raise SolveError("a section of fibres that is to bend needs fibres at two places at least")
    return y, weights, area, inertia
