"""Reduced-order models that a page brings along: of its specimens, and of the pieces of its tests."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from creepkit.app.contents import PageContents
from creepkit.app.network_data import network_data
from creepkit.app.reduced_model_data import rom_data
from creepkit.errors import CreepkitError, SurrogateError
from creepkit.records import History, Specimen
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.surrogates.parameter_surrogate import ParameterSurrogate

MOST_MODELS = 4
"""Of one page, some 150 kB each; tests of further pieces are shown without a curve."""


def page_models(contents: PageContents, *, shown_first: bool = False) -> dict[str, str]:
    """{name: data as JSON} of the models of a page; shown_first : only of what it begins with, as a server needs."""
    models: dict[str, str] = {}
    for specimen in contents.specimens[: 1 if shown_first else None]:
        models |= model_of(specimen)
    for history in contents.histories:
        found = model_of(contents.specimen(history.specimen), history)
        if len(models) < MOST_MODELS:
            models |= found
    return models | network_of(contents)


def network_of(contents: PageContents) -> dict[str, str]:
    """{name: data} of the page's surrogate where it is a network that a page can have; else {}."""
    if not isinstance(contents.surrogate, ParameterSurrogate):
        return {}
    try:
        return dict([_named("network", network_data(contents.surrogate))])
    except SurrogateError:  # one that corrects another model
        return {}


def model_of(specimen: Specimen, history: History | None = None) -> dict[str, str]:
    """{name: data} of the model of a specimen, or of the piece and the observation of a test; {} for no model."""
    if not isinstance(specimen, Bulge):
        return {}
    if history is not None:
        lengths = {name: history.geometry[name] for name in specimen.geometry.lengths if name in history.geometry}
        specimen = specimen.replace(**lengths, observation=specimen.observation_of(history))
    try:
        return dict([_packed(specimen)])
    except CreepkitError:  # of rings, say, which the runtime does not know
        return {}


@lru_cache(maxsize=16)
def _packed(specimen: Bulge) -> tuple[str, str]:
    return _named("dimple", rom_data(BulgeReducedOrderModel(specimen)))


def _named(kind: str, data: Mapping[str, Any]) -> tuple[str, str]:
    """A name that follows from the content, so that several pages in one document may share it, and the JSON."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:12]}", text
