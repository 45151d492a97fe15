"""Identifications as JSON documents, read and written field by field; the law is rebuilt, its fingerprint checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import NumberRange, RecordCodec, RecordError, ValueCodec
from creepkit.inverse.adequacy import Adequacy, LargestDeviation, OutputAdequacy
from creepkit.inverse.defect_correction import NumericalError
from creepkit.inverse.explanation import Explanation, LeftOut
from creepkit.inverse.goodness_of_fit import OutputErrors, OutputFit, TestFit
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
from creepkit.inverse.perturbation import Perturbation
from creepkit.inverse.predictor_documents import predictor_documents, predictor_from_documents
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.single_values import ContradictingValues, SingleValue
from creepkit.inverse.sparsity.result import FitStatistics, Sparsity
from creepkit.inverse.uncertainty.rate_scatter import LEVELS, RateScatter
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import Nuisance

IDENTIFICATION = DocumentFormat(
    "creepkit-identification",
    8,
    FileKind("an identification", FitError, "give a file that Identification.save wrote"),
    remedy="identify again",
)


NOT_NEGATIVE = NumberRange(low=0.0)


POSITIVE = NumberRange(low=0.0, open_low=True)


SIZE = NumberRange(low=0.0, high=1e12)
"""Of a standard deviation, in any unit."""


POSITIVE_OR_INFINITE = NumberRange(low=0.0, open_low=True, infinite=True)


NAN_ALLOWED = NumberRange(nan=True)


NOT_NEGATIVE_OR_NAN = NumberRange(low=0.0, nan=True, infinite=True)


INFINITY_ALLOWED = NumberRange(infinite=True)


LAW_CODEC = ValueCodec(law_to_json, law_from_json)


CODEC = RecordCodec(
    omitted={
        Identification: ("histories", "predictor", "search_trace", "linearised", "problem"),
        Sparsity: ("path",),
        Perturbation: ("residual_change",),
    },
    ranges={
        Identification: {"rms": NOT_NEGATIVE_OR_NAN, "effective_frames": POSITIVE, "freedom": POSITIVE},
        ReferencePoint: dict.fromkeys(("stress", "strain", "time", "temperature"), POSITIVE),
        NoiseModel: {"rate": SIZE, "discrepancy": SIZE, "discrepancy_length": POSITIVE},
        OutputNoise: {
            **dict.fromkeys(("noise", "misfit", "offset", "drift", "stated"), SIZE),
            "correlation_length": POSITIVE,
        },
        Adequacy: dict.fromkeys(
            (
                "chi_square",
                "freedom",
                "p_value",
                "correlation",
                "rate_scatter",
                "critical_chi_square",
                "smallest_p_value",
            ),
            NOT_NEGATIVE_OR_NAN,
        ),
        Explanation: {"sd": NOT_NEGATIVE, "temperature": NOT_NEGATIVE},
        LeftOut: {"sd": NOT_NEGATIVE},
        OutputAdequacy: {"frames": NOT_NEGATIVE, "noise": POSITIVE, "discrepancy": NOT_NEGATIVE},
        ContradictingValues: {
            "scatter": POSITIVE,
            **dict.fromkeys(("rate_ratio", "time_ratio", "p_value"), NOT_NEGATIVE),
        },
        ImplausibleNuisance: {"standard_deviations": NOT_NEGATIVE, "size": POSITIVE, "share": NOT_NEGATIVE_OR_NAN},
        LargestDeviation: {"rms": NOT_NEGATIVE},
        NumericalError: {"noises": NOT_NEGATIVE, "shift": NOT_NEGATIVE_OR_NAN},
        Perturbation: {
            "size": NOT_NEGATIVE,
            "rate_change": NAN_ALLOWED,
            "tests": NOT_NEGATIVE,
            "per_kelvin": NAN_ALLOWED,
            "like_hardening": NAN_ALLOWED,
            "hardening_correlation": NOT_NEGATIVE_OR_NAN,
        },
        OutputErrors: {
            "frames": NOT_NEGATIVE,
            "relative_squared_error": NOT_NEGATIVE_OR_NAN,
            "mean_squared_error": NOT_NEGATIVE_OR_NAN,
            "mean_absolute_error": NOT_NEGATIVE_OR_NAN,
            "relative_rms_error": NOT_NEGATIVE_OR_NAN,
            "chi_square": NOT_NEGATIVE_OR_NAN,
        },
        OutputFit: {"noise": NOT_NEGATIVE},
        SingleValue: {"measured": POSITIVE, **dict.fromkeys(("predicted", "low", "high"), NOT_NEGATIVE_OR_NAN)},
        TestFit: {
            "frames": NOT_NEGATIVE,
            "log_strain_rms": NAN_ALLOWED,
            "log_strain_bias": NAN_ALLOWED,
            "weight": POSITIVE,
        },
        Nuisance: {"sd": POSITIVE_OR_INFINITE, "bounds": INFINITY_ALLOWED},
        NuisanceEstimate: {"sd": NOT_NEGATIVE, "prior_sd": INFINITY_ALLOWED},
        IdentificationSettings: {
            "starts": NumberRange(low=1),
            "sobol_points": NumberRange(low=1),
            "frames": NumberRange(low=2),
        },
        FitStatistics: {"parameters": NOT_NEGATIVE},
        Sparsity: {"observations": NOT_NEGATIVE},
    },
    values={CreepLaw: LAW_CODEC},
    names={"Sparsity": Sparsity, **dict.fromkeys(("PenaltyPath", "SearchTrace", "LinearisedProblem"), object)},
)
"""Of identifications; histories, search trace, linearised problem and changes of residuals are not stored.

The predictor is, by its documents.
"""


def identification_to_json(fit: Identification) -> dict[str, Any]:
    """The identification as JSON-able data."""
    documents = predictor_documents(fit.predictor) or fit.predictor_documents
    return {**IDENTIFICATION.heading, **CODEC.to_json(replace(fit, predictor_documents=documents))}


def write_identification(fit: Identification, path: str | Path) -> Path:
    """Write the identification; the file is whole or absent."""
    return write_json(identification_to_json(fit), Path(path), IDENTIFICATION.kind)


@checked
def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file.

    It knows its specimen by name and predicts new histories; attach its own with `.with_histories(histories)`. The law
    is rebuilt from data and its fingerprint checked.
    """
    return identification_from_json(read_json(Path(path), IDENTIFICATION.kind), str(path))


COVARIANCE_ROUNDING = 1e-6
"""By which a correlation may be asymmetric, or have eigenvalues below zero; inverses of near singular matrices do."""


def identification_from_json(data: Any, source: str = "identification") -> Identification:
    """Rebuild an identification from JSON-able data; FitError, in one sentence, says what is wrong with other data."""
    content = check_heading(data, source, IDENTIFICATION)
    try:
        fit = CODEC.from_json(Identification, content)
    except RecordError as error:
        raise FitError(f"{source}: {error}; it is not an identification of this version") from None
    size, names = len(fit.law.params), tuple(e.name for e in fit.estimates)
    if names != fit.law.names or fit.u.shape != (size,) or fit.covariance.reshape(-1).size != size**2:
        raise FitError(f"{source}: estimates, u and covariance do not belong to the {size} parameters of the law")
    if fit.samples is not None and (fit.samples.ndim != 2 or fit.samples.shape[1] != size or not len(fit.samples)):
        raise FitError(f"{source}: samples do not belong to the {size} parameters of the law; the file is damaged")
    errors = fit.error_covariance
    if errors is not None and (errors.size != size**2 or not np.isfinite(errors).all()):
        raise FitError(f"{source}: error_covariance does not belong to the {size} parameters of the law")
    stated = fit.law.to_internal(fit.values)[0] if size else np.zeros(0)
    # A value at its bound is stated as the bound, a little beside u.
    if size and not np.allclose(fit.coordinates.theta(fit.u), stated, rtol=0.01, atol=0.05):
        raise FitError(f"{source}: the values of the parameters and the coordinates u contradict each other")
    covariance = fit.covariance.reshape(size, size)
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    correlation = covariance / np.maximum(np.outer(scale, scale), 1e-300)
    # Of the correlation: variances of well and of hardly determined parameters lie many powers of ten apart.
    asymmetry = np.max(np.abs(correlation - correlation.T), initial=0.0)
    if size and (asymmetry > COVARIANCE_ROUNDING or np.linalg.eigvalsh(correlation)[0] < -COVARIANCE_ROUNDING):
        raise FitError(f"{source}: covariance is not symmetric and positive semi-definite; the file is damaged")
    if fit.rate_scatter is not None:
        unknowns, tests = size + len(fit.nuisances), [m.name for m in fit.tests]
        fit = replace(fit, rate_scatter=_with_shapes(fit.rate_scatter, len(tests), unknowns))
        problem = _problem_with(fit.rate_scatter, tests, unknowns)  # type: ignore[arg-type]
        if problem:
            raise FitError(f"{source}: rate_scatter: {problem}; the file is damaged")
    if not {"stress", "temperature", "strain", "time"} <= {*fit.ranges} or any(a > b for a, b in fit.ranges.values()):
        raise FitError(f"{source}: ranges must be of stress, temperature, strain and time, each from low to high")
    try:
        predictor = predictor_from_documents(fit.predictor_documents)
    except FitError as error:
        raise FitError(f"{source}: {error}") from None
    errors = None if errors is None else errors.reshape(size, size)
    # Of a law without parameters both are lists.
    return replace(fit, covariance=covariance, error_covariance=errors, predictor=predictor)


def _with_shapes(scatter: RateScatter, tests: int, unknowns: int) -> RateScatter:
    """The record with two-dimensional arrays where they are empty: JSON holds no shape of those."""
    shapes = {"design": (tests, unknowns), "precision": (unknowns, unknowns), "errors": (unknowns, unknowns)}
    known = {name: getattr(scatter, name) for name in shapes}
    empty = [n for n, shape in shapes.items() if known[n] is not None and 0 in shape and not known[n].size]
    arrays: dict[str, Any] = {name: np.zeros(shapes[name]) for name in empty}
    return replace(scatter, **arrays)


LARGEST_NUMBER = 1e12
"""Of a stored record: larger ones are damage."""


def _problem_with(scatter: RateScatter, tests: Sequence[str], unknowns: int) -> str:
    """What is wrong with a record that was read from a file, in one clause; "" for one that fits an identification.

    tests : names of the fitted tests. unknowns : how many the identification has.
    """
    count = len(tests)
    shapes = {
        "log_factor": (count,),
        "variance": (count,),
        "weight": (count,),
        "design": (count, unknowns),
        "precision": (unknowns, unknowns),
        "gradient": (unknowns,),
        "stresses": (count,),
        "temperatures": (count,),
        **({} if scatter.errors is None else {"errors": (unknowns, unknowns)}),
    }
    if scatter.tests != tuple(tests):
        return "its tests are not those of the identification"
    for name, shape in shapes.items():
        array = np.asarray(getattr(scatter, name))
        if array.shape != shape and not array.size == 0 == np.prod(shape):
            return f"{name} has the shape {array.shape}, not {shape}"
        if not (np.abs(array) < LARGEST_NUMBER**2).all():
            return f"{name} holds numbers that are too large"
    if not ((scatter.variance >= 0).all() and (scatter.weight > 0).all()):
        return "a variance is negative, or a weight not above zero"
    if not (scatter.weight < LARGEST_NUMBER).all():
        return "weight holds numbers that are too large"
    for level, names in scatter.members.items():
        if level not in LEVELS[:-1] or len(names) != count:
            return f"members of '{quoted(level, 20)}' are not one for each test, of a heat or laboratory"
    if not {*scatter.common} <= {*LEVELS[:-1]}:
        return "common names levels that are no heat or laboratory"
    if scatter.known is not None and not 0 <= scatter.known < LARGEST_NUMBER:
        return f"known is {scatter.known:g}, which is no standard deviation"
    for name in ("output_scales", "output_floors"):
        if not all(0 < value < LARGEST_NUMBER for value in getattr(scatter, name).values()):
            return f"{name} must be above zero"
    if not ((scatter.stresses > 0).all() and (scatter.temperatures > 0).all()):
        return "a stress or a temperature is not above zero"
    scale = np.sqrt(np.maximum(np.diag(scatter.precision), 1e-300))
    scaled = scatter.precision / np.outer(scale, scale)
    if unknowns and (not np.allclose(scaled, scaled.T, atol=1e-8) or np.linalg.eigvalsh(scaled)[0] < -1e-6):
        return "precision is not symmetric and positive semi-definite"
    return ""
