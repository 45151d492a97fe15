"""Samples of the reader of the NFDI-MatWerk data schema."""

from __future__ import annotations

import json
from collections.abc import Iterator

from file_samples.histories import decided, difference, read
from file_samples.samples import ReaderSample

from helpers.creep_schema import LIS, SERIES_NAME, document


def samples() -> Iterator[ReaderSample]:
    """A document with its series, the series alone, and both with the other one mutated."""
    text = json.dumps(document(), indent=1, ensure_ascii=False).encode()
    files = {"Q7.json": text, SERIES_NAME: LIS.encode()}
    keys = (("initialStress", "intialStress"), ("specifiedTemperature", "specifiedTemprature"))
    yield ReaderSample(
        "creep schema document", files, "Q7.json", read, difference, decided, misspelt=keys, reader="creep-schema"
    )
    entries = (("Initial stress", "Intial stress"), ("Specified temperature", "Specified temprature"))
    alone = {SERIES_NAME: LIS.encode()}
    units = (("\tMPa\t", "\t\t"), ("\th\t", "\t\t"), ("h\t%\t", "\t%\t"), ("h\t%\t", "h\t\t"))
    yield ReaderSample(
        "creep schema series", alone, SERIES_NAME, read, difference, decided, "", entries, units, "creep-schema"
    )
