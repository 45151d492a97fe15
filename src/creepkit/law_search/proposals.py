"""Sums that sparse regression proposes, by an optimizer of pysindy: of rates on the products that fit best."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.law_search.grammar import MOST_PRODUCTS, Product
from creepkit.law_search.smoothed_rates import SmoothedRates

THRESHOLDS = (0.02, 0.1, 0.5)
"""Of STLSQ, in units of ln rate, where no optimizer is given: from sentences of many factors to those of few."""


def proposed_sums(
    rates: SmoothedRates, fitted: Mapping[Product, Floats], optimizer: Any = None
) -> list[tuple[Product, ...]]:
    """Sums of products, of which a sparse regression of relative rates keeps two or three with coefficients above zero.

    fitted : {product: its log rates (intervals,)}.
    """
    products, found = list(fitted), dict[tuple[Product, ...], None]()
    shares = np.exp(np.clip(np.stack(list(fitted.values()), axis=1) - rates.log_rate[:, None], -30, 30))
    for solver in _optimizers(optimizer):
        weights = _solved(shares, np.ones(len(shares)), solver)
        order = [k for k in np.argsort(-weights) if weights[k] > 0][:MOST_PRODUCTS]
        if len(order) > 1:
            found[tuple(sorted(products[k] for k in order))] = None
    return list(found)


def _optimizers(given: Any) -> Sequence[Any]:
    import pysindy  # half a second, which nothing else needs

    return [given] if given is not None else [pysindy.STLSQ(threshold=one, alpha=1e-3) for one in THRESHOLDS]


def _solved(features: Floats, target: Floats, optimizer: Any) -> Floats:
    """Coefficients (terms,) by an optimizer of pysindy, as ranges of ln rate that a column explains."""
    scale = np.maximum(features.std(axis=0), 1e-12)
    solver = deepcopy(optimizer)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that every term was dropped, which is an answer
        solver.fit(features / scale, target[:, None])
    return np.asarray(np.ravel(solver.coef_), float)
