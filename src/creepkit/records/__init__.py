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
    ABSOLUTE,
    EXPLICIT,
    Effects,
    Life,
    Nuisance,
    Prediction,
    Predictor,
    Screened,
    Specimen,
    Status,
    WholeLife,
)
from creepkit.records.valued import Units, ValuedLaw

__all__ = [
    "ABSOLUTE",
    "COMPONENTS",
    "EVERY_FRAME",
    "EXPLICIT",
    "ZERO_CELSIUS",
    "Effects",
    "Exporter",
    "History",
    "Life",
    "Loading",
    "Nuisance",
    "PointLoading",
    "Prediction",
    "Predictor",
    "PressureJump",
    "Program",
    "Reader",
    "RecordedLoading",
    "Screened",
    "Specimen",
    "Status",
    "StrainSteps",
    "StressSteps",
    "Units",
    "ValuedLaw",
    "WholeLife",
    "constant_strain",
    "constant_stress",
]
