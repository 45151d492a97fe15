"""What all bars share: a material point under a program of stress or strain, and an observation of its creep strain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.records import NuisanceValues, History, Prediction, Status
from creepkit.specimens.run import Run, run_from_outputs
from creepkit.specimens.uniaxial_effects import NUISANCES, predict_with_nuisances

if TYPE_CHECKING:
    from creepkit.integration import Integration, PointTest
    from creepkit.language import CreepLaw

STEPS_PER_BREAKPOINT = 20
"""Each straight piece of a program takes some 7 steps of its own; a logged temperature has thousands of pieces."""


@dataclass(frozen=True)
class Bar:
    """A bar; a kind of it says what its point goes through, what its instrument shows, and how that moves with creep.

    tolerance : relative local error of a step of the integration; the output is then within about ten times of it.
    strain_limit : logarithmic creep strain at which the bar has burst.
    max_steps : cap on the steps of one history, beside STEPS_FOR_A_BREAK for each row of its programs.
    """

    tolerance: float = 1e-5
    strain_limit: float = 1.0
    max_steps: int = 2000

    name: ClassVar[str]
    title: ClassVar[str]
    outputs: ClassVar[tuple[str, ...]]
    nuisances: ClassVar[tuple[str, ...]] = NUISANCES
    """Kinds of explicit nuisances that predict() understands."""

    def __post_init__(self) -> None:
        if not 1e-13 <= self.tolerance <= 1e-2:
            raise SolveError(f"{self.name} specimen: tolerance is {self.tolerance:g}; allowed are 1e-13 to 1e-2")
        if not 0 < self.strain_limit <= 10:
            raise SolveError(
                f"{self.name} specimen: strain_limit is {self.strain_limit:g}; allowed is above 0, up to 10"
            )
        if self.max_steps != int(self.max_steps) or not 10 <= self.max_steps <= 10_000_000:
            raise SolveError(f"{self.name} specimen: max_steps is {self.max_steps}; allowed are 10 to 10 000 000")

    def replace(self, **changes: float) -> Self:
        """The same specimen with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    # ---- what a kind of bar says -----------------------------------------------------------------------------------

    def point_test(self, history: History) -> PointTest:
        """What the material point of a history goes through."""
        raise NotImplementedError

    def observed_output(self, history: History, creep: Floats) -> Floats:
        """The output, (candidates, times), from logarithmic creep strain."""
        raise NotImplementedError

    def output_derivative(self, history: History, creep: Floats) -> Floats:
        """Derivative of the output to the creep strain."""
        raise NotImplementedError

    def modulus_derivative(self, result: Prediction, histories: Sequence[History], modulus_changes: Floats) -> Floats | None:
        """Derivative of the values to the relative change of the modulus; None leaves it to differences."""
        return None

    def end_reason(self, history: History, reason: str, output: Floats, end: float) -> str:
        """Why a test ended at `end`, s, from what the integration says; output : (times,) up to there, then NaN."""
        return reason

    # ---- what follows from it --------------------------------------------------------------------------------------

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        nuisances: NuisanceValues | None = None,
    ) -> Prediction:
        """Predict the output of each history at its times, for numbers or (candidates,) values of the parameters.

        nuisances : "temperature" (K above what the history says) and "modulus" (relative change).
        """
        predict_plain = partial(self._predict, law)
        return predict_with_nuisances(predict_plain, values, histories, nuisances, jacobian, modulus_derivative=self.modulus_derivative, specimen=self.name)

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> Run:
        """Run one test: what its history would show at its times, and how it ended."""
        result = self._integrate(law, law.values(values), self._tests([plan]), jacobian=False)
        rows = self.observed_output(plan, result.of(0))[0]
        end, reason = float(result.end_times[0, 0]), integration.REASONS[int(result.terminations[0, 0])]
        reason = self.end_reason(plan, reason, rows, end)
        return run_from_outputs(Run, plan, self.outputs, rows[:, None], Status(int(result.status[0, 0])), end, reason)

    def _predict(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], jacobian: bool
    ) -> Prediction:
        return self._observed_prediction(law, histories, self._integrate(law, values, self._tests(histories), jacobian))

    def _tests(self, histories: Sequence[History]) -> list[PointTest]:
        return [self.point_test(history) for history in histories]

    def _observed_prediction(self, law: CreepLaw, histories: Sequence[History], result: Integration) -> Prediction:
        """What the instruments of the histories show of an integration."""
        candidates, longest = result.strain.shape[0], max((h.times.size for h in histories), default=0)
        shown = np.full((candidates, len(histories), longest, 1), np.nan)
        changes = None if result.jacobian is None else np.full((*shown.shape, len(law.names)), np.nan)
        for k, history in enumerate(histories):
            frames, reach = history.times.size, slice(result.starts[k], result.starts[k + 1])
            creep = result.of(k)
            shown[:, k, :frames, 0] = self.observed_output(history, creep)
            if changes is not None and result.jacobian is not None:
                changes[:, k, :frames, 0] = result.jacobian[:, reach] * self.output_derivative(history, creep)[..., None]
        return Prediction(
            values=shown,
            outputs=self.outputs,
            lengths=np.array([h.times.size for h in histories], dtype=np.int64),
            status=result.status,
            end_times=result.end_times,
            jacobian=changes,
            times=tuple(h.times for h in histories),
        )

    def _integrate(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], tests: Sequence[PointTest], jacobian: bool
    ) -> Integration:
        kernel = kernels.lower(law, "numba")
        breaks = max((test.driving.times.size + test.temperature.times.size - 2 for test in tests), default=0)
        settings = integration.IntegrationSettings(
            rtol=self.tolerance,
            strain_limit=self.strain_limit,
            max_steps=int(self.max_steps) + STEPS_PER_BREAKPOINT * breaks,
        )
        return integration.integrate(kernel, kernel.to_internal(values), tests, settings=settings, jacobian=jacobian)
