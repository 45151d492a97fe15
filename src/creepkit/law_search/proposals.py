"""Sentences that sparse regression proposes: of ln rates on logarithms of factors, and of rates on products.

Both are solved by an optimizer of pysindy. The logarithm of a product is a sum of logarithms of its factors, so that
one regression says which factors a product needs; a regression of rates on the products that fit best says which of
them to add.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.law_search.grammar import MOST_PRODUCTS, Product
from creepkit.law_search.smoothed_rates import SmoothedRates

THRESHOLDS = (0.02, 0.1, 0.5)
"""Of STLSQ, in units of ln rate, where no optimizer is given: from sentences of many factors to those of few."""


def proposed_products(rates: SmoothedRates, optimizer: Any = None) -> list[Product]:
    """The products whose factors a sparse regression of ln rate keeps, and Norton's."""
    columns = {
        "ln s": np.log(rates.stress),
        "s": rates.stress / rates.stress.max(),
        "ln e": np.log(rates.strain),
        "ln t": np.log(rates.time),
        "e": rates.strain / rates.strain.max(),
        "t": rates.time / rates.time.max(),
        "1/T": -(1.0 / rates.temperature - 1.0 / rates.temperature.mean()) * 1e5 / GAS_CONSTANT,
    }
    centred = np.stack([one - one.mean() for one in columns.values()], axis=1)
    found = dict.fromkeys([Product()])
    for solver in _optimizers(optimizer):
        kept = dict(zip(columns, _solved(centred, rates.log_rate - rates.log_rate.mean(), solver), strict=True))
        found[_product_of(kept)] = None
    return list(found)


def _product_of(kept: Mapping[str, float]) -> Product:
    """The product whose ln rate bends as coefficients say."""
    power, bend = kept["ln s"] != 0.0, kept["s"]
    stress = "power" if not bend else "threshold" if bend < 0 else "sinh" if power else "exponential"
    falls = {"strain power": kept["ln e"], "time power": kept["ln t"], "strain saturation": kept["e"]}
    falls["time saturation"] = kept["t"]
    hardening = min(falls, key=lambda name: falls[name])
    softening = "strain" if kept["e"] > 0 else "none"
    return Product(stress, hardening if falls[hardening] < 0 else "none", softening)


def proposed_sums(
    rates: SmoothedRates, fitted: Mapping[Product, Floats], optimizer: Any = None
) -> list[tuple[Product, ...]]:
    """Sums of products, of which a sparse regression of relative rates keeps two or three with coefficients above zero.

    fitted : {product: its log rates (points,)}.
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
