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
from creepkit.language.symbols import POINT

DRAWS = 64
"""Points of the bounds at which a candidate parameter is looked at."""
LEAST_SLOPE = 0.2
"""Of dh/dp over the bounds: a parameter that the local exponent hardly feels cannot stand for it."""
LARGEST = 30.0
"""Local exponents above this are not looked for."""


@dataclass(frozen=True)
class LocalExponent:
    """h = a + b p of one term: p : the parameter's position; others : positions that a and b depend on.

    parts : point and internal parameters of `others` to (a, b, da, db), the latter with one entry for each of them.
    """

    p: int
    others: tuple[int, ...]
    parts: Callable[..., tuple[object, ...]]

    def at(self, point: Sequence[float], theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """a, b (...,) and their derivatives to the internal parameters `others`, (..., others)."""
        given = [theta[..., k] for k in self.others]
        with np.errstate(all="ignore"):
            found = self.parts(*point, *given)
        shape, count = theta.shape[:-1], len(self.others)
        each = [np.broadcast_to(np.asarray(v, float), shape) for v in found]
        da, db = (np.stack(each[k : k + count], axis=-1) if count else np.zeros((*shape, 0)) for k in (2, 2 + count))
        return each[0], each[1], da, db


def local_exponents(law: CreepLaw) -> tuple[LocalExponent, ...]:
    """Those of a law's terms that are worth a coordinate; none for terms that mention internal variables."""
    key = (law.fingerprint, tuple(param.bounds for param in law.params.values()))
    if key not in _KNOWN:
        _KNOWN[key] = _found(law)
    return _KNOWN[key]


_KNOWN: dict[tuple[str, tuple[tuple[float, float], ...]], tuple[LocalExponent, ...]] = {}
"""What was derived in this process, by fingerprint and bounds."""


def _found(law: CreepLaw) -> tuple[LocalExponent, ...]:
    taken: set[int] = set()
    found = []
    for label in law.terms:
        one = _of_term(law, law.terms[label], taken)
        if one is not None:
            found.append(one)
            taken |= {one.p, *one.others}
    return tuple(found)


def _of_term(law: CreepLaw, term: sympy.Expr, taken: set[int]) -> LocalExponent | None:
    if term.free_symbols & set(law.states) or not term.has(stress):
        return None
    h = sympy.simplify(stress * sympy.diff(term, stress) / term)
    own = [symbol for symbol in law.params if symbol in h.free_symbols]
    if h in law.params or {law.names.index(s.name) for s in own} & taken:
        return None
    candidates = [p for p in own if law.params[p].scale != "log" and sympy.diff(h, p, 2) == 0]
    candidates = [p for p in candidates if not sympy.diff(h, p).has(temperature)]  # a slope may be 0 at T_ref
    scored = [(_least_slope(law, h, p), p) for p in candidates]
    scored = [(score, p) for score, p in scored if score > LEAST_SLOPE]
    if not scored:
        return None
    p = max(scored, key=lambda pair: pair[0])[1]
    return _made(law, h, p, [symbol for symbol in own if symbol != p])


def _made(law: CreepLaw, h: sympy.Expr, p: sympy.Symbol, others: list[sympy.Symbol]) -> LocalExponent:
    a, b = h.subs(p, 0), sympy.diff(h, p)
    internal = {s: sympy.exp(s) if law.params[s].scale == "log" else s for s in others}
    a, b = a.subs(internal, simultaneous=True), b.subs(internal, simultaneous=True)
    parts = [a, b, *(sympy.diff(a, s) for s in others), *(sympy.diff(b, s) for s in others)]
    function = sympy.lambdify((*POINT, *others), parts, "numpy", cse=True)
    names = law.names
    return LocalExponent(names.index(p.name), tuple(names.index(s.name) for s in others), function)


def _least_slope(law: CreepLaw, h: sympy.Expr, p: sympy.Symbol) -> float:
    """The smallest |dh/dp| over the bounds, at 100 MPa, strain .01, 2e4 s, 1000 K."""
    slope = sympy.diff(h, p)
    symbols = [s for s in law.params if s in slope.free_symbols]
    function = sympy.lambdify((*POINT, *symbols), slope, "numpy")
    unit = qmc.Sobol(max(len(symbols), 1), seed=0).random(DRAWS)
    ends = [[law.params[s].to_internal(b) for b in law.params[s].bounds] for s in symbols]
    inner = [low + unit[:, k] * (high - low) for k, (low, high) in enumerate(ends)]
    drawn = [np.exp(v) if law.params[s].scale == "log" else v for s, v in zip(symbols, inner, strict=True)]
    with np.errstate(all="ignore"):
        found = np.abs(np.broadcast_to(function(100.0, 0.01, 2e4, 1000.0, 100.0, 33.0, *drawn), DRAWS))
    return float(np.min(found)) if np.isfinite(found).all() else 0.0
