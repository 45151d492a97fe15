"""A bar in tension or compression, under steps of stress or load and of temperature, observed by its creep strain.

Stress and strain are above zero in tension. Under constant load the true stress is the nominal one times exp(creep
strain). An engineering strain is exp(creep strain) - 1; a strain that includes the elastic part has stress/E(T) added.
Times to given strains and to rupture are predicted too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import integration
from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.hookspecs import hookimpl
from creepkit.records import (
    History,
    Load,
    Loading,
    NuisanceValues,
    Output,
    Prediction,
    Specimen,
    Status,
    StressSteps,
    TimesToStrain,
)
from creepkit.records.loading import held_of
from creepkit.specimens.bar import Bar, elastic_strain, observed_strain
from creepkit.specimens.load_scaling import LoadScaling

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class Uniaxial(Bar):
    """A bar under prescribed stress or load; its output is its strain, of the measure that its history names."""

    name: ClassVar[str] = "uniaxial"
    title: ClassVar[str] = "Uniaxial tension or compression under steps of stress or load"
    outputs: ClassVar[tuple[Output, ...]] = (Output("strain", "strain", visible=2e-4),)
    loads: ClassVar[tuple[Load, ...]] = (Load("stress", "signed stress"),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType({"stress": (40.0, 300.0)})
    """Stresses, MPa, of the paper's dimple of 0.5 mm under its pressures, about 12.5 times them."""
    dataset_names: ClassVar[Mapping[str, str]] = MappingProxyType({"jump_time": "Tj"})
    """What data sets call the conditions of its tests."""
    imposed_text: ClassVar[str] = (
        "Its true stress is the stress that is held, or under a held load the nominal one times the exponential of the "
        "logarithmic creep strain."
    )
    own_nuisances: ClassVar[tuple[str, ...]] = ("modulus",)
    follows_to_rupture: ClassVar[bool] = True
    load_scaling: ClassVar[LoadScaling] = LoadScaling()
    """For sampling: the reference stress is the load itself."""

    def planned_loading(self, levels: tuple[float, float], jump_time: float) -> Loading:
        """The loading of a sample of a data set: both stresses, MPa, the second from `jump_time`, s, on."""
        first, second = levels
        return StressSteps(((0.0, first),) if first == second else ((0.0, first), (jump_time, second)))

    def growth_per_strain(self, history: History) -> float:
        """Strain that is observed for each unit of creep strain."""
        return 1.0

    def point_test(self, history: History) -> PointTest:
        """The stress and the temperature over time."""
        return point_test(history)

    def observed_output(self, history: History, creep: Floats) -> Floats:
        """The strain of the history's measure, (candidates, times); creep : (candidates, times)."""
        return observed_strain(history, creep)

    def output_derivative(self, history: History, creep: Floats) -> Floats:
        """Derivative of the observed strain to the creep strain, (candidates, times); creep : (candidates, times)."""
        return np.exp(creep) if history.strain_measure == "engineering" else np.ones_like(creep)

    def _predict_to_rupture(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], sensitivities: bool
    ) -> Prediction:
        """Predict as predict() does, and follow each bar to its rupture: by a state's limit, or by the strain limit.

        theta : (candidates, parameters) internal values.
        """
        turns = bool(law.back_stresses)
        levels = [strain_levels(history, self.point_test(history), turns=turns) for history in histories]
        result = self._integrate(law, theta, [own.test for own in levels], sensitivities)
        prediction = self._observed_prediction(histories, result)
        last = np.array([h.times[-1] for h in histories])
        after_last_frame = (result.end_times > last) & (prediction.status == int(Status.RUPTURED))
        return replace(
            prediction,
            status=np.where(after_last_frame, int(Status.COMPLETE), prediction.status),
            end_times=np.minimum(prediction.end_times, last),
            times_to_strain=predicted_times_to_strain(histories, levels, result),
        )

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict histories; the elastic part of a strain follows the relative change of the modulus.

        theta : (candidates, parameters) internal values.
        """
        result = super().predict_batch(law, theta, histories, {}, sensitivities)
        if "modulus" not in nuisances:
            return result
        values, slope = result.values.copy(), np.zeros_like(result.values)
        for k, history in enumerate(histories):
            if history.includes_elastic:
                share, elastic = 1.0 + nuisances["modulus"][:, k, None], elastic_strain(history)
                values[:, k, : history.times.size, 0] += elastic / share - elastic
                slope[:, k, : history.times.size, 0] = -elastic / share**2
        return replace(result, values=values, nuisance_jacobian={"modulus": slope} if sensitivities else {})


@lru_cache(maxsize=4096)
def point_test(history: History) -> PointTest:
    """What the material point of a uniaxial history goes through."""
    where = history.origin
    if history.loading.quantity != "stress":
        held = "the specimen relaxation" if history.loading.quantity == "strain" else "StressSteps or constant_stress"
        raise SolveError(
            f"{where}: a uniaxial specimen is loaded by stress, found {history.loading.quantity}; use {held}"
        )
    if history.includes_elastic and history.elastic is None:
        raise SolveError(
            f"{where}: the strain includes the elastic part, but no elastic data are given; set "
            "elastic=Elastic(E=...), or write modulus_GPa in its file"
        )
    return integration.PointTest(
        driving=history.loading.program(),
        temperature=history.temperature_program(),
        times=history.times,
        constant_load=held_of(history.loading) == "load",
    )


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The uniaxial specimen with its default settings."""
    return [Uniaxial()]


HORIZON = 100.0
"""How far beyond the last frame, and the measured rupture, a bar is followed, as a factor on time."""


SMALLEST_STRAIN = 1e-12
"""Creep strains below this are there from the beginning."""


EARLIEST_RUPTURE = 1e-12
"""s; a bar that breaks at once does so then, for rupture times are compared by their logarithms."""


@dataclass(frozen=True)
class StrainLevels:
    """The creep strains of a history's frames as levels to be reached.

    test : the point test that is followed to the horizon.
    frames : (levels,) the frame of each. creep : (frames,) logarithmic creep strain that was measured; a frame where it
        is not finite or not above SMALLEST_STRAIN has no level, nor has any of a bar that is pressed, or turns.
    """

    test: PointTest
    frames: Ints
    creep: Floats


@lru_cache(maxsize=4096)
def strain_levels(history: History, test: PointTest, *, turns: bool = False) -> StrainLevels:
    """The levels of a history; `test` is what its material point goes through.

    turns : whether it may creep backwards once the stress has fallen.
    """
    creep = _measured_creep_strain(history)
    if (test.driving.values < 0.0).any() or (turns and (np.diff(test.driving.values) < 0.0).any()):
        creep = np.full_like(creep, np.inf)
    frames = np.flatnonzero(np.isfinite(creep) & (creep > SMALLEST_STRAIN))
    frames = frames[np.argsort(creep[frames], kind="stable")]
    last = max(float(history.times[-1]), history.rupture_time or 0.0)
    return StrainLevels(replace(test, levels=creep[frames], until=HORIZON * last), frames, creep)


def _measured_creep_strain(history: History) -> Floats:
    """Measured logarithmic creep strain, (frames,); nothing where the history only plans."""
    if "strain" not in history.outputs:
        return np.full(history.times.size, np.nan)
    strain = history.outputs["strain"] - (elastic_strain(history) if history.includes_elastic else 0.0)
    if history.strain_measure == "logarithmic":
        return np.asarray(strain)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log1p(strain)


def predicted_times_to_strain(
    histories: Sequence[History], levels: Sequence[StrainLevels], result: Integration
) -> TimesToStrain:
    """Times to the strains of frames, and to rupture, on the axes of a prediction."""
    candidates, longest = result.terminations.shape[0], max((h.times.size for h in histories), default=0)
    shape = candidates, len(histories), longest
    ruptured = result.status == int(Status.RUPTURED)
    ruptures = np.where(ruptured, np.maximum(result.end_times, EARLIEST_RUPTURE), np.nan)
    level_times, level_rates = np.repeat(ruptures[..., None], longest, axis=2), np.full(shape, np.inf)
    jacobian = None
    if result.end_jacobian is not None:
        jacobian = np.repeat(result.end_jacobian[:, :, None], longest, axis=2)
    start = 0
    for k, (history, own_values) in enumerate(zip(histories, levels, strict=True)):
        reach, frames = slice(start, start + own_values.frames.size), own_values.frames
        start = reach.stop
        level_times[:, k, np.flatnonzero(own_values.creep <= SMALLEST_STRAIN)] = 0.0
        reached = np.isfinite(result.level_times[:, reach])
        output_factor = np.exp(own_values.creep[frames]) if history.strain_measure == "engineering" else 1.0
        level_times[:, k, frames] = np.where(reached, result.level_times[:, reach], level_times[:, k, frames])
        level_rates[:, k, frames] = np.where(reached, result.level_rates[:, reach] * output_factor, np.inf)
        if jacobian is not None and result.level_time_jacobian is not None:
            level_jacobian = result.level_time_jacobian[:, reach]
            jacobian[:, k, frames] = np.where(reached[..., None], level_jacobian, jacobian[:, k, frames])
    horizon = np.array([own.test.end for own in levels])
    return TimesToStrain(level_times, level_rates, ruptures, horizon, jacobian, result.end_jacobian)
