"""Kernels for NumPy arrays and torch tensors: values, shapes, zeros, gradients."""

import re
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy
import torch

import creepkit as ck
from creepkit.errors import ArgumentError, LawError
from creepkit.kernels import lower
from creepkit.kernels.compilation import assembly, module_source
from creepkit.kernels.extremes import Heaviside, Max, Min
from creepkit.kernels.symbolic_kernel import symbolic_kernel
from creepkit.language import CreepLaw, arrhenius, parameters, strain, stress, time
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, law, m, n, number

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
        (lambda: lower(NORTON).rate(VALUES, stress=1.0, stres=2.0), "has no variable 'stres'; did you mean 'stress'"),
        (lambda: lower(NORTON).rate(VALUES, strain=1.0), "needs a stress, in MPa"),
        (lambda: lower(NORTON).rate({"A": 1e-10}, stress=1.0), "needs a value for n"),
        (lambda: lower(NORTON).rate({**VALUES, "m": 1.0}, stress=1.0), "has no parameter 'm'"),
        (lambda: lower(WARM).rate(WARM.center(), stress=10.0), "depends on temperature: give temperature in K"),
        (lambda: lower(NORTON, "jax"), "target of lower() is 'jax'; allowed is 'numpy', 'torch' or 'compiled'"),
    ],
)
def test_a_call_that_cannot_be_meant_is_refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises((ArgumentError, LawError), match=re.escape(message)):
        call()


# ---- extremes --------------------------------------------------------------------------------------------------------

# Maxima that are differentiated without comparing their arguments: same values, and no time lost.


x, y, z = sympy.symbols("x y z", real=True)


@pytest.mark.parametrize(("own", "numpy_function"), [(Max, np.max), (Min, np.min)])
def test_values_and_slopes_are_those_of_the_extreme_argument(own: type, numpy_function: Callable) -> None:
    arguments = (x * y, y + 2, z**2 - x)
    expression = own(*arguments)
    for point in ((1.0, 2.0, 3.0), (4.0, 2.0, 1.0), (0.1, 7.0, 2.0), (-3.0, 1.0, 0.5)):
        at = dict(zip((x, y, z), point, strict=True))
        values = [float(one.subs(at)) for one in arguments]
        chosen = arguments[values.index(numpy_function(values))]
        assert float(expression.subs(at)) == numpy_function(values)
        for symbol in at:
            assert float(expression.diff(symbol).subs(at)) == float(chosen.diff(symbol).subs(at))


def test_duplicates_nested_ones_and_numbers_are_joined() -> None:
    assert Max(x, Max(y, x), 1, 3) == Max(3, x, y)
    assert Min(x, x) == x
    assert (Max(2, 5), Min(2, 5)) == (5, 2)
    assert [Heaviside(sympy.Integer(k)) for k in (-1, 0, 1)] == [0, sympy.S.Half, 1]
    assert Max(x, y).xreplace({x: z}) == Max(y, z)


SHAPES = {
    "a maximum of eight sums": lambda parts: sympy.Max(*parts, evaluate=False),
    "a minimum of eight sums": lambda parts: sympy.Min(*parts, evaluate=False),
    "a maximum of minima": lambda parts: sympy.Max(
        *(sympy.Min(*parts[k : k + 2], evaluate=False) for k in range(0, 8, 2)), evaluate=False
    ),
    "absolute values in a maximum": lambda parts: sympy.Max(*(sympy.Abs(one) for one in parts[:4]), evaluate=False),
    "steps of sums": lambda parts: sympy.Add(*(sympy.Heaviside(one, 0) * one for one in parts[:4])),
    "branches": lambda parts: sympy.Piecewise(
        *((a, b > strain) for a, b in zip(parts[:4], parts[4:], strict=True)), (parts[0], True), evaluate=False
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_law_of_many_branches_is_exported_in_seconds(name: str) -> None:
    numbers = [1.0 + 0.37 * k for k in range(8)]
    parts = [c * stress**2 - 1.5 * k * stress + sympy.sin(c * stress * time) for k, c in enumerate(numbers)]
    law = CreepLaw("branches", {"t": A * stress**n * SHAPES[name](parts)}, {A: RATE, n: POWER})
    start = clock.process_time()
    for target in ("c", "abaqus", "mfront", "python", "latex"):
        assert ck.export(law, target, {"A": 1e-16, "n": 4.0})
    assert clock.process_time() - start < 30.0


# ---- leading exponent ------------------------------------------------------------------------------------------------

# The leading exponent of time: strain ~ t^beta from a virgin state at constant stress.


def leading(of: CreepLaw, point: list[float] | None = None, **values: float) -> float:
    compiled = lower(of, "compiled")
    theta = of.to_internal({**of.center(), **values})
    return float(
        compiled.leading_exponent(theta)[0] if point is None else compiled.leading_exponent(theta, np.array([point]))[0]
    )


@pytest.mark.parametrize(
    ("of", "values", "beta"),
    [
        (NORTON, {}, 1.0),
        (TIME_HARDENING, {"m": -0.7}, 0.3),  # strain = A s^n t^(1+m)/(1+m)
        (STRAIN_HARDENING, {"m": -0.6}, 1 / 1.6),  # strain^(1-m) = (1-m) A s^n t
        (DRIFTING_EXPONENT, {"m": -0.5}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8}, 0.2),
        (COMBINED, {"m_1": -0.5, "m_2": -0.1}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8, "A_3": 0.0}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8, "A_2": 0.0, "A_3": 0.0}, 1.0),
        (COMBINED, {"A_1": 0.0, "A_2": 0.0, "A_3": 0.0}, 1.0),
        (EQUATIONS["saturating"], {}, 2.0),  # 1 - exp(-r t) starts as r t
        (EQUATIONS["saturating to a power"], {"m": 0.5}, 1.5),
        (EQUATIONS["erf and atan"], {}, 1.0),
        (law(A * stress**n * time**m * strain**m, {A: RATE, n: POWER, m: number(-0.9, 0)}), {"m": -0.5}, 0.5 / 1.5),
        (law(A * stress**n * (strain + 1e-4), {A: RATE, n: POWER}), {}, 1.0),
    ],
)
def test_the_exponent_is_that_of_the_closed_form(of: CreepLaw, values: dict[str, float], beta: float) -> None:
    assert leading(of, **values) == pytest.approx(beta, rel=1e-12)


def test_an_exponent_that_varies_with_temperature_is_taken_at_the_point() -> None:
    warm = EQUATIONS["exponent of time with temperature"]
    point = [100.0, 0.0, 0.0, 1173.15, 100.0, 33.0]  # 100 K above T_ref

    assert leading(warm, point, m=-0.5, m_T=1e-3) == pytest.approx(0.6, rel=1e-12)


# ---- source ----------------------------------------------------------------------------------------------------------

# Printed kernels read well, whatever the author's names are.


def test_what_needs_no_point_is_done_once_for_all_eight() -> None:
    """Functions of parameters alone, such as exp(-r) of Liu-Murakami, are called for one number, not for a vector."""
    for law_ in (COMBINED, EQUATIONS["Liu-Murakami"]):
        for function in assembly(module_source(symbolic_kernel(law_))).split("define internal i64 ")[1:]:
            numbers_in_every_lane = set(re.findall(r"(%\w+) = shufflevector", function))
            for arguments in re.findall(r"= call <8 x double> @\w[\w.]*\((.*)\)", function):
                assert set(re.findall(r"%\w+", arguments)) - numbers_in_every_lane


@pytest.mark.parametrize("name", ["names of Python", "names of kernels"])
def test_awkward_names_are_made_fit_to_print(name: str) -> None:
    foreign = EQUATIONS[name]
    values = foreign.center()

    for target in ("numpy", "torch"):
        rate = lower(foreign, target).rate(values, stress=50.0, strain=0.01, time=10.0, temperature=1000.0)
        assert float(rate) == pytest.approx(float(_by_sympy(foreign, values)), rel=1e-12)


def test_names_that_look_alike_stay_apart() -> None:
    """Python reads the micro sign and the Greek letter as one name."""
    micro, greek = parameters("µ μ")
    foreign = law(A * stress**n * (micro + 10 * greek), {A: RATE, n: POWER, micro: POWER, greek: POWER})

    rate = lower(foreign, "numpy").rate({"A": 1e-10, "n": 1.0, "µ": 2.0, "μ": 3.0}, stress=1.0)

    assert float(rate) == pytest.approx(32e-10, rel=1e-14)


def test_a_label_cannot_leave_its_comment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws refuse such labels; generated source does not rely on it."""
    monkeypatch.setattr("creepkit.language.law_record.validate_law", lambda law_: None)
    label = 'creep """\nraise SystemExit("label was run")\r# \x0c\u2028'
    foreign = law({label: A * stress**n}, {A: RATE, n: POWER}, name=label)

    assert float(lower(foreign, "numpy").rate({"A": 1e-10, "n": 2.0}, stress=3.0)) == pytest.approx(9e-10, rel=1e-14)
    text = module_source(symbolic_kernel(foreign))
    assert next(line for line in text.splitlines() if "SystemExit" in line).startswith("# ")


def _by_sympy(foreign: CreepLaw, values: dict[str, float]) -> float:
    at = {foreign.symbol(name): value for name, value in values.items()}
    point = {s: v for s in foreign.rate.free_symbols for n, v in _POINT.items() if s.name == n}
    return foreign.rate.evalf(30, subs={**at, **point})


_POINT = {"stress": 50.0, "strain": 0.01, "time": 10.0, "temperature": 1000.0}
