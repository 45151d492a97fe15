"""RateNet in torch: gradients flow back to a law's parameters, through the derivatives of the compiled model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from creepkit import kernels
from creepkit.records import History
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import simulate_trajectories
from creepkit.surrogate.matching import check_history
from creepkit.surrogate.rate_surrogate import RateSurrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


class _TrajectoryFunction(torch.autograd.Function):
    """Courses as a function of the law's internal parameters; the backward pass is a product with their derivatives."""

    @staticmethod
    def forward(ctx: Any, theta: Tensor, derivatives: Tensor, values: Tensor) -> Tensor:
        ctx.save_for_backward(derivatives)
        return values

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        (derivatives,) = ctx.saved_tensors
        return (gradients[0][..., None] * derivatives).sum(dim=(1, 2)), None, None


def differentiable_outputs(surrogate: RateSurrogate, law: CreepLaw, theta: Tensor, history: History) -> Tensor:
    """(candidates, times, outputs) of one test, for internal parameters theta (candidates, P) float64.

    Internal means the natural logarithm where the scale of a parameter is logarithmic. Gradients are exact; they do not
    go through the integration in torch.
    """
    check_history(surrogate.metadata, history)
    compiled, specimen = kernels.lower(law, "numba"), surrogate.specimen
    assert isinstance(specimen, Bulge)
    trajectories = simulate_trajectories(specimen, compiled, theta.detach().numpy(), [history], factors=surrogate.recipe.factors, exact=True)
    assert trajectories.jacobian is not None
    node_count = trajectories.schedules[0].times.size
    values = torch.from_numpy(trajectories.values[:, 0, :node_count])
    derivatives = torch.from_numpy(trajectories.jacobian[:, 0, :node_count, :, : theta.shape[1]])
    thickness = torch.full((len(theta),), trajectories.schedules[0].setup.geometry.apex_thickness, dtype=torch.float64)
    trajectory = _TrajectoryFunction.apply(theta, derivatives, values)  # type: ignore[no-untyped-call]
    node_outputs = surrogate.at_nodes(trajectory, thickness)
    return torch.from_numpy(trajectories.schedules[0].frames).to(node_outputs.dtype) @ node_outputs
