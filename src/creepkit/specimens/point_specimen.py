"""PointSpecimen: what bars and material points share, settings of the integration and nuisance parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records import History, Load, NuisanceValues, Output, Prediction, broadcast_candidates, check_nuisances
from creepkit.specimens.settings_checks import check_ranges
from creepkit.specimens.test_piece import BASIC_NUISANCES, warmer_and_stiffer

if TYPE_CHECKING:
    from creepkit.integration import IntegrationSettings
    from creepkit.language import CreepLaw


DIFFERENCE_STEPS = {"temperature": 0.1, "modulus": 1e-3}
"""Of central differences: K, and relative."""


@dataclass(frozen=True)
class PointSpecimen:
    """A material point, or a bar, which is one.

    tolerance : relative local error of a step of the integration; the output is then within about ten times of it.
    strain_limit : equivalent creep strain, of a bar logarithmic, at which the point has ruptured.
    max_steps : cap on the steps of one history, beside 20 for each further straight piece of its programs.
    """

    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000

    name: ClassVar[str]
    title: ClassVar[str]
    outputs: ClassVar[tuple[Output, ...]]
    loads: ClassVar[tuple[Load, ...]]
    nuisances: ClassVar[tuple[str, ...]] = BASIC_NUISANCES
    """Kinds of explicit nuisances that predict() understands."""

    least_tolerance: ClassVar[float] = 1e-13

    def __post_init__(self) -> None:
        ranges = {"tolerance": (self.least_tolerance, 1e-2), "strain_limit": (0.0, 10.0), "max_steps": (10, 10_000_000)}
        check_ranges(self, ranges)

    def replace(self, **changes: float) -> Self:
        """The same specimen with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def integration_settings(self, more_steps: int = 0) -> IntegrationSettings:
        """The settings of the integration of one history."""
        from creepkit.integration import IntegrationSettings

        most = int(self.max_steps) + more_steps
        return IntegrationSettings(rtol=self.tolerance, strain_limit=self.strain_limit, max_steps=most)

    # ---- of each kind ---------------------------------------------------------------------------------------------

    def predict_plain(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], sensitivities: bool
    ) -> Prediction:
        """Predict histories without nuisances; theta : (candidates, parameters) internal values."""
        raise NotImplementedError

    def modulus_derivative(
        self, result: Prediction, histories: Sequence[History], modulus_changes: Floats
    ) -> Floats | None:
        """Derivative of the values, (candidates, tests, times, outputs), to the relative change of the modulus.

        modulus_changes : (tests,) the changes themselves. None leaves the derivative to differences.
        """
        return None

    # ---- of every kind --------------------------------------------------------------------------------------------

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict the outputs of each history at its times; see records.Predictor.

        theta : (candidates, parameters) internal values.
        nuisances : "temperature" (K above what the history says) and "modulus" (relative change). Derivatives to them
        are central differences, of 0.1 K and of a thousandth to each side, but where `modulus_derivative` knows it.
        """
        if not nuisances:
            return self.predict_plain(law, theta, histories, sensitivities)
        check_nuisances(nuisances, self.nuisances, f"a {self.name} specimen")
        if max(len(v) for v in nuisances.values()) == 1:
            shared = {kind: v[0] for kind, v in nuisances.items()}
            return self._predict_one(law, theta, histories, shared, sensitivities)
        theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
        parts = []
        for row in range(len(theta)):
            own = {kind: v[row] for kind, v in nuisances.items()}
            parts.append(self._predict_one(law, theta[row : row + 1], histories, own, sensitivities))
        return _concatenated(parts)

    def _predict_one(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        nuisances: Mapping[str, Floats],
        sensitivities: bool,
    ) -> Prediction:
        """Predict with the same nuisances {kind: (tests,)} for all candidates."""
        perturbed = _perturbed_histories(histories, nuisances)
        result, slopes = self.predict_plain(law, theta, perturbed, sensitivities), {}
        for kind, values in nuisances.items() if sensitivities else ():
            slope = self.modulus_derivative(result, perturbed, values) if kind == "modulus" else None
            if slope is None:
                step = DIFFERENCE_STEPS[kind]
                ends = (_perturbed_histories(histories, {**nuisances, kind: values + s}) for s in (step, -step))
                up, down = (self.predict_plain(law, theta, moved, False).values for moved in ends)
                slope = (up - down) / (2 * step)
            slopes[kind] = slope
        return replace(result, nuisance_jacobian=slopes) if slopes else result


def _perturbed_histories(histories: Sequence[History], nuisances: Mapping[str, Floats]) -> list[History]:
    """Histories that are so many K warmer, with moduli larger by these shares."""
    zeros = np.zeros(len(histories))
    temperature_changes, modulus_changes = nuisances.get("temperature", zeros), nuisances.get("modulus", zeros)
    changes = zip(histories, temperature_changes, modulus_changes, strict=True)
    return [warmer_and_stiffer(history, float(T), float(share)) for history, T, share in changes]


def _concatenated(parts: Sequence[Prediction]) -> Prediction:
    def joined(arrays: Sequence[Floats]) -> Floats:
        return np.concatenate(arrays)

    jacobians = [p.jacobian for p in parts if p.jacobian is not None]
    return replace(
        parts[0],
        values=joined([p.values for p in parts]),
        status=np.concatenate([p.status for p in parts]),
        end_times=joined([p.end_times for p in parts]),
        jacobian=joined(jacobians) if jacobians else None,
        nuisance_jacobian={
            kind: joined([p.nuisance_jacobian[kind] for p in parts]) for kind in parts[0].nuisance_jacobian
        },
    )


def isothermal_elasticity(history: History, specimen: str) -> tuple[float, float]:
    """E, MPa, and nu of a test whose strain is prescribed: they must be the same at all its temperatures."""
    where = history.origin
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
