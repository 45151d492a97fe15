"""Surrogates: trained networks as predictors, and as files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.dataset.specimen_document import specimen_to_json, specimen_from_json
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import CreepkitError, SurrogateError
from creepkit.language.tree import law_from_json, law_to_json
from creepkit.records import NuisanceValues, History, Prediction, Predictor
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.surrogate import files
from creepkit.surrogate.domain import ApplicabilityDomain
from creepkit.surrogate.matching import check_applicable
from creepkit.surrogate.recipe import SurrogateModule, Recipe, SurrogateMetadata, Training
from creepkit.surrogate.table import surrogate_text

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen

RECIPE_CLASSES = {
    "parameter-gru": "creepkit.surrogate.parameter_gru:ParameterGru",
    "rate-net": "creepkit.surrogate.rate_net:RateNet",
}
"""{kind: where its recipe is}; the recipe makes the network that the weights of a file belong to."""


class Surrogate(ABC):
    """A trained network in the place of a specimen; a records.Predictor.

    recipe, module, told : what it was trained as, its network (on the CPU), and what it knows of its training.
    """

    nuisances: tuple[str, ...] = ()
    """Kinds of explicit nuisances that predict() understands."""

    def __init__(self, recipe: Recipe, module: SurrogateModule, metadata: SurrogateMetadata) -> None:
        self.recipe, self.module, self.metadata = recipe, module.eval(), metadata

    @property
    def name(self) -> str:
        """Which kind of surrogate it is, and of what."""
        return f"{self.recipe.kind} of {self.specimen.name}"

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.specimen.title}, by a network ({self.recipe.kind}) trained on law '{self.metadata.law.name}'"

    @property
    def specimen(self) -> Specimen:
        """What it stands for."""
        return self.metadata.specimen

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is predicted."""
        return self.metadata.outputs

    @abstractmethod
    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        nuisances: NuisanceValues | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor.

        A row outside the domain of the training has its values all the same, and Status.OUTSIDE_DOMAIN.
        """

    @property
    def error(self) -> dict[str, float]:
        """{output: standard deviation of its error}, in the output's unit, as validation saw it.

        1.25 times the mean absolute error, that of a Gaussian: rare large errors would make every answer unsure.
        """
        outputs = self.metadata.metrics.get("outputs", {})
        return {name: 1.2533 * float(errors["mae"]) for name, errors in outputs.items() if "mae" in errors}

    def screening(self) -> Predictor:
        """A stand-in for searches: that of the specimen, if it has one, else the network itself."""
        screening_model = getattr(self.specimen, "reduced_order_model", None)
        return self if screening_model is None else screening_model()

    def applies_to(self, specimen: object, histories: Sequence[History]) -> bool:
        """Whether it was trained on this specimen, but for its apex thickness and threads, and knows such histories."""
        if _without_free_fields(specimen) != _without_free_fields(self.specimen):
            return False
        try:
            check_applicable(self.metadata, histories, (), self.nuisances)
        except SurrogateError:
            return False
        return True

    def reference_stress(self, history: History) -> Floats:
        """The von Mises stresses, MPa, that stand for the test: the specimen's, or those that are prescribed."""
        specimen_stress = getattr(self.specimen, "reference_stress", None)
        if specimen_stress is not None:
            return np.asarray(specimen_stress(history))
        levels = np.unique(history.loading.program().values)
        return np.asarray(levels[levels > 0])

    @property
    def file_header(self) -> dict[str, Any]:
        """Everything that a file says beside the weights."""
        metadata = self.metadata
        return {
            "kind": self.recipe.kind,
            "config": asdict(self.recipe),  # type: ignore[call-overload]
            "law": law_to_json(metadata.law),
            "specimen": specimen_to_json(metadata.specimen),
            "grid": metadata.grid.document(),
            "outputs": list(metadata.outputs),
            "parameters": list(metadata.parameters),
            "conditions": list(metadata.conditions),
            "scaling": dict(metadata.scaling),
            "domain": None if metadata.domain is None else metadata.domain.document(),
            "metrics": dict(metadata.metrics),
            "curves": dict(metadata.curves),
            "provenance": dict(metadata.provenance),
            "notes": list(metadata.notes),
        }

    def save(self, path: str | Path) -> Path:
        """Write the weights with their header."""
        return files.write_safetensors(path, self.module.state_dict(), self.file_header)

    def __str__(self) -> str:
        return surrogate_text(self.title, self.metadata)

    def __repr__(self) -> str:
        return f"<Surrogate: {self.title}>"


def _without_free_fields(specimen: object) -> object:
    """A specimen without what a surrogate is free of."""
    if isinstance(specimen, Bulge):
        return specimen.replace(threads=None, apex_thickness=DimpleGeometry().apex_thickness)
    return specimen


def load_surrogate(path: str | Path) -> Surrogate:
    """Return the surrogate in a file; SurrogateError says what is wrong with any other file."""
    tensors, header = files.read_safetensors(path)
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
        specimen=specimen_from_json(header["specimen"], source),
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
