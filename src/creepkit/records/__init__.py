"""The nouns: what goes into and comes out of the verbs. Frozen records; MPa, mm, s, K throughout."""

from creepkit.records.doors import Exporter, Reader
from creepkit.records.history import EVERY_FRAME, ZERO_CELSIUS, History
from creepkit.records.loading import (
    Loading,
    PressureJump,
    Program,
    RecordedLoading,
    StrainSteps,
    StressSteps,
    constant_strain,
    constant_stress,
)
from creepkit.records.point_loading import COMPONENTS, PointLoading
from creepkit.records.prediction import (
    LENGTH_NUISANCES,
    SIMULATED_NUISANCES,
    NuisanceValues,
    TimesToStrain,
    Nuisance,
    Prediction,
    Predictor,
    SupportsReducedOrderModel,
    Specimen,
    Status,
    SupportsRupturePrediction,
)
from creepkit.records.valued import Units, LawWithValues

__all__ = [
    "LENGTH_NUISANCES",
    "COMPONENTS",
    "EVERY_FRAME",
    "SIMULATED_NUISANCES",
    "ZERO_CELSIUS",
    "NuisanceValues",
    "Exporter",
    "History",
    "TimesToStrain",
    "Loading",
    "Nuisance",
    "PointLoading",
    "Prediction",
    "Predictor",
    "PressureJump",
    "Program",
    "Reader",
    "RecordedLoading",
    "SupportsReducedOrderModel",
    "Specimen",
    "Status",
    "StrainSteps",
    "StressSteps",
    "Units",
    "LawWithValues",
    "SupportsRupturePrediction",
    "constant_strain",
    "constant_stress",
]
