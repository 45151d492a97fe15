"""Uniaxial tension: a bar under steps of stress or load and of temperature, observed by its creep strain.

Under constant load the true stress is the nominal one times exp(creep strain): creep keeps the volume, and the
elastic change of the cross-section is neglected. An engineering strain is exp(creep strain) - 1; a strain that
includes the elastic part has stress/E(T) added, with the nominal stress and the modulus at the temperature of the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.hookspecs import hookimpl
from creepkit.records import Effects, History, Prediction, Specimen, Status
from creepkit.specimens.elastic_part import observed
from creepkit.specimens.run import Run, run_of
from creepkit.specimens.uniaxial_effects import KINDS, predict_with

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class Uniaxial:
    """A uniaxial specimen.

    tolerance : relative local error of a step of the integration; the strain is then within about ten times of it.
    strain_limit : logarithmic creep strain at which the bar has burst.
    max_steps : cap on the steps of one history.
    """

    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000
    name: str = field(default="uniaxial", init=False)
    title: str = field(default="Uniaxial tension under steps of stress or load", init=False)
    outputs: tuple[str, ...] = field(default=("strain",), init=False)

    effects: ClassVar[tuple[str, ...]] = KINDS
    """Kinds of explicit nuisances that predict() understands."""

    def __post_init__(self) -> None:
        if not 1e-13 <= self.tolerance <= 1e-2:
            raise SolveError(f"uniaxial specimen: tolerance is {self.tolerance:g}; allowed are 1e-13 to 1e-2")
        if not 0 < self.strain_limit <= 10:
            raise SolveError(f"uniaxial specimen: strain_limit is {self.strain_limit:g}; allowed is above 0, up to 10")
        if self.max_steps != int(self.max_steps) or not 10 <= self.max_steps <= 10_000_000:
            raise SolveError(f"uniaxial specimen: max_steps is {self.max_steps}; allowed are 10 to 10 000 000")

    def replace(self, **changes: float) -> Uniaxial:
        """The same specimen with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict the strain of each history at its times, for numbers or (candidates,) values of the parameters.

        effects : "temperature" (K above what the history says) and "modulus" (relative change, of the elastic part).
        """

        def plain(values: Mapping[str, ArrayLike], histories: Sequence[History], jacobian: bool) -> Prediction:
            return self._predict(law, values, histories, jacobian)

        if effects:
            return predict_with(plain, values, histories, effects, jacobian)
        return plain(values, histories, jacobian)

    def _predict(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], jacobian: bool
    ) -> Prediction:
        result = self._integrate(law, values, histories, jacobian)
        candidates, longest = result.strain.shape[0], max((h.times.size for h in histories), default=0)
        strain = np.full((candidates, len(histories), longest, 1), np.nan)
        changes = np.full((*strain.shape, len(law.names)), np.nan) if jacobian else None
        for k, history in enumerate(histories):
            frames, reach = history.times.size, slice(result.starts[k], result.starts[k + 1])
            creep = result.of(k)
            strain[:, k, :frames, 0] = observed(history, creep)
            if changes is not None and result.jacobian is not None:
                changes[:, k, :frames, 0] = result.jacobian[:, reach] * _stretch(history, creep)[..., None]
        return Prediction(
            values=strain,
            outputs=self.outputs,
            lengths=np.array([h.times.size for h in histories], dtype=np.int64),
            status=result.status,
            end_times=result.end_times,
            jacobian=changes,
            times=tuple(h.times for h in histories),
        )

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> Run:
        """Run one test: what its history would show at its times, and how it ended."""
        result = self._integrate(law, law.values(values), [plan], jacobian=False)
        strain = observed(plan, result.of(0))[0]
        end, reason = float(result.end_times[0, 0]), integration.REASONS[int(result.endings[0, 0])]
        return run_of(Run, plan, self.outputs, strain[:, None], Status(int(result.status[0, 0])), end, reason)

    def _integrate(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], jacobian: bool
    ) -> Integration:
        kernel = kernels.lower(law, "numba")
        settings = integration.Settings(
            rtol=self.tolerance, strain_limit=self.strain_limit, max_steps=int(self.max_steps)
        )
        tests = [point_test(history) for history in histories]
        return integration.integrate(kernel, kernel.internal(values), tests, settings=settings, jacobian=jacobian)


@lru_cache(maxsize=4096)
def point_test(history: History) -> PointTest:
    """What the material point of a uniaxial history goes through."""
    where = history.source or f"history '{history.name}'"
    if history.loading.quantity != "stress":
        raise SolveError(
            f"{where}: a uniaxial specimen is loaded by stress, found {history.loading.quantity}; "
            "use StressSteps or constant_stress"
        )
    if history.includes_elastic and history.elastic is None:
        raise SolveError(f"{where}: the strain includes the elastic part, but no elastic data are given; set elastic=")
    return integration.PointTest(
        driving=history.loading.program(),
        temperature=history.temperature_program(),
        times=history.times,
        constant_load=getattr(history.loading, "control", "stress") == "load",
    )


def _stretch(history: History, creep: Floats) -> Floats:
    """Derivative of the observed strain to the creep strain."""
    return np.exp(creep) if history.strain_measure == "engineering" else np.ones_like(creep)


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The uniaxial specimen with its default settings."""
    return [Uniaxial()]
