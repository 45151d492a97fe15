"""Which law alloys obey, by composition: what one alloy's tests leave open, its neighbours say.

The probability of law k at contents x is multinomial, p_k(x) ~ exp(a_k + b_k'x), with a normal prior on b whose width
is that of the least loss of alloys left out. Each alloy counts by its laws' weights, so that one whose tests decide
nothing says nothing. The posterior of an alloy is then its weights times what the others say of its composition.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats

WIDTHS = (0.3, 3.0, 30.0)
"""Of the prior of b, as the inverse of scikit-learn's penalty; the last is nearly none."""


LEAST_PROBABILITY = 1e-6
"""Of a law at any composition: no neighbour excludes what an alloy's own tests show."""


@dataclass(frozen=True, eq=False)
class LawsByComposition:
    """Probabilities of laws over compositions.

    laws : names. contents : (alloys, elements) atomic fractions. weights : (alloys, laws) by each alloy's own tests.
    left_out : (alloys, laws) what the others say. width : of the prior.
    """

    laws: tuple[str, ...]
    contents: Floats
    weights: Floats
    left_out: Floats
    width: float

    @classmethod
    def of(cls, contents: Floats, weights: Sequence[Mapping[str, float]]) -> LawsByComposition:
        """That of alloys with contents (alloys, elements); weights : {law: weight} of each."""
        laws = tuple(sorted({name for one in weights for name in one}))
        own = np.array([[one.get(name, 0.0) for name in laws] for one in weights])
        own = own / own.sum(axis=1, keepdims=True)
        others = ~np.eye(len(own), dtype=bool)

        def left_out(width: float) -> Floats:
            each = (_probabilities(contents[k], contents[j], own[k], width) for j, k in enumerate(others))
            return np.concatenate([p[None] if p.ndim == 1 else p for p in each])

        tried = {width: left_out(width) for width in WIDTHS}
        width = max(tried, key=lambda one: float(np.log((tried[one] * own).sum(axis=1)).sum()))
        return cls(laws, contents, own, tried[width], width)

    @property
    def shared(self) -> Floats:
        """(alloys, laws) probabilities by an alloy's own tests and by the others."""
        both = self.weights * self.left_out
        return np.asarray(both / both.sum(axis=1, keepdims=True))

    def at(self, contents: Floats) -> Floats:
        """(points, laws) probabilities at contents (points, elements)."""
        return np.stack([_probabilities(self.contents, one, self.weights, self.width)[0] for one in contents])


def _probabilities(contents: Floats, at: Floats, weights: Floats, width: float) -> Floats:
    """(1, laws) probabilities at contents (elements,), of alloys (alloys, elements) with weights (alloys, laws)."""
    from sklearn.linear_model import LogisticRegression

    count = weights.shape[1]
    known = np.flatnonzero(weights.sum(axis=0) > LEAST_PROBABILITY)
    result = np.full((1, count), LEAST_PROBABILITY)
    if known.size == 1:
        result[:, known] = 1.0
        return result
    law = np.tile(np.arange(count), len(contents))
    rows, weight = np.repeat(contents, count, axis=0), weights.ravel()
    counted = weight > 0
    model = LogisticRegression(C=width, max_iter=1000).fit(rows[counted], law[counted], weight[counted])
    result[:, model.classes_] = model.predict_proba(at[None])
    result = np.maximum(result, LEAST_PROBABILITY)
    return np.asarray(result / result.sum())
