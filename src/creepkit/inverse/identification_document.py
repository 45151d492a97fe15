"""Identifications as JSON documents, read and written field by field; the law is rebuilt, its fingerprint checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.files.json_documents import DocumentFormat, check_heading, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import Record, RecordCodec, RecordError, ValueCodec
from creepkit.inverse.adequacy import Adequacy, LargestDeviation, OutputAdequacy
from creepkit.inverse.defect_correction import NumericalError
from creepkit.inverse.explanation import Explanation, LeftOut
from creepkit.inverse.goodness_of_fit import OutputErrors, OutputFit, TestFit
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.nuisance_parameters import NuisanceEstimate, Perturbation
from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
from creepkit.inverse.predictor_documents import predictor_documents, predictor_from_documents
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.single_values import ContradictingValues, SingleValue
from creepkit.inverse.sparsity.result import FitStatistics, Sparsity
from creepkit.inverse.uncertainty.rate_scatter import LEVELS, RateScatter
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.limits import numbers
from creepkit.records import Nuisance

IDENTIFICATION = DocumentFormat(
    "creepkit-identification",
    8,
    FileKind("an identification", FitError, "give a file that Identification.save wrote"),
    remedy="identify again",
)


LARGEST = 1e12
"""Of a standard deviation, in any unit: larger ones are damage."""


NOT_NEGATIVE, POSITIVE, SIZE = numbers(0.0), numbers(0.0, above=True), numbers(0.0, LARGEST)
POSITIVE_SIZE, ANY_SIZE = numbers(0.0, LARGEST, above=True), numbers(-(LARGEST**2), LARGEST**2)
NAN_ALLOWED, INFINITY_ALLOWED = numbers(nan=True), numbers(infinite=True)
NOT_NEGATIVE_OR_NAN = numbers(0.0, nan=True, infinite=True)


LAW_CODEC = ValueCodec(law_to_json, law_from_json)


CODEC = RecordCodec(
    omitted={Identification: ("histories", "predictor", "linearised", "problem"), Perturbation: ("residual_change",)},
    ranges={
        Identification: {"rms": NOT_NEGATIVE_OR_NAN, "effective_frames": POSITIVE, "freedom": POSITIVE},
        ReferencePoint: {"*": POSITIVE, "conditions": ANY_SIZE},
        NoiseModel: {"*": SIZE, "discrepancy_length": POSITIVE},
        OutputNoise: {"*": SIZE, "correlation_length": POSITIVE},
        RateScatter: {
            "*": ANY_SIZE,
            **dict.fromkeys(("stresses", "temperatures", "output_scales", "output_floors"), POSITIVE_SIZE),
            "variance": numbers(0.0, LARGEST**2),
            "known": SIZE,
        },
        Adequacy: {"*": NOT_NEGATIVE_OR_NAN},
        Explanation: {"sd": NOT_NEGATIVE, "temperature": NOT_NEGATIVE},
        LeftOut: {"sd": NOT_NEGATIVE},
        OutputAdequacy: {"*": NOT_NEGATIVE, "noise": POSITIVE},
        ContradictingValues: {"*": NOT_NEGATIVE, "scatter": POSITIVE},
        ImplausibleNuisance: {"standard_deviations": NOT_NEGATIVE, "size": POSITIVE, "share": NOT_NEGATIVE_OR_NAN},
        LargestDeviation: {"rms": NOT_NEGATIVE},
        NumericalError: {"*": NOT_NEGATIVE, "shift": NOT_NEGATIVE_OR_NAN},
        Perturbation: {"*": NAN_ALLOWED, **dict.fromkeys(("size", "tests"), NOT_NEGATIVE)},
        OutputErrors: {"*": NOT_NEGATIVE_OR_NAN},
        OutputFit: {"noise": NOT_NEGATIVE},
        SingleValue: {"*": NOT_NEGATIVE_OR_NAN, "measured": POSITIVE},
        TestFit: {"*": NAN_ALLOWED, "frames": NOT_NEGATIVE, "rate_factor": numbers()},
        Nuisance: {"sd": numbers(0.0, above=True, infinite=True), "bounds": INFINITY_ALLOWED},
        NuisanceEstimate: {"sd": NOT_NEGATIVE, "prior_sd": INFINITY_ALLOWED},
        FitStatistics: {"parameters": NOT_NEGATIVE},
        Sparsity: {"observations": NOT_NEGATIVE},
    },
    values={CreepLaw: LAW_CODEC},
    names={"Sparsity": Sparsity, "LinearisedProblem": object},
)
"""Of identifications; histories, linearised problem and changes of residuals are not stored.

The predictor is, by its documents.
"""


def identification_to_json(fit: Identification) -> dict[str, Any]:
    """The identification as JSON-able data."""
    documents = predictor_documents(fit.predictor) or fit.predictor_documents
    return {**IDENTIFICATION.heading, **CODEC.to_json(replace(fit, predictor_documents=documents))}


def write_identification(fit: Identification, path: str | Path) -> Path:
    """Write the identification; the file is whole or absent."""
    return write_json(identification_to_json(fit), Path(path), IDENTIFICATION.kind)


COVARIANCE_ROUNDING = 1e-6
"""By which a correlation may be asymmetric, or have eigenvalues below zero; inverses of near singular matrices do."""


def identification_from_json(data: Any, source: str = "identification") -> Identification:
    """Rebuild an identification from JSON-able data; FitError, in one sentence, says what is wrong with other data."""
    content = check_heading(data, source, IDENTIFICATION)
    try:
        fit = _with_arrays(CODEC.from_json(Identification, content))
    except RecordError as error:
        raise FitError(f"{source}: {error}; it is not an identification of this version") from None
    if problem := _contradiction(fit):
        raise FitError(f"{source}: {problem}; the file is damaged")
    try:
        return replace(fit, predictor=predictor_from_documents(fit.predictor_documents))
    except FitError as error:
        raise FitError(f"{source}: {error}") from None


def with_shapes(record: Record, shapes: Mapping[str, tuple[int, ...]]) -> Record:
    """The record with arrays of these shapes, empty ones too: JSON holds no shape of those; RecordError for others."""
    arrays = {name: getattr(record, name) for name in shapes if getattr(record, name) is not None}
    for name, array in arrays.items():
        if array.shape != shapes[name] and not array.size == 0 == math.prod(shapes[name]):
            raise RecordError(f"{name} has the shape {array.shape}, not {shapes[name]}")
    shaped: Any = {name: array.reshape(shapes[name]) for name, array in arrays.items()}
    return replace(record, **shaped)  # type: ignore[type-var]


def _with_arrays(fit: Identification) -> Identification:
    """The identification whose arrays have the shapes that its law, tests and nuisances ask for; RecordError if not."""
    size, tests, scatter = len(fit.law.params), len(fit.tests), fit.rate_scatter
    if tuple(e.name for e in fit.estimates) != fit.law.names:
        raise RecordError(f"estimates do not belong to the {size} parameters of the law")
    draws = 0 if fit.samples is None else len(fit.samples)
    shapes = {"u": (size,), "samples": (draws, size), "covariance": (size, size), "error_covariance": (size, size)}
    fit = with_shapes(fit, shapes)
    if scatter is None:
        return fit
    unknowns = size + len(fit.nuisances)
    vectors = dict.fromkeys(("log_factor", "variance", "stresses", "temperatures"), (tests,))
    matrices = dict.fromkeys(("precision", "errors"), (unknowns, unknowns))
    shapes = {**vectors, **matrices, "design": (tests, unknowns), "gradient": (unknowns,)}
    return replace(fit, rate_scatter=with_shapes(scatter, shapes))


def _contradiction(fit: Identification) -> str:
    """What in a file contradicts the rest of it, in one clause; "" where nothing does."""
    stated = fit.law.to_internal(fit.values)[0] if fit.law.params else np.zeros(0)
    # A value at its bound is stated as the bound, a little beside u.
    if fit.law.params and not np.allclose(fit.coordinates.theta(fit.u), stated, rtol=0.01, atol=0.05):
        return "the values of the parameters and the coordinates u contradict each other"
    if not _is_covariance(fit.covariance):
        return "covariance is not symmetric and positive semi-definite"
    if not {"stress", "temperature", "strain", "time"} <= {*fit.ranges} or any(a > b for a, b in fit.ranges.values()):
        return "ranges must be of stress, temperature, strain and time, each from low to high"
    scatter, tests = fit.rate_scatter, tuple(m.name for m in fit.tests)
    if scatter is None:
        return ""
    if scatter.tests != tests or any(len(names) != len(tests) for names in scatter.members.values()):
        return "rate_scatter is not of the tests of the identification"
    if not {*scatter.members, *scatter.common} <= {*LEVELS[:-1]}:
        return f"levels of rate_scatter are not among {', '.join(LEVELS[:-1])}"
    return "" if _is_covariance(scatter.precision) else "rate_scatter.precision is not symmetric and positive"


def _is_covariance(matrix: Floats) -> bool:
    """Whether a matrix is symmetric and positive semi-definite, but for rounding.

    Of the correlation: variances of well and of hardly determined parameters lie many powers of ten apart.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    correlation = matrix / np.maximum(np.outer(scale, scale), 1e-300)
    asymmetry = np.max(np.abs(correlation - correlation.T), initial=0.0)
    return not matrix.size or bool(
        asymmetry <= COVARIANCE_ROUNDING and np.linalg.eigvalsh(correlation)[0] >= -COVARIANCE_ROUNDING
    )
