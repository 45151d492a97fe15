"""The compiled interface: layout, rows, flags, and what is off."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from creepkit.arrays import Floats
from creepkit.kernels import CompiledLaw, llvm_functions, lower, numpy_functions
from creepkit.kernels.interface import EntryName, call_entry
from creepkit.language import CreepLaw, strain, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.testing import draw_samples
from helpers.compiled_functions import compiled_function
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, B, damage, law, n, omega, scale

RATE_NOT_FINITE, DERIVATIVE_NOT_FINITE = 1, 2  # flags of an entry

SHIPPED = [NORTON, STRAIN_HARDENING, TIME_HARDENING, HYPERBOLIC_SINE, DRIFTING_EXPONENT, COMBINED]
LAWS = [*SHIPPED, EQUATIONS["Liu-Murakami"], EQUATIONS["threshold"], EQUATIONS["combined with temperature"]]
each_law = pytest.mark.parametrize("law_", LAWS, ids=lambda law_: law_.name)


def point(**given: float) -> Floats:
    """One row: 100 MPa uniaxial, strain 0.01, 1000 s, 1000 K."""
    names = ("stress", "strain", "time", "temperature", "principal_stress", "mean_stress")
    usual = dict(zip(names, (100.0, 0.01, 1000.0, 1000.0, 100.0, 100.0 / 3), strict=True))
    return np.array([[{**usual, **given}[name] for name in names]])


# ---- layout --------------------------------------------------------------------------------------------------------


def test_damage_comes_after_the_rate_row_by_row() -> None:
    """Rate A s^n (1 + omega) and damage rate B s omega: values, then slopes to x of both, then to theta."""
    damaging = damage(A * stress**n * (1 + omega), B * stress * omega, {A: RATE, n: POWER, B: RATE})
    compiled = lower(damaging, "compiled")
    theta = damaging.to_internal({"A": 1e-16, "n": 4.0, "B": 1e-9})[0]
    x = np.column_stack([point(), [[0.25]]])

    rate, _ = call_entry(compiled, "rate", x, theta)
    update, _ = call_entry(compiled, "update", x, theta)
    sensitivity, _ = call_entry(compiled, "sensitivity", x, theta)

    f, g = 1.25e-8, 2.5e-8
    np.testing.assert_allclose(rate, [[f, g]], rtol=1e-13)
    to_x = [0.04, 0, 0, 0, 0, 0, 1 / 1.25], [g / 100, 0, 0, 0, 0, 0, 1e-7]
    np.testing.assert_allclose(update, [[np.log(f), g, *to_x[0], *to_x[1]]], rtol=1e-13)
    to_theta = [f, f * np.log(100), 0], [0, 0, g]
    expected = [f, g, *np.multiply(f, to_x[0]), *to_x[1], *to_theta[0], *to_theta[1]]
    np.testing.assert_allclose(sensitivity, [expected], rtol=1e-13)
    assert (compiled.states, compiled.initial.tolist(), compiled.limits.tolist()) == (1, [0.0], [0.99])


@each_law
@pytest.mark.parametrize("entry", ["rate", "update", "sensitivity"])
def test_rows_are_taken_by_eight_and_the_rest_one_by_one(law_: CreepLaw, entry: EntryName) -> None:
    compiled, drawn = lower(law_, "compiled"), draw_samples(law_, 32, seed=2)
    x, theta = drawn.points[:19], drawn.theta[0]
    parts = [x[:8], x[8:16], x[16:17], x[17:18], x[18:]]

    together, _ = call_entry(compiled, entry, x, theta)

    np.testing.assert_array_equal(together, np.vstack([call_entry(compiled, entry, p, theta)[0] for p in parts]))


@each_law
@pytest.mark.parametrize("entry", ["rate", "update", "sensitivity"])
def test_eight_points_together_are_the_points_alone(law_: CreepLaw, entry: EntryName) -> None:
    """They round differently; exponents of 50 make a hundred units of the last place of that."""
    compiled, drawn = lower(law_, "compiled"), draw_samples(law_, 64, seed=3)
    theta = drawn.theta[0]

    together, _ = call_entry(compiled, entry, drawn.points, theta)
    alone = np.vstack([call_entry(compiled, entry, row[None], theta)[0] for row in drawn.points])

    np.testing.assert_allclose(together, alone, rtol=1e-12, atol=1e-290)


@each_law
def test_hostile_points_give_what_the_arrays_give(law_: CreepLaw) -> None:
    """One such point among seven good ones, and alone: the values of the NumPy kernel, and the flags they ask for."""
    compiled, arrays, drawn = lower(law_, "compiled"), lower(law_, "numpy"), draw_samples(law_, 8, seed=5)
    theta = drawn.theta[0]
    for column, bad in itertools.product(range(6), [0.0, -1.0, -1e300, 5e-324, 1e300, np.inf, -np.inf, np.nan]):
        x = drawn.points.copy()
        x[3, column] = bad
        with np.errstate(all="ignore"):
            expected = np.stack(np.broadcast_arrays(*arrays.internal_rates(*x.T, *theta)), -1)

        together, found = call_entry(compiled, "rate", x, theta)
        alone, found_alone = call_entry(compiled, "rate", x[3:4], theta)

        case = f"column {column}, {bad}"
        np.testing.assert_allclose(together, expected, rtol=1e-11, atol=1e-290, err_msg=case)
        np.testing.assert_allclose(alone, expected[3:4], rtol=1e-11, atol=1e-290, err_msg=case)
        assert found == (0 if np.isfinite(expected).all() else RATE_NOT_FINITE), case
        assert found_alone == (0 if np.isfinite(expected[3]).all() else RATE_NOT_FINITE), case


@each_law
def test_update_is_the_logarithm_of_the_rate(law_: CreepLaw) -> None:
    compiled, drawn = lower(law_, "compiled"), draw_samples(law_, 16, seed=4)
    for x, theta in zip(drawn.points, drawn.theta, strict=True):
        sensitivity, update = (call_entry(compiled, e, x[None], theta)[0][0] for e in ("sensitivity", "update"))
        inner = 1 + compiled.states
        if 1e-250 < sensitivity[0] < 1e250:
            assert np.exp(update[0]) == pytest.approx(sensitivity[0], rel=1e-12)
            slopes = sensitivity[inner : inner + x.size] / sensitivity[0]
            np.testing.assert_allclose(update[inner : inner + x.size], slopes, rtol=1e-10)


# ---- flags and off -------------------------------------------------------------------------------------------------


def flags(compiled: CompiledLaw, entry: EntryName, x: Floats, theta: Floats) -> int:
    return call_entry(compiled, entry, x, theta)[1]


def test_a_rate_beyond_float64_is_flagged_but_not_its_logarithm() -> None:
    compiled = lower(HYPERBOLIC_SINE, "compiled")
    theta = HYPERBOLIC_SINE.to_internal({"A": 1e-5, "n": 8.0, "B": 1.0})[0]

    assert flags(compiled, "rate", point(stress=2000.0), theta) == RATE_NOT_FINITE
    assert flags(compiled, "sensitivity", point(stress=2000.0), theta) == RATE_NOT_FINITE | DERIVATIVE_NOT_FINITE
    assert flags(compiled, "update", point(stress=2000.0), theta) == 0


def test_a_derivative_alone_can_be_flagged() -> None:
    """The rate at strain 0 is 1e-10 (1e-30)^-10 = 1e290, its slope a factor 1e31 larger."""
    steep = law(A * stress / strain**10, {A: scale(1e-12, 1e-5)})
    compiled = lower(steep, "compiled")
    theta = steep.to_internal({"A": 1e-10})[0]

    assert flags(compiled, "sensitivity", point(strain=0.0, stress=1.0), theta) == DERIVATIVE_NOT_FINITE


@each_law
def test_a_nan_is_flagged(law_: CreepLaw) -> None:
    compiled = lower(law_, "compiled")
    theta, x = law_.to_internal(law_.center())[0], point(stress=np.nan)
    x = np.column_stack([x, np.full((1, compiled.states), 0.1)])

    assert flags(compiled, "rate", x, theta) & RATE_NOT_FINITE
    assert flags(compiled, "update", x, theta) & RATE_NOT_FINITE


def test_a_term_that_is_off_leaves_the_others() -> None:
    compiled = lower(COMBINED, "compiled")
    values = {**COMBINED.center(), "A_1": 0.0, "A_3": 0.0, "A_2": 1e-16, "n_2": 4.0, "m_1": -0.5}

    update, _ = call_entry(compiled, "update", point(), COMBINED.to_internal(values)[0])

    np.testing.assert_allclose(update, [[np.log(1e-7), 0.04, -50.0, 0, 0, 0, 0]], rtol=1e-12)


# ---- records -------------------------------------------------------------------------------------------------------


def test_one_structure_is_compiled_once() -> None:
    """Bounds and titles do not enter; the scale does, since theta is the logarithm then."""
    other = law({"power law": A * stress**n}, {A: scale(1e-9, 1e-1), n: POWER}, name="other")
    linear = law({"power law": A * stress**n}, {A: POWER, n: POWER}, name="linear")

    assert lower(other, "compiled").fingerprint == lower(NORTON, "compiled").fingerprint
    assert lower(other, "compiled").rate is lower(NORTON, "compiled").rate
    assert lower(linear, "compiled").fingerprint != lower(NORTON, "compiled").fingerprint


# ---- every kind of equation ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EQUATIONS)
def test_equations_of_every_kind_give_what_the_arrays_give(name: str) -> None:
    """Branches, functions of the C library, states: a vector of eight points and one point more."""
    law_ = EQUATIONS[name]
    compiled, arrays, drawn = lower(law_, "compiled"), lower(law_, "numpy"), draw_samples(law_, 16, seed=6)
    x, theta = drawn.points[:9], drawn.theta[0]
    with np.errstate(all="ignore"):
        expected = np.stack(np.broadcast_arrays(*arrays.internal_rates(*x.T, *theta)), -1)

    found, _ = call_entry(compiled, "rate", x, theta)

    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-190)


# ---- llvm functions --------------------------------------------------------------------------------------------------

# Functions of compiled kernels against mpmath, in units of the last place, as vectors and as single numbers.


POINTS = 400
RNG = np.random.default_rng(0)


def powers(low: float, high: float) -> Floats:
    """Numbers of both sizes, evenly spread in their logarithm."""
    return 10.0 ** RNG.uniform(low, high, POINTS)


def uniform(low: float, high: float) -> Floats:
    return RNG.uniform(low, high, POINTS)


WIDE = np.concatenate([uniform(-710.4, 710.4), uniform(-1, 1), powers(-300, 0), uniform(15, 30)])
POSITIVE = np.concatenate([powers(-29, 2.8), uniform(0, 3), uniform(0.5, 1.5)])
ARGUMENTS = {
    "exp": np.concatenate([uniform(-745, 709.7), uniform(-1, 1), -powers(-300, 0), uniform(-745.1, -708)]),
    "log": np.concatenate([
        *(powers(-307, 308), uniform(0.5, 2), uniform(0.999, 1.001), powers(-323, -308)),
        *(1 + 0.5 ** np.arange(1, 53), 1 - 0.5 ** np.arange(1, 54)),
    ]),
    "expm1": np.concatenate([uniform(-40, 709.7), uniform(-1, 1), powers(-300, 0), -powers(-300, 0)]),
    "log1p": np.concatenate([powers(-300, 300), uniform(-1, 2), -powers(-300, -0.01)]),
    **dict.fromkeys(("sinh", "cosh", "tanh"), WIDE),
    **dict.fromkeys(("coth", "log_cosh", "log_rise", "log_tanh"), POSITIVE),
}  # fmt: skip
EXACT: dict[str, Callable[[Any], Any]] = {
    **{name: getattr(mpmath, name) for name in ("exp", "log", "expm1", "log1p", "sinh", "cosh", "tanh", "coth")},
    "log_cosh": lambda x: mpmath.log(mpmath.cosh(x)),
    "log_rise": lambda x: mpmath.log(-mpmath.expm1(-x)),
    "log_tanh": lambda x: mpmath.log(mpmath.tanh(x)),
}
WORST = {"exp": 2.0, "log": 2.0, "log1p": 2.0}
"""Units of the last place; 4 for the others."""


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize("name", ARGUMENTS)
def test_functions_are_exact_to_a_few_units_of_the_last_place(name: str, size: int) -> None:
    function, x = compiled_function(getattr(llvm_functions, name)), ARGUMENTS[name]
    x = x[: x.size // 8 * 8]

    found = np.concatenate([function(part) for part in x.reshape(-1, size)])

    with mpmath.workdps(400):
        exact = [EXACT[name](mpmath.mpf(float(v))) for v in x]
        error = [
            float(abs(mpmath.mpf(float(v)) - e) / mpmath.mpf(float(np.spacing(abs(float(e))))))
            for v, e in zip(found, exact, strict=True)
        ]
    worst = int(np.argmax(error))
    assert error[worst] <= WORST.get(name, 4.0), x[worst]


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize("name", ["exp", "log", "expm1", "log1p", "sinh", "cosh", "tanh", "asinh", "atan", "sqrt"])
def test_the_ends_of_the_doubles_are_those_of_numpy(name: str, size: int) -> None:
    x = [0.0, -0.0, np.inf, -np.inf, np.nan, -1.0, -5e-324, 5e-324, 800.0, -800.0, 709.782712893384, 709.7827128933841]
    x += [-745.2, -745.1, -708.5, 1e300, -1e300, 2.0**-1022, 1.7976931348623157e308, -0.5, 36.0, -36.0, 1.0, -2.0]
    with np.errstate(all="ignore"):
        expected = getattr(np, {"asinh": "arcsinh", "atan": "arctan"}.get(name, name))(np.array(x))

    function = compiled_function(getattr(llvm_functions, name))
    found = np.concatenate([function(part) for part in np.array(x).reshape(-1, size)])

    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        assert (same | (abs(found - expected) <= 4 * np.spacing(abs(expected)))).all()


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize(
    "name", ["exp_difference", "larger", "smaller", "power 3", "power -4.5", "power 0.3", "power -70"]
)
def test_functions_of_two_arguments_are_those_of_numpy(name: str, size: int) -> None:
    values = [-np.inf, -1000.0, -2.0, -2.0 + 1e-15, 0.0, 1e-9, 3.0, 1000.0, np.inf, np.nan]
    if name == "power -4.5":  # the root of minus infinity is NaN here
        values.remove(-np.inf)
    pairs = np.array(list(itertools.product(values, values)) + 7 * [(1.0, 2.0)])
    pairs = pairs[: len(pairs) // 8 * 8]
    kind, _, exponent = name.partition(" ")

    def formula(functions: Any) -> Callable[..., Any]:
        function = getattr(functions, kind)
        return (lambda a, b: function(a, float(exponent))) if exponent else function

    with np.errstate(all="ignore"):
        expected = formula(numpy_functions)(*pairs.T.copy())

    function = compiled_function(formula(llvm_functions), arguments=2)
    found = np.concatenate([function(*part.T) for part in pairs.reshape(-1, size, 2)])

    np.testing.assert_allclose(found, expected, rtol=4e-15)


def test_constants_are_evaluated_at_once() -> None:
    assert llvm_functions.exp(2.0) == math.exp(2.0)
    assert llvm_functions.power(2.0, 3.0) == 8.0
    assert llvm_functions.choose(llvm_functions.both(True, False), 1.0, 2.0) == 2.0
