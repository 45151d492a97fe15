"""One unmodelled effect: something that an identification has no nuisance parameter for, its size, and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats

DRIFT, OFFSET = "temperature drift", "offset of "


NOTEWORTHY_CHANGE = 0.01
"""Of the rate, from which on an effect is named."""


LARGEST_PER_CENT = 0.4
"""Of ln rate, from which on its change is given as a factor."""


NOT_INCLUDED = "the intervals do not include what no nuisance parameter models"
"""How the note on unmodelled effects begins."""


LARGEST_DRIFT = 30.0
"""K, of a furnace over a test: a larger drift explains nothing that anybody measures."""


LIKE_HARDENING = 0.8
"""Correlation from which on a drift looks like hardening."""


@dataclass(frozen=True, eq=False)
class UnmodelledEffect:
    """An effect for which an identification has no nuisance parameter.

    kind : of the nuisance parameter that would stand for it. size : of one standard deviation of errors that the tests
        have independently of one another, or of one error common to all tests, and its unit.
    rate_change : of ln of the rate at the reference point: one standard deviation of it where the errors are
        independent; where one is common, what the rate changes by if its size is added to what the tests state.
    like_hardening : the size, in the same unit, that looks most like the hardening of the law itself, NaN where it has
        none, and hardening_correlation : how much like it, in the residuals, 1 for the same.
    residual_change : (tests, observations) -, of the residuals, by one standard deviation; saved in kept fits alone.
    common : whether it is one error of all tests, as of an instrument that measures them all. tests : how many have it.
    activation_energy : J/mol, by which kelvins change the rate at the reference temperature, NaN where none do;
        assumed : whether it is a usual one, as the law has none.
    """

    kind: str
    size: float
    unit: str
    rate_change: float
    like_hardening: float = float("nan")
    hardening_correlation: float = float("nan")
    residual_change: Floats = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    common: bool = False
    tests: int = 1
    activation_energy: float = float("nan")
    assumed: bool = False

    @property
    def description(self) -> str:
        """What, and of which size, in one test."""
        article = "an" if self.kind[0] in "aeiou" else "a"
        return f"{article} {self.kind} of {self.size:.2g} {self.unit}".strip()

    @property
    def change_text(self) -> str:
        """By how much it changes the rate at the reference point: in per cent, large ones as a factor."""
        if abs(self.rate_change) >= LARGEST_PER_CENT:
            return f"a factor of {float(np.exp(self.rate_change)):.2g}"
        if self.common:
            return f"{100 * float(np.expm1(self.rate_change)):+.2g} %"
        return f"{100 * self.rate_change:.2g} %"

    @property
    def sentence(self) -> str:
        """By how much the rate amid the tests would move with what, to follow "would move", without a full stop."""
        spread = "" if self.common or self.tests == 1 else " (one standard deviation)"
        energy = ""
        if np.isfinite(self.activation_energy):
            assumed = " (assumed: the law has no temperature)" if self.assumed else ""
            energy = f", taking an activation energy of {self.activation_energy / 1e3:.3g} kJ/mol{assumed}"
        return f"by {self.change_text}{spread} with {self._cause}{energy}"

    @property
    def _cause(self) -> str:
        size = f"{self.size:.2g} {self.unit}".strip()
        if self.common:
            of_tests = "the test" if self.tests == 1 else f"all {self.tests} tests"
            stated = {
                "temperature": f"temperatures {size} above those stated, in {of_tests}",
                "load": f"loads {size} above those stated, in {of_tests}",
                "modulus": f"Young's moduli {size} above those stated, in {of_tests}",
            }
            if self.kind.startswith("imposed "):
                return f"{self.kind} {size} above that stated, in {of_tests}"
            return stated.get(self.kind, f"a {self.kind} {size} above that stated, in {of_tests}")
        several = self.tests > 1
        each = f"each of the {self.tests} tests" if several else "the test"
        if self.kind == DRIFT:
            kelvin = f"{self.size:.2g} K over {each}"
            return (
                f"independent linear drifts of the temperature, {kelvin}" if several else f"a linear drift of {kelvin}"
            )
        if self.kind.startswith(OFFSET):
            output = self.kind.removeprefix(OFFSET).replace("_", " ")
            return f"{'independent offsets' if several else 'an offset'} of {size} in the {output} of {each}"
        return f"{'independent errors' if several else 'an error'} of {size} in the {self.kind} of {each}"


def combined_change_text(effects: Sequence[UnmodelledEffect]) -> str:
    """The root sum of squares of the changes of the rate by all of them; "" where there are none."""
    if not effects:
        return ""
    total = float(np.sqrt(sum(e.rate_change**2 for e in effects)))
    return f"a factor of {np.exp(total):.2g}" if total >= LARGEST_PER_CENT else f"{100 * total:.2g} %"


def unmodelled_note(effects: Sequence[UnmodelledEffect]) -> tuple[str, ...]:
    """One sentence on what intervals do not include, with what it would do to the rate; none where that is little."""
    parts = [e.sentence for e in effects if abs(e.rate_change) > NOTEWORTHY_CHANGE]
    sentences = [f"{NOT_INCLUDED}; the rate amid the tests would move: {'; '.join(parts)}"] if parts else []
    for effect in effects:
        plausible = abs(effect.like_hardening) < LARGEST_DRIFT
        if plausible and effect.hardening_correlation > LIKE_HARDENING:
            sentences.append(
                f"no temperature was recorded: a drift of {effect.like_hardening:+.2g} K over a test would look like "
                f"the hardening of this law (correlation {effect.hardening_correlation:.2f})"
            )
    return tuple(sentences)
