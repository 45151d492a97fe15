"""From camera frames to measured outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.checked_arguments import checked_with_own_words
from creepkit.errors import HistoryError
from creepkit.extraction.domes import Centers
from creepkit.records import Loading, Program, RecordedLoading, Specimen, SupportsSurfaceObservation
from creepkit.registry.arguments import resolve_predictor

if TYPE_CHECKING:
    from creepkit.extraction import Extraction
    from creepkit.extraction.options import ExtractionOptions
    from creepkit.instruments.imposed import Imposed
    from creepkit.records import Frames, History, InstrumentRecord

WATCHED = "bulge"
"""The specimen that cameras are taken to watch where none is named."""


@checked_with_own_words("centers")
def extract(
    frames: Frames,
    specimen: Specimen | str = WATCHED,
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


def extract_as_described(
    frames: Frames,
    specimen: Specimen | str,
    described: ExtractionOptions,
    operator: str,
    progress: Callable[[str, int, int], None],
) -> list[Extraction]:
    """Extract what a command or a study describes: its frames' interval, centres, names and frames at rest.

    progress : called as progress("frames", done, total) for each frame that is read. HistoryError for another number of
    names than of test pieces.
    """
    if described.interval is not None:
        frames = replace(frames, times=described.interval * np.arange(len(frames), dtype=float))
    names = described.names or tuple(f"D{k + 1}" for k in range(len(described.centers)))
    done: set[int] = set()

    def read(index: int) -> Any:
        done.add(index)
        progress("frames", len(done), len(frames))
        return frames.read_frame(index)

    centers = {name: (x, y) for name, (x, y) in zip(names, described.centers, strict=False)}
    found = extract(
        replace(frames, read_frame=read),
        specimen,
        operator=operator,
        centers=centers or None,
        rest=described.frames_at_rest,
        subset=described.subset,
    )
    if not names or centers:
        return found
    if len(names) != len(found):
        raise HistoryError(
            f"{len(found)} test pieces were found, and {len(names)} names are given: {', '.join(names)}; give as many "
            "names, or the centres of those that have them"
        )
    return [one.replace(name=name) for one, name in zip(found, names, strict=True)]


def operator_of(specimen: Specimen | str, described: ExtractionOptions) -> str:
    """The text of the operator of a specimen within the window or on the rings described; by default its own."""
    if described.window is not None and described.rings:
        raise HistoryError("a window and rings were given: means on rings have no window; leave one of them out")
    return _watched(specimen).surface_operator(described.window, described.rings)


def imposed_on(
    extraction: Extraction,
    record: InstrumentRecord,
    channels: Sequence[str] | None = None,
    *,
    lag: float | None = None,
    search: tuple[float, float] | None = None,
    camera_start: float | None = None,
) -> Imposed:
    """What an instrument recorded of a test piece, over the time of its frames, after the clocks were aligned.

    channels : of load and temperature; None: those that the record's format has for the name of the extraction.
    lag : s by which the record's clock is known to be ahead; None to find it, as ck.align_clocks does with search and
    camera_start.
    """
    import creepkit as ck
    from creepkit.instruments.clock_alignment import nominal_zero
    from creepkit.records import ClockAlignment

    times = extraction.times + extraction.first_time
    names = None if channels is None else (channels[0], channels[1])
    if lag is not None:
        alignment = ClockAlignment.stated(lag, zero=nominal_zero(record, times, camera_start))
    else:
        signal = np.where(extraction.used, next(iter(extraction.outputs.values())), np.nan)
        pattern = record.channel_patterns.get(extraction.load_name, "{}")
        channel = pattern.replace("{}", extraction.name) if names is None else names[0]
        alignment = ck.align_clocks(record, channel, times, signal, search=search, camera_start=camera_start)
    return ck.imposed(record, extraction.name if names is None else names, times, alignment)


def history_of(extraction: Extraction, under: Imposed) -> History:
    """The test as a history, under what was imposed."""
    return extraction.history_under(
        RecordedLoading(under.load, extraction.load_name),
        under.temperature,
        time_zero=float(under.time_zero) - extraction.first_time,
    )


def _watched(specimen: Specimen | str) -> SupportsSurfaceObservation:
    watched = resolve_predictor(specimen)
    if not isinstance(watched, SupportsSurfaceObservation):
        name = getattr(watched, "name", type(watched).__name__)
        raise HistoryError(f"specimen '{name}' does not say how cameras see its surface; use one that does, as 'bulge'")
    return watched
