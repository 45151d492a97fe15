"""Specimen: a predictor that is the record of a test piece, and what files, data sets and cameras ask of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from creepkit.errors import SolveError
from creepkit.records.predictor import Predictor
from creepkit.records.presentable import NotebookCell

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.records.camera_frames import SurfaceObservation, SurfacePoints, SurfaceRegion
    from creepkit.records.history import History
    from creepkit.records.loading import Loading


class Specimen(Predictor, NotebookCell):
    """A frozen record of a test piece: which outputs are observed, and how to predict them.

    dataset_names : {general name of a condition: its own}. surrogate_name : of its
        reduced-order model among the surrogates. load_scaling : reference stresses of many tests at once, see
        specimens.load_scaling. frame_interval : s between frames of a planned test. threads : that predict.
    is_watched : whether cameras watch its flat surface, so that it has a region and three methods of it.
    draws_section : whether its runs can draw their section.
    """

    dataset_names: ClassVar[Mapping[str, str]] = {}
    surrogate_name: ClassVar[str] = ""
    load_scaling: ClassVar[Any] = None
    frame_interval: ClassVar[float | None] = None
    threads: int | None = 1
    is_watched: ClassVar[bool] = False
    draws_section: ClassVar[bool] = False

    def of_test(self, history: History, nuisances: Mapping[str, float]) -> tuple[Specimen, History]:
        """The test piece and the history of one test, as that test and its nuisances {kind: value} say."""
        return self, history

    def planned_loading(self, levels: tuple[float, float], jump_time: float) -> Loading | None:
        """The loading of a test with two levels, the second from `jump_time`, s, on; None where it does not say."""
        return None

    @property
    def surface_region(self) -> SurfaceRegion:
        """Which part of the surface moves and which is clamped."""
        raise self._unwatched

    def surface_operator(self, window: float | None = None, radii: Sequence[float] = ()) -> str:
        """The text of the operator within a window, mm, or at radii, mm; by default the region's own."""
        raise self._unwatched

    def surface_center(self, points: SurfacePoints) -> tuple[Floats, Floats]:
        """The one centre of all frames, (2,) mm, and its covariance, (2, 2) mm2, if points err independently.

        FitError where the points show no centre.
        """
        raise self._unwatched

    def observe_surface(self, points: SurfacePoints, operator: str) -> SurfaceObservation:
        """The outputs of each frame, of points about the centre; SolveError for an operator not understood."""
        raise self._unwatched

    @property
    def _unwatched(self) -> SolveError:
        return SolveError(f"specimen '{self.label}' does not say how cameras see it")
