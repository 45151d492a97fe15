"""What an expression costs before anything is done with it: how large it and its derivatives become when it is lowered.

A few characters can describe what no computer can hold: twenty squares of sums in each other have a million nodes, the
derivatives of a maximum of N expressions N^2, and a condition on a condition has the combinations of both. The counts
below follow what kernels.log_form and sympy do with each node (powers as exponentials, absolute values and steps as
branches, products of sums expanded). Each distinct node is visited once, without recursion, so that to count is cheap
even where to traverse would not end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import sympy

from creepkit.errors import LawError
from creepkit.language.expression_trees import DEPTH_LIMIT, EXPONENT_LIMIT, SIZE_LIMIT, magnitude

TERM_LIMIT, DERIVATIVE_LIMIT = 6_000, 40_000
"""Nodes of the first derivatives of a term and of a whole law, before common subexpressions are shared.

Eleven laws of the packages added, each with an activation energy, have 20,000 together, and 2,000 in a term at most.
"""


SUMMAND_LIMIT = 2000
"""Summands of a sum when its products of sums, and its integer powers of them, are expanded."""


BRANCH_LIMIT = 1000
"""Combinations of the branches of conditions that depend on each other."""


@dataclass(frozen=True)
class ExpressionCost:
    """Counts of one expression; float, for they overflow integers of any reasonable size: inf then.

    depth : levels. size : nodes, each as often as it is used. lowered : nodes once it is lowered. derivatives : nodes
    of its derivatives to all of its symbols. summands : of its expansion. branches : combinations of conditions.
    power : the largest product of numeric exponents within each other. symbols : on which it depends.
    """

    depth: float
    size: float
    lowered: float
    derivatives: float
    summands: float
    branches: float
    power: float
    symbols: frozenset[sympy.Symbol]


def expression_cost(expression: sympy.Basic) -> ExpressionCost:
    """Count an expression."""
    costs: dict[int, ExpressionCost] = {}
    for node in _nodes_after_arguments(expression):
        costs[id(node)] = _node_cost(node, [costs[id(argument)] for argument in node.args])
    return costs[id(expression)]


def check_cost(origin: str, expressions: Iterable[tuple[str, sympy.Basic]]) -> None:
    """LawError, in one sentence, for expressions that cannot be differentiated and lowered in a few seconds.

    expressions : (where it stands, expression) of all of a law.
    """
    total = 0.0
    for place, expression in expressions:
        cost = expression_cost(expression)
        total += cost.derivatives
        excess = (
            (cost.depth, DEPTH_LIMIT, "levels of nesting"),
            (cost.size, SIZE_LIMIT, "nodes"),
            (cost.power, EXPONENT_LIMIT, "as the product of exponents"),
            (cost.branches, BRANCH_LIMIT, "combinations of branches, for its conditions hold other conditions"),
            (cost.summands, SUMMAND_LIMIT, "summands when its products and powers of sums are expanded"),
            (cost.derivatives, TERM_LIMIT, "operations in its derivatives"),
            (total, DERIVATIVE_LIMIT, "operations in the derivatives of the law"),
        )
        for count, limit, what in excess:
            if not count <= limit:
                raise LawError(
                    f"{origin}, {place}: the expression is too large: {_number(count)} {what}, and at most {limit} are "
                    "allowed; write it with fewer parts, or fewer of them within each other"
                )


def _number(count: float) -> str:
    return f"{count:.0f}" if count < 1e6 else f"{count:.0e}" if math.isfinite(count) else "more than 1e308"


def _nodes_after_arguments(expression: sympy.Basic) -> Iterator[sympy.Basic]:
    """Every distinct node once, after its arguments."""
    seen: set[int] = set()
    pending = [(expression, False)]
    while pending:
        node, is_entered = pending.pop()
        if is_entered:
            yield node
        elif id(node) not in seen:
            seen.add(id(node))
            pending.append((node, True))
            pending.extend((argument, False) for argument in node.args)


_EXPONENT_LEVELS = 4.0
"""Levels that a power with a symbol in its exponent adds, and what sympy asks of towers of them."""


_BRANCHED = (sympy.Abs, sympy.sign, sympy.Heaviside)
"""Functions that become branches."""


def _node_cost(node: sympy.Basic, parts: list[ExpressionCost]) -> ExpressionCost:
    if not parts:
        symbols = frozenset([node] if isinstance(node, sympy.Symbol) else [])
        return ExpressionCost(1.0, 1.0, 2.0, float(len(symbols)), 1.0, 1.0, 1.0, symbols)
    lowered = _lowered_nodes(node, parts)
    return ExpressionCost(
        depth=1.0 + max(part.depth for part in parts) + (_EXPONENT_LEVELS if node.is_Pow and parts[1].symbols else 0.0),
        size=1.0 + sum(part.size for part in parts),
        lowered=lowered,
        derivatives=sum(part.derivatives for part in parts) + _of_partial_derivatives(node, parts, lowered),
        summands=_summands(node, parts),
        branches=_branches(node, parts),
        power=_power(node, parts),
        symbols=frozenset().union(*(part.symbols for part in parts)),
    )


def _lowered_nodes(node: sympy.Basic, parts: list[ExpressionCost]) -> float:
    """A condition on x and the branches x and -x are three of it; a power is exp(k ln x)."""
    total = sum(part.lowered for part in parts)
    if isinstance(node, _BRANCHED):
        return 3.0 * total + 6.0
    return total + (4.0 if node.is_Pow else 1.0)


def _of_partial_derivatives(node: sympy.Basic, parts: list[ExpressionCost], lowered: float) -> float:
    """Nodes that the chain rule writes down: for each argument its factor, once a symbol that the argument has."""
    if node.is_Add or isinstance(node, (sympy.Piecewise, sympy.functions.elementary.piecewise.ExprCondPair)):
        return float(len(parts))
    if node.is_Mul or isinstance(node, (sympy.Max, sympy.Min)):
        return sum(len(part.symbols) * lowered for part in parts)
    return sum(len(part.symbols) * (lowered + 3.0) for part in parts)


def _summands(node: sympy.Basic, parts: list[ExpressionCost]) -> float:
    """Summands of an expansion; the largest of any argument where the node itself is not expanded."""
    counts = [part.summands for part in parts]
    if node.is_Add:
        return float(sum(counts))
    if node.is_Mul:
        return math.prod(counts)
    if node.is_Pow and isinstance(node.args[1], sympy.Integer) and counts[0] > 1.0:
        power = min(abs(int(node.args[1])), SUMMAND_LIMIT)
        if node.args[0].is_Add or node.args[0].is_Mul:
            return math.inf if counts[0] > SUMMAND_LIMIT else float(math.comb(power + int(counts[0]) - 1, power))
    return 1.0 if max(counts) <= SUMMAND_LIMIT else math.inf


def _branches(node: sympy.Basic, parts: list[ExpressionCost]) -> float:
    """Combinations of branches: sympy multiplies out those of a condition that itself has branches."""
    product = math.prod(part.branches for part in parts)
    if isinstance(node, sympy.Abs):
        return 2.0 * product * product
    if isinstance(node, (sympy.sign, sympy.Heaviside)):
        return 3.0 * product * product
    if isinstance(node, sympy.Piecewise):
        return float(sum(part.branches for part in parts))
    if node.is_Boolean and product > 1.0:
        return product * product
    return product


def _power(node: sympy.Basic, parts: list[ExpressionCost]) -> float:
    """The product of numeric exponents; sympy multiplies them, and raises the numbers in their base to it."""
    largest = max(part.power for part in parts)
    if not node.is_Pow or parts[1].symbols:
        return largest
    if parts[1].size > _LARGEST_CONSTANT or parts[1].power > EXPONENT_LIMIT:
        return math.inf
    return largest * max(1.0, float(min(magnitude(node.args[1]), 1e300)))


_LARGEST_CONSTANT = 50
"""Nodes of an exponent without symbols that is computed."""
