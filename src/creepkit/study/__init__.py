"""The verbs of a study, as typed in a notebook; each finds its nouns in the registry and hands over the work."""

from creepkit.study.files import load, read_histories, check_data_quality, exclude_suspect_frames
from creepkit.study.models import identify, moduli, rank, select, simulate
from creepkit.study.networks import surrogate, train
from creepkit.study.nouns import law, laws, specimen, specimens
from creepkit.study.plates import confirm, screen
from creepkit.study.sets import generate, rate_family, read_dataset
from creepkit.study.text import export, exporters
from creepkit.study.trends import discover, temperature_study

__all__ = [
    "confirm",
    "discover",
    "export",
    "exporters",
    "generate",
    "identify",
    "law",
    "laws",
    "load",
    "moduli",
    "rank",
    "rate_family",
    "read_dataset",
    "read_histories",
    "screen",
    "select",
    "simulate",
    "specimen",
    "specimens",
    "surrogate",
    "check_data_quality",
    "temperature_study",
    "train",
    "exclude_suspect_frames",
]
