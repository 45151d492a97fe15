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
from creepkit.records import NuisanceValues, History, Prediction, Status
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import Trajectories, simulate_trajectories
from creepkit.specimens.reduced_march import NUISANCE_DIRECTIONS
from creepkit.surrogate.matching import check_applicable
from creepkit.surrogate.rate_inputs import network_inputs, local_inputs, with_running_means
from creepkit.surrogate.rate_module import RateModule
from creepkit.surrogate.rate_net import RateNet, base_columns
from creepkit.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

VALUE_BATCH_NUMBERS = 2**17
"""Numbers in the courses that a thread looks at, about what a cache holds."""
DERIVATIVE_BATCH_NUMBERS = 2**22
"""The same of their derivatives: a call of torch's for them costs some milliseconds, however few they are."""


class NodeOutputs(NamedTuple):
    """At nodes: outputs (candidates, nodes, 3), their derivatives with a last axis of directions, or None; and which
    candidates leave the domain, (candidates,).
    """

    values: Floats
    derivatives: Floats | None
    outside: Bools


class RateSurrogate(Surrogate):
    """The one-degree-of-freedom model of a dimple, corrected by a network; for any law."""

    recipe: RateNet
    nuisances = NUISANCE_DIRECTIONS

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
        nuisances: NuisanceValues | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor and Surrogate.predict."""
        nuisances = nuisances or {}
        check_applicable(self.metadata, histories, nuisances, self.nuisances)
        specimen, compiled = self.specimen, kernels.lower(law, "numba")
        assert isinstance(specimen, Bulge)
        theta = compiled.to_internal(values)
        count = max([len(theta), *(len(v) for v in nuisances.values())])
        theta = np.broadcast_to(theta, (count, theta.shape[1]))
        nuisances = {kind: np.broadcast_to(v, (count, len(histories))) for kind, v in nuisances.items()}
        threads = specimen.threads or len(os.sched_getaffinity(0))
        trajectories = simulate_trajectories(
            specimen, compiled, theta, histories, nuisances=nuisances, factors=self.recipe.factors, exact=jacobian,
            threads=threads,
        )  # fmt: skip
        return self._prediction(trajectories, histories, theta.shape[1], nuisances, threads)

    def _prediction(
        self, trajectories: Trajectories, histories: Sequence[History], parameters: int, nuisances: NuisanceValues, threads: int
    ) -> Prediction:
        lengths = np.array([h.times.size for h in histories], dtype=np.int64)
        count = len(trajectories.values)
        values = np.full((count, len(histories), int(lengths.max(initial=0)), 3), np.nan)
        derivatives = None if trajectories.jacobian is None else np.full((*values.shape, trajectories.jacobian.shape[-1]), np.nan)
        status = np.array(trajectories.status)
        for k, history in enumerate(histories):
            thickness = self._thickness(trajectories, k, count, nuisances)
            node_outputs = self._node_outputs(trajectories, k, thickness, threads)
            values[:, k, : lengths[k]] = trajectories.frames(k, node_outputs.values)
            if derivatives is not None and node_outputs.derivatives is not None:
                derivatives[:, k, : lengths[k]] = trajectories.frames(k, node_outputs.derivatives)
            incomplete = status[:, k] != Status.COMPLETE
            after_end = incomplete[:, None] & (history.times >= trajectories.end_times[:, k, None])
            values[:, k, : lengths[k]][after_end] = np.nan
            status[:, k] = np.where(node_outputs.outside & ~incomplete, int(Status.OUTSIDE_DOMAIN), status[:, k])
        nuisance_derivatives = {kind: derivatives[..., parameters + NUISANCE_DIRECTIONS.index(kind)] for kind in nuisances} if derivatives is not None else {}
        return Prediction(
            values=values, outputs=self.outputs, lengths=lengths, status=status, end_times=trajectories.end_times,
            jacobian=None if derivatives is None else derivatives[..., :parameters], times=tuple(h.times for h in histories),
            nuisance_jacobian=nuisance_derivatives,
        )  # fmt: skip

    def _thickness(self, trajectories: Trajectories, test: int, count: int, nuisances: NuisanceValues) -> Tensor:
        thicknesses = np.full(count, trajectories.schedules[test].setup.geometry.apex_thickness)
        return torch.from_numpy(np.array(nuisances["thickness"][:, test]) if "thickness" in nuisances else thicknesses)

    def _node_outputs(self, trajectories: Trajectories, test: int, thickness: Tensor, threads: int) -> NodeOutputs:
        """What the network makes of the courses of one test."""
        nodes = trajectories.schedules[test].times.size
        trajectory = torch.from_numpy(trajectories.values[:, test, :nodes])
        values, outside = self._values(trajectory, thickness, threads)
        if trajectories.jacobian is None:
            return NodeOutputs(values, None, outside)
        trajectory_derivatives = torch.from_numpy(trajectories.jacobian[:, test, :nodes])
        step = max(1, DERIVATIVE_BATCH_NUMBERS // trajectory_derivatives[0].numel())
        parts = [slice(k, k + step) for k in range(0, len(trajectory), step)]
        derivative_parts = [self._derivatives(trajectory[part], thickness[part], trajectory_derivatives[part]) for part in parts]
        return NodeOutputs(values, np.concatenate(derivative_parts), outside)

    def _values(self, trajectory: Tensor, thickness: Tensor, threads: int) -> tuple[Floats, Bools]:
        """Outputs at nodes, and who is outside; threads share the candidates."""
        step = max(1, min(VALUE_BATCH_NUMBERS // trajectory[0].numel(), -(-len(trajectory) // threads)))
        parts = [slice(k, k + step) for k in range(0, len(trajectory), step)]
        values, outside = np.empty((*trajectory.shape[:2], 3)), np.zeros(len(trajectory), bool)

        def evaluate(part: slice) -> None:
            with torch.no_grad():  # torch keeps this for each thread
                local_values = local_inputs(trajectory[part], thickness[part])
                node_inputs = with_running_means(trajectory[part], local_values)
                values[part] = self._module.at_nodes(node_inputs, base_columns(trajectory[part])).numpy()
            if self.metadata.domain is not None:
                outside[part] = self.metadata.domain.outside(local_values.numpy()).any(axis=1)

        if len(parts) == 1 or torch.get_num_threads() > 1:  # torch's own threads and ours would fight for the cores
            for part in parts:
                evaluate(part)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(evaluate, parts))
        return values, outside

    @property
    def _module(self) -> RateModule:
        assert isinstance(self.module, RateModule)
        return self.module

    def at_nodes(self, trajectory: Tensor, thickness: Tensor) -> Tensor:
        """(candidates, nodes, 3) corrected outputs, from courses (candidates, nodes, columns) and thicknesses, mm."""
        return self._module.at_nodes(network_inputs(trajectory, thickness), base_columns(trajectory))

    def _derivatives(self, trajectory: Tensor, thickness: Tensor, trajectory_derivatives: Tensor) -> Floats:
        """Derivatives of outputs at nodes: forward through inputs and network, all directions at once."""
        directions = trajectory_derivatives.shape[-1]
        thickness_directions = torch.zeros(directions, len(thickness), dtype=thickness.dtype)
        thickness_directions[directions - len(NUISANCE_DIRECTIONS) + NUISANCE_DIRECTIONS.index("thickness")] = 1.0

        def along(moved: Tensor, thick: Tensor) -> Any:
            return torch.func.jvp(network_inputs, (trajectory, thickness), (moved, thick))

        out: Any = (None, 0)  # inputs themselves are the same along all directions

        with torch.no_grad():
            trajectory_directions = trajectory_derivatives.movedim(-1, 0)
            node_inputs, input_directions = torch.func.vmap(along, out_dims=out)(trajectory_directions, thickness_directions)
            derivatives = self._module.derivatives(node_inputs, base_columns(trajectory), input_directions, base_columns(trajectory_directions)).movedim(0, -1)
        return np.asarray(derivatives.double().numpy())
