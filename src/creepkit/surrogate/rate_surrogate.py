"""A trained RateNet as a predictor: for any law, with derivatives to its parameters and to what is unsure of a test."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from creepkit import kernels
from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.records import Effects, History, Prediction, Status
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import Courses, courses
from creepkit.specimens.reduced_march import EFFECTS
from creepkit.surrogate.matching import check_asked
from creepkit.surrogate.rate_inputs import inputs, local, remembering
from creepkit.surrogate.rate_module import RateModule
from creepkit.surrogate.rate_net import RateNet, base_of
from creepkit.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

AT_ONCE = 2**17
"""Numbers in the courses that a thread looks at, about what a cache holds."""
AT_ONCE_CHANGES = 2**22
"""The same of their derivatives: a call of torch's for them costs some milliseconds, however few they are."""


class Shown(NamedTuple):
    """At nodes: outputs (candidates, nodes, 3), their derivatives with a last axis of directions, or None; and which
    candidates leave the domain, (candidates,).
    """

    values: Floats
    changes: Floats | None
    outside: Bools


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
        check_asked(self.told, histories, effects, self.effects)
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
        return self._prediction(found, histories, theta.shape[1], assumed, threads)

    def _prediction(
        self, found: Courses, histories: Sequence[History], parameters: int, assumed: Effects, threads: int
    ) -> Prediction:
        lengths = np.array([h.times.size for h in histories], dtype=np.int64)
        count = len(found.values)
        values = np.full((count, len(histories), int(lengths.max(initial=0)), 3), np.nan)
        wide = None if found.changes is None else np.full((*values.shape, found.changes.shape[-1]), np.nan)
        status = np.array(found.status)
        for k, history in enumerate(histories):
            thickness = self._thickness(found, k, count, assumed)
            shown = self._shown(found, k, thickness, threads)
            values[:, k, : lengths[k]] = found.frames(k, shown.values)
            if wide is not None and shown.changes is not None:
                wide[:, k, : lengths[k]] = found.frames(k, shown.changes)
            cut = status[:, k] != Status.COMPLETE
            gone = cut[:, None] & (history.times >= found.end_times[:, k, None])
            values[:, k, : lengths[k]][gone] = np.nan
            status[:, k] = np.where(shown.outside & ~cut, int(Status.OUTSIDE_DOMAIN), status[:, k])
        kinds = {kind: wide[..., parameters + EFFECTS.index(kind)] for kind in assumed} if wide is not None else {}
        return Prediction(
            values=values, outputs=self.outputs, lengths=lengths, status=status, end_times=found.end_times,
            jacobian=None if wide is None else wide[..., :parameters], times=tuple(h.times for h in histories),
            effect_jacobian=kinds,
        )  # fmt: skip

    def _thickness(self, found: Courses, test: int, count: int, assumed: Effects) -> Tensor:
        own = np.full(count, found.plans[test].made.geometry.apex_thickness)
        return torch.from_numpy(np.array(assumed["thickness"][:, test]) if "thickness" in assumed else own)

    def _shown(self, found: Courses, test: int, thickness: Tensor, threads: int) -> Shown:
        """What the network makes of the courses of one test."""
        nodes = found.plans[test].times.size
        course = torch.from_numpy(found.values[:, test, :nodes])
        values, outside = self._values(course, thickness, threads)
        if found.changes is None:
            return Shown(values, None, outside)
        changes = torch.from_numpy(found.changes[:, test, :nodes])
        step = max(1, AT_ONCE_CHANGES // changes[0].numel())
        parts = [slice(k, k + step) for k in range(0, len(course), step)]
        slopes = [self._slopes(course[part], thickness[part], changes[part]) for part in parts]
        return Shown(values, np.concatenate(slopes), outside)

    def _values(self, course: Tensor, thickness: Tensor, threads: int) -> tuple[Floats, Bools]:
        """Outputs at nodes, and who is outside; threads share the candidates."""
        step = max(1, min(AT_ONCE // course[0].numel(), -(-len(course) // threads)))
        parts = [slice(k, k + step) for k in range(0, len(course), step)]
        values, outside = np.empty((*course.shape[:2], 3)), np.zeros(len(course), bool)

        def look(part: slice) -> None:
            with torch.no_grad():  # torch keeps this for each thread
                own = local(course[part], thickness[part])
                seen = remembering(course[part], own)
                values[part] = self._module.at_nodes(seen, base_of(course[part])).numpy()
            if self.told.domain is not None:
                outside[part] = self.told.domain.outside(own.numpy()).any(axis=1)

        if len(parts) == 1 or torch.get_num_threads() > 1:  # torch's own threads and ours would fight for the cores
            for part in parts:
                look(part)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(look, parts))
        return values, outside

    @property
    def _module(self) -> RateModule:
        assert isinstance(self.module, RateModule)
        return self.module

    def at_nodes(self, course: Tensor, thickness: Tensor) -> Tensor:
        """(candidates, nodes, 3) corrected outputs, from courses (candidates, nodes, columns) and thicknesses, mm."""
        return self._module.at_nodes(inputs(course, thickness), base_of(course))

    def _slopes(self, course: Tensor, thickness: Tensor, changes: Tensor) -> Floats:
        """Derivatives of outputs at nodes: forward through inputs and network, all directions at once."""
        directions = changes.shape[-1]
        thicker = torch.zeros(directions, len(thickness), dtype=thickness.dtype)
        thicker[directions - len(EFFECTS) + EFFECTS.index("thickness")] = 1.0

        def along(moved: Tensor, thick: Tensor) -> Any:
            return torch.func.jvp(inputs, (course, thickness), (moved, thick))

        out: Any = (None, 0)  # inputs themselves are the same along all directions

        with torch.no_grad():
            moved = changes.movedim(-1, 0)
            seen, seen_moved = torch.func.vmap(along, out_dims=out)(moved, thicker)
            found = self._module.slopes(seen, base_of(course), seen_moved, base_of(moved)).movedim(0, -1)
        return np.asarray(found.double().numpy())
