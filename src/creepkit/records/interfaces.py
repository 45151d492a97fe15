"""The plugin interfaces: predictors, specimens, readers and exporters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language.law import CreepLaw
    from creepkit.records.camera_frames import SurfaceObservation, SurfacePoints, SurfaceRegion
    from creepkit.records.history import History
    from creepkit.records.law_with_values import LawWithValues
    from creepkit.records.prediction import NuisanceValues, Prediction


@runtime_checkable
class Reader(Protocol):
    """Turns measured files into histories."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""

    @property
    def title(self) -> str:
        """One line for people."""

    def accepts(self, path: Path) -> bool:
        """Say whether this reader understands the file or folder, without reading all of it."""

    def read(self, path: Path) -> list[History]:
        """Return the histories in the file or folder; HistoryError with file and line when it cannot."""


@runtime_checkable
class Exporter(Protocol):
    """Writes a law with its values as text: to read, or for another program.

    Optional attribute: `serves`, other words that users ask for it by, such as ("umat",).
    """

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""

    @property
    def title(self) -> str:
        """One line for people."""

    @property
    def suffix(self) -> str:
        """Ending of a file's name, with its dot."""

    def text(self, source: LawWithValues) -> str:
        """Return the text; notes (intervals, validity) become comments.

        ExportError, with the reason, when the target cannot express the law or its units.
        """


@runtime_checkable
class Predictor(Protocol):
    """Anything that predicts histories from a law and its internal values: specimen, surrogate or closed form.

    Optional attributes, looked for by name: `outputs`, the names of what is predicted, first the one that grows with
    creep; `optional_outputs` and `outputs_of_test(history)`, where a test decides what is observed of it, as by its
    operator: all that may be, and what is; `nuisances`, the kinds of explicit nuisances that predict() understands
    (none without it); `program_nuisances`, those of PROGRAM_NUISANCES that predict() takes and differentiates itself
    (without it they become other programs of the histories);
    `reference_stress(history)`, the von Mises stress, MPa, that stands for the test (a number, or one for each level
    of its loading); `reduced_order_model()`, `refined()` and `for_search()`, see SupportsReducedOrderModel,
    SupportsRefinement and SupportsSearchTolerance; `specimen`, that a surrogate stands for; `outside_class(law)`, why
    it does not know the class of a law, in a sentence, or "" where it does; `model_text(histories)`, how it predicts
    these tests, in sentences for a paper: what is solved, discretisation, integration in time, tolerances, rupture.
    """

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict each history's outputs at its times.

        theta : (candidates, parameters) internal values in the order of law.names, see CreepLaw.to_internal: the
            natural logarithm where the scale is log, -inf for a coefficient that is off.
        nuisances : {key: (candidates or 1, tests)} of what differs from test to test, measured as Nuisance says. A
            kind that the predictor does not know is a SolveError.
        sensitivities : whether the prediction has its derivatives with respect to theta, in `jacobian`, and to the
            kinds of nuisances given, in `nuisance_jacobian`.
        """


@runtime_checkable
class SupportsRupturePrediction(Predictor, Protocol):
    """A predictor that follows a specimen to its rupture, beyond the last time of its history."""

    def predict_to_rupture(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], *, sensitivities: bool = False
    ) -> Prediction:
        """Predict as predict() does, with `times_to_strain`: when measured strains are reached, and when it ruptures.

        theta : (candidates, parameters) internal values.
        """


@runtime_checkable
class SupportsReducedOrderModel(Predictor, Protocol):
    """A predictor too expensive for a global search, with a cheap model of the same outputs and nuisances."""

    def reduced_order_model(self) -> Predictor:
        """Return the reduced-order model; it may be some per cent off and need not know derivatives."""


@runtime_checkable
class SupportsTraining(Predictor, Protocol):
    """A reduced-order model that is trained before it predicts, as one of finite elements is."""

    def train(self) -> str:
        """Train it, where that was not done before, and keep it; what it is, in a few words."""

    @property
    def error(self) -> Mapping[str, float]:
        """{output: standard deviation of its error}, in the output's unit, from runs that training did not see."""


@runtime_checkable
class SupportsRefinement(Predictor, Protocol):
    """A predictor with an error of its own, and a more exact one of the same outputs and nuisances.

    Of a specimen in finite elements: the same on a finer mesh in smaller steps. Of a surrogate: the specimen.
    """

    def refined(self) -> Predictor:
        """Return the more exact predictor; a few runs of it may cost as much as the rest of an identification."""


@runtime_checkable
class SupportsSearchTolerance(Predictor, Protocol):
    """A predictor whose own error may be larger while a global search looks for minima, which is cheaper."""

    def for_search(self) -> Predictor:
        """Return the same predictor at such tolerances; its error is far below that of any measurement."""


@runtime_checkable
class SupportsSurfaceObservation(Protocol):
    """A specimen whose flat surface cameras watch: how its outputs follow from measured points."""

    @property
    def surface_region(self) -> SurfaceRegion:
        """Return which part of the surface moves and which is clamped."""

    def surface_operator(self, window: float | None = None, radii: Sequence[float] = ()) -> str:
        """Return the text of the operator within a window, mm, or at radii, mm; by default the region's own.

        SolveError where it cannot be.
        """

    def surface_center(self, points: SurfacePoints) -> tuple[Floats, Floats]:
        """Return the one centre of all frames, (2,) mm, and its covariance, (2, 2) mm2, if points err independently.

        FitError where the points show no centre.
        """

    def observe_surface(self, points: SurfacePoints, operator: str) -> SurfaceObservation:
        """Return the outputs of each frame, of points about the centre; SolveError for an operator not understood."""


@runtime_checkable
class Specimen(Predictor, Protocol):
    """A frozen record of a test piece: which outputs are observed, and how to predict them.

    Optional attributes, looked for by name, beside those of a predictor: `loads`, `dimensions`; and for data sets
    `conditions`, {load, "modulus", "temperature", "end_time" or length: (lowest, highest)}, the default ranges, in
    their units; `growth_per_strain(history)`, the growth or fall of the output that shows creep for each unit of creep
    strain at the reference stress; `planned_loading(levels, jump_time)`, the loading of a test with two levels;
    `load_scaling`, both for many tests at once, see specimens.load_scaling; `dataset_names`, {general name of a
    condition: its own}; `surrogate_name`, that of its reduced-order model among the surrogates.
    """

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""

    @property
    def title(self) -> str:
        """One line for people."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is observed."""
