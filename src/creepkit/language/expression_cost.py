"""What an expression costs before anything is done with it: how large its derivatives become when it is lowered.

A few characters can describe what no computer can hold: the derivatives of a maximum of N expressions have N^2 nodes.
The counts follow what kernels.log_form does with each node (powers as exponentials, absolute values and steps as
branches). Each distinct node is visited once, without recursion, so that to count is cheap.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import sympy

from creepkit.errors import LawError
from creepkit.language.expression_trees import DEPTH_LIMIT, SIZE_LIMIT

TERM_LIMIT, DERIVATIVE_LIMIT = 6_000, 40_000
"""Nodes of the first derivatives of a term and of a whole law, before common subexpressions are shared.

Eleven laws of the packages added, each with an activation energy, have 20,000 together, and 2,000 in a term at most.
"""


@dataclass(frozen=True)
class ExpressionCost:
    """Counts of one expression; float, for they overflow integers of any reasonable size: inf then.

    depth : levels. size : nodes, each as often as it is used. lowered : nodes once it is lowered. derivatives : nodes
    of its derivatives to all of its symbols. symbols : on which it depends.
    """

    depth: float
    size: float
    lowered: float
    derivatives: float
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
        return ExpressionCost(1.0, 1.0, 2.0, float(len(symbols)), symbols)
    lowered = _lowered_nodes(node, parts)
    return ExpressionCost(
        depth=1.0 + max(part.depth for part in parts) + (_EXPONENT_LEVELS if node.is_Pow and parts[1].symbols else 0.0),
        size=1.0 + sum(part.size for part in parts),
        lowered=lowered,
        derivatives=sum(part.derivatives for part in parts) + _of_partial_derivatives(node, parts, lowered),
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
