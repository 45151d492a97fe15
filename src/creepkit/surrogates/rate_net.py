"""RateNet: a surrogate of the bulge test that takes creep rates as input, also for laws outside its training.

The reduced-order model of the dimple follows a law along a reference path. At each node the network receives how the
rate of the law changes around the path, and means of that over the creep so far, and returns a correction of the
reduced-order model. It is trained on the rate family.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
import torch
from torch import Tensor

from creepkit import kernels
from creepkit.arrays import Bools, Floats
from creepkit.errors import DatasetError, SurrogateError
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Status,
    assemble_prediction,
    broadcast_candidates,
)
from creepkit.specimens.bulge.reduced_order.step_equations import TRAJECTORY_COLUMNS
from creepkit.specimens.bulge.reduced_order.step_solution import NUISANCE_DIRECTIONS, FeatureFactors
from creepkit.specimens.bulge.reduced_order.trajectories import Trajectories, TrajectoryOptions, simulate_trajectories
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.surrogates.applicability_domain import ApplicabilityDomain
from creepkit.surrogates.law_class import LawClass
from creepkit.surrogates.parameter_network import SampleTensors, SurrogateModule, load_weights, sample_tensors
from creepkit.surrogates.rate_network import (
    BASE_COLUMNS,
    RateModule,
    input_names,
    local_inputs,
    network_inputs,
    with_running_means,
)
from creepkit.surrogates.recipe import ProgressCallback, SampleArrays, SurrogateMetadata, Training, Weights
from creepkit.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw


DOMAIN_NODES = 4
"""Nodes of each history that the domain is made of, spread over it: neighbours say the same."""


CONDITION_INPUTS = ("ln P/E", "log10 age", "ln D", "ln D/D_elastic", "fast", "slow", "apex thickness")


DOMAIN_DIGITS = 6
"""Decimals of what the domain is made of: a feature that is zero but for its rounding does not vary."""


CONDITION_MARGIN, RATE_MARGIN = 0.05, 0.5
"""Shares of its range by which a CONDITION of the dimple, and all else, what a law's rate is like, may leave it.

Trained on exponents of stress up to 14 the network is still nearer than its base for Norton's law with n = 20 (5.6
against 14 um of 400), and no longer with n = 25; laws with m = -0.95, where training ends at -0.7, have the errors of
others. A pressure that falls or cycles, or a thicker roof, is another matter.
"""


@dataclass(frozen=True)
class RateNet:
    """The points around the reference path at which a law is evaluated, and the network that takes these rates.

    hidden, layers : of the network. stress_factors, strain_factors : where the rate is evaluated, as shares of the
    reference stress and strain.
    """

    hidden: int = 128
    layers: int = 3
    stress_factors: tuple[float, ...] = (0.33, 0.6, 0.8, 1.0, 1.25, 1.6, 2.1)
    strain_factors: tuple[float, ...] = (0.2, 1.0, 5.0)
    training: Training = field(
        default_factory=lambda: Training(epochs=300, rate=3e-3, schedule="cosine", clip=1.0, validation=0.1)
    )

    kind: ClassVar[str] = "rate-net"

    def __post_init__(self) -> None:
        for name, largest in (("hidden", 4096), ("layers", 32)):
            value = getattr(self, name)
            if value != int(value) or not 1 <= value <= largest:
                raise SurrogateError(f"RateNet: {name} is {value}; allowed are whole numbers from 1 to {largest}")
        for name in ("stress_factors", "strain_factors"):
            values = tuple(float(v) for v in getattr(self, name))
            if not values or not all(0 < v < 100 for v in values):
                raise SurrogateError(f"RateNet: {name} are {values}; allowed are numbers above 0 and below 100")
            object.__setattr__(self, name, values)

    @property
    def factors(self) -> FeatureFactors:
        """Where the features are taken."""
        return FeatureFactors(np.array(self.stress_factors), np.array(self.strain_factors))

    # ---- for the training ------------------------------------------------------------------------------------------

    def law_class(self, law: CreepLaw) -> LawClass:
        """Rates of stress, strain, time and temperature, whatever the law of the data.

        The inputs are rates along one path. Internal variables have another value at each point of the dimple, and the
        largest principal and the mean stress another ratio to the von Mises stress, of which the path knows nothing.
        """
        return LawClass(("stress", "strain", "time", "temperature"))

    def sample_arrays(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleArrays:
        """Arrays of a data set: inputs and base at nodes, weights of frames, targets and masks."""
        specimen, reason = bulge_of(data), self.law_class(data.law).reason_outside(data.law)
        if reason:
            raise DatasetError(
                f"law '{data.law.name}' of the data set {reason}, which RateNet is not given; train a ParameterGru"
            )
        law = kernels.lower(data.law, "numba")
        theta = data.law.to_internal(data.parameters)
        trajectories = []
        for row in range(len(data)):
            trajectories.append(
                simulate_trajectories(
                    specimen,
                    law,
                    theta[row : row + 1],
                    [data.planned_test(row)],
                    options=TrajectoryOptions(factors=self.factors),
                )
            )
            if progress is not None:
                progress("features", row + 1, len(data), "")
        nodes = max(trajectory.values.shape[2] for trajectory in trajectories)
        padded_values = np.stack([_padded(one.values[0, 0], nodes) for one in trajectories])
        thickness = torch.tensor(
            [one.schedules[0].setup.geometry.apex_thickness for one in trajectories], dtype=torch.float64
        )
        counts = torch.tensor([one.values.shape[2] for one in trajectories])
        values = torch.from_numpy(padded_values)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        tensors = {
            "inputs": network_inputs(values, thickness),
            "base": base_columns(values),
            "frames": torch.from_numpy(
                np.stack([_frame_weights(one, data.grid.frames, nodes) for one in trajectories])
            ),
            "targets": torch.from_numpy(np.where(mask[..., None], data.values, 0.0)),
        }
        single = {name: tensor.to(torch.float32) for name, tensor in tensors.items()}
        domain_rows = local_inputs(values, thickness)[:, _domain_nodes(nodes)].to(torch.float32)
        node_mask = torch.arange(nodes) < counts[:, None]
        arrays = {name: t.numpy() for name, t in {**single, "nodes": node_mask, "domain": domain_rows}.items()}
        return {**arrays, "mask": mask}

    def module(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateModule:
        """A fresh network with the scales of the training rows; train : (rows,) their positions."""
        return RateModule(samples["inputs"].shape[-1], self.hidden, self.layers).with_scales(samples, train)

    def metadata(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateMetadata:
        """Scales and domain; train : (rows,) positions of training rows."""
        module = self.module(data, samples, train)
        assert isinstance(module, RateModule)
        input_labels = input_names(self._feature_count)
        scaling = {
            "inputs": {
                n: [float(m), float(d)] for n, m, d in zip(input_labels, module.mean, module.deviation, strict=True)
            }
        }
        rows = samples["domain"][train].numpy().round(DOMAIN_DIGITS)
        domain_names = input_labels[: rows.shape[-1]]
        margins = [CONDITION_MARGIN if name in CONDITION_INPUTS else RATE_MARGIN for name in domain_names]
        return SurrogateMetadata.from_dataset(
            data,
            scaling=scaling,
            domain=ApplicabilityDomain.from_rows(domain_names, rows.reshape(-1, rows.shape[-1]), margins),
        )

    def surrogate(self, weights: Weights, metadata: SurrogateMetadata) -> Surrogate:
        """The network as a predictor."""
        return RateSurrogate(self, weights, metadata)

    def network(self, weights: Weights) -> RateModule:
        """The network with these weights."""
        module = RateModule(len(input_names(self._feature_count)), self.hidden, self.layers)
        load_weights(module.to(torch.from_numpy(weights["mean"].copy()).dtype), weights)
        return module

    @property
    def _feature_count(self) -> int:
        return len(self.stress_factors) * len(self.strain_factors)


def bulge_of(data: Dataset) -> Bulge:
    """The specimen of a data set; DatasetError unless it is a dimple."""
    if not isinstance(data.specimen, Bulge):
        raise DatasetError(
            f"RateNet corrects the one-degree-of-freedom model of a dimple, and these are tests of a "
            f"{data.specimen.name} specimen; train a ParameterGru, or simulate them: a bar needs no surrogate"
        )
    return data.specimen


def base_columns(trajectory: Any) -> Any:
    """(..., nodes, 4) what the network corrects, from trajectories (..., nodes, columns)."""
    return trajectory[..., [TRAJECTORY_COLUMNS.index(name) for name in BASE_COLUMNS]]


def _padded(values: Any, nodes: int) -> Any:
    """The last node repeated."""
    return np.pad(values, ((0, nodes - len(values)), (0, 0)), mode="edge")


def _frame_weights(trajectory: Trajectories, frames: int, nodes: int) -> Any:
    """(frames, nodes) weights of the nodes at the frames of the grid; zero for what is not there."""
    weights = trajectory.schedules[0].frames
    return np.pad(weights, ((0, frames - weights.shape[0]), (0, nodes - weights.shape[1])))


def _domain_nodes(nodes: int) -> list[int]:
    return [round(k * (nodes - 1) / (DOMAIN_NODES - 1)) for k in range(DOMAIN_NODES)]


VALUE_BATCH_NUMBERS = 2**17
"""Numbers in the trajectories of a batch of one thread, about what a cache holds."""


DERIVATIVE_BATCH_NUMBERS = 2**22
"""The same of their derivatives: a call of torch's for them costs some milliseconds, however few they are."""


class NodeOutputs(NamedTuple):
    """Outputs at nodes.

    values : (candidates, nodes, 3). derivatives : (candidates, nodes, 3, directions) or None. outside : (candidates,)
        which candidates leave the domain.
    """

    values: Floats
    derivatives: Floats | None
    outside: Bools


class RateSurrogate(Surrogate):
    """The reduced-order model of a dimple, corrected by a network of creep rates."""

    recipe: RateNet
    nuisances = NUISANCE_DIRECTIONS

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.specimen.title}, by a network of creep rates"

    def _predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        nuisances: NuisanceValues | None,
        sensitivities: bool,
    ) -> Prediction:
        """Predict each history's outputs at its times; theta : (candidates, parameters)."""
        specimen, compiled = self.specimen, kernels.lower(law, "numba")
        assert isinstance(specimen, Bulge)
        theta, nuisances = broadcast_candidates(theta, nuisances, len(histories))
        threads = specimen.threads or len(os.sched_getaffinity(0))
        trajectories = simulate_trajectories(
            specimen,
            compiled,
            theta,
            histories,
            nuisances=nuisances,
            options=TrajectoryOptions(factors=self.recipe.factors, exact=sensitivities, threads=threads),
        )
        parts = [self._history_prediction(h, k, trajectories, nuisances, threads) for k, h in enumerate(histories)]
        return assemble_prediction(parts, histories, self.outputs, len(theta))

    def _history_prediction(
        self, history: History, test: int, trajectories: Trajectories, nuisances: NuisanceValues, threads: int
    ) -> HistoryPrediction:
        """The corrected outputs at the times of one history, NaN after the end of a candidate."""
        status, end_times = trajectories.status[:, test], trajectories.end_times[:, test]
        thickness = self._thickness(trajectories, test, len(status), nuisances)
        node_outputs = self._node_outputs(trajectories, test, thickness, threads)
        values, jacobian, nuisance_jacobian = trajectories.frames(test, node_outputs.values), None, {}
        incomplete = status != Status.COMPLETE
        values[incomplete[:, None] & (history.times >= end_times[:, None])] = np.nan
        if node_outputs.derivatives is not None:
            derivatives, parameters = trajectories.frames(test, node_outputs.derivatives), trajectories.parameters
            jacobian = derivatives[..., :parameters]
            nuisance_jacobian = {
                kind: derivatives[..., parameters + NUISANCE_DIRECTIONS.index(kind)] for kind in nuisances
            }
        status = np.where(node_outputs.outside & ~incomplete, int(Status.OUTSIDE_DOMAIN), status)
        return HistoryPrediction(values, status, end_times, jacobian, nuisance_jacobian)

    def _thickness(self, trajectories: Trajectories, test: int, count: int, nuisances: NuisanceValues) -> Tensor:
        thicknesses = np.full(count, trajectories.schedules[test].setup.geometry.apex_thickness)
        return torch.from_numpy(np.array(nuisances["thickness"][:, test]) if "thickness" in nuisances else thicknesses)

    def _node_outputs(self, trajectories: Trajectories, test: int, thickness: Tensor, threads: int) -> NodeOutputs:
        """The corrected outputs at the nodes of one test."""
        nodes = trajectories.schedules[test].times.size
        trajectory = torch.from_numpy(trajectories.values[:, test, :nodes])
        values, outside = self._values(trajectory, thickness, threads)
        if trajectories.jacobian is None:
            return NodeOutputs(values, None, outside)
        trajectory_derivatives = torch.from_numpy(trajectories.jacobian[:, test, :nodes])
        step = max(1, DERIVATIVE_BATCH_NUMBERS // trajectory_derivatives[0].numel())
        parts = [slice(k, k + step) for k in range(0, len(trajectory), step)]
        derivative_parts = [
            self._derivatives(trajectory[part], thickness[part], trajectory_derivatives[part]) for part in parts
        ]
        return NodeOutputs(values, np.concatenate(derivative_parts), outside)

    def _values(self, trajectory: Tensor, thickness: Tensor, threads: int) -> tuple[Floats, Bools]:
        """Outputs at nodes, and which candidates are outside the domain; threads share the candidates."""
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

    @cached_property
    def _module(self) -> RateModule:
        return self.recipe.network(self.weights)

    def predict_samples(self, samples: SampleArrays) -> Floats:
        """(rows, frames, outputs) of the network for samples of its recipe."""
        with torch.no_grad():
            return np.asarray(self._module(sample_tensors(samples)).numpy(), float)

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
            node_inputs, input_directions = torch.func.vmap(along, out_dims=out)(
                trajectory_directions, thickness_directions
            )
            derivatives = self._module.derivatives(
                node_inputs, base_columns(trajectory), input_directions, base_columns(trajectory_directions)
            ).movedim(0, -1)
        return np.asarray(derivatives.double().numpy())
