"""Adequacy: whether a law explains the tests to their noise (see inverse.judging for how it is judged)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.inverse.explanation import VERDICT_ODDS, Explanation
from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
from creepkit.inverse.single_values import ContradictingValues
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, SMALLEST_RATE_SCATTER
from creepkit.limits import SIGNIFICANCE
from creepkit.records.presentable import Presentable

SHAPE_MISFIT = 5.0
"""Noises that a law leaves of an output, from which on it misses the shape of curves, and its rates are doubtful."""


UNDETECTED_SCATTER = 1.5 * SMALLEST_RATE_SCATTER
"""Of ln rate between tests: an estimate that is not above is at its lower bound."""


AdequacyVerdict = Literal["explains", "leaves a discrepancy", "cannot be judged"]


@dataclass(frozen=True)
class OutputAdequacy:
    """One output of all tests.

    frames : how many values count. noise : typical standard deviation of one, in the output's unit; noise_source :
    "stated" by the histories, or "estimated" from neighbouring frames. chi_square : over its degrees of freedom.
    p_value : of a larger one by chance. discrepancy : rms of predicted less measured beyond noise, in the output's
    unit, offsets and the scatter of rates and rupture lives taken out; 0 where there is nothing.
    """

    output: str
    frames: int
    noise: float
    noise_source: Literal["stated", "estimated"]
    chi_square: float
    p_value: float
    discrepancy: float

    @property
    def discrepancy_in_noises(self) -> float:
        """The discrepancy over the noise, each frame's over its own; 0 where there is no discrepancy."""
        return float(np.sqrt(max(self.chi_square - 1.0, 0.0))) if self.discrepancy > 0 else 0.0


@dataclass(frozen=True)
class LargestDeviation:
    """Where a law misses the tests most: the test and output of largest rms over noise, and the frames within it.

    test, output : names. time : s, of the neighbouring frames of largest mean deviation, which is `deviation`,
    predicted less measured, in the output's unit, and `noises`, in noises of one frame. rms : of the deviation over all
    frames of the test, 0 where unknown. Offsets and the scatter of rates and rupture lives are taken out of all.
    """

    test: str
    output: str
    time: float
    deviation: float
    noises: float
    rms: float = 0.0


@dataclass(frozen=True)
class Remedy:
    """An error that nobody modelled, with which a law that the tests reject would explain them.

    kind : of the nuisance parameter that would stand for it, or "control" of what was held. description : it with the
    largest size that it takes in a test, such as "an error of 0.01 mm in the thickness". is_usual : whether errors as
    large as those of all tests are usual; a law of another kind explains the tests as well as larger ones do.
    """

    kind: str
    description: str
    is_usual: bool = True


@dataclass(frozen=True)
class Adequacy(Presentable):
    """What was found of whether a law explains the tests to their noise; `verdict` follows from it.

    outputs : one by one; those without known noise are missing. chi_square : of all of them, over `freedom`, its
    degrees of freedom. p_value : the least of all and of each, times their number. correlation : of what is left, as a
    share of the test (of outputs that span decades: the ln of a factor in time); NaN where nothing is. largest : where
    the law misses most; None if nothing is known.
    remedies : errors that nobody modelled, with any of which the law would explain the tests.
    rate_scatter : standard deviation of ln rate between tests, which was estimated from them.
    of_rates : explanations of that scatter, the likeliest first: the law's dependence on stress or temperature, one
        test, two groups of tests (see inverse.rate_explanations). outlying : one test alone that the others did not
        lead to expect, which is no explanation.
    implausible : nuisances that lie far from their priors, without which the law would not explain the tests.
    expected_chi_square : what `chi_square` is in the mean if the law is right: above one where noise is estimated from
        few frames. critical_chi_square : the reduced chi-square beyond which the tests contradict the law.
    smallest_p_value : of all outputs together and of each, before it is multiplied by their number.
    not_judged : the outputs, where nothing can be judged, and few_frames : the tests, each with how
        many frames it has, where these are too few to show the noise.
    unpredicted : tests of which nothing, or not every reading, is predicted: a law is never judged to explain them.
    contradicting : minimum rates and rupture times that contradict one another by the law, beyond their own scatter.
    """

    outputs: tuple[OutputAdequacy, ...]
    chi_square: float
    freedom: float
    p_value: float
    correlation: float
    largest: LargestDeviation | None
    remedies: tuple[Remedy, ...] = ()
    rate_scatter: float = 0.0
    of_rates: tuple[Explanation, ...] = ()
    outlying: Explanation | None = None
    implausible: tuple[ImplausibleNuisance, ...] = ()
    expected_chi_square: float = 1.0
    not_judged: tuple[str, ...] = ()
    few_frames: tuple[tuple[str, int], ...] = ()
    critical_chi_square: float = float("nan")
    smallest_p_value: float = float("nan")
    unpredicted: tuple[str, ...] = ()
    contradicting: ContradictingValues | None = None

    @property
    def verdict(self) -> AdequacyVerdict:
        """What contradicts the law comes before what is not known of it."""
        if self.leaves_readings or self.remedies or self.contradicting is not None or self.contradicted_by_rates:
            return "leaves a discrepancy"
        return "explains" if self.outputs and not self.unpredicted else "cannot be judged"

    @property
    def leaves_readings(self) -> bool:
        """Whether readings leave more than noise, or rates of tests scatter by more than those of one alloy do."""
        return bool(self.outputs) and (self.p_value < SIGNIFICANCE or self.scatters_too_much)

    @property
    def contradicted_by_rates(self) -> bool:
        """Whether rates of tests alone contradict the law: by something likelier than their scatter."""
        return bool(self.of_rates) and self.of_rates[0].odds >= VERDICT_ODDS

    @property
    def explanations(self) -> tuple[Explanation, ...]:
        """Of what rates of tests leave of a law that is rejected by them or by readings, the likeliest first."""
        return self.of_rates if self.contradicted_by_rates or self.leaves_readings else ()

    @property
    def mentioned(self) -> Explanation | None:
        """A caution, where nothing rejects the law: an explanation of too small odds, or one test that stands out."""
        return None if self.rejects else next(iter(self.of_rates), self.outlying)

    @property
    def scatters_too_much(self) -> bool:
        """Whether rates of tests scatter by more than those of one alloy do."""
        return self.rate_scatter > 0.99 * LARGEST_RATE_SCATTER

    @property
    def explains(self) -> bool:
        """Whether the law explains the tests to their noise."""
        return self.verdict == "explains"

    @property
    def lies_in_tests(self) -> bool:
        """Whether what is left is explained by one test or by two groups of tests, and not by another law."""
        return self.is_explained and not self.explanations[0].is_of_law

    @property
    def in_tests(self) -> Explanation | None:
        """What lies in the tests and is to be checked: the likeliest explanation, or the test that stands out."""
        mentioned = None if self.mentioned is None or self.mentioned.is_of_law else self.mentioned
        return self.explanations[0] if self.lies_in_tests else mentioned

    @property
    def is_explained(self) -> bool:
        """Whether rates of tests are what the law misses, and not the shape of their curves."""
        return bool(self.explanations) and not self.discrepancy_in_noises > SHAPE_MISFIT

    def judges(self, output: str) -> bool:
        """Whether the noise of an output is known well enough to judge a law by."""
        return any(one.output == output for one in self.outputs)

    @property
    def rejects(self) -> bool:
        """Whether the law leaves what noise does not explain: its values describe the law and not the tests."""
        return self.verdict == "leaves a discrepancy"

    @property
    def explains_plausibly(self) -> bool:
        """Whether it explains them with nuisances of plausible size."""
        return self.explains and not self.implausible

    @property
    def discrepancy_in_noises(self) -> float:
        """The largest discrepancy of an output, over its noise."""
        return max((o.discrepancy_in_noises for o in self.outputs), default=float("nan"))

    def misses_shape(self, by: float = 1.0) -> bool:
        """Whether the law misses the shape of curves, by more noises than so many times SHAPE_MISFIT."""
        return self.rejects and self.discrepancy_in_noises > by * SHAPE_MISFIT

    def __getitem__(self, output: str) -> OutputAdequacy:
        for one in self.outputs:
            if one.output == output:
                return one
        raise KeyError(output)

    shown_by = "verdicts.adequacy_text"
