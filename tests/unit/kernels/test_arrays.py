"""Kernels for NumPy arrays and torch tensors: values, shapes, zeros, gradients."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from creepkit.errors import LawError
from creepkit.kernels import lower
from creepkit.language import CreepLaw, arrhenius
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from helpers.literature_laws import EQUATIONS

SHIPPED = [NORTON, STRAIN_HARDENING, TIME_HARDENING, HYPERBOLIC_SINE, DRIFTING_EXPONENT, COMBINED]
LAWS = [*SHIPPED, EQUATIONS["combined with temperature"], EQUATIONS["Liu-Murakami"], EQUATIONS["threshold"]]
ARRAYS: list[Any] = [("numpy", np.asarray), ("torch", torch.as_tensor)]

VALUES, WARM = {"A": 1e-10, "n": 3.0}, NORTON.times(arrhenius())

each_law = pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
torch_warns = pytest.mark.filterwarnings("ignore:.torch.jit.script. is deprecated")  # torch's own forward mode does
each_target = pytest.mark.parametrize(("target", "array"), ARRAYS, ids=["numpy", "torch"])


def moderate(law: CreepLaw, size: int, dtype: torch.dtype = torch.float64) -> list[torch.Tensor]:
    """Positional arguments near the middle of the bounds, whose rates are representable in single precision."""
    generator = np.random.default_rng(3)
    low, high = [120.0, 0.01, 1e3, 1000.0, 90.0, 39.0], [140.0, 0.02, 2e3, 1100.0, 110.0, 49.0]
    point = generator.uniform(low, high, (size, 6)).T
    inner = generator.uniform(0.1, 0.3, (len(law.states), size))
    bounds = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()])
    middle, reach = bounds.mean(axis=1), np.ptp(bounds, axis=1)
    theta = (middle + 0.05 * generator.uniform(-1, 1, (size, len(middle))) * reach).T
    return [torch.tensor(column, dtype=dtype) for column in (*point, *inner, *theta)]


# ---- values and shapes ---------------------------------------------------------------------------------------------


@each_target
def test_candidates_and_points_broadcast(target: Any, array: Callable[[Any], Any]) -> None:
    kernel = lower(TIME_HARDENING, target)
    values = {"A": 1e-12, "n": array([[2.0], [3.0]]), "m": -0.5}
    point = {"stress": array([10.0, 20.0, 30.0]), "time": 4.0}

    found = kernel.derivatives(values, **point)

    expected = 1e-12 * np.array([10.0, 20.0, 30.0]) ** np.array([[2.0], [3.0]]) / 2
    np.testing.assert_allclose(kernel.rate(values, **point), expected, rtol=1e-13)
    assert {tuple(d.shape) for d in (*found.point.values(), *found.params.values())} == {(2, 3)}


@each_target
def test_numbers_alone_give_a_number(target: Any, array: Callable[[Any], Any]) -> None:
    rate = lower(NORTON, target).rate({"A": 1e-10, "n": 2.0}, stress=3.0)

    assert rate.shape == ()
    assert float(rate) == pytest.approx(9e-10, rel=1e-14)


@each_target
def test_log_rate_reaches_where_the_rate_does_not(target: Any, array: Callable[[Any], Any]) -> None:
    kernel = lower(HYPERBOLIC_SINE, target)
    values = {"A": 1e-5, "n": 8.0, "B": 1.0}

    assert float(kernel.rate(values, stress=2000.0)) == np.inf
    assert float(kernel.log_rate(values, stress=2000.0)) == pytest.approx(
        np.log(1e-5) + 8 * (2000 - np.log(2)), rel=1e-14
    )


# ---- off, and zero -------------------------------------------------------------------------------------------------


def test_the_gradient_to_a_coefficient_that_is_off_is_not_nan() -> None:
    A = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)

    rate = lower(NORTON, "torch").rate({"A": A, "n": 3.0}, stress=torch.tensor([10.0], dtype=torch.float64))
    rate.sum().backward()

    assert torch.isfinite(A.grad)


# ---- gradients -----------------------------------------------------------------------------------------------------


@torch_warns
@each_law
@pytest.mark.parametrize("transform", ["jacfwd", "jacrev", "grad"])
def test_batches_of_candidates_are_differentiated_by_torch_func(law: CreepLaw, transform: str) -> None:
    arguments, kernel = moderate(law, 5), lower(law, "torch")
    split = 6 + len(law.states)
    point, theta = [a[0] for a in arguments[:split]], torch.stack(arguments[split:], dim=1)

    def log_rate(candidate: torch.Tensor) -> torch.Tensor:
        return kernel.internal_log_rate(*point, *candidate.unbind())

    found = torch.func.vmap(getattr(torch.func, transform)(log_rate))(theta)

    slopes = kernel.internal_derivatives(*point, *theta.T)
    expected = torch.stack([d / slopes.rate for d in slopes.params.values()], dim=1)
    torch.testing.assert_close(found, expected, rtol=1e-10, atol=1e-300)


def test_gradients_of_damage_rates_are_theirs() -> None:
    """d/dr of B s^k (1 - omega)^-r is that times -ln(1 - omega)."""
    kernel, r = (
        lower(EQUATIONS["Kachanov-Rabotnov"], "torch"),
        torch.tensor(4.0, dtype=torch.float64, requires_grad=True),
    )
    values = {"A": 1e-12, "n": 3.0, "B": 1e-8, "k": 2.0, "r": r}

    rate = kernel.state_rates(values, stress=50.0, principal_stress=40.0, omega=0.5)["omega"]
    (slope,) = torch.autograd.grad(rate, r)

    assert float(slope) == pytest.approx(1e-8 * 40.0**2 * 0.5**-4 * np.log(2), rel=1e-13)


@torch_warns
def test_second_derivatives_are_those_of_norton() -> None:
    """ln f = ln A + n ln s, so d2/ds2 = -n/s^2 and d2/(ds dn) = 1/s."""
    kernel = lower(NORTON, "torch")

    def log_rate(stress: torch.Tensor, n: torch.Tensor) -> torch.Tensor:
        return kernel.internal_log_rate(stress, 0.0, 0.0, 1000.0, stress, stress / 3, -40.0, n)

    at = torch.tensor(20.0, dtype=torch.float64), torch.tensor(4.0, dtype=torch.float64)
    (ss, sn), (ns, nn) = torch.func.hessian(log_rate, argnums=(0, 1))(*at)

    torch.testing.assert_close(torch.stack([ss, sn, ns, nn]), torch.tensor([-0.01, 0.05, 0.05, 0.0], dtype=at[0].dtype))


def test_single_precision_stays_single() -> None:
    law, arguments = COMBINED, moderate(COMBINED, 8, torch.float32)

    found = lower(law, "torch").internal_derivatives(*arguments)
    exact = lower(law, "torch").internal_derivatives(*(a.double() for a in arguments))

    doubled = [*exact.point.values(), *exact.params.values()]
    for got, expected in zip((*found.point.values(), *found.params.values()), doubled, strict=True):
        assert got.dtype == torch.float32
        torch.testing.assert_close(got.double(), expected, rtol=1e-3, atol=1e-30)


# ---- what is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: lower(NORTON).rate(VALUES, stress=1.0, stres=2.0), "has no variable 'stres': did you mean 'stress'"),
        (lambda: lower(NORTON).rate(VALUES, strain=1.0), "needs a stress, in MPa"),
        (lambda: lower(NORTON).rate({"A": 1e-10}, stress=1.0), "needs a value for n"),
        (lambda: lower(NORTON).rate({**VALUES, "m": 1.0}, stress=1.0), "has no parameter 'm'"),
        (lambda: lower(WARM).rate(WARM.center(), stress=10.0), "depends on temperature: give temperature in K"),
        (lambda: lower(NORTON, "jax"), "no kernel target 'jax'"),
    ],
)
def test_a_call_that_cannot_be_meant_is_refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(LawError, match=message):
        call()
