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
from creepkit.dataset.specimen_document import specimen_document, specimen_of
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import CreepkitError, SurrogateError
from creepkit.language.tree import law_from_json, law_to_json
from creepkit.records import Effects, History, Prediction, Predictor
from creepkit.specimens.bulge import Bulge
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.surrogate import files
from creepkit.surrogate.domain import Domain
from creepkit.surrogate.matching import check_asked
from creepkit.surrogate.recipe import Module, Recipe, Told, Training
from creepkit.surrogate.table import table

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen

KINDS = {
    "parameter-gru": "creepkit.surrogate.parameter_gru:ParameterGru",
    "rate-net": "creepkit.surrogate.rate_net:RateNet",
}
"""{kind: where its recipe is}; the recipe makes the network that the weights of a file belong to."""


class Surrogate(ABC):
    """A trained network in the place of a specimen; a records.Predictor.

    recipe, module, told : what it was trained as, its network (on the CPU), and what it knows of its training.
    """

    effects: tuple[str, ...] = ()
    """Kinds of explicit nuisances that predict() understands."""

    def __init__(self, recipe: Recipe, module: Module, told: Told) -> None:
        self.recipe, self.module, self.told = recipe, module.eval(), told

    @property
    def name(self) -> str:
        """Which kind of surrogate it is, and of what."""
        return f"{self.recipe.kind} of {self.specimen.name}"

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.specimen.title}, by a network ({self.recipe.kind}) trained on law '{self.told.law.name}'"

    @property
    def specimen(self) -> Specimen:
        """What it stands for."""
        return self.told.specimen

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is predicted."""
        return self.told.outputs

    @abstractmethod
    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor.

        A row outside the domain of the training has its values all the same, and Status.OUTSIDE_DOMAIN.
        """

    @property
    def error(self) -> dict[str, float]:
        """{output: standard deviation of its error}, in the output's unit, as validation saw it.

        1.25 times the mean absolute error, that of a Gaussian: rare large errors would make every answer unsure.
        """
        outputs = self.told.metrics.get("outputs", {})
        return {name: 1.2533 * float(m["mae"]) for name, m in outputs.items() if "mae" in m}

    def screening(self) -> Predictor:
        """A stand-in for searches: that of the specimen, if it has one, else the network itself."""
        offered = getattr(self.specimen, "screening", None)
        return self if offered is None else offered()

    def stands_for(self, specimen: object, histories: Sequence[History]) -> bool:
        """Whether it was trained on this specimen, but for its apex thickness and threads, and knows such histories."""
        if _told_apart(specimen) != _told_apart(self.specimen):
            return False
        try:
            check_asked(self.told, histories, (), self.effects)
        except SurrogateError:
            return False
        return True

    def reference_stress(self, history: History) -> Floats:
        """The von Mises stresses, MPa, that stand for the test: the specimen's, or those that are prescribed."""
        offered = getattr(self.specimen, "reference_stress", None)
        if offered is not None:
            return np.asarray(offered(history))
        levels = np.unique(history.loading.program().values)
        return np.asarray(levels[levels > 0])

    @property
    def header(self) -> dict[str, Any]:
        """Everything that a file says beside the weights."""
        told = self.told
        return {
            "kind": self.recipe.kind,
            "config": asdict(self.recipe),  # type: ignore[call-overload]
            "law": law_to_json(told.law),
            "specimen": specimen_document(told.specimen),
            "grid": told.grid.document(),
            "outputs": list(told.outputs),
            "parameters": list(told.parameters),
            "conditions": list(told.conditions),
            "scaling": dict(told.scaling),
            "domain": None if told.domain is None else told.domain.document(),
            "metrics": dict(told.metrics),
            "curves": dict(told.curves),
            "provenance": dict(told.provenance),
            "notes": list(told.notes),
        }

    def save(self, path: str | Path) -> Path:
        """Write the weights with their header."""
        return files.write(path, self.module.state_dict(), self.header)

    def __str__(self) -> str:
        return table(self.title, self.told)

    def __repr__(self) -> str:
        return f"<Surrogate: {self.title}>"


def _told_apart(specimen: object) -> object:
    """A specimen without what a surrogate is free of."""
    if isinstance(specimen, Bulge):
        return specimen.replace(threads=None, apex_thickness=DimpleGeometry().apex_thickness)
    return specimen


def load(path: str | Path) -> Surrogate:
    """Return the surrogate in a file; SurrogateError says what is wrong with any other file."""
    tensors, header = files.read(path)
    if header["kind"] == "checkpoint":
        raise SurrogateError(f"{path}: a training that was interrupted; run the same training again to finish it")
    try:
        recipe = recipe_of(header["kind"], header["config"])
        told = _told(header, str(path))
        module = recipe.blank(told)
        module.load_state_dict(tensors)
    except CreepkitError as error:
        raise SurrogateError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError):
        raise SurrogateError(f"{path}: its header and its weights do not belong together; train it again") from None
    return recipe.surrogate(module, told)


def recipe_of(kind: str, config: Mapping[str, Any]) -> Recipe:
    """The recipe with these fields."""
    if kind not in KINDS:
        raise SurrogateError(f"kind '{kind}' is unknown here (known: {', '.join(KINDS)}); update creepkit")
    module, _, name = KINDS[kind].partition(":")
    made: Any = getattr(import_module(module), name)
    known = {f.name for f in fields(made) if f.init}
    values = {name: tuple(v) if isinstance(v, list) else v for name, v in config.items() if name in known}
    recipe: Recipe = made(**{**values, "training": Training(**config["training"])})
    return recipe


def _told(header: Mapping[str, Any], source: str) -> Told:
    return Told(
        law=law_from_json(header["law"], source),
        specimen=specimen_of(header["specimen"], source),
        outputs=tuple(header["outputs"]),
        grid=TimeGrid(np.array(header["grid"]["values"], float), bool(header["grid"]["relative"])),
        parameters=tuple(header["parameters"]),
        conditions=tuple(header["conditions"]),
        scaling=header["scaling"],
        domain=None if header["domain"] is None else Domain.from_document(header["domain"]),
        metrics=header["metrics"],
        curves=header["curves"],
        provenance=header["provenance"],
        notes=tuple(header["notes"]),
    )
