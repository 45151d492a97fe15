"""Checkpoints: a training after its last whole epoch, beside the file that it is to become."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.dataset.specimen_document import specimen_document
from creepkit.errors import SurrogateError
from creepkit.surrogate import files
from creepkit.surrogate.fitting import Fit
from creepkit.surrogate.recipe import Recipe

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

KIND = "checkpoint"


def fingerprint(data: Dataset) -> str:
    """Identity of what can be learnt from a data set: 16 hexadecimal digits."""
    told = [data.law.fingerprint, specimen_document(data.specimen), data.grid.relative, data.outputs]
    digest = hashlib.sha256(json.dumps([*told, data.parameter_names, data.condition_names]).encode())
    for array in (data.grid.values, data.parameters, data.conditions, data.values):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def call_of(data: Dataset, recipe: Recipe, seed: int) -> dict[str, Any]:
    """What was asked for, as JSON-able data: the same call goes on where it was interrupted."""
    config: Any = asdict(recipe)  # type: ignore[call-overload]
    called: dict[str, Any] = json.loads(
        json.dumps({"data": fingerprint(data), "kind": recipe.kind, "recipe": config, "seed": seed})
    )
    return called


class Checkpoint:
    """Where a training leaves what it needs to go on; without a path it leaves nothing."""

    def __init__(self, to: Path | None, call: Mapping[str, Any]) -> None:
        self.path = None if to is None else to.with_name(f"{to.name}.checkpoint")
        self.call = dict(call)

    def save(self, fit: Fit) -> None:
        """Leave a fit as it is, in the place of what was left before."""
        if self.path is not None:
            files.write(self.path, fit.state(), {"kind": KIND, "call": self.call, "curves": fit.curves})

    def restore(self, fit: Fit) -> None:
        """Bring a fresh fit to where the same call was interrupted, if it was."""
        if self.path is None or not self.path.exists():
            return
        tensors, header = files.read(self.path)
        if header["kind"] != KIND:
            raise SurrogateError(f"{self.path}: not a checkpoint of a training; remove it, or choose another name")
        if header.get("call") != self.call:
            other = ", ".join(_differences(self.call, header.get("call") or {}))
            raise SurrogateError(
                f"{self.path}: left by another training (it differs in {other}); finish that one, remove the file, or "
                "choose another name"
            )
        try:
            fit.restore(tensors, header["curves"])
        except (KeyError, RuntimeError, ValueError, AttributeError):
            raise SurrogateError(f"{self.path}: this checkpoint is damaged; remove it to begin again") from None

    def remove(self) -> None:
        """The training is done and its file written."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def _differences(one: Any, other: Any, place: str = "") -> list[str]:
    """The names of what two calls do not share."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        names = dict.fromkeys([*one, *other])
        return [found for name in names for found in _differences(one.get(name), other.get(name), name)]
    return [] if one == other else [place]
