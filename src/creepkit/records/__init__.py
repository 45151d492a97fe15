"""The records that the public functions take and return. Frozen; MPa, mm, s, K throughout."""

from creepkit.records.history import EVERY_FRAME, ZERO_CELSIUS, History, output_unit
from creepkit.records.interfaces import (
    Exporter,
    Predictor,
    Reader,
    Specimen,
    SupportsReducedOrderModel,
    SupportsRefinement,
    SupportsRupturePrediction,
)
from creepkit.records.law_with_values import LawWithValues, Units
from creepkit.records.loading import (
    TENSOR_COMPONENTS,
    Loading,
    PointLoading,
    PressureJump,
    Program,
    RecordedLoading,
    StrainSteps,
    StressSteps,
    constant_strain,
    constant_stress,
)
from creepkit.records.prediction import (
    LENGTH_NUISANCES,
    SIMULATED_NUISANCES,
    Nuisance,
    NuisanceValues,
    Prediction,
    Status,
    TimesToStrain,
)
from creepkit.records.prediction_assembly import (
    HistoryPrediction,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
    unpredicted,
)

__all__ = [
    "EVERY_FRAME",
    "LENGTH_NUISANCES",
    "SIMULATED_NUISANCES",
    "TENSOR_COMPONENTS",
    "ZERO_CELSIUS",
    "Exporter",
    "History",
    "HistoryPrediction",
    "LawWithValues",
    "Loading",
    "Nuisance",
    "NuisanceValues",
    "PointLoading",
    "Prediction",
    "Predictor",
    "PressureJump",
    "Program",
    "Reader",
    "RecordedLoading",
    "Specimen",
    "Status",
    "StrainSteps",
    "StressSteps",
    "SupportsReducedOrderModel",
    "SupportsRefinement",
    "SupportsRupturePrediction",
    "TimesToStrain",
    "Units",
    "assemble_prediction",
    "broadcast_candidates",
    "check_nuisances",
    "constant_strain",
    "constant_stress",
    "output_unit",
    "unpredicted",
]
