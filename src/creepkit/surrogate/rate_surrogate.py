"""A trained RateNet as a predictor: for any law, with derivatives to its parameters and to what is not known of a test."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SurrogateError
from creepkit.records import Effects, History, Prediction, Status
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import Courses, courses
from creepkit.specimens.reduced_march import EFFECTS
from creepkit.surrogate.rate_inputs import inputs, local
from creepkit.surrogate.rate_module import RateModule
from creepkit.surrogate.rate_net import RateNet, base_of
from creepkit.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

AT_ONCE = 2**24
"""Numbers in a tensor of inputs, or of their derivatives."""


class Shown(NamedTuple):
    """At nodes: outputs (candidates, nodes, 3), and their derivatives with a last axis of directions, or None."""

    values: Floats
    changes: Floats | None


class RateSurrogate(Surrogate):
    """The one-degree-of-freedom model of a dimple, corrected by a network; for any law."""

    recipe: RateNet
    effects = EFFECTS

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.specimen.title}, by a network fed with creep rates; for any law"

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor and Surrogate.predict."""
        effects = effects or {}
        for kind in effects:
            if kind not in self.effects:
                raise SurrogateError(f"this surrogate does not know '{kind}'; it knows {', '.join(self.effects)}")
        specimen, compiled = self.specimen, kernels.lower(law, "numba")
        assert isinstance(specimen, Bulge)
        theta = compiled.internal(values)
        count = max([len(theta), *(len(v) for v in effects.values())])
        theta = np.broadcast_to(theta, (count, theta.shape[1]))
        assumed = {kind: np.broadcast_to(v, (count, len(histories))) for kind, v in effects.items()}
        threads = specimen.threads or len(os.sched_getaffinity(0))
        found = courses(
            specimen, compiled, theta, histories, effects=assumed, factors=self.recipe.factors, exact=jacobian,
            threads=threads,
        )  # fmt: skip
        return self._prediction(found, histories, theta.shape[1], assumed)

    def _prediction(
        self, found: Courses, histories: Sequence[History], parameters: int, assumed: Effects
    ) -> Prediction:
        lengths = np.array([h.times.size for h in histories], dtype=np.int64)
        count = len(found.values)
        values = np.full((count, len(histories), int(lengths.max(initial=0)), 3), np.nan)
        wide = None if found.changes is None else np.full((*values.shape, found.changes.shape[-1]), np.nan)
        status = np.array(found.status)
        for k, history in enumerate(histories):
            thickness = self._thickness(found, k, count, assumed)
            shown = self._shown(found, k, thickness)
            values[:, k, : lengths[k]] = found.frames(k, shown.values)
            if wide is not None and shown.changes is not None:
                wide[:, k, : lengths[k]] = found.frames(k, shown.changes)
            cut = status[:, k] != Status.COMPLETE
            gone = cut[:, None] & (history.times >= found.end_times[:, k, None])
            values[:, k, : lengths[k]][gone] = np.nan
            outside = self._outside(found, k, thickness) | self._strange(history)
            status[:, k] = np.where(outside & ~cut, int(Status.OUTSIDE_DOMAIN), status[:, k])
        kinds = {kind: wide[..., parameters + EFFECTS.index(kind)] for kind in assumed} if wide is not None else {}
        return Prediction(
            values=values, outputs=self.outputs, lengths=lengths, status=status, end_times=found.end_times,
            jacobian=None if wide is None else wide[..., :parameters], times=tuple(h.times for h in histories),
            effect_jacobian=kinds,
        )  # fmt: skip

    def _thickness(self, found: Courses, test: int, count: int, assumed: Effects) -> Tensor:
        own = np.full(count, found.plans[test].made.geometry.apex_thickness)
        return torch.from_numpy(np.array(assumed["thickness"][:, test]) if "thickness" in assumed else own)

    def _shown(self, found: Courses, test: int, thickness: Tensor) -> Shown:
        """What the network makes of the courses of one test."""
        nodes = found.plans[test].times.size
        course = torch.from_numpy(found.values[:, test, :nodes])
        if found.changes is None:
            with torch.no_grad():
                return Shown(self.at_nodes(course, thickness).double().numpy(), None)
        changes = torch.from_numpy(found.changes[:, test, :nodes])
        step = max(1, AT_ONCE // (nodes * course.shape[-1] * changes.shape[-1] * 4))
        parts = [
            self._with_slopes(course[k : k + step], thickness[k : k + step], changes[k : k + step])
            for k in range(0, len(course), step)
        ]
        return Shown(*(np.concatenate([part[i] for part in parts]) for i in range(2)))

    def at_nodes(self, course: Tensor, thickness: Tensor) -> Tensor:
        """(candidates, nodes, 3) corrected outputs, from courses (candidates, nodes, columns) and thicknesses, mm."""
        module = self.module
        assert isinstance(module, RateModule)
        return module.at_nodes(inputs(course, thickness), base_of(course))

    def _with_slopes(self, course: Tensor, thickness: Tensor, changes: Tensor) -> tuple[Any, Any]:
        """Outputs and derivatives at nodes: forward mode through inputs and network, all directions at once."""
        directions = changes.shape[-1]
        thicker = torch.zeros(directions, len(thickness), dtype=thickness.dtype)
        thicker[directions - len(EFFECTS) + EFFECTS.index("thickness")] = 1.0

        def along(moved: Tensor, thick: Tensor) -> Tensor:
            told: Tensor = torch.func.jvp(self.at_nodes, (course, thickness), (moved, thick))[1]
            return told

        with torch.no_grad():
            values = self.at_nodes(course, thickness)
            slopes = torch.func.vmap(along)(changes.movedim(-1, 0), thicker).movedim(0, -1)
        return values.double().numpy(), slopes.double().numpy()

    def _outside(self, found: Courses, test: int, thickness: Tensor) -> Any:
        """Which candidates leave the domain at any node."""
        if self.told.domain is None:
            return np.zeros(len(thickness), bool)
        nodes = found.plans[test].times.size
        rows = local(torch.from_numpy(found.values[:, test, :nodes]), thickness)
        return self.told.domain.outside(rows.numpy()).any(axis=1)

    def _strange(self, history: History) -> bool:
        """Whether a test was observed in a way the network was not trained on."""
        assert isinstance(self.specimen, Bulge)
        return bool(history.operator) and history.operator != str(self.specimen.observation)
