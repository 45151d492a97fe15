"""PointSpecimen: what bars and material points share, settings of the integration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit.errors import SolveError
from creepkit.language.elastic import STATE_MODULUS
from creepkit.limits import Limits, check_fields, numbers
from creepkit.records import History
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.integration import IntegrationSettings


@dataclass(frozen=True)
class PointSpecimen(TestPiece):
    """A material point, or a bar, which is one.

    tolerance : relative local error of a step of the integration; the output is then within about ten times of it.
    strain_limit : equivalent creep strain, of a bar logarithmic, at which the point has ruptured.
    max_steps : cap on the steps of one history, beside 20 for each further straight piece of its programs.
    """

    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000

    own_nuisances: ClassVar[tuple[str, ...]] = ()
    """None: a history that is warmer, or whose modulus is larger, stands for it."""

    least_tolerance: ClassVar[float] = 1e-13

    def __post_init__(self) -> None:
        tolerances = numbers(self.least_tolerance, 1e-2)
        most = {"strain_limit": numbers(0.0, 10.0, above=True), "max_steps": Limits(10, 10_000_000)}
        check_fields(self, {"tolerance": tolerances, **most}, f"{self.name} specimen: ", SolveError)

    def integration_settings(self, more_steps: int = 0) -> IntegrationSettings:
        """The settings of the integration of one history."""
        from creepkit.integration import IntegrationSettings

        most = int(self.max_steps) + more_steps
        return IntegrationSettings(rtol=self.tolerance, strain_limit=self.strain_limit, max_steps=most)


def isothermal_elasticity(history: History, specimen: str) -> tuple[float, float]:
    """E, MPa, and nu of a test whose strain is prescribed: they must be the same at all its temperatures."""
    where = history.origin
    if history.elastic is None:
        raise SolveError(f"{where}: a {specimen} specimen under prescribed strain needs elastic data; {STATE_MODULUS}")
    result = [history.elastic.at(float(T)) for T in np.unique(history.temperature_program().values)]
    moduli = [float(one.E) for one in result]
    if max(moduli) - min(moduli) > 1e-12 * max(moduli):
        raise SolveError(
            f"{where}: the modulus changes from {moduli[0]:g} to {moduli[-1]:g} MPa with the temperature of the test; "
            f"a {specimen} specimen takes one modulus a test, such as elastic.at(T)"
        )
    return moduli[0], float(result[0].nu)
