"""Checkpoints: a training after its last whole epoch, beside the file that it is to become."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.dataset.specimen_document import specimen_to_json
from creepkit.errors import SurrogateError
from creepkit.surrogate import files
from creepkit.surrogate.fitting import NetworkTraining
from creepkit.surrogate.recipe import Recipe

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

CHECKPOINT_KIND = "checkpoint"


def dataset_fingerprint(data: Dataset) -> str:
    """Identity of what can be learnt from a data set: 16 hexadecimal digits."""
    document = [data.law.fingerprint, specimen_to_json(data.specimen), data.grid.relative, data.outputs]
    digest = hashlib.sha256(json.dumps([*document, data.parameter_names, data.condition_names]).encode())
    for array in (data.grid.values, data.parameters, data.conditions, data.values):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def training_request(data: Dataset, recipe: Recipe, seed: int) -> dict[str, Any]:
    """What was asked for, as JSON-able data: the same call goes on where it was interrupted."""
    config: Any = asdict(recipe)  # type: ignore[call-overload]
    request: dict[str, Any] = json.loads(
        json.dumps({"data": dataset_fingerprint(data), "kind": recipe.kind, "recipe": config, "seed": seed})
    )
    return request


class Checkpoint:
    """Where a training leaves what it needs to go on; without a path it leaves nothing."""

    def __init__(self, result_path: Path | None, request: Mapping[str, Any]) -> None:
        self.path = None if result_path is None else result_path.with_name(f"{result_path.name}.checkpoint")
        self.request = dict(request)

    def save(self, state_of_training: NetworkTraining) -> None:
        """Leave a fit as it is, in the place of what was left before."""
        if self.path is not None:
            files.write_safetensors(self.path, state_of_training.state(), {"kind": CHECKPOINT_KIND, "call": self.request, "curves": state_of_training.curves})

    def restore(self, state_of_training: NetworkTraining) -> None:
        """Bring a fresh fit to where the same call was interrupted, if it was."""
        if self.path is None or not self.path.exists():
            return
        tensors, header = files.read_safetensors(self.path)
        if header["kind"] != CHECKPOINT_KIND:
            raise SurrogateError(f"{self.path}: not a checkpoint of a training; remove it, or choose another name")
        if header.get("call") != self.request:
            differences = ", ".join(_differences(self.request, header.get("call") or {}))
            raise SurrogateError(
                f"{self.path}: left by another training (it differs in {differences}); finish that one, remove the file, or "
                "choose another name"
            )
        try:
            state_of_training.restore(tensors, header["curves"])
        except (KeyError, RuntimeError, ValueError, AttributeError):
            raise SurrogateError(f"{self.path}: this checkpoint is damaged; remove it to begin again") from None

    def remove(self) -> None:
        """The training is done and its file written."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def _differences(first: Any, second: Any, path: str = "") -> list[str]:
    """The names of what two calls do not share."""
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        names = dict.fromkeys([*first, *second])
        return [difference for name in names for difference in _differences(first.get(name), second.get(name), name)]
    return [] if first == second else [path]
