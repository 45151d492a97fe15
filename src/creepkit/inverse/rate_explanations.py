"""Explanations: why the rates of tests scatter about a law, tried against one another before any cause is named.

Rates that the law does not follow may be the law's fault, whose stress exponent or activation energy changes over the
tests, or that of one test, or the tests may be of two materials or rigs. Each of these is a perturbation of the problem
made linear at its optimum: ln of the rate of test k is moved by sum_j w_kj c_j, with weights w that the explanation
states and coefficients c with a Gaussian prior. With s the scatter of rates between tests, r the residuals, J their
derivatives to the unknowns and d those to ln rate, the evidence

    p(r | w) = mean over s of  int N(r + J dx + (w c) d; 0, C0 + s^2 d d') p(dx) p(c) dx dc

is a mean over s with its prior, for the few tests of a campaign do not show their scatter. C0 is the noise, offsets and
misfit of each test as they were estimated. A curve says one number of its rate (see uncertainty.rate_scatter), so that
all explanations of twelve tests cost a few hundredths of a second and no simulation.

Occam's factor is in the evidence: a wide prior that the tests do not need costs. What an explanation was chosen from is
counted too: one of n tests by ln n, a split into two groups by the ln of how many splits there are.

A changing activation energy has to show beside usual errors of temperature, the same in all tests of one temperature.
One test alone that the others do not lead to expect, by Student's t, is a caution where no explanation has the odds.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.explanation import MENTIONED_ODDS, Explanation, Kind, LeftOut
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.perturbations import USUAL_ACTIVATION_ENERGY, log_rate_per_kelvin
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import USUAL_ERRORS
from creepkit.inverse.uncertainty.quantities import gradient, local_exponent, log_rate
from creepkit.inverse.uncertainty.rate_scatter import (
    SMALLEST_FACTOR,
    Evidence,
    RateScatter,
    rate_scatter,
    redundant_rates,
)
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.language import temperature
from creepkit.language.symbols import GAS_CONSTANT

FACTOR_SD = 1.5
"""Prior standard deviation of ln of a factor on the rate of one test or of a group."""


EXPONENT_CHANGE, ENERGY_CHANGE = 5.0, 200e3
"""Prior standard deviations of what the stress exponent and the activation energy, J/mol, change by over the tests."""


ENERGY_ODDS = float(np.log(0.3))
"""ln of the odds of a changing activation energy before the tests were seen: stress exponents change more often."""


LARGEST_CHANCE = 0.003
"""That scatter and usual errors of temperature make a change of the activation energy that is stated."""


OUTLYING_CHANCE, BENT_CHANCE = 0.05, 0.01
"""That of any of the tests standing out so far by scatter (Bonferroni), below which one is a caution; and that of rates
and curves saying exponents so far apart."""


HELD = 1e10
"""Times the precision of its prior, that of a value at its bound, which does not move with the others."""


STEP = 0.01
"""Of ln of strain and time, for derivatives of the rate."""


SMALLEST_CHANGE = {"stress exponent": 0.5, "activation energy": 30e3}
"""Over the tests: less is no finding."""


FEWEST_TESTS, FEWEST_CONTRASTS = 4, 2
"""Tests, and combinations of their rates that the law does not move: with one alone any test could be to blame."""


MOST_TESTS = 3
"""That may be named one after the other."""


OF_READING = ("assumed", "suspect", "cut at strain", "loading_strain", "frames_after_end")
"""Labels that say how a test was read and checked, by which tests are no groups."""


NAMES = re.compile(
    r"(?<![a-z])(?:alloy|heat|lab\w*|rig|machine|furnace|batch|charge|lot|schmelze|ofen|maschine|coul[eé]e)"
    r"(?:s|n)?(?:[ _-]*(?:no|nr|number|nummer|id|code)\b.*|\W*)$",
    re.IGNORECASE,
)
"""Labels whose numbers are names."""


def are_numbers(label: str, entries: Iterable[str]) -> bool:
    """Whether all entries of a label are numbers, and no names such as those of heats and machines."""
    texts = [entry.strip() for entry in entries if entry.strip()]
    numbers = [re.fullmatch(r"[-+]?\d*[.,]?\d+(?:[eE][-+]?\d+)?", text) for text in texts]
    return bool(texts) and all(numbers) and not NAMES.search(label)


class RateExplanations:
    """The search for explanations of a problem at its optimum, where it is made linear."""

    def __init__(self, problem: LeastSquaresProblem, linear: LinearisedProblem, noise: NoiseModel) -> None:
        self.problem, self.x, self.free = problem, linear.x, linear.free[: problem.parameter_count]
        held = replace(linear, precision=np.where(linear.free, linear.precision, HELD * linear.precision))
        self.scatter = replace(rate_scatter(problem, linear, noise), members={})
        self.lives = _scatter_of_lives(problem, held, noise)
        self.held = rate_scatter(problem, held, noise)  # beside heats, whose rates would hide what stresses say
        self.stresses, self.temperatures = problem.conditions
        log_stress, activation = np.log(self.stresses), -1.0 / (GAS_CONSTANT * self.temperatures)  # -, mol/J
        self.log_stress, self.activation = log_stress - log_stress.mean(), activation - activation.mean()
        self.possible = len(problem.histories) >= FEWEST_TESTS and bool(linear.residuals.log_rate_sensitivity.any())
        self.redundant = redundant_rates(linear, noise) if self.possible else 0

    @cached_property
    def found(self) -> tuple[Explanation, ...]:
        """What explains the rates better than scatter, likeliest first; with prior odds six times likelier at least."""
        if self.redundant < FEWEST_CONTRASTS:
            return ()
        found = [*self._of_law(), *self._of_tests(), *self._of_groups()]
        return tuple(sorted((e for e in found if e.odds > MENTIONED_ODDS), key=lambda e: -e.odds))

    @cached_property
    def outlying(self) -> Explanation | None:
        """What rates do not lead to expect where nothing explains them: the exponent of curves, or one test alone."""
        if self.redundant < FEWEST_CONTRASTS or self.found:
            return None
        if np.unique(self.log_stress.round(2)).size >= 3 and self._by_rates[0].p_value[0] < BENT_CHANCE:
            return next(iter(self._of_curves()), None)
        chance = len(self._alone) * np.array([one.p_value[0] for one in self._alone])
        far = np.flatnonzero(chance < OUTLYING_CHANCE)
        if far.size != 1 or abs(self._alone[far[0]].mean[0]) < SMALLEST_FACTOR:
            return None
        return self._one_test(int(far[0]), self._alone[far[0]], 0.0)

    @cached_property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Each test beside all others; none of fewer tests than FEWEST_TESTS."""
        if not self.possible:
            return ()
        out, reference = [], self.problem.coordinates.reference
        for history, evidence in zip(self.problem.histories, self._alone, strict=True):
            exponent = float(local_exponent(self.problem.coordinates, reference.stress)(self._moved(evidence)))
            out.append(LeftOut(history.name, float(evidence.mean[0]), float(evidence.sd[0]), exponent))
        return tuple(out)

    def _evidence(self, columns: Sequence[Floats], prior_sd: Sequence[float]) -> Evidence:
        weights = np.stack(columns, axis=1) if columns else np.zeros((len(self.problem.histories), 0))
        return self.scatter.evidence(weights, np.array(prior_sd, float))

    @cached_property
    def _as_it_is(self) -> float:
        return self._evidence([], []).log

    @cached_property
    def _alone(self) -> list[Evidence]:
        """Of each test with a rate of its own."""
        return [self._evidence([self._only(k)], [FACTOR_SD]) for k in range(len(self.problem.histories))]

    def _only(self, test: int) -> Floats:
        return np.asarray(np.arange(len(self.problem.histories)) == test, float)

    # ---- the law -----------------------------------------------------------------------------------------------------

    def _of_law(self) -> Iterable[Explanation]:
        """A stress exponent that changes with stress, an activation energy that changes with temperature."""
        s, z = self.log_stress, self.activation
        if np.unique(s.round(2)).size >= 3:
            yield from self._change("stress exponent", s, EXPONENT_CHANGE)
            yield from self._of_curves()
            yield from self._of_lives()
        if self.problem.law.uses(temperature) and np.unique((z / max(np.ptp(z), 1e-300)).round(2)).size >= 3:
            yield from self._change("activation energy", z, ENERGY_CHANGE)

    @cached_property
    def _by_rates(self) -> tuple[Evidence, float]:
        """Of a stress exponent of the rates of tests that is not the law's, and the odds of it.

        Beside the one test whose rate is its own that makes it likeliest, if any: either may hide the other.
        """
        column, ones, choice = (
            self.log_stress[:, None],
            np.eye(len(self.log_stress))[..., None],
            np.log(self.log_stress.size),
        )
        alone = max(self.held.evidence(one, np.array([FACTOR_SD])).log for one in ones) - choice
        without = max(self.held.evidence(column[:, :0], np.zeros(0)).log, alone)
        sizes = np.array([EXPONENT_CHANGE, FACTOR_SD])
        tried = [(0.0, self.held.evidence(column, sizes[:1]))]
        tried += [(choice, self.held.evidence(np.concatenate([column, one], axis=1), sizes)) for one in ones]
        choice, evidence = max(tried, key=lambda one: one[1].log - one[0])
        return evidence, float(evidence.log - choice - without)

    def _of_curves(self) -> Iterable[Explanation]:
        """The stress exponent of the rates of tests is another one than the shape of curves gives the law.

        A law that is not that of the curves bends its exponent to them, as where the stress of a bar rises with strain
        under a constant load. By a right law both are one exponent, and two estimates of it agree.
        """
        (evidence, odds), stress = self._by_rates, self.problem.coordinates.reference.stress
        if self._slope[~self.free].any() or not any(history.outputs for history in self.problem.histories):
            return  # a bound holds the exponent, or there are no curves: their shape does not
        change, sd = float(evidence.mean[0]), float(evidence.sd[0])
        if abs(change) > SMALLEST_CHANGE["stress exponent"]:
            exponent, u = local_exponent(self.problem.coordinates, stress), self.x[: self.problem.parameter_count]
            ends = float(exponent(u)), float(exponent(self._moved(evidence))) + change
            if abs(ends[1] - ends[0]) < SMALLEST_CHANGE["stress exponent"]:
                return  # values follow the rates already
            yield Explanation("stress exponent", (), change, sd, odds, ends, (stress, stress))

    def _of_lives(self) -> Iterable[Explanation]:
        """The lives of tests depend on the stress by another exponent than the shape of curves gives the law's."""
        if self.lives is None:
            return
        column, sizes = self.log_stress[:, None], np.array([EXPONENT_CHANGE])
        evidence = self.lives.evidence(column, sizes)
        change, sd = float(evidence.mean[0]), float(evidence.sd[0])
        if abs(change) > SMALLEST_CHANGE["stress exponent"]:
            odds = float(evidence.log - self.lives.evidence(column[:, :0], sizes[:0]).log)
            yield Explanation("life exponent", (), change, sd, odds)

    @cached_property
    def _slope(self) -> Floats:
        """(parameters,) derivatives of the law's exponent to its coordinates."""
        u, coordinates = self.x[: self.problem.parameter_count], self.problem.coordinates
        return gradient(local_exponent(coordinates, coordinates.reference.stress), u, np.ones(u.size))

    @property
    def second_moment(self) -> Floats:
        """(parameters, parameters) of coordinates, by what rates of tests and shapes of curves say apart; or zeros.

        The coordinates move with the rates of tests, and beside that as changes the law's exponent by as much and is
        likeliest by the bounds alone.
        """
        u, width = self.x[: self.problem.parameter_count], self.problem.bounds.width[: self.problem.parameter_count]
        if not any(e.is_of_curves for e in self.found):
            return np.zeros((u.size, u.size))
        evidence, slope = self._by_rates[0], self._slope * width
        shift = self._moved(evidence) - u + float(evidence.mean[0]) * width * slope / float(slope @ slope)
        return np.asarray(np.outer(shift, shift))

    def _change(self, kind: Kind, over: Floats, prior_sd: float) -> Iterable[Explanation]:
        """The slope of ln rate over ln stress, or over -1/(R T), changes in proportion to it or to its exponential.

        The exponential of ln stress is the stress: the exponent of a law whose power law breaks down grows with it.
        """
        scaled = over / np.ptp(over)
        forms = [(scaled, 0.5 * scaled * over)]
        forms += [(np.exp(over) - 1.0, np.exp(over) - over)] if kind == "stress exponent" else []
        errors, error_sd = self._temperature_errors if kind == "activation energy" else ([], [])
        tried = [
            (self._evidence([w, *errors], [prior_sd / float(np.ptp(slope)), *error_sd]), slope, w) for slope, w in forms
        ]
        evidence, slope, primitive = max(tried, key=lambda one: one[0].log)
        straight = np.stack([np.ones_like(over), over], axis=1)
        bend = primitive - straight @ np.linalg.lstsq(straight, primitive, rcond=None)[0]
        if np.ptp(bend) * abs(evidence.mean[0]) < SMALLEST_FACTOR:
            return
        span = float(np.ptp(slope))
        u, coordinates, middle = self._moved(evidence), self.problem.coordinates, self.problem.coordinates.reference
        first, last = int(over.argmin()), int(over.argmax())
        if kind == "stress exponent":
            at = float(self.stresses[first]), float(self.stresses[last])
            own = [float(local_exponent(coordinates, stress)(u)) for stress in at]
        else:
            at = float(self.temperatures[first]), float(self.temperatures[last])
            own = [self._energy(u, middle.stress, T) for T in at]
        low, high = (value + float(evidence.mean[0] * slope[k]) for value, k in zip(own, (first, last), strict=True))
        if abs(high - low) < SMALLEST_CHANGE[kind] or abs(evidence.mean[0]) * span < SMALLEST_CHANGE[kind]:
            return
        before = 0.0
        if kind == "activation energy":
            before = ENERGY_ODDS if evidence.p_value[0] < LARGEST_CHANCE else -np.inf
        odds = evidence.log - self._evidence(errors, error_sd).log - float(np.log(len(tried))) + before
        change, sd = float(evidence.mean[0]) * span, float(evidence.sd[0]) * span
        yield Explanation(kind, (), change, sd, odds, (low, high), at)

    @cached_property
    def _temperature_errors(self) -> tuple[list[Floats], list[float]]:
        """What the usual error of temperature does to ln rates, the same in all tests of one temperature.

        Returns columns (tests,) and standard deviations, one for each temperature that changes the rate.
        """
        temperatures, stress = self.temperatures.round(), self.problem.coordinates.reference.stress
        u, levels = self.x[: self.problem.parameter_count], np.unique(temperatures)
        slopes = log_rate_per_kelvin(self.problem, u, stress, levels)
        felt = slopes != 0.0  # nowhere where the activation energy is at its bound of zero
        columns = [np.asarray(temperatures == T, float) for T in levels[felt]]
        return columns, list(USUAL_ERRORS["temperature"] * np.abs(slopes[felt]))

    # ---- single tests ------------------------------------------------------------------------------------------------

    def _of_tests(self) -> Iterable[Explanation]:
        """One test whose rate is its own; and others beside it, while each of them is likelier by as much again."""
        count, base, kept, total = len(self.problem.histories), self._as_it_is, list[int](), 0.0
        best: tuple[Evidence, tuple[str, ...]] | None = None
        for _ in range(min(MOST_TESTS, (count - 1) // 3, self.redundant - 1)):
            tried = [
                (self._evidence([self._only(j) for j in (*kept, k)], [FACTOR_SD] * (len(kept) + 1)), k)
                for k in range(count)
                if k not in kept
            ]
            evidence, test = max(tried, key=lambda one: one[0].log)
            odds = evidence.log - base - float(np.log(len(tried)))
            if odds < MENTIONED_ODDS or abs(evidence.mean[-1]) < SMALLEST_FACTOR:
                break
            near = [k for e, k in tried if k != test and e.log > evidence.log - MENTIONED_ODDS]
            kept.append(test)
            base, total = evidence.log, total + odds
            best = evidence, tuple(self.problem.histories[k].name for k in near)
        if best is not None:
            evidence, others = best
            first = self._one_test(kept[0], replace(evidence, mean=evidence.mean[:1], sd=evidence.sd[:1]), total)
            names = tuple(self.problem.histories[k].name for k in kept)
            yield replace(first, tests=names, factors=tuple(map(float, np.exp(evidence.mean))), near=others)

    def _one_test(self, test: int, evidence: Evidence, odds: float) -> Explanation:
        history, u = self.problem.histories[test], self._moved(evidence)
        size, T = float(evidence.mean[-1]), history.mean_temperature
        errors = {
            name: float(np.exp(np.clip(size / exponent, -50.0, 50.0)))
            for name, exponent in self._rate_exponents(u, float(self.stresses[test]), T).items()
        }
        energy = USUAL_ACTIVATION_ENERGY
        if self.problem.law.uses(temperature):
            energy = self._energy(u, float(self.stresses[test]), T)
        inverse = 1.0 / T - GAS_CONSTANT * size / energy if energy > 0 else 0.0
        if inverse > 0:
            errors["temperature"] = 1.0 / inverse - T
        found = Explanation("one test", (history.name,), size, float(evidence.sd[-1]), odds, errors=errors)
        return replace(found, condition=history.condition, temperature=T)

    def _rate_exponents(self, u: Floats, stress: float, T: float) -> dict[str, float]:
        """{quantity: exponent of its true over its stated value in the factor on the rate that it seems to make}.

        A rate k g(s) e^m t^r makes e^(1 - m) grow as k t^(1 + r): a strain stated c times too large seems to need
        k = c^(1 - m), a time c times too short k = c^(1 + r), a load that was c times as large k = c^n.
        """
        coordinates, middle = self.problem.coordinates, self.problem.coordinates.reference
        about = np.exp([-STEP, STEP])
        in_strain = log_rate(coordinates, stress, T, middle.strain * about)(u)
        in_time = log_rate(coordinates, stress, T, None, middle.time * about)(u)
        strain, time = (float(pair[1] - pair[0]) / (2 * STEP) for pair in (in_strain, in_time))
        exponents = {
            "strain": strain - 1.0,
            "load": float(local_exponent(coordinates, stress, T)(u)),
            "time": 1.0 + time,
        }
        return {name: value for name, value in exponents.items() if np.isfinite(value) and abs(value) > 0.05}

    # ---- groups ------------------------------------------------------------------------------------------------------

    def _of_groups(self) -> Iterable[Explanation]:
        """Two groups of tests, of two materials or rigs: rates that differ by a factor, or in exponent and energy."""
        count = len(self.problem.histories)
        stated = self._stated_groups()
        tried = [(self._of_split(group), group, names, float(np.log(len(stated)))) for names, group in stated.items()]
        order = np.argsort([evidence.mean[0] for evidence in self._alone])
        starts = [np.isin(np.arange(count), order[:size]) for size in range(2, count - 1)]
        if starts:
            evidence, group = self._exchanged(max(starts, key=lambda one: self._of_split(one).log))
            splits = 2.0 ** (count - 1) - count - 1.0
            tried.append((evidence, group, ("", ""), float(np.log(max(splits, 1.0)))))
        if not tried:
            return
        _, group, (label, beside), choice = max(tried, key=lambda one: one[0].log - one[3])
        smaller = group if label or group.sum() <= count / 2 else ~group
        evidence = self._of_split(smaller)
        odds = evidence.log - self._as_it_is - choice - float(np.log(2.0))  # of a factor alone and of more
        if abs(evidence.mean[0]) > SMALLEST_FACTOR or evidence.mean.size > 1:
            names = tuple(self.problem.histories[k].name for k in np.flatnonzero(smaller))
            size, sd = float(evidence.mean[0]), float(evidence.sd[0])
            yield Explanation("two groups", names, size, sd, odds, label=label, beside=beside)

    def _stated_groups(self) -> dict[tuple[str, str], Bools]:
        """{(what they are, what the others are): which tests}, of groups that the tests state: alloy, heat, rig.

        The others are "" where they are of several or not all of them state it. A label of numbers is a quantity, and
        what readers and checks of data write is none of the laboratory's.
        """
        histories, groups = self.problem.histories, dict[tuple[str, str], Bools]()
        for key in dict.fromkeys(["alloy", *(key for h in histories for key in h.labels)]):
            entries = [h.alloy if key == "alloy" else h.labels.get(key, "") for h in histories]
            if key in OF_READING or are_numbers(key, entries):
                continue
            for entry in dict.fromkeys(entries):
                group = np.array([one == entry for one in entries])
                known = any((group == other).all() or (group != other).all() for other in groups.values())
                if entry and 2 <= group.sum() <= len(histories) - 2 and not known:
                    others = {one for one in entries if one != entry}
                    beside = f"{key} {others.pop()}" if len(others) == 1 and all(others) else ""
                    groups[f"{key} {entry}", beside] = group
        return groups

    def _of_split(self, group: Bools) -> Evidence:
        """The likelier of a factor between two groups alone, and of one with exponents and energies of their own."""
        s, z, inside = self.log_stress, self.activation, group.astype(float)
        simple = self._evidence([inside], [FACTOR_SD])
        columns, deviations = [inside], [FACTOR_SD]
        if np.ptp(s[group]) > 0.05 and np.ptp(s[~group]) > 0.05:
            columns, deviations = [*columns, inside * (s - s[group].mean())], [*deviations, EXPONENT_CHANGE]
        if self.problem.law.uses(temperature) and np.ptp(z[group]) > 0 and np.ptp(z[~group]) > 0:
            columns, deviations = [*columns, inside * (z - z[group].mean())], [*deviations, ENERGY_CHANGE]
        return max(simple, self._evidence(columns, deviations), key=lambda one: one.log)

    def _exchanged(self, group: Bools) -> tuple[Evidence, Bools]:
        """The group with tests moved one by one to the other side while that is likelier."""
        best = self._of_split(group)
        for _ in range(2 * len(group)):
            tried = []
            for k in range(len(group)):
                moved = group.copy()
                moved[k] = ~moved[k]
                if 2 <= moved.sum() <= len(group) - 2:
                    tried.append((self._of_split(moved), moved))
            if not tried or max(one.log for one, _ in tried) <= best.log:
                break
            best, group = max(tried, key=lambda one: one[0].log)
        return best, group

    # ---- values ------------------------------------------------------------------------------------------------------

    def _moved(self, evidence: Evidence) -> Floats:
        """(parameters,) coordinates of the law, moved to where they are with the explanation."""
        return (self.x + evidence.step)[: self.problem.parameter_count]

    def _energy(self, u: Floats, stress: float, T: float) -> float:
        return float(log_rate_per_kelvin(self.problem, u, stress, T)) * GAS_CONSTANT * T**2


def _scatter_of_lives(problem: LeastSquaresProblem, linear: LinearisedProblem, noise: NoiseModel) -> RateScatter | None:
    """The scatter of lives between tests beside their rates, as rate_scatter() has it of rates; None without lives."""
    residuals = linear.residuals
    if not noise.life > 0.0 or residuals.log_life_sensitivity is None:
        return None
    lives, rates = residuals.log_life_sensitivity, residuals.log_rate_sensitivity
    # errors of rates that tests state stay with rates
    stated = [] if residuals.rate_errors is None else [residuals.rate_errors[:, None] * rates]
    residuals = replace(residuals.with_effects(stated), rate_errors=None)
    residuals = replace(residuals, log_rate_sensitivity=lives, log_life_sensitivity=rates)
    noise = replace(noise, rate=noise.life, life=noise.rate)
    return replace(rate_scatter(problem, replace(linear, residuals=residuals), noise), members={}, known=None)
