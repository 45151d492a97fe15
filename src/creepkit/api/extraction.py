"""From camera frames to measured outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.errors import HistoryError
from creepkit.records import Loading, Program, SupportsSurfaceObservation
from creepkit.registry.arguments import resolve_predictor

if TYPE_CHECKING:
    from creepkit.extraction import Extraction
    from creepkit.extraction.domes import Centers
    from creepkit.records import Frames, Specimen


def extract(
    frames: Frames,
    specimen: Specimen | str = "bulge",
    *,
    operator: str | None = None,
    centers: Centers | None = None,
    rest: slice | None = None,
    subset: float = 0.0,
    loading: Loading | float | None = None,
    temperature: float | Program | None = None,
) -> list[Extraction]:
    """Extract the outputs of every test piece in the field of view, with their noise, and flag bad frames.

    specimen : one that cameras can watch, or its name. operator : what is made of the points, as in "field 0-7.5 mm",
    Eq. (7) of the paper within a window, or "rings 0, 2, 4 mm", mean displacements there; None for the specimen's own.
    centers : {name: (x, y)} or [(x, y), ...] in mm, in the axes of the frames, where they shall not be found.
    rest : frames without load, as slice(0, 40), where they shall not be found. subset : mm, side of the camera's
    subsets, whose smoothing is taken out of the outputs; 0 leaves it in.
    loading : a record of the load whose program counts from the first frame, or a constant load, MPa. temperature : K.
    With both, each extraction has a history; `Extraction.history_under` makes one later, as from an instrument record.

    >>> extractions = ck.extract(frames, subset=1.2)  # doctest: +SKIP
    """
    from creepkit.extraction import extract_surfaces

    watched = _watched(specimen)
    program = loading.program() if isinstance(loading, Loading) else None
    load = None if program is None else program.at(frames.times - frames.times[0])
    found = extract_surfaces(frames, watched, operator=operator, centers=centers, rest=rest, subset=subset, load=load)
    if loading is None or temperature is None:
        return found
    # A program counts from the first frame, a constant load from the last frame at rest.
    zero = None if program is None else 0.0
    return [one.replace(history=one.history_under(loading, temperature, time_zero=zero)) for one in found]


def operator_of(specimen: Specimen | str, window: float | None = None, radii: Sequence[float] = ()) -> str:
    """The text of the operator of a specimen within a window, mm, or at radii, mm; by default its own."""
    if window is not None and len(radii):
        raise HistoryError("a window and rings were given: means on rings have no window; leave one of them out")
    return _watched(specimen).surface_operator(window, radii)


def _watched(specimen: Specimen | str) -> SupportsSurfaceObservation:
    watched = resolve_predictor(specimen)
    if not isinstance(watched, SupportsSurfaceObservation):
        name = getattr(watched, "name", type(watched).__name__)
        raise HistoryError(f"specimen '{name}' does not say how cameras see its surface; use one that does, as 'bulge'")
    return watched
