"""RuptureAssessment: methods with weights, strengths with bounds, checks, and a verdict no stronger than they are.

Assessments are written as JSON files, and read back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import SAID, FitError, nearest, quoted, refuse_unknown, restated
from creepkit.files.json_documents import DocumentFormat, check_heading, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.files.writing import write_text
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.limits import ANY_NUMBER, PROBABILITY, SEED, Limits, numbers
from creepkit.options import CELSIUS, Options, option
from creepkit.records import SECONDS_PER_HOUR
from creepkit.records.presentable import Plotted, Presentable, Tabulated, function_of_reports
from creepkit.records.units import celsius_text
from creepkit.rupture_assessment.checks import AssessmentCheck
from creepkit.rupture_assessment.fitting import MinimumRateRelation
from creepkit.rupture_assessment.methods import METHODS, Conditions
from creepkit.rupture_assessment.observed_tests import RuptureTests
from creepkit.rupture_assessment.rupture_fit import RuptureFit, RuptureParameter, VarianceFreedom, power_of_ten
from creepkit.rupture_assessment.strength import (
    BOUND_KINDS,
    LifeEstimate,
    StrengthEstimate,
    WeightedModels,
    bound_curves,
    extrapolation,
    mixed,
    strength_estimates,
)
from creepkit.rupture_assessment.written_times import written_times

AVERAGE = "average"
"""Name of the average over all ranked methods by their weights."""

LEAST_WEIGHT = 1e-3
"""In the average."""

LARGEST_CONSTANT = 1e7
"""Of those that may be given: an activation energy in J/mol is some 1e5."""


@checked
@dataclass(frozen=True)
class RuptureSettings(Options, title="settings of an assessment"):
    """How rupture tests are assessed.

    degrees : of polynomials of log10 of the stress that are tried.
    fixed : {method: {constant: value}} that are given in the place of fitted ones, {"larson-miller": {"C": 20.0}}.
    random_effects : whether heats and laboratories scatter. usual_scatter : of one test of a heat, of log10 of time,
    which counts as that of two tests more; 0 for none. level : of intervals and bounds.
    seed : of the tests that a check of repeatability leaves out.
    """

    degrees: tuple[int, ...] = option((1, 2, 3), "Of polynomials of log stress that are tried.", Limits(1, 5))
    fixed: Mapping[str, Mapping[str, float]] = option(
        dict, "A constant that is given.", flag="fix", example="larson-miller.C=20"
    )
    random_effects: bool = option(True, "Whether heats and laboratories scatter.")
    usual_scatter: float = option(
        0.1, "Scatter of log10 of the life of a test, which counts as two tests more; 0: none.", numbers(0, 1)
    )
    level: float = option(0.95, "Probability of intervals and bounds.", PROBABILITY)
    seed: int = option(0, "Of the tests that a check of repeatability leaves out.", SEED)

    def __post_init__(self) -> None:
        if not self.degrees:
            raise FitError("degrees are (); give whole numbers from 1 to 5, such as (1, 2, 3)")
        for method, constants in self.fixed.items():
            refuse_unknown(method, METHODS, FitError, f"fixed= names a method '{method}'")
            for name, value in constants.items():
                if name not in METHODS[method].fixable:
                    allowed = ", ".join(METHODS[method].fixable) or "none"
                    raise FitError(f"fixed= gives {method} a constant '{name}'; those that may be given: {allowed}")
                if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST_CONSTANT:
                    raise FitError(
                        f"fixed= gives {method} {name}={quoted(repr(value))}; give a number, at most 1e7 in size"
                    )


@checked
@dataclass(frozen=True)
class RuptureQuestion(Options, title="arguments of an assessment"):
    """What rupture() is asked beside its settings, as its arguments of these names have it; K, h, MPa."""

    methods: tuple[str, ...] | None = option(
        None, "larson-miller, orr-sherby-dorn, manson-haferd, wilshire, monkman-grant or isothermal.", flag="method"
    )
    hours: tuple[float, ...] = option(
        (1e3, 1e4, 1e5),
        "At which strengths are stated.",
        numbers(0, 1e12, above=True),
        key="times_h",
        flag="times",
        unit="h",
        example="1e4h,1e5h",
    )
    temperatures: tuple[float, ...] | None = option(
        None, "Of what is stated; by default as tested.", numbers(-273.15, 1e4), flag="temperature-c", **CELSIUS
    )
    stresses: tuple[float, ...] = option(
        (), "At which times to rupture are stated.", numbers(0, 1e9, above=True), flag="stress", unit="MPa"
    )


@dataclass(frozen=True)
class RankedRuptureFit:
    """A fitted method in the ranking: its BIC (of the tests that broke) less the lowest, and its weight.

    The weight is exp(-excess / 2) over the number of degrees of the method that are ranked, normalised: before the
    tests are seen all methods have the same weight, however many degrees are tried.
    """

    fit: RuptureFit
    excess: float
    weight: float


@dataclass(frozen=True, eq=False)
class RuptureAssessment(Presentable, Plotted, Tabulated):
    """The result of rupture().

    ranked : methods, each with every degree that was tried, the highest weight first. rejected : {method: why it is
    not ranked}.
    relation : Monkman-Grant's, where rates are known; it is not ranked, for it uses rates that the others do not.
    strengths : by the average, by the best fit of each method, and by the relation. lives : times to rupture.
    checks : post-assessment checks of the best fit. tensile_temperatures, tensile_strengths : (known,) K and
    MPa, to interpolate.
    """

    tests: RuptureTests
    settings: RuptureSettings
    ranked: tuple[RankedRuptureFit, ...]
    strengths: tuple[StrengthEstimate, ...]
    checks: tuple[AssessmentCheck, ...]
    tensile_temperatures: Floats
    tensile_strengths: Floats
    relation: MinimumRateRelation | None = None
    rejected: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    lives: tuple[LifeEstimate, ...] = ()

    def __repr__(self) -> str:
        return f"<RuptureAssessment of {len(self.tests.names)} tests, best {self.best.method}>"

    @property
    def best(self) -> RuptureFit:
        """The fit of highest weight."""
        return self.ranked[0].fit

    @property
    def methods(self) -> dict[str, float]:
        """{method: weight of all its degrees together}, in the order of their best fits."""
        weights: dict[str, float] = {}
        for one in self.ranked:
            weights[one.fit.method] = weights.get(one.fit.method, 0.0) + one.weight
        return weights

    def __getitem__(self, method: str) -> RuptureFit:
        """The best fit of a method; of "monkman-grant" that of times by rates."""
        for one in self.ranked:
            if method in (one.fit.method, one.fit.name):
                return one.fit
        if self.relation is not None and method == self.relation.times.method:
            return self.relation.times
        raise FitError(f"there is no fit of '{method}'; {nearest(method, [*self.methods, *self.rejected])}")

    @property
    def decisive(self) -> bool:
        """Whether one of several methods has 95 % of the weight and passes every check."""
        first = self.methods[self.best.method]
        return len(self.methods) > 1 and first > DECISIVE_WEIGHT and all(check.passed for check in self.checks)

    @property
    def verdict(self) -> str:
        """One sentence: which method to use, or which the tests cannot tell apart, and which checks it fails."""
        return str(function_of_reports("rupture.rupture_verdict")(self))

    def models(self, method: str | None = None) -> WeightedModels:
        """Fits with weights that add up to one: of the average (None), or of one method."""
        if method is not None and method != AVERAGE:
            is_relation = self.relation is not None and method == self.relation.times.method
            return [((self.relation if is_relation else None) or self[method], 1.0)]
        kept = [(one.fit, one.weight) for one in self.ranked if one.weight >= LEAST_WEIGHT]
        total = sum(weight for _, weight in kept)
        return [(fit, weight / total) for fit, weight in kept]

    def tensile(self, temperature: Floats) -> Floats:
        """(...,) tensile strength, MPa; NaN where it is not known.

        temperature : (...,) K.
        """
        return interpolated(self.tensile_temperatures, self.tensile_strengths, temperature)

    def strength(self, temperature: float, *, hours: float, method: str | None = None) -> StrengthEstimate:
        """The rupture strength at a temperature, K, and a time, h; by the average, or by one method."""
        for one in self.strengths:
            if one.method == (method or AVERAGE) and one.hours == hours and abs(one.temperature - temperature) < 1e-6:
                return one
        return self.strengths_at(temperature, hours=[hours], method=method)[0]

    @checked
    def strengths_at(
        self, temperature: float, *, hours: Sequence[float], method: str | None = None
    ) -> list[StrengthEstimate]:
        """Strengths at one temperature, K, and several times, h."""
        check_conditions([temperature], hours)
        models, name, unknown = self.models(method), method or AVERAGE, (None, None)
        reason = self.obstacle(models, temperature)
        if reason:
            return [
                StrengthEstimate(
                    h,
                    temperature,
                    name,
                    None,
                    unknown,
                    unknown,
                    unknown,
                    extrapolation(self.tests, h, temperature, None),
                    reason,
                )
                for h in hours
            ]
        return strength_estimates(
            models, name, self.tests, self.tensile, hours=hours, temperature=temperature, level=self.settings.level
        )

    def obstacle(self, models: WeightedModels, temperature: float) -> str:
        """Why models state no strength at a temperature, K, whatever the time; "" where they do."""
        methods = [METHODS[model.method] for model, _ in models if isinstance(model, RuptureFit)]
        needs_tensile = any(method.needs == "tensile_strength" for method in methods)
        if needs_tensile and not np.isfinite(self.tensile(np.array([temperature]))[0]):
            return f"no tensile strength is known at {celsius_text(temperature)}"
        if self.tests.isothermal and abs(temperature - self.tests.temperature.mean()) > ISOTHERMAL_TOLERANCE:
            return f"all tests are at {celsius_text(float(self.tests.temperature.mean()))}"
        return ""

    @checked
    def rupture_time(
        self, stress: float, temperature: float, *, of: str = "test", method: str | None = None
    ) -> tuple[float, float, float]:
        """Rupture time at a stress, MPa, and a temperature, K: median, low and high, s.

        In s as of an identification, so that methods and laws compare; hours stand only where a name says so.
        of : "test", one test of a new heat; "heat", the median of a new heat; "mean", of the average heat.
        """
        if of not in BOUND_KINDS:
            raise FitError(f"of is {quoted(repr(of))}; allowed are {', '.join(BOUND_KINDS)}")
        check_conditions([temperature])
        if not 0 < stress < 1e9:
            raise FitError(f"stress is {stress!r}; give MPa above zero")
        at = Conditions.isotherm(np.array([float(stress)]), temperature, self.tensile)
        models = self.models(method)
        if reason := self.obstacle(models, temperature):
            raise FitError(f"no time to rupture is stated at {celsius_text(temperature)}: {reason}")
        ends = [curve for (kind, _), curve in bound_curves(models, at, self.settings.level).items() if kind == of]
        curves = [mixed(models, at, of).quantile(0.5), *ends]
        median, low, high = (SECONDS_PER_HOUR * power_of_ten(curve[0]) for curve in curves)
        return median, low, high

    def life(self, stress: float, temperature: float) -> LifeEstimate:
        """The time to rupture at a stress, MPa, and a temperature, K, with all bounds, h."""
        times = [np.divide(self.rupture_time(stress, temperature, of=of), SECONDS_PER_HOUR) for of in BOUND_KINDS]
        hours, (mean, heat, test) = float(times[0][0]), [(float(low), float(high)) for _, low, high in times]
        beyond = extrapolation(self.tests, hours, temperature, stress)
        return LifeEstimate(stress, temperature, hours, mean, heat, test, beyond)

    drawn_by = "rupture.rupture_figure", "rupture.draw_isotherms"

    def save(self, path: str | Path) -> Path:
        """Write the assessment as JSON; by their suffixes the time to rupture in C or Fortran, or a table with bounds.

        path : .c and .f90 hold a function of the best method, .csv the average at the stresses tested.
        """
        return write_assessment(self, path)

    shown_by = "rupture.rupture_answer"
    detailed_by = "rupture.assessment_blocks"


ISOTHERMAL_TOLERANCE = 5.0
"""K by which a strength may be asked for beside tests of one temperature."""


def interpolated(temperatures: Floats, strengths: Floats, at: Floats) -> Floats:
    """(...,) linear between known temperatures, NaN more than 1 K beyond them.

    temperatures, strengths : (known,) K and MPa. at : (...,) K.
    """
    at = np.asarray(at, float)
    if not len(temperatures):
        return np.full(at.shape, np.nan)
    known = (at >= temperatures[0] - 1.0) & (at <= temperatures[-1] + 1.0)
    return np.where(known, np.interp(at, temperatures, strengths), np.nan)


def check_conditions(temperatures: Sequence[float] | None, hours: Sequence[float] | None = None) -> None:
    """FitError unless strengths can be asked for at these temperatures, K, and times, h."""
    for name, given, unit, highest in (("temperatures", temperatures, "K", 1e4), ("hours", hours, "h", 1e12)):
        if given is not None and not len(given):
            raise FitError(f"{name} is empty; give numbers, in {unit}")
        for one in () if given is None else given:
            if not 0 < one < highest:
                raise FitError(f"{name} holds {one!r}; give {unit}, above 0 and below {highest:g}")


ASSESSMENT = DocumentFormat(
    "creepkit-rupture-assessment",
    2,
    FileKind("a rupture assessment", FitError, "give a file that RuptureAssessment.save wrote"),
    remedy="assess the tests again",
)

POSITIVE = numbers(low=0.0, above=True)
POSITIVE_OR_NAN = numbers(low=0.0, above=True, nan=True)

CODEC = RecordCodec(
    ranges={
        RuptureTests: {
            "stress": POSITIVE,
            "temperature": POSITIVE,
            "tensile_strength": POSITIVE_OR_NAN,
            "minimum_rate": POSITIVE_OR_NAN,
        },
        RankedRuptureFit: {"excess": numbers(low=0.0), "weight": numbers(low=0.0, high=1.0)},
        RuptureFit: {"scale": POSITIVE, "scale_corrected": POSITIVE},
        VarianceFreedom: {"most": numbers(low=1.0)},
        RuptureParameter: dict.fromkeys(("value", "low", "high"), ANY_NUMBER),
        LifeEstimate: dict.fromkeys(("hours", *(f"bounds_of_{of}" for of in BOUND_KINDS)), ANY_NUMBER),
    }
)


PROGRAMS = (".c", ".f90", ".csv")
"""Suffixes of files that hold the time to rupture for other programs."""


def write_assessment(assessment: RuptureAssessment, path: str | Path) -> Path:
    """Write the assessment, or its time to rupture by the suffix; the file is whole or absent."""
    if Path(path).suffix in PROGRAMS:
        return write_text(written_times(assessment, Path(path).suffix), Path(path), FitError)
    return write_json({**ASSESSMENT.heading, **CODEC.to_json(assessment)}, Path(path), ASSESSMENT.kind)


def assessment_from_json(data: Any, source: str) -> RuptureAssessment:
    """The rupture assessment of a document: its fits predict, plot and state strengths as before."""
    content = check_heading(data, source, ASSESSMENT)
    with restated(RecordError, FitError, f"{source}: {SAID}; it is not a rupture assessment of this version"):
        assessment = CODEC.from_json(RuptureAssessment, content)
    problem = _problem(assessment)
    if problem:
        raise FitError(f"{source}: {problem}; the file is damaged")
    return assessment


def _problem(assessment: RuptureAssessment) -> str:
    """What of an assessment contradicts the rest, "" where nothing does."""
    tests = assessment.tests
    sizes = {len(getattr(tests, name)) for name in ("log_time", "censored", "stress", "temperature")}
    sizes |= {len(tests.tensile_strength), len(tests.minimum_rate), *map(len, tests.groups.values())}
    if sizes != {len(tests)} or not len(tests):
        return "the tests have arrays of different lengths"
    if not assessment.ranked:
        return "no method is ranked"
    if len(assessment.tensile_temperatures) != len(assessment.tensile_strengths):
        return "tensile strengths and their temperatures differ in number"
    fits: list[Any] = [one.fit for one in assessment.ranked]
    if assessment.relation is not None:
        fits += [assessment.relation.times, assessment.relation.rates]
    for fit in fits:
        if fit.method not in METHODS:
            return f"there is no method '{fit.method}'"
        count = len(fit.coefficients) + METHODS[fit.method].bilinear + 1 + len(fit.scatter)
        if fit.covariance.shape != (count, count):
            return f"the covariance of {fit.name} does not belong to its {count} estimates"
        freedom, location = fit.variance_freedom, count - 1 - len(fit.scatter)
        kinds = len(freedom.variances)
        if freedom.derivatives.shape != (kinds, location, location) or freedom.uncertainty.shape != (kinds, kinds):
            return f"the degrees of freedom of {fit.name} do not belong to its {location} location parameters"
    return ""
