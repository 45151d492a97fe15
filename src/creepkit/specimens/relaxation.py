"""Relaxation: a bar whose total strain is prescribed (held, in steps or ramps), observed by its stress.

    sigma = E (total strain - creep strain),    so that  d(sigma)/dt = -E f(sigma, ...)  while the strain is held.

The total strain is mechanical, without thermal expansion, and the stress is the true one. An engineering strain
becomes ln(1 + strain). A strain that falls presses the bar once its stress has passed zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import integration
from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.hookspecs import hookimpl
from creepkit.records import History, Load, Output, Program, Specimen
from creepkit.specimens.bar import Bar
from creepkit.specimens.point_specimen import isothermal_elasticity

if TYPE_CHECKING:
    from creepkit.integration import PointTest


@dataclass(frozen=True)
class Relaxation(Bar):
    """A bar under prescribed total strain; its output is its true stress, MPa. Its histories need elastic data."""

    name: ClassVar[str] = "relaxation"
    title: ClassVar[str] = "A bar under held total strain, or steps and ramps of it"
    outputs: ClassVar[tuple[Output, ...]] = (Output("stress", "signed stress", grows=False, visible=1.0),)
    loads: ClassVar[tuple[Load, ...]] = (Load("strain", "strain", "total strain"),)
    imposed_text: ClassVar[str] = (
        "Its true stress is Young's modulus times the difference of the logarithmic total strain that is imposed and "
        "the creep strain."
    )
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"strain": (5e-4, 5e-3), "modulus": (50e3, 300e3)}
    )

    def point_test(self, history: History) -> PointTest:
        """The elastic stress of the total strain, the modulus, and the temperature over time."""
        return point_test(history)

    def observed_output(self, history: History, creep: Floats) -> Floats:
        """The stress, (candidates, times) MPa; creep : (candidates, times) logarithmic creep strain."""
        test = point_test(history)
        return np.asarray(test.driving.at(history.times) - test.stiffness * creep)

    def output_derivative(self, history: History, creep: Floats) -> Floats:
        """Minus the modulus, (candidates, times) MPa; creep : (candidates, times)."""
        return np.full_like(creep, -point_test(history).stiffness)

    def reference_stress(self, history: History) -> Floats:
        """The largest stress of a test and the least from there on, which no ramp passed, (2,) MPa, the least first.

        As measured; of a plan that of elasticity alone.
        """
        driving = np.abs(point_test(history).driving.values)
        measured = np.abs(history.outputs["stress"][history.used]) if "stress" in history.outputs else driving
        stresses = measured[int(measured.argmax()) :] if measured.any() else driving
        stresses = stresses[stresses > 0]
        return np.array([float(stresses.min()), float(stresses.max())])

    def growth_per_strain(self, history: History) -> float:
        """MPa by which the stress falls for each unit of creep strain while the total strain is held: the modulus."""
        return float(point_test(history).stiffness)

    def reference_strain(self, history: History) -> float:
        """The largest creep strain that a test reached, as far as its stress says."""
        test = point_test(history)
        fallen = np.abs(test.driving.at(history.times) - history.outputs["stress"])
        return float(np.max(fallen[history.used], initial=0.0)) / test.stiffness


@lru_cache(maxsize=4096)
def point_test(history: History) -> PointTest:
    """What the material point of a relaxation history goes through."""
    where = history.origin
    if history.loading.quantity != "strain":
        raise SolveError(
            f"{where}: a relaxation specimen is loaded by strain, found {history.loading.quantity}; "
            "use StrainSteps or constant_strain"
        )
    modulus, _ = isothermal_elasticity(history, "relaxation")
    strain = history.loading.program()
    logarithmic = np.log1p(strain.values) if history.strain_measure == "engineering" else strain.values
    return integration.PointTest(
        driving=Program(strain.times, modulus * logarithmic),
        temperature=history.temperature_program(),
        times=history.times,
        stiffness=modulus,
    )


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The relaxation specimen with its default settings."""
    return [Relaxation()]
