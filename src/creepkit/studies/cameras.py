"""Cameras and instrument records of a study: stages whose results are tests, which are identified like those of files.

Frames are extracted first, and what an instrument recorded is then put onto their clock; each is a stage of its own, so
that another time zone of a record, or another channel, leaves the frames alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from creepkit.api.extraction import WATCHED, extract_as_described, history_of, imposed_on, operator_of
from creepkit.api.options import elastic_of
from creepkit.cameras.sequences import in_order
from creepkit.errors import CreepkitError, HistoryError, StudyError, nearest
from creepkit.extraction import Extraction
from creepkit.extraction.options import ExtractionOptions
from creepkit.files.record_codec import record_to_json
from creepkit.forecasts.planned_tests import stepped_load
from creepkit.instruments.imposed import Imposed
from creepkit.inverse.fingerprints import predictor_fingerprint
from creepkit.options import values_of_table
from creepkit.records import History, Loading, Specimen, SupportsSurfaceObservation, loads_of
from creepkit.registry.reading import frame_files
from creepkit.reports.contents import Exclusion
from creepkit.studies import arguments
from creepkit.studies.inputs import InputFile
from creepkit.studies.stage import Results, Stage, Tick
from creepkit.studies.study_file import KeyPath, StudyFile
from creepkit.studies.tables import CameraTable, RecordTable

MOST_REASON = 300
"""Characters of a reason for which frames were flagged."""


CONTRADICTIONS = (
    *(("format", "columns"), ("times", "interval_s"), ("operator", "window_mm"), ("operator", "rings_mm")),
    *(("window_mm", "rings_mm"), ("lag_s", "search_s"), ("record", "load"), ("record", "temperature_C")),
)
"""Keys of a [[camera]] of which one may be given."""


@dataclass(frozen=True)
class ExtractedTests:
    """What the frames of one camera gave, one extraction for each test piece."""

    tests: tuple[Extraction, ...]


@dataclass(frozen=True)
class ImposedOnTests:
    """What an instrument recorded of the test pieces of one camera, in their order."""

    tests: tuple[Imposed, ...]


def cameras_of(file: StudyFile) -> list[StudyCamera]:
    """The cameras of a study; StudyError for cameras and records that contradict themselves, or that nobody names."""
    import creepkit as ck

    model = file.model
    for table, parts in (("camera", model.camera), ("record", model.record)):
        names = [one.name for one in parts]
        for k, name in enumerate(names):
            if name in names[:k]:
                raise file.error((table, k, "name"), f"two of them are called '{name}'; rename one of them")
    cameras = [StudyCamera(file, k) for k in range(len(model.camera))]
    for camera in cameras:
        camera.check()
    for k, record in enumerate(model.record):
        if record.name not in [part.record for part in model.camera]:
            what = f"no [[camera]] says record = '{record.name}'; add that, or leave it out"
            raise file.error(("record", k, "name"), what)
        file.check_name(("record", k, "format"), "format", record.format, ck.available("instruments"))
    return cameras


@dataclass(frozen=True)
class StudyCamera:
    """One [[camera]] of a study file, of this number."""

    file: StudyFile
    number: int

    @property
    def part(self) -> CameraTable:
        """Its table."""
        return self.file.model.camera[self.number]

    @property
    def name(self) -> str:
        """Of its extraction."""
        return f"extraction of {self.part.name}"

    @property
    def record_name(self) -> str:
        """Of what its instrument recorded."""
        return f"record of {self.part.name}"

    def key(self, *names: str) -> KeyPath:
        """The place of a key in the file."""
        return ("camera", self.number, *names)

    def check(self) -> None:
        """StudyError for what contradicts itself, or names what there is not; before anything is read."""
        import creepkit as ck

        part = self.part
        given = {key for key in type(part).model_fields if getattr(part, key) not in (None, {}, [])}
        self.file.check_name(self.key("format"), "format", part.format, ck.available("cameras"))
        for first, second in CONTRADICTIONS:
            if {first, second} <= given:
                raise self.file.error(self.key(second), f"contradicts {first}; leave one of them out")
        for name in ("channels", "lag_s", "search_s", "camera_start"):
            if part.record is None and name in given:
                raise self.file.error(self.key(name), "belongs to a record; say record = its name")
        if part.record is None and (len(part.load) != 1 or part.temperature_C is None):
            what = "does not say what was imposed; give record, or load and temperature_C, as load = { ... = 5 }"
            raise self.file.error(self.key(), what)
        names, centers = self.said.names, self.said.centers
        if names and centers and len(names) != len(centers):
            what = f"are {len(names)}, and centers_mm {len(centers)}; give one name of each"
            raise self.file.error(self.key("names"), what)
        if len(set(names)) < len(names):
            raise self.file.error(self.key("names"), "stand there twice; each test piece has its own")
        for name in ("record_number", "operator", "camera_start", "stated_loading", "lengths", "files"):
            getattr(self, name)  # each says what is wrong with its keys

    # ---- its table as arguments ------------------------------------------------------------------------------------

    @cached_property
    def record_number(self) -> int | None:
        """Which [[record]] it names; None where it names none."""
        names, name = [one.name for one in self.file.model.record], self.part.record
        if name is not None and name not in names:
            known = nearest(name, names) if names else "add a table [[record]] with name and file"
            raise self.file.error(self.key("record"), f"there is no record '{name}'; {known}")
        return None if name is None else names.index(name)

    @cached_property
    def files(self) -> tuple[list[Path], Path | None, Path | None]:
        """Its frames in their order, the file of their times, and that of its record."""
        part, file, index = self.part, self.file, self.record_number
        paths = file.paths(self.key("frames"), part.frames)
        with file.at(*self.key("frames")):
            if len(part.frames) == len(paths) == 1 and paths[0].is_dir():
                paths = frame_files(paths[0], self.format)
            elif any(path.is_dir() for path in paths):
                raise HistoryError("names a folder beside others; give one folder, or files of frames")
            elif len(part.frames) == 1:
                paths = in_order(paths)
        record = None if index is None else self._file(("record", index, "file"), file.model.record[index].file)
        return paths, self._file(self.key("times"), part.times), record

    def _file(self, key: KeyPath, text: str | None) -> Path | None:
        found = [] if text is None else self.file.paths(key, [text])
        if text is not None and (len(found) != 1 or not found[0].is_file()):
            raise self.file.error(key, f"'{text}' is no single file; name one")
        return found[0] if found else None

    @property
    def all_files(self) -> list[Path]:
        """Every file that it reads."""
        frames, times, record = self.files
        return [*frames, *(path for path in (times, record) if path is not None)]

    @property
    def format(self) -> Any:
        """The camera format as ck.read_frames takes it."""
        return dict(self.said.columns) if self.said.columns else self.said.format

    @cached_property
    def specimen(self) -> Specimen:
        """What it watched: as it says, else the specimen of the study, else the one of ck.extract."""
        import creepkit as ck

        of_study = self.part.specimen is None and self.file.model.specimen is not None
        key = ("specimen", "name") if of_study else self.key(*(["specimen"] if self.part.specimen else []))
        with self.file.at(*key):
            found = arguments.specimen_of_study(self.file) if of_study else ck.specimen(self.part.specimen or WATCHED)
        if not isinstance(found, SupportsSurfaceObservation):
            watched = [n for n, s in ck.available("specimens").items() if isinstance(s, SupportsSurfaceObservation)]
            what = f"specimen '{found.name}' does not say how cameras see its surface; {nearest(found.name, watched)}"
            raise self.file.error(key, what)
        return found

    @cached_property
    def operator(self) -> str:
        """What is made of the points."""
        if self.part.operator is not None:
            return self.part.operator
        with self.file.at(*self.key("rings_mm" if self.said.rings else "window_mm")):
            return operator_of(self.specimen, self.said)

    @cached_property
    def said(self) -> ExtractionOptions:
        """What is said of the frames."""
        with self.file.at(*self.key("rest_frames")):
            said = ExtractionOptions().changed({**values_of_table(ExtractionOptions, self.part), "times": None})
            _ = said.frames_at_rest  # which a text that is no range of frames has not
            return said

    @cached_property
    def camera_start(self) -> float | None:
        """Unix time of the camera's time zero, s."""
        text, start = self.part.camera_start, None
        if text is None:
            return None
        with suppress(ValueError):
            start = datetime.fromisoformat(text)
        if start is None or start.tzinfo is None:
            what = f"'{text}' is not known; write \"2025-08-18T18:51:53-05:00\""
            raise self.file.error(self.key("camera_start"), what)
        return start.timestamp()

    @cached_property
    def stated_loading(self) -> tuple[Loading | float, Any] | None:
        """Load and temperature, K, where there is no record."""
        if self.part.record is not None:
            return None
        loads = {load.name: load for load in loads_of(self.specimen)}
        ((key, steps),) = self.part.load.items()
        kinds = {name: load.kind for name, load in loads.items()}
        name, levels = arguments.levels_of(self.file, self.key("load", key), kinds, steps)
        end = max(2.0 * levels[-1][0], 1e9)
        with self.file.at(*self.key("load", key)):
            loading = stepped_load(name, loads[name], levels, control=None, ramp=self.part.ramp_s, end=end)
        assert self.part.temperature_C is not None
        return loading, arguments.temperature_of(self.file, self.key("temperature_C"), self.part.temperature_C)

    @cached_property
    def lengths(self) -> dict[str, float]:
        """{length of the test pieces: mm}."""
        return arguments.lengths_of(self.file, self.key("lengths"), self.part.lengths, self.specimen)

    # ---- its stages ------------------------------------------------------------------------------------------------

    def stages(self, files: Sequence[InputFile]) -> list[Stage]:
        """The extraction, and what its record imposed. files : with their hashes."""
        hashes = {one.path: [one.name, one.sha256] for one in files}
        return [self._extraction(hashes), *([] if self.part.record is None else [self._imposed(hashes)])]

    def _extraction(self, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        part, said, (paths, times, _) = self.part, self.said, self.files

        def make(results: Results, tick: Tick) -> ExtractedTests:
            frames = replace(ck.read_frames(list(paths), self.format, times), name=part.name)
            found = extract_as_described(frames, self.specimen, said, self.operator, tick)
            return ExtractedTests(tuple(_without_folders(one, paths[0].parent) for one in found))

        settings = [
            {"frames": [hashes[path] for path in paths], "times": times and hashes[times]},
            record_to_json(asdict(said)),
            [part.name, self.operator, predictor_fingerprint(self.specimen)],
        ]
        return Stage("extraction", "", settings, make, ExtractedTests, _numbers_of_frames, name=self.name)

    def _imposed(self, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        part, path, index = self.part, self.files[2], self.record_number
        assert index is not None
        assert path is not None
        record = self.file.model.record[index]
        search = None if part.search_s is None else (part.search_s[0], part.search_s[1])

        def make(results: Results, tick: Tick) -> ImposedOnTests:
            read = ck.read_record(path, record.format, **_record_options(record))
            found = []
            tests: tuple[Extraction, ...] = results[self.name].tests
            for k, one in enumerate(tests):
                tick("align clocks", k, len(tests))
                channels = part.channels.get(one.name, part.channels.get(""))
                try:
                    under = imposed_on(
                        one, read, channels, lag=part.lag_s, search=search, camera_start=self.camera_start
                    )
                except CreepkitError as error:
                    raise StudyError(f"{one.name}: {error}") from None
                found.append(under)
            return ImposedOnTests(tuple(found))

        settings = [hashes[path], record.model_dump(), part.channels, [part.lag_s, part.search_s, part.camera_start]]
        numbers, needs = _numbers_of_records, (self.name,)
        return Stage("record", "", settings, make, ImposedOnTests, numbers, needs, name=self.record_name)

    # ---- its tests -------------------------------------------------------------------------------------------------

    def tests(self, results: Any) -> Iterator[tuple[str, Extraction, Imposed | None]]:
        """Name, extraction, and what its record says was imposed, of each test; none where the extraction failed."""
        extracted = results[self.name].tests if self.name in results else ()
        imposed = results[self.record_name].tests if self.record_name in results else [None] * len(extracted)
        for one, under in zip(extracted, imposed, strict=True):
            yield f"{self.part.name} {one.name}", one, under

    def histories(self, results: Any) -> list[History]:
        """The tests, where no stage failed."""
        with self.file.at(*self.key()):
            return [
                self._history(name, one, under)
                for name, one, under in self.tests(results)
                if under is not None or self.part.record is None
            ]

    def _history(self, name: str, one: Extraction, under: Imposed | None) -> History:
        part, stated = self.part, self.stated_loading
        history = one.history_under(*stated) if stated is not None else history_of(one, under)  # type: ignore[arg-type]
        modulus = None if part.modulus_GPa is None else 1e3 * part.modulus_GPa
        return history.replace(
            name=name,
            alloy=part.alloy or "",
            elastic=elastic_of(modulus, part.poisson),
            geometry={**history.geometry, **self.lengths},
            labels={**history.labels, **part.labels},
            source=f"{part.frames[0]} ({one.name})",
        )


def flagged_frames(extractions: Mapping[str, Extraction]) -> list[Exclusion]:
    """Frames that extractions do not use, with the reasons, as the camera counts them."""
    return [
        Exclusion(name, flag.frames, f"{flag.kind}, frames as the camera counts them: {flag.reason}")
        for name, one in extractions.items()
        for flag in one.flags
    ]


def _numbers_of_frames(extracted: ExtractedTests) -> dict[str, Any]:
    """Frames used, the centre and the last outputs of each test piece."""
    return {
        one.name: {
            "frames": int(one.used.sum()),
            "centre": one.center,
            **{name: float(values[one.used][-1]) for name, values in one.outputs.items() if one.used.any()},
        }
        for one in extracted.tests
    }


def _numbers_of_records(imposed: ImposedOnTests) -> dict[str, Any]:
    """The alignment of the clocks of each test piece."""
    return {
        f"{k + 1}": {"lag_s": one.alignment.lag, "interval_s": one.alignment.lag_interval, "zero_s": one.time_zero}
        for k, one in enumerate(imposed.tests)
    }


def _record_options(record: RecordTable) -> Any:
    options = record.model_dump(exclude={"name", "file", "format", "pressure_reference", "ambient_pressure_MPa"})
    reference, ambient = record.pressure_reference or "", record.ambient_pressure_MPa
    return {**options, "pressure_reference": reference, "ambient_pressure": ambient}


def _without_folders(extraction: Extraction, folder: Path) -> Extraction:
    """Reasons of flags without the place of the files on this machine, which are the same wherever they lie."""
    flags = tuple(
        replace(flag, reason=flag.reason.replace(f"{folder}/", "").replace(f"{folder}\\", "")[:MOST_REASON])
        for flag in extraction.flags
    )
    return extraction.replace(flags=flags)
