"""How well a law describes and predicts its tests, in the units of who made them, whatever chi-square says of it.

Real tests contradict almost every law; a law that is contradicted and predicts within a few per cent is useful. Rates
are those of tests the law has not seen: each is compared with what the others say of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.records import is_logarithmic

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

LARGEST_PER_CENT = 0.5
"""Of ln, from which on a spread is given as a factor."""


WELL_PREDICTED = 0.5
"""Of ln rate, standard deviation of what the others say of a test: where it is larger they say nothing."""


@dataclass(frozen=True)
class Description:
    """Root mean squares of predicted over measured, of ln; NaN of what was not measured.

    rates : of tests left out in turn, of those that the others predict. outputs : {output: of its values}, of strains
    ln, of other outputs relative to their root mean square; with the offset of each test, and without a rate of its
    own. ruptures, minimum_rates : of the tests that state them and of which one is predicted; unpredicted : ruptures of
    which none is.
    """

    rates: float
    outputs: dict[str, float]
    ruptures: float
    minimum_rates: float
    unpredicted: int = 0

    @classmethod
    def of(cls, fit: Identification) -> Description:
        """That of an identification, also of one from a file."""
        ends = [m.rupture.ratio for m in fit.tests if m.rupture is not None and not m.rupture.censored]
        minima = [m.minimum_rate.ratio for m in fit.tests if m.minimum_rate is not None]
        outputs = {
            name: fit.rms if is_logarithmic(name) else errors.relative_rms_error for name, errors in fit.errors.items()
        }
        rates = [one.log_factor for one in fit.left_out if one.sd < WELL_PREDICTED]
        predicted = [ratio for ratio in ends if 0.0 < ratio < np.inf]
        unpredicted = len(ends) - len(predicted)
        return cls(_rms(rates), outputs, _spread(predicted), _spread(minima), unpredicted)

    @property
    def sentence(self) -> str:
        """What it describes within how much, the most telling first, without a full stop; "" of nothing."""
        lost = f" ({self.unpredicted} not predicted)" if self.unpredicted else ""
        logarithmic = [
            (f"rupture times{lost}", self.ruptures),
            ("minimum creep rates", self.minimum_rates),
            ("creep rates", self.rates),
            *((_plural(name), value) for name, value in self.outputs.items() if is_logarithmic(name)),
        ]
        texts = [f"{name} within {spread_text(value)}" for name, value in logarithmic if np.isfinite(value)]
        texts += [
            f"{_plural(name)} within {100 * value:.2g} %"
            for name, value in self.outputs.items()
            if np.isfinite(value) and not is_logarithmic(name)
        ]
        return " and ".join(texts[:2])


def spread_text(spread: float) -> str:
    """A root mean square of ln as "12 %", large ones as "a factor of 2.1"."""
    if spread > LARGEST_PER_CENT:
        return f"a factor of {float(f'{np.exp(min(spread, 50.0)):.2g}'):g}"
    return f"{float(f'{100 * np.expm1(spread):.2g}'):g} %"


def headline(fit: Identification) -> str:
    """How well the law describes the tests, then whether it could be the true one: one sentence without a full stop."""
    described, adequacy = Description.of(fit).sentence, fit.adequacy
    useful = f"describes {described}" if described else "was fitted"
    if not fit.converged:
        truth = "but the search for its values did not converge"
    elif adequacy is None or adequacy.verdict == "cannot be judged":
        truth = "whether it is the true law cannot be judged"
    elif adequacy.explains:
        truth = "the tests do not contradict it"
    elif adequacy.is_explained:
        truth = f"but {adequacy.explanations[0].headline}"
    elif adequacy.contradicting is not None:
        truth = "but minimum rates and rupture times contradict one another by it"
    else:
        shape = adequacy.misses_shape()
        truth = "the shape of the curves contradicts it" if shape else "the tests contradict it beyond their noise"
    return f"{fit.law.name} {useful}; {truth}"


def _plural(name: str) -> str:
    word = name.replace("_", " ")
    return f"{word}es" if word.endswith("s") else f"{word}s"


def _spread(ratios: list[float]) -> float:
    return _rms([float(np.log(r)) if 0.0 < r < np.inf else np.nan for r in ratios])


def _rms(values: list[float]) -> float:
    """Root mean square; NaN of nothing, and where one is not known."""
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")
