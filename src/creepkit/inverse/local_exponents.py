"""Local stress exponents as coordinates: what a test knows of a term, where n itself trades with other parameters.

For A sinh(s/B)^n a test near one stress knows n_loc = d ln f / d ln s = n (s/B) coth(s/B), hardly n or B; for Eq. (1)
it knows n(t). Where the local exponent h of a term is a + b p, linear in one of its parameters p with a and b of the
others, h at the reference takes the place of p among the coordinates. Derived from the term's own algebra; a power
law's exponent is its own local exponent and stays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, stress, temperature
from creepkit.language.symbols import POINT_VARIABLES

SAMPLE_POINTS = 64
"""Points of the bounds at which a candidate parameter is looked at."""
MINIMUM_DERIVATIVE = 0.2
"""Of dh/dp over the bounds: a parameter that the local exponent hardly feels cannot stand for it."""
LARGEST_EXPONENT = 30.0
"""Local exponents above this are not looked for."""


@dataclass(frozen=True)
class LocalExponent:
    """h = a + b p of one term: p : the parameter's position; others : positions that a and b depend on.

    parts : point and internal parameters of `others` to (a, b, da, db), the latter with one entry for each of them.
    """

    position: int
    others: tuple[int, ...]
    coefficients: Callable[..., tuple[object, ...]]

    def evaluate(self, point: Sequence[float], theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """a, b (...,) and their derivatives to the internal parameters `others`, (..., others)."""
        other_values = [theta[..., k] for k in self.others]
        with np.errstate(all="ignore"):
            evaluated = self.coefficients(*point, *other_values)
        shape, count = theta.shape[:-1], len(self.others)
        broadcast = [np.broadcast_to(np.asarray(v, float), shape) for v in evaluated]
        da, db = (np.stack(broadcast[k : k + count], axis=-1) if count else np.zeros((*shape, 0)) for k in (2, 2 + count))
        return broadcast[0], broadcast[1], da, db


def local_exponents(law: CreepLaw) -> tuple[LocalExponent, ...]:
    """Those of a law's terms that are worth a coordinate; none for terms that mention internal variables."""
    key = (law.fingerprint, tuple(param.bounds for param in law.params.values()))
    if key not in _CACHE:
        _CACHE[key] = _derived(law)
    return _CACHE[key]


_CACHE: dict[tuple[str, tuple[tuple[float, float], ...]], tuple[LocalExponent, ...]] = {}
"""What was derived in this process, by fingerprint and bounds."""


def _derived(law: CreepLaw) -> tuple[LocalExponent, ...]:
    used_positions: set[int] = set()
    exponents = []
    for label in law.terms:
        exponent = _exponent_of_term(law, law.terms[label], used_positions)
        if exponent is not None:
            exponents.append(exponent)
            used_positions |= {exponent.position, *exponent.others}
    return tuple(exponents)


def _exponent_of_term(law: CreepLaw, term: sympy.Expr, used_positions: set[int]) -> LocalExponent | None:
    if term.free_symbols & set(law.states) or not term.has(stress):
        return None
    exponent = sympy.simplify(stress * sympy.diff(term, stress) / term)
    parameters = [symbol for symbol in law.params if symbol in exponent.free_symbols]
    if exponent in law.params or {law.names.index(s.name) for s in parameters} & used_positions:
        return None
    candidates = [p for p in parameters if law.params[p].scale != "log" and sympy.diff(exponent, p, 2) == 0]
    candidates = [p for p in candidates if not sympy.diff(exponent, p).has(temperature)]  # a slope may be 0 at T_ref
    scored = [(_smallest_derivative(law, exponent, p), p) for p in candidates]
    scored = [(score, p) for score, p in scored if score > MINIMUM_DERIVATIVE]
    if not scored:
        return None
    p = max(scored, key=lambda pair: pair[0])[1]
    return _compiled(law, exponent, p, [symbol for symbol in parameters if symbol != p])


def _compiled(law: CreepLaw, exponent: sympy.Expr, p: sympy.Symbol, others: list[sympy.Symbol]) -> LocalExponent:
    a, b = exponent.subs(p, 0), sympy.diff(exponent, p)
    internal = {s: sympy.exp(s) if law.params[s].scale == "log" else s for s in others}
    a, b = a.subs(internal, simultaneous=True), b.subs(internal, simultaneous=True)
    parts = [a, b, *(sympy.diff(a, s) for s in others), *(sympy.diff(b, s) for s in others)]
    function = sympy.lambdify((*POINT_VARIABLES, *others), parts, "numpy", cse=True)
    names = law.names
    return LocalExponent(names.index(p.name), tuple(names.index(s.name) for s in others), function)


def _smallest_derivative(law: CreepLaw, exponent: sympy.Expr, p: sympy.Symbol) -> float:
    """The smallest |dh/dp| over the bounds, at 100 MPa, strain .01, 2e4 s, 1000 K."""
    derivative = sympy.diff(exponent, p)
    symbols = [s for s in law.params if s in derivative.free_symbols]
    function = sympy.lambdify((*POINT_VARIABLES, *symbols), derivative, "numpy")
    unit = qmc.Sobol(max(len(symbols), 1), seed=0).random(SAMPLE_POINTS)
    internal_bounds = [[law.params[s].to_internal(b) for b in law.params[s].bounds] for s in symbols]
    internal = [low + unit[:, k] * (high - low) for k, (low, high) in enumerate(internal_bounds)]
    sampled = [np.exp(v) if law.params[s].scale == "log" else v for s, v in zip(symbols, internal, strict=True)]
    with np.errstate(all="ignore"):
        magnitudes = np.abs(np.broadcast_to(function(100.0, 0.01, 2e4, 1000.0, 100.0, 33.0, *sampled), SAMPLE_POINTS))
    return float(np.min(magnitudes)) if np.isfinite(magnitudes).all() else 0.0
