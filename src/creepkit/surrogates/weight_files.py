"""Files of surrogates and of interrupted trainings: the weights of a network below a JSON header."""

from __future__ import annotations

from creepkit.errors import SurrogateError
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import ANY_NUMBER, RecordCodec, ValueCodec
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import Specimen
from creepkit.registry.specimen_documents import specimen_from_json, specimen_to_json
from creepkit.sampling.conditions import TimeGrid
from creepkit.surrogates.applicability_domain import ApplicabilityDomain

SURROGATE = DocumentFormat(
    "creepkit-surrogate",
    2,
    FileKind("a surrogate", SurrogateError, "train again or take a copy", maximum_bytes=2**30),
    remedy="train again",
)
"""Eight layers of 2048 units of a GRU take 0.8 GB, and one of the default size 1 MB."""


CHECKPOINT = DocumentFormat(
    "creepkit-training-checkpoint",
    1,
    FileKind("a checkpoint of a training", SurrogateError, "remove it to begin again", maximum_bytes=2**32),
    remedy="remove it to begin again",
)
"""It holds the weights, the best ones, and two moments of each."""


CODEC = RecordCodec(
    values={
        CreepLaw: ValueCodec(law_to_json, law_from_json),
        Specimen: ValueCodec(specimen_to_json, specimen_from_json),
    },
    names={
        "CreepLaw": CreepLaw,
        "Specimen": Specimen,
        "TimeGrid": TimeGrid,
        "ApplicabilityDomain": ApplicabilityDomain,
    },
    default_range=ANY_NUMBER,
)
"""Of recipes, and of what a surrogate knows beside its weights."""
