"""Calls of creepkit that several benchmark programs make: predictions of given values, cross-validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from time_comparison import TimeComparison, held_out_times_to_strain, times_to_rupture

from creepkit.arrays import ArrayLike, Floats
from creepkit.inverse.cross_validation import CrossValidation, cross_validate
from creepkit.inverse.identification import Identification
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor


def predict(
    predictor: Predictor,
    law: CreepLaw,
    values: Mapping[str, ArrayLike],
    histories: Sequence[History],
    nuisances: Mapping[str, Floats] | None = None,
    sensitivities: bool = False,
) -> Prediction:
    """Predictions of candidates; values : {parameter: number or (candidates,)} in the author's units."""
    return predictor.predict(law, law.to_internal(values), histories, nuisances=nuisances, sensitivities=sensitivities)


def rupture_times(predictor: Any, law: CreepLaw, values: Mapping[str, float], histories: Sequence[History]) -> Floats:
    """Predicted times to rupture, (tests,) s."""
    return predictor.predict_to_rupture(law, law.to_internal(values), histories).times_to_strain.rupture_times[0]


def cross_validated_tests(fit: Identification, histories: Sequence[History]) -> CrossValidation:
    """Each test predicted by the law identified from all others."""
    return cross_validate(fit, histories, by="test")


def cross_validated_times(fit: Identification, histories: Sequence[History], strain: float | None) -> TimeComparison:
    """Times to a strain (None: to rupture), each condition predicted by the law identified from all others."""
    validated = cross_validate(fit, histories, by="condition")
    if strain is not None:
        return held_out_times_to_strain(validated, strain, histories)
    return times_to_rupture((name, one.get("rupture time")) for name, one in validated.single_values.items())
