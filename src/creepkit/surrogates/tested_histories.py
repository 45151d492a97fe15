"""Histories before a surrogate: which tests it applies to, its frames, and what the instrument of a test shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SurrogateError
from creepkit.records import History, Specimen, dimension_named, outputs_of
from creepkit.sampling.conditions import TimeGrid
from creepkit.sampling.specimen_conditions import specimen_conditions
from creepkit.surrogates.recipe import SurrogateMetadata

RELATIVE_TOLERANCE = 1e-6


def check_history(metadata: SurrogateMetadata, history: History) -> None:
    """SurrogateError where a history is of another kind of test than those of the training."""
    where, specimen = history.origin, metadata.specimen
    quantity = specimen_conditions(specimen).load.name
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
    _check_lengths(where, metadata, history)


def _check_lengths(where: str, metadata: SurrogateMetadata, history: History) -> None:
    """Lengths must be those of the specimen, but for those that the applicability domain checks.

    These are the lengths that were varied, and those that differ from test piece to test piece.
    """
    for name, value in history.geometry.items():
        length = dimension_named(metadata.specimen, name)
        if length is None or length.tolerance > 0.0 or length.name in metadata.conditions:
            continue
        if abs(length.default - value) > RELATIVE_TOLERANCE * length.default:
            raise SurrogateError(f"{where}: {name} is {value:g} mm; the surrogate was trained on {length.default:g} mm")


def prediction_frames(grid: TimeGrid, histories: Sequence[History]) -> list[Floats]:
    """The times (frames,) s of the network for each history: as many for all, as far as the longest needs."""
    if grid.relative:
        return [grid.times(float(h.times[-1])) for h in histories]
    last = max(float(h.times[-1]) for h in histories)
    count = min(int(np.searchsorted(grid.values, last * (1 - RELATIVE_TOLERANCE))) + 1, grid.values.size)
    return [grid.values[:count]] * len(histories)


def interpolation_weights(frames: Floats, times: Floats) -> Floats:
    """(times, frames) weights: linear in time between frames, constant before the first and beyond the last.

    frames : (frames,) s. times : (times,) s.
    """
    position = np.interp(times, frames, np.arange(frames.size, dtype=float))
    below = np.minimum(position.astype(int), frames.size - 1)
    fraction, rows = position - below, np.arange(times.size)
    weights = np.zeros((times.size, frames.size))
    weights[rows, below] = 1.0 - fraction
    weights[rows, np.minimum(below + 1, frames.size - 1)] += fraction
    return weights


def observed_outputs(specimen: Specimen, history: History, values: Floats) -> Floats:
    """What a history's instrument shows, (candidates, times, outputs): of a creep strain, its own measure of strain.

    values : (candidates, times, outputs) of the network.
    """
    observe = _strain_method(specimen, "observed_output")
    return values if observe is None else np.asarray(observe(history, values[..., 0]))[..., None]


def observation_derivative(specimen: Specimen, history: History, values: Floats) -> Floats:
    """Derivative of what is shown to what the network gives, values (candidates, times, outputs); of that shape."""
    derivative = _strain_method(specimen, "output_derivative")
    return np.ones_like(values) if derivative is None else np.asarray(derivative(history, values[..., 0]))[..., None]


def _strain_method(specimen: Specimen, name: str) -> Any:
    """A method of creep strain of a specimen whose only output is a strain; None of others, which show one thing."""
    outputs = outputs_of(specimen)
    only_strain = len(outputs) == 1 and outputs[0].quantity == "strain"
    return getattr(specimen, name, None) if only_strain else None
