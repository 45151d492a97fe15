"""Samples of results that creepkit keeps: an identification and a ranking, as the version before wrote them."""

from __future__ import annotations

from collections.abc import Iterator

from file_samples.documents import document
from file_samples.samples import ReaderSample

from creepkit.inverse.identification_document import load
from creepkit.inverse.ranking_document import load_ranking
from helpers.paths import ROOT

FORMATS = ROOT / "tests" / "data" / "formats" / "0.1.0"


def samples() -> Iterator[ReaderSample]:
    """The samples of results."""
    keys = '"format" "version"'
    yield document("identification", "identification.json", (FORMATS / "identification.json").read_bytes(), load, keys)
    ranking, others = (FORMATS / "ranking.json").read_bytes(), {"norton.json": (FORMATS / "norton.json").read_bytes()}
    yield document("ranking", "ranking.json", ranking, load_ranking, '"format" "weight"', others)
