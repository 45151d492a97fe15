"""Whether a history is one that a surrogate can speak of, and at which frames it is to be asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import test_kind
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import SurrogateError
from creepkit.records import History, Specimen
from creepkit.surrogate.recipe import SurrogateMetadata

CONTROLLED_QUANTITY = {"bulge": "pressure", "uniaxial": "stress"}
"""What drives the tests of each kind of specimen."""
RELATIVE_TOLERANCE = 1e-6


def check_applicable(metadata: SurrogateMetadata, histories: Sequence[History], nuisances: Iterable[str], known_nuisances: Sequence[str]) -> None:
    """SurrogateError where a history, or an explicit nuisance, is none that the surrogate knows."""
    for history in histories:
        check_history(metadata, history)
    for kind in nuisances:
        if kind not in known_nuisances:
            names = ", ".join(known_nuisances) or "none"
            raise SurrogateError(f"this surrogate does not know the nuisance '{kind}'; it knows {names}")


def check_history(metadata: SurrogateMetadata, history: History) -> None:
    """SurrogateError where a history is of another kind of test than those of the training."""
    where, specimen = history.source or f"history '{history.name}'", metadata.specimen
    quantity = CONTROLLED_QUANTITY[test_kind(specimen)]
    if history.loading.quantity != quantity:
        raise SurrogateError(f"{where}: its {history.loading.quantity} is prescribed; the surrogate knows {quantity}")
    control = getattr(history.loading, "control", None)
    if control not in (None, "load") and quantity == "stress" and metadata.provenance.get("control", "load") != control:
        raise SurrogateError(f"{where}: true stress is held, and the surrogate was trained under held loads")
    last = float(history.times[-1])
    if not metadata.grid.relative and last > metadata.grid.end * (1 + RELATIVE_TOLERANCE):
        raise SurrogateError(
            f"{where}: it lasts {last:g} s, and the surrogate was trained up to {metadata.grid.end:g} s; leave later "
            "frames out or train on longer tests"
        )
    observation = getattr(specimen, "observation", None)
    if observation is not None and history.operator and history.operator != str(observation):
        raise SurrogateError(f"{where}: observed by '{history.operator}'; the surrogate was trained on '{observation}'")
    _check_lengths(where, history, getattr(specimen, "geometry", None))


def _check_lengths(where: str, history: History, geometry: Any) -> None:
    """Lengths but the apex thickness, which the domain guard watches, must be those of the specimen."""
    for name, value in history.geometry.items():
        trained = getattr(geometry, name, None)
        if name != "apex_thickness" and trained is not None and abs(float(trained) - value) > RELATIVE_TOLERANCE * abs(float(trained)):
            raise SurrogateError(f"{where}: {name} is {value:g} mm; the surrogate was trained on {float(trained):g} mm")


def prediction_frames(grid: TimeGrid, histories: Sequence[History]) -> list[Floats]:
    """The frames, s, at which the network is asked for each history: as many for all, as far as the longest needs."""
    if grid.relative:
        return [grid.times(float(h.times[-1])) for h in histories]
    last = max(float(h.times[-1]) for h in histories)
    count = min(int(np.searchsorted(grid.values, last * (1 - RELATIVE_TOLERANCE))) + 1, grid.values.size)
    return [grid.values[:count]] * len(histories)


def interpolation_weights(frames: Floats, times: Floats) -> Floats:
    """(times, frames): linear in time between frames, constant before the first and beyond the last."""
    position = np.interp(times, frames, np.arange(frames.size, dtype=float))
    below = np.minimum(position.astype(int), frames.size - 1)
    fraction, rows = position - below, np.arange(times.size)
    weights = np.zeros((times.size, frames.size))
    weights[rows, below] = 1.0 - fraction
    weights[rows, np.minimum(below + 1, frames.size - 1)] += fraction
    return weights


def observed_outputs(specimen: Specimen, history: History, values: Floats) -> Floats:
    """What a history's instrument shows, (candidates, times, outputs): of a bar's creep strain, its own measure."""
    observe: Any = getattr(specimen, "shown", None)
    return values if observe is None else np.asarray(observe(history, values[..., 0]))[..., None]


def observation_derivative(specimen: Specimen, history: History, values: Floats) -> Floats:
    """Derivative of what is shown to what the network gives, (candidates, times, outputs)."""
    derivative: Any = getattr(specimen, "slope", None)
    return np.ones_like(values) if derivative is None else np.asarray(derivative(history, values[..., 0]))[..., None]
