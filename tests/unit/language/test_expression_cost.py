"""Laws that no computer can differentiate are refused at once; those that people write are not."""

from collections.abc import Callable
from typing import Any

import pytest
import sympy
from sympy import Abs, Add, Heaviside, Max, Mul, Piecewise, Rational, exp, log, sinh

from creepkit.errors import LawError
from creepkit.kernels import lower
from creepkit.language import CreepLaw, arrhenius, strain, stress, temperature, time
from creepkit.language.expression_cost import DERIVATIVE_LIMIT, TERM_LIMIT, expression_cost
from creepkit.registry import default_registry
from helpers.literature_laws import POWER, RATE, A, n


def nested(step: Callable[[Any], Any], levels: int) -> sympy.Expr:
    """A function of a function of ... stress, as a file writes it: nothing evaluated."""
    expression: sympy.Expr = stress
    for _ in range(levels):
        expression = step(expression)
    return expression


def law(expression: sympy.Expr) -> CreepLaw:
    return CreepLaw("x", {"a": A * stress**n, "b": expression}, {A: RATE, n: POWER})


HOSTILE = {
    "28 nested absolute values": lambda: nested(lambda e: Abs(e - 1, evaluate=False), 28),
    "a maximum of 1500": lambda: Max(*(stress - k * strain for k in range(1500)), evaluate=False),
    "nested products": lambda: nested(lambda e: Mul(e, e + 1, evaluate=False), 20),
    "nested steps": lambda: nested(lambda e: Heaviside(e - Rational(1, 2), 0) + e, 12),
    "nested branches": lambda: nested(
        lambda e: Piecewise((e, stress > 1), (e + 1, time > 1), (-e, True), evaluate=False), 12
    ),
    "a deep expression": lambda: nested(lambda e: exp(-e, evaluate=False), 200),
    "a sum of 2000 powers": lambda: Add(*(strain**k for k in range(2, 2000))),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_law_that_cannot_be_lowered_is_one_sentence(name: str) -> None:
    with pytest.raises(
        LawError, match=r"law 'x', term 'b': the expression is too large: .* are allowed; write"
    ) as error:
        law(HOSTILE[name]())
    assert len(str(error.value)) < 300


def test_every_registered_law_is_far_from_the_limits() -> None:
    for registered in default_registry().laws().values():
        with_temperature = registered.value.times(arrhenius())
        counts = [expression_cost(term).derivatives for term in with_temperature.terms.values()]
        assert max(counts) < TERM_LIMIT / 2
        assert sum(counts) < DERIVATIVE_LIMIT / 8


def test_a_law_of_many_terms_is_not_refused() -> None:
    terms = {f"t{k}": A * stress**n * strain ** Rational(k, 7) * exp(-time / 10**k) for k in range(1, 40)}
    assert CreepLaw("large", terms, {A: RATE, n: POWER}).names == ("A", "n")


@pytest.mark.parametrize("levels", [1, 2])
def test_steps_within_steps_are_lowered(levels: int) -> None:
    step = nested(lambda e: Heaviside(e - Rational(1, 2), 0), levels)
    kernel = lower(law(A * step * stress**n), "numpy")
    assert kernel.rate({"A": 1e-16, "n": 4.0}, stress=100.0) == pytest.approx(2e-8, rel=1e-12)


@pytest.mark.parametrize(
    ("expression", "derivatives"),
    [
        (stress, 1),
        (stress + strain, 2 + 2),
        (exp(stress), 1 + (2 + 1 + 3)),  # d exp(x): the function again, times its inner derivative
    ],
)
def test_what_is_counted(expression: sympy.Expr, derivatives: int) -> None:
    assert expression_cost(expression).derivatives == derivatives


def test_counts_bound_what_sympy_makes() -> None:
    """Each first derivative, as sympy writes it, has no more nodes than are counted."""
    for expression in (
        A * sinh(stress / 30) ** n * exp(-stress * strain),
        log(1 + stress * time) * stress**n * (1 + strain) ** 3,
        Max(stress - A, strain, evaluate=False) * exp(-time * strain / temperature),
    ):
        made = [sympy.diff(expression, s) for s in expression.free_symbols]
        nodes = sum(sum(1 for _ in sympy.preorder_traversal(derivative)) for derivative in made)
        assert nodes <= expression_cost(expression).derivatives
