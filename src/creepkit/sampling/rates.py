"""Creep rates of many parameter rows at once, and the mean rate of a test at its reference stress.

Bulge test: reference stress k P with k = 14.69 (h/0.5 mm)^-1.17 for a cavity radius of 7.5 mm and apex thickness h, P
the geometric mean of both pressures. The amplitude grows by 42.3 (h/0.5 mm)^-0.486 mm per unit of reference strain.
Both were fitted to simulations with the Norton law, n from 1 to 8, h from 0.44 to 0.60 mm. A tensile bar has the
stresses of its two holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.kernels import lower
from creepkit.language import CreepLaw, time
from creepkit.records import Specimen
from creepkit.sampling.conditions import BULGE, LOAD_LEVELS, ROOM_TEMPERATURE, VISIBLE_CREEP, test_kind
from creepkit.sampling.draws import Draws
from creepkit.specimens.bulge.specimen import Bulge


@dataclass(frozen=True, eq=False)
class RateArguments:
    """Where rates are evaluated.

    stress : number or (rows, ...) MPa; strain, time, temperature : number or (rows, ...) -, s, K.
    """

    stress: ArrayLike
    strain: ArrayLike
    time: ArrayLike
    temperature: ArrayLike


def log10_rate(law: CreepLaw, parameters: Floats, arguments: RateArguments) -> Floats:
    """Return log10 of the rate in 1/s, (rows,).

    parameters : (rows, parameters) in the author's units.
    """
    return np.asarray(ln_rate(law, law.to_internal(parameters), arguments) / np.log(10.0))


def ln_rate(
    law: CreepLaw, theta: Floats, arguments: RateArguments, states: Sequence[ArrayLike] | None = None
) -> Floats:
    """Return ln of the rate in 1/s, (rows, ...), in simple tension.

    theta : (rows, ..., parameters) internal values. states : internal variables, each (rows, ...), by default their
        initial values.
    """
    stress = np.asarray(arguments.stress, float)
    states = [state.initial for state in law.states.values()] if states is None else states
    variables: list[Any] = [
        stress,
        arguments.strain,
        arguments.time,
        arguments.temperature,
        stress,
        stress / 3.0,
        *states,
    ]
    shape = np.broadcast_shapes(theta.shape[:-1], *(np.shape(v) for v in variables))
    columns = [np.broadcast_to(np.asarray(v, float), shape) for v in (*variables, *np.moveaxis(theta, -1, 0))]
    return np.asarray(lower(law, "numpy").internal_log_rate(*columns), float)


def author_parameters(law: CreepLaw, theta: Floats) -> Floats:
    """The author's values, (rows, parameters) in the law's order, of internal ones, theta (rows, parameters)."""
    return np.stack(list(law.from_internal(theta).values()), axis=-1)


POINT_COUNT = 12


POINT_FRACTIONS = (np.arange(POINT_COUNT) + 0.5) / POINT_COUNT
"""Times of the points as fractions of the end of the test."""


REFERENCE_STRAIN = 0.01
"""At which rates are stated, as in the paper's criteria 1 and 2."""


@dataclass(frozen=True, eq=False)
class RateEvaluationPoints:
    """Points in time at which the rates of tests are evaluated.

    stress : (rows, points) MPa, or (rows, 1) where it stays. times : (rows, points) s. temperature : (rows,) K.
    """

    stress: Floats
    times: Floats
    temperature: Floats

    def arguments(self, axes: int = 0, *, one_time: bool = False, factor: float = 1.0) -> RateArguments:
        """The points with `axes` more axes between rows and points.

        one_time : one point will do where the stress stays. factor : multiplies the stresses.
        """
        times = self.times[:, :1] if one_time else self.times
        columns = (factor * self.stress, times, self.temperature[:, None])
        stress, seconds, temperature = (v.reshape(v.shape[0], *[1] * axes, v.shape[1]) for v in columns)
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    def rows(self, rows: Ints) -> RateEvaluationPoints:
        """Some of the rows; rows : (k,) their numbers."""
        return RateEvaluationPoints(self.stress[rows], self.times[rows], self.temperature[rows])

    @property
    def end_times(self) -> Floats:
        """(rows,) s, when the tests end."""
        return np.asarray(self.times[:, -1] / POINT_FRACTIONS[-1])

    def midpoint_arguments(self, axes: int = 0) -> RateArguments:
        """The point at the mean stress and half the duration, with `axes` axes after the rows."""
        shape = (len(self.times), *[1] * axes)
        stress, seconds, temperature = (
            v.reshape(shape) for v in (self.mean_stress, 0.5 * self.end_times, self.temperature)
        )
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    @property
    def mean_stress(self) -> Floats:
        """(rows,) MPa, geometric mean of the stresses."""
        return np.asarray(np.exp(np.log(self.stress).mean(axis=1)))


def mean_ln_rate(law: CreepLaw, theta: Floats, points: RateEvaluationPoints, stress_factor: float = 1.0) -> Floats:
    """ln of the mean rate over a test, (rows, ...), the rate in 1/s.

    theta : (rows, ..., parameters) internal values. stress_factor : multiplies the stresses.
    """
    arguments = points.arguments(theta.ndim - 2, one_time=not law.uses(time), factor=stress_factor)
    ln_rates = ln_rate(law, theta[..., None, :], arguments)
    return np.asarray(logsumexp(ln_rates, axis=-1) - np.log(ln_rates.shape[-1]))


LARGEST_REFERENCE_STRAIN = 0.2
"""Largest reference strain at the end of a test; the paper's dimple is then some 2 mm deep."""


@dataclass(frozen=True)
class ReferenceStress:
    """How loads become stresses and rates.

    kind : of specimen. visible_creep : mm or strain, that every sample should show. stress_per_load : reference stress
        over load at the specimen's own `thickness` (mm; 0: it has none). creep_per_strain : mm or strain, creep per
        unit of reference strain there. thickness_exponents : of both.
    """

    kind: str
    visible_creep: float
    stress_per_load: float = 1.0
    creep_per_strain: float = 1.0
    thickness: float = 0.0
    thickness_exponents: tuple[float, float] = (0.0, 0.0)

    def evaluation_points(self, draws: Draws, end: float) -> RateEvaluationPoints:
        """Stresses and times of each row of draws; end : s, where it is not drawn."""
        first, second = (draws.condition(name)[:, None] for name in LOAD_LEVELS[self.kind])
        times = POINT_FRACTIONS * draws.condition("end_time", end)[:, None]
        if self.kind == BULGE:
            stress = (
                self.stress_per_load
                * np.sqrt(first * second)
                * self._relative_thickness(draws)[:, None] ** self.thickness_exponents[0]
            )
        else:
            stress = np.where(times < draws.condition("Tj")[:, None], first, second)
        return RateEvaluationPoints(stress, times, draws.condition("temperature", ROOM_TEMPERATURE))

    def useful_rates(self, draws: Draws, end: float) -> tuple[Floats, Floats]:
        """log10 of the lowest and highest useful mean rate in 1/s, (rows,) each: half the visible creep, most strain.

        Half, because the higher of both pressures gives more creep than their geometric mean.
        """
        least_strain = (
            0.5
            * self.visible_creep
            / (self.creep_per_strain * self._relative_thickness(draws) ** self.thickness_exponents[1])
        )
        end_times = draws.condition("end_time", end)
        return np.log10(least_strain / end_times), np.log10(LARGEST_REFERENCE_STRAIN / end_times)

    def _relative_thickness(self, draws: Draws) -> Floats:
        """(rows,) thickness of each row over the specimen's own."""
        if not self.thickness:
            return np.ones(len(draws))
        return draws.condition("apex_thickness", self.thickness) / self.thickness


def reference_stress_of(specimen: Specimen) -> ReferenceStress:
    """The reference of a specimen."""
    kind = test_kind(specimen)
    if kind != BULGE:
        return ReferenceStress(kind, VISIBLE_CREEP[kind])
    bulge = getattr(specimen, "specimen", specimen)
    assert isinstance(bulge, Bulge)
    radius, thickness = bulge.geometry.cavity_radius / 7.5, bulge.geometry.apex_thickness / 0.5
    stress_per_load, creep_per_strain = 14.69 * (radius / thickness) ** 1.17, 42.3 * radius**1.486 * thickness**-0.486
    return ReferenceStress(
        kind, VISIBLE_CREEP[kind], stress_per_load, creep_per_strain, bulge.geometry.apex_thickness, (-1.17, -0.486)
    )
