"""From camera frames to measured outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError
from creepkit.extraction.domes import Centers
from creepkit.extraction.options import ClockOptions, ExtractionOptions
from creepkit.instruments.imposed import Imposed, channel_names, named_specimens
from creepkit.records import Frames, History, InstrumentRecord, Loading, Program, RecordedLoading, Specimen
from creepkit.registry.arguments import resolve_predictor

if TYPE_CHECKING:
    from creepkit.extraction import Extraction
    from creepkit.extraction.temperature_fields import InfraredField

FEWEST_AT_REST = 3
"""Frames whose level shows that there is no load: a single one is the reference, whatever it was taken under."""


WATCHED = "bulge"
"""The specimen that cameras are taken to watch where none is named."""


@checked
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
    from creepkit.extraction import ExtractionRequest, extract_surfaces

    watched = _watched(specimen)
    program = loading.program() if isinstance(loading, Loading) else None
    load = None if program is None else program.at(frames.times - frames.times[0])
    found = extract_surfaces(frames, watched, ExtractionRequest(operator, centers, (), rest, subset, load))
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
    failed: dict[str, str] | None = None,
) -> list[Extraction]:
    """Extract what a command or a study describes: its frames' interval, centres, names and frames at rest.

    progress : called as progress("frames", done, total) for each frame that is read. failed : takes {test piece: why
    nothing is extracted of it}, so that the others are; None: HistoryError for the first. HistoryError for another
    number of names than of test pieces, and where none of these is left.
    """
    from creepkit.extraction import ExtractionRequest, extract_surfaces

    if described.interval is not None:
        frames = replace(frames, times=described.interval * np.arange(len(frames), dtype=float))
    if np.isnan(frames.times).any():
        raise HistoryError(
            f"frames '{frames.name}': their files hold no times; give times, a file with a row for each of the "
            f"{len(frames)} frames, or interval, s between two of them"
        )
    names = described.names or tuple(f"D{k + 1}" for k in range(len(described.centers)))
    done: set[int] = set()

    def read(index: int) -> Any:
        done.add(index)
        progress("frames", len(done), len(frames))
        return frames.read_frame(index)

    centers = {name: (x, y) for name, (x, y) in zip(names, described.centers, strict=False)} or None
    asked = ExtractionRequest(operator, centers, names, described.frames_at_rest, described.subset)
    return extract_surfaces(replace(frames, read_frame=read), _watched(specimen), asked, failed)


def operator_of(specimen: Specimen | str, described: ExtractionOptions) -> str:
    """The text of the operator of a specimen within the window or on the rings described; by default its own."""
    return _watched(specimen).surface_operator(described.window, described.rings)


@dataclass(frozen=True)
class ImposedChannels:
    """What is known of load and temperature of the test pieces of one camera.

    channels : {test piece: load, then thermocouples}, "" for all; {} for those that the record's format has for their
    names. places : {thermocouple: (x, y)} mm in the axes of the frames. infrared : mean temperatures there.
    numbered : whether test pieces are called D1, D2, ... because nobody named them.
    """

    channels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    places: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    infrared: InfraredField | None = None
    numbered: bool = False

    def check(self, record: InstrumentRecord, pieces: Sequence[str]) -> None:
        """HistoryError where numbers that several test pieces were given may be taken for names of the record."""
        named = named_specimens(record)
        if self.numbered and not self.channels and len(pieces) > 1 and named and {*named} != {*pieces}:
            raise HistoryError(
                f"{record.origin}: has channels of {', '.join(named[:30])}, and the test pieces that were found are "
                f"only numbered, {pieces[0]} to {pieces[-1]} row by row; say names, in this order, out of these"
            )

    def names_for(self, piece: str, record: InstrumentRecord) -> tuple[str, list[str]]:
        """Channels of the load of a test piece and of its thermocouples; HistoryError where they are not known."""
        given = self.channels.get(piece, self.channels.get(""))
        names = [record.channel(name).name for name in given or channel_names(record, piece)]
        if len(names) < 2 and self.infrared is None:
            raise HistoryError(f"{record.origin}: no channel of the temperature of '{piece}' is named; name one")
        return names[0], names[1:]


def imposed_on(
    extractions: Sequence[Extraction],
    record: InstrumentRecord,
    known: ImposedChannels | None = None,
    clock: ClockOptions | None = None,
    failed: dict[str, str] | None = None,
) -> list[Imposed]:
    """What an instrument recorded of the test pieces of one camera, over the time of its frames, on one clock.

    The lag is estimated from all of them at once, as ck.align_clocks does; none of them has another. failed : takes
    {test piece: why it has no result}; None: HistoryError for the first of them.
    """
    import creepkit as ck
    from creepkit.extraction.extract import problem_kept
    from creepkit.instruments.clock_alignment import nominal_zero
    from creepkit.records import ClockAlignment

    known, clock, problems = known or ImposedChannels(), clock or ClockOptions(), dict[str, str]()
    times = extractions[0].times + extractions[0].first_time
    known.check(record, [one.name for one in extractions])
    names = dict[str, tuple[str, list[str]]]()
    for one in extractions:
        with problem_kept(problems, one.name, failed):
            names[one.name] = known.names_for(one.name, record)
    pieces = [one for one in extractions if one.name in names]
    found: list[Imposed] = []
    if clock.lag is not None:
        alignment = ClockAlignment.stated(clock.lag, zero=nominal_zero(record, times, clock.start))
    elif pieces:
        signals = [np.where(one.used, next(iter(one.outputs.values())), np.nan) for one in pieces]
        loads = [names[one.name][0] for one in pieces]
        still = max((one.rest.tolist() for one in pieces), key=len)
        alignment = ck.align_clocks(
            record,
            loads,
            times,
            signals,
            search=clock.bounds,
            camera_start=clock.start,
            unloaded=still if len(still) >= FEWEST_AT_REST else (),
        )
    for one in pieces:
        load, warm = names[one.name]
        with problem_kept(problems, one.name, failed):
            with_its, channel, sd = _with_temperature(record, one, warm, known)
            imposed = ck.imposed(with_its, (load, channel), times, alignment)
            found.append(replace(imposed, specimen=one.name, temperature_sd=sd))
    if failed is not None:
        failed.update(problems)
    return found


def _with_temperature(
    record: InstrumentRecord, one: Extraction, names: Sequence[str], known: ImposedChannels
) -> tuple[InstrumentRecord, str, float]:
    """A record with a channel of the temperature at a test piece, its name, and its standard deviation, K."""
    from creepkit.extraction.temperature_fields import TemperatureAt, temperature_between
    from creepkit.records import Channel

    x, y = (float(value) for value in one.center)
    if known.infrared is None:
        if len(names) == 1:
            return record, names[0], 0.0
        found = temperature_between(record, names, known.places, (x, y))
        name = f"temperature at {one.name} between {', '.join(names)}"
    else:
        mean, sd = known.infrared.at((x, y), 0.5 * one.region.moving)
        course = record.channel(names[0]).values if names else np.zeros(record.times.size)
        found = TemperatureAt(mean + course - np.nanmean(course), sd)
        name = f"infrared temperature at {one.name}"
    channel = Channel(name, "temperature", found.values)
    return replace(record, channels={**record.channels, name: channel}), name, found.sd


def history_of(extraction: Extraction, under: Imposed) -> History:
    """The test as a history, under what was imposed; what is not known of the lag enters the noise of its outputs."""
    history = extraction.history_under(
        RecordedLoading(under.load, extraction.load_name),
        under.temperature,
        time_zero=float(under.time_zero) - extraction.first_time,
    )
    errors = {name: under.lag_error(history.times, values) for name, values in history.outputs.items()}
    sd = {name: np.hypot(history.standard_deviation[name], error) for name, error in errors.items()}
    kelvin = {"temperature_sd_K": f"{under.temperature_sd:.2g}"} if under.temperature_sd else {}
    return history.replace(standard_deviation=sd, labels={**history.labels, **kelvin})


def _watched(specimen: Specimen | str) -> Specimen:
    watched = resolve_predictor(specimen)
    if not isinstance(watched, Specimen) or not watched.is_watched:
        raise HistoryError(
            f"specimen '{watched.label}' does not say how cameras see its surface; use one that does, as 'bulge'"
        )
    return watched
