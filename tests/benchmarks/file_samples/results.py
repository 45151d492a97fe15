"""Samples of results that creepkit keeps: an identification and a ranking, as the version before wrote them."""

from __future__ import annotations

from collections.abc import Iterator

from file_samples.documents import document
from file_samples.samples import ReaderSample

import creepkit as ck
from helpers.paths import ROOT

FORMATS = ROOT / "tests" / "data" / "formats" / "0.1.0"


def samples() -> Iterator[ReaderSample]:
    """The samples of results."""
    keys = '"format" "version"'
    yield document(
        "identification", "identification.json", (FORMATS / "identification.json").read_bytes(), ck.load, keys
    )
    ranking, others = (FORMATS / "ranking.json").read_bytes(), {"norton.json": (FORMATS / "norton.json").read_bytes()}
    yield document("ranking", "ranking.json", ranking, ck.load, '"format" "weight"', others)
