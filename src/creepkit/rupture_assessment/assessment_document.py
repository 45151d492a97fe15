"""Rupture assessments as JSON files: written, and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import ANY_NUMBER, NumberRange, RecordCodec, RecordError
from creepkit.rupture_assessment.assessment import RankedRuptureFit, RuptureAssessment
from creepkit.rupture_assessment.degrees_of_freedom import VarianceFreedom
from creepkit.rupture_assessment.methods import METHODS
from creepkit.rupture_assessment.observed_tests import RuptureTests
from creepkit.rupture_assessment.rupture_fit import RuptureFit, RuptureParameter

ASSESSMENT = DocumentFormat(
    "creepkit-rupture-assessment",
    1,
    FileKind("a rupture assessment", FitError, "give a file that RuptureAssessment.save wrote"),
    remedy="assess the tests again",
)

POSITIVE = NumberRange(low=0.0, open_low=True)
POSITIVE_OR_NAN = NumberRange(low=0.0, open_low=True, nan=True)

CODEC = RecordCodec(
    ranges={
        RuptureTests: {
            "stress": POSITIVE,
            "temperature": POSITIVE,
            "tensile_strength": POSITIVE_OR_NAN,
            "minimum_rate": POSITIVE_OR_NAN,
        },
        RankedRuptureFit: {"excess": NumberRange(low=0.0), "weight": NumberRange(low=0.0, high=1.0)},
        RuptureFit: {"scale": POSITIVE, "scale_corrected": POSITIVE},
        VarianceFreedom: {"most": NumberRange(low=1.0)},
        RuptureParameter: dict.fromkeys(("value", "low", "high"), ANY_NUMBER),
    }
)


def write_assessment(assessment: RuptureAssessment, path: str | Path) -> Path:
    """Write the assessment; the file is whole or absent."""
    return write_json({**ASSESSMENT.heading, **CODEC.to_json(assessment)}, Path(path), ASSESSMENT.kind)


@checked
def load_rupture_assessment(path: str | Path) -> RuptureAssessment:
    """Return the rupture assessment saved in a JSON file: its fits predict, plot and state strengths as before.

    FitError, in one sentence, says what is wrong with other files.
    """
    data = read_json(Path(path), ASSESSMENT.kind)
    content = check_heading(data, str(path), ASSESSMENT)
    try:
        assessment = CODEC.from_json(RuptureAssessment, content)
    except RecordError as error:
        raise FitError(f"{path}: {error}; it is not a rupture assessment of this version") from None
    problem = _problem(assessment)
    if problem:
        raise FitError(f"{path}: {problem}; the file is damaged")
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
