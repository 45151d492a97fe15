"""Surrogates by name (those shipped with creepkit) or from a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from creepkit import registry
from creepkit.errors import CreepkitError, SurrogateError, nearest
from creepkit.files import safetensors_files
from creepkit.language.law_codec import law_from_json
from creepkit.sampling.conditions import TimeGrid
from creepkit.specimens.documents import specimen_from_json
from creepkit.surrogates.applicability_domain import ApplicabilityDomain
from creepkit.surrogates.recipe import SurrogateMetadata, Training
from creepkit.surrogates.surrogate import Recipe, Surrogate

WEIGHTS_FOLDER = Path(__file__).with_name("weights")


SUFFIX = ".safetensors"


def shipped_files() -> dict[str, Path]:
    """{name: file} of the surrogates inside the package."""
    return {path.name.removesuffix(SUFFIX): path for path in sorted(WEIGHTS_FOLDER.glob(f"*{SUFFIX}"))}


def surrogate_by_name(name_or_path: str | Path) -> Surrogate:
    """The surrogate of this name, or in this file."""
    files, text = shipped_files(), str(name_or_path)
    if isinstance(name_or_path, str) and text in files:
        return load_surrogate(files[text])
    if not (text.endswith(SUFFIX) or Path(text).exists()):
        raise SurrogateError(f"no surrogate is called '{text}', and there is no such file; {nearest(text, files)}")
    return load_surrogate(text)


RECIPE_CLASSES = {
    "parameter-gru": "creepkit.surrogates.parameter_gru:ParameterGru",
    "rate-net": "creepkit.surrogates.rate_net:RateNet",
}
"""{kind: where its recipe is}; the recipe makes the network that the weights of a file belong to."""


def load_surrogate(path: str | Path) -> Surrogate:
    """Return the surrogate in a file; SurrogateError says what is wrong with any other file."""
    tensors, header = safetensors_files.read_safetensors(path)
    if header["kind"] == "checkpoint":
        raise SurrogateError(f"{path}: a training that was interrupted; run the same training again to finish it")
    try:
        recipe = recipe_from_config(header["kind"], header["config"])
        metadata = _metadata_from_header(header, str(path))
        module = recipe.empty_module(metadata)
        module.load_state_dict(tensors)
    except CreepkitError as error:
        raise SurrogateError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError):
        raise SurrogateError(f"{path}: its header and its weights do not belong together; train it again") from None
    return recipe.surrogate(module, metadata)


def recipe_from_config(kind: str, config: Mapping[str, Any]) -> Recipe:
    """The recipe with these fields."""
    if kind not in RECIPE_CLASSES:
        raise SurrogateError(f"kind '{kind}' is unknown here (known: {', '.join(RECIPE_CLASSES)}); update creepkit")
    module, _, name = RECIPE_CLASSES[kind].partition(":")
    recipe_class: Any = getattr(import_module(module), name)
    field_names = {f.name for f in fields(recipe_class) if f.init}
    values = {name: tuple(v) if isinstance(v, list) else v for name, v in config.items() if name in field_names}
    recipe: Recipe = recipe_class(**{**values, "training": Training(**config["training"])})
    return recipe


def _metadata_from_header(header: Mapping[str, Any], source: str) -> SurrogateMetadata:
    return SurrogateMetadata(
        law=law_from_json(header["law"], source),
        specimen=specimen_from_json(header["specimen"], source, registry.default_registry().specimen),
        outputs=tuple(header["outputs"]),
        grid=TimeGrid(np.array(header["grid"]["values"], float), bool(header["grid"]["relative"])),
        parameters=tuple(header["parameters"]),
        conditions=tuple(header["conditions"]),
        scaling=header["scaling"],
        domain=None if header["domain"] is None else ApplicabilityDomain.from_document(header["domain"]),
        metrics=header["metrics"],
        curves=header["curves"],
        provenance=header["provenance"],
        notes=tuple(header["notes"]),
    )
