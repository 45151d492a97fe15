"""One perturbation of the tests: what they may hide, its size, what it does to the rate, and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats

DRIFT, OFFSET = "temperature drift", "offset of "


NOTEWORTHY_CHANGE = 0.01
"""Of the rate, from which on a perturbation is named."""


LARGEST_PER_CENT = 0.4
"""Of ln rate, from which on its change is given as a factor."""


NOT_INCLUDED = "the intervals do not include"
"""How the note on perturbations that are not modelled begins."""


@dataclass(frozen=True, eq=False)
class Perturbation:
    """Something that tests may hide, with the prior standard deviation that is usual for it.

    kind : of the nuisance parameter that would stand for it. size : one standard deviation, in its unit, of errors that
        the tests have independently of one another, or of one error common to all tests.
    rate_change : one standard deviation of ln of the rate at the reference point; NaN of what intervals include, and of
        what is common to all tests.
    residual_change : (tests, observations) -, of the residuals, by one standard deviation; saved in kept fits alone.
    common : whether it is one error of all tests, as of an instrument that measures them all. tests : how many have it.
    included : whether the intervals include it.
    per_kelvin : change of ln rate a kelvin at the reference point, NaN where it is no drift of temperature; assumed :
        whether by a usual activation energy, as the law has none.
    """

    kind: str
    size: float
    unit: str
    rate_change: float = float("nan")
    residual_change: Floats = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    common: bool = False
    tests: int = 1
    included: bool = False
    per_kelvin: float = float("nan")
    assumed: bool = False

    @property
    def amount(self) -> str:
        """Its size with the unit."""
        return f"{self.size:.2g} {self.unit}".strip()

    @property
    def description(self) -> str:
        """What, and of which size, in one test."""
        if self.unit == "mm" and not self.kind.startswith(OFFSET):
            return f"an error of {self.amount} in the {self.kind}"
        return f"{'an' if self.kind[0] in 'aeiou' else 'a'} {self.kind} of {self.amount}"

    @property
    def change_text(self) -> str:
        """By how much it changes the rate at the reference point: in per cent, large ones as a factor."""
        if self.rate_change >= LARGEST_PER_CENT:
            return f"a factor of {float(np.exp(self.rate_change)):.2g}"
        return f"{100 * self.rate_change:.2g} %"

    @property
    def sentence(self) -> str:
        """By how much the rate amid the tests would move with what, to follow "would move", without a full stop."""
        spread = "" if self.tests == 1 else " (one standard deviation)"
        energy = ""
        if np.isfinite(self.per_kelvin):
            whence = "assumed" if self.assumed else "by the law"
            energy = f" ({100 * float(np.expm1(self.per_kelvin)):.2g} % a kelvin, {whence})"
        return f"by {self.change_text}{spread} with {self._cause}{energy}"

    @property
    def _cause(self) -> str:
        one = self.tests == 1
        each = "the test" if one else f"each of {self.tests} tests"
        if self.kind == DRIFT:
            drift = "a linear drift of" if one else "independent linear drifts of the temperature,"
            return f"{drift} {self.size:.2g} K over {each}"
        if self.kind.startswith(OFFSET):
            output = self.kind.removeprefix(OFFSET).replace("_", " ")
            return f"{'an offset' if one else 'independent offsets'} of {self.amount} in the {output} of {each}"
        return f"{'an error' if one else 'independent errors'} of {self.amount} in the {self.kind} of {each}"


def beyond_intervals(perturbations: Sequence[Perturbation]) -> list[Perturbation]:
    """Those that intervals do not include, of which it is known what they do to the rate."""
    return [one for one in perturbations if np.isfinite(one.rate_change)]


def combined_change_text(perturbations: Sequence[Perturbation]) -> str:
    """The root sum of squares of the changes of the rate by those that are not included; "" where there are none."""
    changes = [p.rate_change for p in beyond_intervals(perturbations)]
    if not changes:
        return ""
    total = float(np.sqrt(np.sum(np.square(changes))))
    return f"a factor of {np.exp(total):.2g}" if total >= LARGEST_PER_CENT else f"{100 * total:.2g} %"


def unmodelled_note(perturbations: Sequence[Perturbation]) -> tuple[str, ...]:
    """One sentence on what intervals do not include, with what it would do to the rate; none where that is little."""
    parts = [p.sentence for p in beyond_intervals(perturbations) if p.rate_change > NOTEWORTHY_CHANGE]
    return (f"{NOT_INCLUDED} what would move the rate amid the tests: {'; '.join(parts)}",) if parts else ()
