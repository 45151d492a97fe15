"""The nouns: what goes into and comes out of the verbs. Frozen records; MPa, mm, s, K throughout."""

from creepkit.records.doors import Exporter, Reader
from creepkit.records.history import EVERY_FRAME, ZERO_CELSIUS, History
from creepkit.records.loading import (
    Loading,
    PressureJump,
    Program,
    RecordedLoading,
    StressSteps,
    constant_stress,
)
from creepkit.records.prediction import (
    ABSOLUTE,
    EXPLICIT,
    Effects,
    Nuisance,
    Prediction,
    Predictor,
    Screened,
    Specimen,
    Status,
)

__all__ = [
    "ABSOLUTE",
    "EVERY_FRAME",
    "EXPLICIT",
    "ZERO_CELSIUS",
    "Effects",
    "Exporter",
    "History",
    "Loading",
    "Nuisance",
    "Prediction",
    "Predictor",
    "PressureJump",
    "Program",
    "Reader",
    "RecordedLoading",
    "Screened",
    "Specimen",
    "Status",
    "StressSteps",
    "constant_stress",
]
