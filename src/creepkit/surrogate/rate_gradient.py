"""RateNet in torch: gradients flow back to a law's parameters, through the derivatives of the compiled model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from creepkit import kernels
from creepkit.records import History
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.reduced_courses import courses
from creepkit.surrogate.matching import check
from creepkit.surrogate.rate_surrogate import RateSurrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


class _Course(torch.autograd.Function):
    """Courses as a function of the law's internal parameters; the backward pass is a product with their derivatives."""

    @staticmethod
    def forward(ctx: Any, theta: Tensor, changes: Tensor, values: Tensor) -> Tensor:
        ctx.save_for_backward(changes)
        return values

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        (changes,) = ctx.saved_tensors
        return (gradients[0][..., None] * changes).sum(dim=(1, 2)), None, None


def outputs(surrogate: RateSurrogate, law: CreepLaw, theta: Tensor, history: History) -> Tensor:
    """(candidates, times, outputs) of one test, for internal parameters theta (candidates, P) float64.

    Internal means the natural logarithm where the scale of a parameter is logarithmic. Gradients are exact; they do not
    go through the integration in torch.
    """
    check(surrogate.told, history)
    compiled, specimen = kernels.lower(law, "numba"), surrogate.specimen
    assert isinstance(specimen, Bulge)
    found = courses(specimen, compiled, theta.detach().numpy(), [history], factors=surrogate.recipe.factors, exact=True)
    assert found.changes is not None
    nodes = found.plans[0].times.size
    values = torch.from_numpy(found.values[:, 0, :nodes])
    changes = torch.from_numpy(found.changes[:, 0, :nodes, :, : theta.shape[1]])
    thickness = torch.full((len(theta),), found.plans[0].made.geometry.apex_thickness, dtype=torch.float64)
    course = _Course.apply(theta, changes, values)  # type: ignore[no-untyped-call]
    shown = surrogate.at_nodes(course, thickness)
    return torch.from_numpy(found.plans[0].frames).to(shown.dtype) @ shown
