"""What a page knows of a law: names, units, bounds and values, intervals and likely directions, equations and code.

Everything is a dictionary of plain JSON values; `embedded_json` writes it so that it ends no script element.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from creepkit.arrays import Floats
from creepkit.exporters.javascript import law_expression, script_safe_json
from creepkit.exporters.mathml import expression_mathml, law_equations
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.correlation import correlation
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues


def law_data(source: CreepLaw | Identification | LawWithValues) -> dict[str, Any]:
    """Return a law as a page needs it; the values of a law alone are the middles of its bounds.

    `source` is a JavaScript expression (see `exporters.javascript.law_expression`). `interval` is that of 95 %,
    `verdict` says whether the tests determine a parameter, and `directions` are those in which parameters are uncertain
    together, the least certain first: steps of one standard deviation on the scale of each parameter (its logarithm
    where the scale is log). They are null, or empty, without an identification.
    """
    fit = source if isinstance(source, Identification) else None
    law, values = (source, source.center()) if isinstance(source, CreepLaw) else (source.law, dict(source.values))
    ranges = {} if isinstance(source, CreepLaw) else dict(source.ranges)
    record = LawWithValues(law, values)
    return {
        "name": law.name,
        "title": law.title or law.name,
        "references": [*law.references],
        "equations": [*law_equations(law)],
        "variables": [symbol.name for symbol in POINT_VARIABLES if law.uses(symbol)],
        "terms": [{"name": name, "formula": expression_mathml(term)} for name, term in law.terms.items()],
        "parameters": _parameters(law, values, fit),
        "states": [
            {"name": symbol.name, "symbol": expression_mathml(symbol), "title": state.meaning, "unit": state.unit,
             "initial": state.initial, "limit": state.limit}
            for symbol, state in law.states.items()
        ],
        "constraints": [sympy.sstr(relation) for relation in law.constraints],
        "ranges": {name: [float(low), float(high)] for name, (low, high) in ranges.items()},
        "directions": [] if fit is None else _directions(fit),
        "source": law_expression(record),
    }  # fmt: skip


def embedded_json(data: Mapping[str, Any]) -> str:
    """Data as JSON for a script element: nothing in it ends the element."""
    return script_safe_json(data)


def _parameters(law: CreepLaw, values: Mapping[str, float], fit: Identification | None) -> list[dict[str, Any]]:
    estimates = {} if fit is None else {estimate.name: estimate for estimate in fit.estimates}
    rows = []
    for symbol, param in law.params.items():
        found = estimates.get(symbol.name)
        rows.append({
            "name": symbol.name,
            "symbol": expression_mathml(symbol),
            "title": param.meaning,
            "unit": "" if param.unit == "1" else param.unit,
            "scale": param.scale,
            "low": param.bounds[0],
            "high": param.bounds[1],
            "off": param.off,
            "value": float(values[symbol.name]),
            "interval": None if found is None else _finite_pair(found.low, found.high),
            "verdict": None if found is None else found.verdict,
        })  # fmt: skip
    return rows


def _finite_pair(low: float, high: float) -> list[float | None]:
    return [float(end) if np.isfinite(end) else None for end in (low, high)]


def _directions(fit: Identification) -> list[dict[str, float]]:
    """One standard deviation along each principal direction of the covariance, the longest first.

    Directions are those of the correlation, so that the units of the parameters do not matter.
    """
    found = correlation(fit)
    if not (np.isfinite(found.matrix).all() and np.isfinite(found.sd).all()):
        return []
    lengths, vectors = np.linalg.eigh(found.matrix)
    steps: Floats = found.sd[:, None] * vectors * np.sqrt(np.maximum(lengths, 0.0))
    return [dict(zip(fit.law.names, column.tolist(), strict=True)) for column in steps.T[::-1]]
