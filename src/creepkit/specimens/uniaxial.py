"""Uniaxial tension: a bar under steps of stress or load and of temperature, observed by its creep strain.

Under constant load the true stress is the nominal one times exp(creep strain): creep keeps the volume, and the
elastic change of the cross-section is neglected. An engineering strain is exp(creep strain) - 1; a strain that
includes the elastic part has stress/E(T) added, with the nominal stress and the modulus at the temperature of the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import integration
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.hookspecs import hookimpl
from creepkit.records import History, Prediction, Specimen, Status
from creepkit.specimens.bar import Bar
from creepkit.specimens.elastic_part import elastic_strain, observed_strain
from creepkit.specimens.uniaxial_life import predicted_life, strain_levels

if TYPE_CHECKING:
    from creepkit.integration import PointTest
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class Uniaxial(Bar):
    """A bar under prescribed stress or load; its output is its strain, of the measure that its history names."""

    name: ClassVar[str] = "uniaxial"
    title: ClassVar[str] = "Uniaxial tension under steps of stress or load"
    outputs: ClassVar[tuple[str, ...]] = ("strain",)

    def point_test(self, history: History) -> PointTest:
        """The stress and the temperature over time."""
        return point_test(history)

    def observed_output(self, history: History, creep: Floats) -> Floats:
        """The strain of the history's measure."""
        return observed_strain(history, creep)

    def output_derivative(self, history: History, creep: Floats) -> Floats:
        """Derivative of the observed strain to the creep strain."""
        return np.exp(creep) if history.strain_measure == "engineering" else np.ones_like(creep)

    def predict_life(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], *, jacobian: bool = False
    ) -> Prediction:
        """Predict as predict() does, and follow each bar to its rupture: by a state's limit, or by the strain limit."""
        levels = [strain_levels(history, self.point_test(history)) for history in histories]
        result = self._integrate(law, values, [own_values.test for own_values in levels], jacobian)
        values_found, last = self._observed_prediction(law, histories, result), np.array([h.times[-1] for h in histories])
        after_last_frame = (result.end_times > last) & (values_found.status == int(Status.RUPTURED))
        status, ends = np.where(after_last_frame, int(Status.COMPLETE), values_found.status), np.minimum(values_found.end_times, last)
        return replace(values_found, status=status, end_times=ends, times_to_strain=predicted_life(histories, levels, result))

    def modulus_derivative(self, result: Prediction, histories: Sequence[History], modulus_changes: Floats) -> Floats:
        """Derivative of the strain to the relative change of the modulus: that of its elastic part."""
        slope = np.zeros_like(result.values)
        for k, history in enumerate(histories):
            if history.includes_elastic:
                slope[:, k, : history.times.size, 0] = -elastic_strain(history) / (1.0 + modulus_changes[k])
        return slope


@lru_cache(maxsize=4096)
def point_test(history: History) -> PointTest:
    """What the material point of a uniaxial history goes through."""
    where = history.source or f"history '{history.name}'"
    if history.loading.quantity != "stress":
        held = "the specimen relaxation" if history.loading.quantity == "strain" else "StressSteps or constant_stress"
        raise SolveError(
            f"{where}: a uniaxial specimen is loaded by stress, found {history.loading.quantity}; use {held}"
        )
    if history.includes_elastic and history.elastic is None:
        raise SolveError(f"{where}: the strain includes the elastic part, but no elastic data are given; set elastic=")
    return integration.PointTest(
        driving=history.loading.program(),
        temperature=history.temperature_program(),
        times=history.times,
        constant_load=getattr(history.loading, "control", "stress") == "load",
    )


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The uniaxial specimen with its default settings."""
    return [Uniaxial()]
