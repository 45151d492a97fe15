"""RateNet: a surrogate of the bulge test that is fed with creep rates, so that it serves laws it has never seen.

The one-degree-of-freedom model of the dimple (see specimens.reduced_courses) follows a law along a reference path. What
the network is told at each node of that path is how the law's rate changes around it (features), how far stresses have
redistributed, and means of both over the creep so far; what it says is by how much the model is wrong. It is trained on
a family of rate functions (see dataset.rate_family), not on named laws.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from creepkit import kernels
from creepkit.errors import DatasetError, SurrogateError
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import Trajectories, simulate_trajectories
from creepkit.specimens.reduced_march import FeatureFactors
from creepkit.specimens.reduced_observed import TRAJECTORY_COLUMNS
from creepkit.surrogate.domain import ApplicabilityDomain
from creepkit.surrogate.rate_inputs import network_inputs, local_inputs, input_names
from creepkit.surrogate.rate_module import BASE_COLUMNS, RateModule
from creepkit.surrogate.recipe import SurrogateModule, ProgressCallback, SampleTensors, SurrogateMetadata, Training

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogate.surrogate import Surrogate

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
    """What is asked of a law around the reference path, and the network that hears it.

    hidden, layers : of the network. stress_factors, strain_factors : where the rate is asked for, as shares of the
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

    # ---- what the trainer asks -------------------------------------------------------------------------------------

    def sample_tensors(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleTensors:
        """Tensors of a data set: inputs and base at nodes, weights of frames, targets and masks."""
        specimen = bulge_of(data)
        law = kernels.lower(data.law, "numba")
        theta = law.to_internal(dict(zip(data.parameter_names, data.parameters.T, strict=True)))
        trajectories = []
        for row in range(len(data)):
            trajectories.append(simulate_trajectories(specimen, law, theta[row : row + 1], [data.planned_test(row)], factors=self.factors))
            if progress is not None:
                progress("features", row + 1, len(data), "")
        nodes = max(trajectory.values.shape[2] for trajectory in trajectories)
        padded_values = np.stack([_padded(one.values[0, 0], nodes) for one in trajectories])
        thickness = torch.tensor([one.schedules[0].setup.geometry.apex_thickness for one in trajectories], dtype=torch.float64)
        counts = torch.tensor([one.values.shape[2] for one in trajectories])
        values = torch.from_numpy(padded_values)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        tensors = {
            "inputs": network_inputs(values, thickness),
            "base": base_columns(values),
            "frames": torch.from_numpy(np.stack([_frame_weights(one, data.grid.frames, nodes) for one in trajectories])),
            "targets": torch.from_numpy(np.where(mask[..., None], data.values, 0.0)),
        }
        single = {name: tensor.to(torch.float32) for name, tensor in tensors.items()}
        domain_rows = local_inputs(values, thickness)[:, _domain_nodes(nodes)].to(torch.float32)
        node_mask = torch.arange(nodes) < counts[:, None]
        return {**single, "mask": torch.from_numpy(mask), "nodes": node_mask, "domain": domain_rows}

    def module(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateModule:
        """A fresh network with the scales of the training rows."""
        return RateModule(samples["inputs"].shape[-1], self.hidden, self.layers).with_scales(samples, train)

    def metadata(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateMetadata:
        """Scales and domain."""
        module = self.module(data, samples, train)
        assert isinstance(module, RateModule)
        input_labels = input_names(self._feature_count)
        scaling = {
            "inputs": {n: [float(m), float(d)] for n, m, d in zip(input_labels, module.mean, module.deviation, strict=True)}
        }
        rows = samples["domain"][train].numpy().round(DOMAIN_DIGITS)
        domain_names = input_labels[: rows.shape[-1]]
        margins = [CONDITION_MARGIN if name in CONDITION_INPUTS else RATE_MARGIN for name in domain_names]
        return SurrogateMetadata.from_dataset(data, scaling=scaling, domain=ApplicabilityDomain.from_rows(domain_names, rows.reshape(-1, rows.shape[-1]), margins))

    def empty_module(self, metadata: SurrogateMetadata) -> SurrogateModule:
        """A network for the weights of a file."""
        return RateModule(len(input_names(self._feature_count)), self.hidden, self.layers)

    def surrogate(self, module: SurrogateModule, metadata: SurrogateMetadata) -> Surrogate:
        """The network as a predictor."""
        from creepkit.surrogate.rate_surrogate import RateSurrogate

        return RateSurrogate(self, module, metadata)

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
    """(..., nodes, 4) what the network corrects, from courses (..., nodes, columns)."""
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
