"""Adequacy: whether a law explains the tests to their noise (see inverse.judging for how it is judged)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.inverse.explanation import VERDICT_ODDS, Explanation
from creepkit.inverse.known_noise import how_to_state_noise
from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
from creepkit.inverse.single_values import ContradictingValues
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, SMALLEST_RATE_SCATTER
from creepkit.limits import SIGNIFICANCE
from creepkit.records import is_logarithmic, output_unit
from creepkit.records.units import time_text

IMPLAUSIBLE_CHI_SQUARE = 0.05
"""Reduced chi-square below which the noise that was stated is questioned: 4.5 times what the frames show."""


SHAPE_MISFIT = 5.0
"""Noises that a law leaves of an output, from which on it misses the shape of curves, and its rates are doubtful."""


UNDETECTED_SCATTER = 1.5 * SMALLEST_RATE_SCATTER
"""Of ln rate between tests: an estimate that is not above is at its lower bound."""


NOTEWORTHY_EXPECTATION = 1.05
"""Mean reduced chi-square of a right law from which on it is said beside the one that was found."""


SMALLEST_SHOWN_P_VALUE = 1e-12
"""p-values below are shown as such."""


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

    def __str__(self) -> str:
        side = "above" if self.deviation > 0 else "below"
        rms = f" (rms {_amount(self.rms, self.output)})" if self.rms > 0 else ""
        return (
            f"{self.output} of '{self.test}'{rms} about {time_text(self.time)}, where it lies "
            f"{_amount(abs(self.deviation), self.output)} {side} what was measured"
        )


def _amount(value: float, output: str) -> str:
    """So much of an output, strains in per cent."""
    percent = is_logarithmic(output)
    return f"{(100.0 if percent else 1.0) * value:.2g} {'%' if percent else output_unit(output)}".strip()


@dataclass(frozen=True)
class Adequacy:
    """What was found of whether a law explains the tests to their noise; `verdict` follows from it.

    outputs : one by one; those without known noise are missing. chi_square : of all of them, over `freedom`, its
    degrees of freedom. p_value : the least of all and of each, times their number. correlation : of what is left, as a
    share of the test (of outputs that span decades: the ln of a factor in time); NaN where nothing is. largest : where
    the law misses most; None if nothing is known.
    remedies : errors that nobody modelled, with the largest size that they take in a test, such as "an error of 0.01 mm
    in the thickness", with any of which the law would explain the tests.
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
    remedies: tuple[str, ...] = ()
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

    @property
    def explanation_text(self) -> str:
        """The likeliest explanation of the rates of tests, those of other tests, and by how much it beats the next."""
        if not self.explanations:
            return ""
        first, *rivals = self.explanations
        sentence = first.sentence
        if not rivals:
            return sentence
        ahead = first.odds - rivals[0].odds
        said = f"{odds_text(ahead)} less likely" if ahead > np.log(3.0) else "about as likely"
        return f"{sentence}; {said}: {rivals[0].headline}"

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
    def qualification(self) -> str:
        """What follows "not rejected" where it takes nuisances of implausible size; "" where it does not."""
        if not self.implausible:
            return ""
        more = len(self.implausible) - 1
        others = f" (and {more} more such nuisance{'s' * (more > 1)})" if more else ""
        return f", but only with {self.implausible[0].description}{others}"

    @property
    def discrepancy_in_noises(self) -> float:
        """The largest discrepancy of an output, over its noise."""
        return max((o.discrepancy_in_noises for o in self.outputs), default=float("nan"))

    def misses_shape(self, by: float = 1.0) -> bool:
        """Whether the law misses the shape of curves, by more noises than so many times SHAPE_MISFIT."""
        return self.rejects and self.discrepancy_in_noises > by * SHAPE_MISFIT

    @property
    def _chi_square_text(self) -> str:
        remarks = []
        if self.critical_chi_square > 0:
            remarks.append(f"critical value {self.critical_chi_square:.3g}")
        if self.expected_chi_square > NOTEWORTHY_EXPECTATION:
            remarks.append(
                f"expected {self.expected_chi_square:.3g} for a correct law, as the noise itself is estimated"
            )
        said = f" ({'; '.join(remarks)})" if remarks else ""
        return f"reduced chi-square {self.chi_square:.3g} with {self.freedom:.0f} degrees of freedom{said}"

    @property
    def _p_value_text(self) -> str:
        """The p-value; where it is the least of several times their number, how many and that one itself."""
        count = len(self.outputs) + 1
        if count == 2:
            return p_value_text(self.p_value)
        smallest = "" if np.isnan(self.smallest_p_value) else f"smallest {p_value_text(self.smallest_p_value)}, "
        return f"{smallest}{p_value_text(self.p_value)} adjusted for {count} comparisons (Bonferroni)"

    @property
    def verdict_text(self) -> str:
        """The verdict in few words, with the p-value, or what is left in noises; "?" where nothing can be judged."""
        if self.verdict == "cannot be judged":
            return "?"
        if self.explains:
            large = f", but only with a large {self.implausible[0].kind}" if self.implausible else ""
            return f"not rejected ({p_value_text(self.p_value)}){large}"
        if self.contradicting is not None:
            return "rejected: rates contradict rupture times"
        noises = self.discrepancy_in_noises
        if self.explanations and (self.lies_in_tests or not noises > 0):
            return f"rejected: {self.explanations[0].headline}"
        left = f"leaves {noises_text(noises)} noises" if noises > 0 else "rates of tests are not followed"
        return f"rejected: {left}"

    def __getitem__(self, output: str) -> OutputAdequacy:
        for one in self.outputs:
            if one.output == output:
                return one
        raise KeyError(output)

    def __str__(self) -> str:
        """One sentence, to follow "the law": the verdict, with what is left and where."""
        if self.unpredicted and self.verdict == "cannot be judged":
            more = f" and {len(self.unpredicted) - 1} more" if len(self.unpredicted) > 1 else ""
            return f"cannot be judged: it does not predict every reading of test '{self.unpredicted[0]}'{more}"
        if self.verdict == "cannot be judged":
            return f"cannot be judged: {how_to_state_noise(self.not_judged, self.few_frames)}"
        source = " and ".join(dict.fromkeys(o.noise_source for o in self.outputs))
        if self.explains:
            slow = np.isfinite(self.correlation)
            correlated = "; what is left is autocorrelated, noise or the law's own" if slow else ""
            scatter = f" ({rate_scatter_text(self.rate_scatter)})" if self.rate_scatter > 0 else ""
            if self.chi_square < IMPLAUSIBLE_CHI_SQUARE:
                scatter += " (far larger than what the readings show: check its unit)"
            found = f"{self._chi_square_text}, {self._p_value_text}{correlated}"
            return f"is not rejected by the tests at their {source} noise{self.qualification}{scatter}: {found}"
        if self.contradicting is not None and not self.outputs:
            return f"is rejected by the tests: {self.contradicting}"
        parts = [
            f"{_amount(o.discrepancy, o.output)} of {o.output} ({noises_text(o.discrepancy_in_noises)} times its "
            f"{o.noise_source} noise)"
            for o in sorted(self.outputs, key=lambda o: -o.discrepancy_in_noises)
            if o.discrepancy > 0
        ]
        if (self.scatters_too_much or (self.remedies and not parts)) and not self.explanations:
            parts.append(f"rates of tests that scatter by a factor of {np.exp(self.rate_scatter):.2g}")
        if self.contradicting is not None:
            parts.append(str(self.contradicting))
        where = f". Most in {self.largest}" if self.largest is not None else ""
        if self.remedies and not self.explanations:
            where += f". It would explain them with {' or with '.join(self.remedies)}, which nobody modelled"
        if self.explanations and not parts:
            curves = f"; curves agree with the noise ({self._p_value_text})" if self.outputs else ""
            return f"is rejected by the rates of the tests: {self.explanation_text}{curves}"
        judged = f"{self._chi_square_text}, {self._p_value_text}"
        rest = f"leaves {' and '.join(parts) or 'more than noise'} unexplained: {judged}{where}"
        beside = "" if self.is_explained else "of its rates, "
        return f"{rest}; {beside}{self.explanation_text}" if self.explanations else rest


def p_value_text(p: float) -> str:
    """A probability as "p = 0.028"."""
    if p <= SMALLEST_SHOWN_P_VALUE:
        return f"p < {SMALLEST_SHOWN_P_VALUE:g}"
    return f"p = {p:.{2 if p >= 1e-3 else 1}g}"


def noises_text(noises: float) -> str:
    """Multiples of a noise to two digits, without a power of ten."""
    return f"{float(f'{noises:.2g}'):g}" if np.isfinite(noises) and noises < 1e5 else f"{noises:.2g}"


def odds_text(log_odds: float) -> str:
    """Odds as a factor: "30 times"; log_odds : their ln."""
    return f"{float(f'{np.exp(min(log_odds, 13.8)):.1g}'):,.0f} times" + (" or more" if log_odds > 13.8 else "")


def rate_scatter_text(scatter: float) -> str:
    """What was found of the scatter of rates between tests; scatter : of ln rate, one standard deviation."""
    if scatter <= UNDETECTED_SCATTER:
        return "no scatter of rates between tests was detected"
    return f"rates of tests scatter by {100 * scatter:.2g} %"
