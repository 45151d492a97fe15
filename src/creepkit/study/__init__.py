"""The verbs of a study, as typed in a notebook; each finds its nouns in the registry and hands over the work."""

from creepkit.study.files import load, read_histories, suspects, with_suspects_marked
from creepkit.study.models import identify, moduli, rank, simulate
from creepkit.study.nouns import law, laws, specimen, specimens
from creepkit.study.text import export, exporters

__all__ = [
    "export",
    "exporters",
    "identify",
    "law",
    "laws",
    "load",
    "moduli",
    "rank",
    "read_histories",
    "simulate",
    "specimen",
    "specimens",
    "suspects",
    "with_suspects_marked",
]
