"""Cameras and instrument records of a study: stages whose results are tests, which are identified like those of files.

Frames are extracted first, and what an instrument recorded is then put onto their clock; each is a stage of its own, so
that another time zone of a record, or another channel, leaves the frames alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import creepkit as ck
from creepkit.api.extraction import WATCHED, ImposedChannels, extract_as_described, history_of, imposed_on, operator_of
from creepkit.cameras.sequences import in_order
from creepkit.errors import HistoryError, StudyError, nearest
from creepkit.extraction import Extraction
from creepkit.extraction.options import ClockOptions, ExtractionOptions
from creepkit.extraction.temperature_fields import IMAGE_FILE, InfraredCamera, InfraredField
from creepkit.files.record_codec import record_to_json
from creepkit.forecasts.planned_tests import stepped_load
from creepkit.instruments.imposed import Imposed
from creepkit.instruments.reading_options import RecordOptions
from creepkit.inverse.predictor_documents import predictor_fingerprint
from creepkit.language import elastic_of
from creepkit.options import values_of_table
from creepkit.records import ZERO_CELSIUS, History, Loading, Nuisance, Specimen, dimensions_of, loads_of
from creepkit.registry.reading import frame_files
from creepkit.reports.contents import Exclusion
from creepkit.studies import arguments
from creepkit.studies.alloy_table import AlloyTable, Dimple, read_alloy_table
from creepkit.studies.execution import Results, Stage, Tick
from creepkit.studies.inputs import InputFile
from creepkit.studies.study_file import KeyPath, StudyFile
from creepkit.studies.tables import CameraTable

MOST_REASON = 300
"""Characters of a reason for which frames were flagged."""


CONTRADICTIONS = (
    *(("format", "columns"), ("times", "interval_s"), ("operator", "window_mm"), ("operator", "rings_mm")),
    *(("window_mm", "rings_mm"), ("lag_s", "search_s"), ("record", "load"), ("record", "temperature_C")),
    *(("infrared", one) for one in ("temperature_C", "thermocouples_mm")),
)
"""Keys of a [[camera]] of which one may be given."""


@dataclass(frozen=True)
class ExtractedTests:
    """What the frames of one camera gave, one extraction for each test piece; failed : {test piece: why not}."""

    tests: tuple[Extraction, ...]
    failed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ImposedOnTests:
    """What an instrument recorded of the test pieces of one camera; failed : {test piece: why nothing}."""

    tests: tuple[Imposed, ...]
    failed: Mapping[str, str] = field(default_factory=dict)


def cameras_of(file: StudyFile) -> list[StudyCamera]:
    """The cameras of a study; StudyError for cameras and records that contradict themselves, or that nobody names."""
    model = file.model
    cameras = [StudyCamera(file, k) for k in range(len(model.camera))]
    named = {"camera": [one.label for one in cameras], "record": [one.name for one in model.record]}
    for table, names in named.items():
        for k, name in enumerate(names):
            if name in names[:k]:
                raise file.error((table, k, "name"), f"two of them are called '{name}'; rename one of them")
    for camera in cameras:
        camera.check()
    if model.alloys is not None and not cameras:
        raise file.error(("alloys",), "says what cameras show, and there is no [[camera]]; leave it out")
    for k, record in enumerate(model.record):
        if k not in [camera.record_number for camera in cameras]:
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
    def label(self) -> str:
        """Its name, by default that of its folder."""
        place = Path(self.part.frames[0])
        folder = place.parent if "*" in place.name or place.suffix else place
        return self.part.name or folder.name or "camera"

    @property
    def name(self) -> str:
        """Of its extraction."""
        return f"extraction of {self.label}"

    @property
    def record_name(self) -> str:
        """Of what its instrument recorded."""
        return f"record of {self.label}"

    def key(self, *names: str) -> KeyPath:
        """The place of a key in the file."""
        return ("camera", self.number, *names)

    def check(self) -> None:
        """StudyError for what contradicts itself, or names what there is not; before anything is read."""
        part = self.part
        given = {key for key in type(part).model_fields if getattr(part, key) not in (None, {}, [])}
        self.file.check_name(self.key("format"), "format", part.format, ck.available("cameras"))
        for first, second in CONTRADICTIONS:
            if {first, second} <= given:
                raise self.file.error(self.key(second), f"contradicts {first}; leave one of them out")
        for name in ("channels", "thermocouples_mm", "lag_s", "search_s", "camera_start"):
            if self.record_number is None and name in given:
                raise self.file.error(self.key(name), "belongs to a record; say record = its name")
        if self.record_number is None and (len(part.load) != 1 or not {"temperature_C", "infrared"} & given):
            what = "does not say what was imposed; give record, or load and temperature_C, as load = { ... = 5 }"
            raise self.file.error(self.key(), what)
        for name in ("operator", "clock", "stated_loading", "lengths", "files", "images", "alloys"):
            getattr(self, name)  # each says what is wrong with its keys

    # ---- its table as arguments ------------------------------------------------------------------------------------

    @cached_property
    def record_number(self) -> int | None:
        """Which [[record]] it names, the only one where it says nothing of what was imposed; None for no record."""
        names, name = [one.name for one in self.file.model.record], self.part.record
        if name is None and len(names) == 1 and not self.part.load and self.part.temperature_C is None:
            return 0
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
        table = None if self.alloys is None else self.alloys.path
        return [*frames, *self.images, *(path for path in (times, record, table) if path is not None)]

    @property
    def format(self) -> Any:
        """The camera format as ck.read_frames takes it."""
        return dict(self.said.columns) if self.said.columns else self.said.format

    @cached_property
    def specimen(self) -> Specimen:
        """What it watched: as it says, else the specimen of the study, else the one of ck.extract."""
        of_study = self.part.specimen is None and self.file.model.specimen is not None
        key = ("specimen", "name") if of_study else self.key(*(["specimen"] if self.part.specimen else []))
        with self.file.at(*key):
            found = arguments.specimen_of_study(self.file) if of_study else ck.specimen(self.part.specimen or WATCHED)
        if not found.is_watched:
            watched = [n for n, s in ck.available("specimens").items() if s.is_watched]
            what = f"specimen '{found.name}' does not say how cameras see its surface; {nearest(found.name, watched)}"
            raise self.file.error(key, what)
        with self.file.at(*self.key("lengths")):
            lengths = arguments.lengths_of(self.file, self.key("lengths"), self.part.lengths, found)
            return cast("Specimen", cast("Any", found).replace(**lengths))

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
        with self.file.at(*self.key("rest_frames" if self.part.rest_frames else "names")):
            said = ExtractionOptions().changed({**values_of_table(ExtractionOptions, self.part), "times": None})
            said.check()
            return said

    @cached_property
    def clock(self) -> ClockOptions:
        """What is known of the clocks of frames and record."""
        stated = values_of_table(ClockOptions, self.part)
        with self.file.at(*self.key("search_s" if self.part.search_s else "camera_start")):
            clock = ClockOptions().changed(stated)
            _ = clock.bounds, clock.start  # which texts and numbers of other kinds have not
            return clock

    @cached_property
    def images(self) -> list[Path]:
        """Of the temperature."""
        if self.part.infrared is None:
            return []
        paths = self.file.paths(self.key("infrared", "images"), self.part.infrared.images)
        if len(paths) == 1 and paths[0].is_dir():
            paths = sorted(one for one in paths[0].iterdir() if one.suffix.lower() in (".csv", ".npy", ".mat", ".txt"))
        if not paths or any(path.is_dir() for path in paths):
            raise self.file.error(self.key("infrared", "images"), f"name {IMAGE_FILE.noun}, or a folder of them")
        return paths

    @cached_property
    def infrared(self) -> InfraredField | None:
        """Temperatures of the plate, where it was seen in the infrared."""
        part = self.part.infrared
        if part is None:
            return None
        seen = ((part.center_mm[0], part.center_mm[1]), part.mm_per_pixel)
        surface = (part.emissivity, part.emissivity_sd, part.camera_emissivity, part.surroundings_C + ZERO_CELSIUS)
        camera = InfraredCamera(*seen, *surface, part.wavelength_um, part.unit)
        with self.file.at(*self.key("infrared")):
            return camera.read(self.images)

    @cached_property
    def alloys(self) -> AlloyTable | None:
        """The table of alloys of the study."""
        table = self.file.model.alloys
        if table is None:
            return None
        path = self._file(("alloys", "file"), table.file)
        assert path is not None
        with self.file.at("alloys", "file"):
            return read_alloy_table(path, self.specimen)

    @cached_property
    def stated_loading(self) -> tuple[Loading | float, Any] | None:
        """Load and temperature, K, where there is no record; None of a temperature that infrared images show."""
        if self.record_number is not None:
            return None
        loads = {load.name: load for load in loads_of(self.specimen)}
        ((key, steps),) = self.part.load.items()
        kinds = {name: load.kind for name, load in loads.items()}
        name, levels = arguments.levels_of(self.file, self.key("load", key), kinds, steps)
        end = max(2.0 * levels[-1][0], 1e9)
        with self.file.at(*self.key("load", key)):
            loading = stepped_load(name, loads[name], levels, control=None, ramp=self.part.ramp_s, end=end)
        stated = self.part.temperature_C or []
        return loading, arguments.temperature_of(self.file, self.key("temperature_C"), stated)

    @cached_property
    def lengths(self) -> dict[str, float]:
        """{length of the test pieces: mm}."""
        return arguments.lengths_of(self.file, self.key("lengths"), self.part.lengths, self.specimen)

    # ---- its stages ------------------------------------------------------------------------------------------------

    def stages(self, files: Sequence[InputFile]) -> list[Stage]:
        """The extraction, and what its record imposed. files : with their hashes."""
        hashes = {one.path: [one.name, one.sha256] for one in files}
        return [self._extraction(hashes), *([] if self.record_number is None else [self._imposed(hashes)])]

    def _extraction(self, hashes: Mapping[Path, list[str]]) -> Stage:
        said, (paths, times, _) = self.said, self.files

        def make(results: Results, tick: Tick) -> ExtractedTests:
            frames = replace(ck.read_frames(list(paths), self.format, times), name=self.label)
            failed: dict[str, str] = {}
            found = extract_as_described(frames, self.specimen, said, self.operator, tick, failed)
            return ExtractedTests(tuple(_without_folders(one, paths[0].parent) for one in found), failed)

        settings = [
            {"frames": [hashes[path] for path in paths], "times": times and hashes[times]},
            record_to_json(asdict(said)),
            [self.label, self.operator, predictor_fingerprint(self.specimen)],
        ]
        return Stage("extraction", "", settings, make, ExtractedTests, name=self.name)

    def _imposed(self, hashes: Mapping[Path, list[str]]) -> Stage:
        part, path, index = self.part, self.files[2], self.record_number
        assert index is not None
        assert path is not None
        record = self.file.model.record[index]

        def make(results: Results, tick: Tick) -> ImposedOnTests:
            read = ck.read_record(path, record.format, **values_of_table(RecordOptions, record))
            places = {name: (x, y) for name, (x, y) in part.thermocouples_mm.items()}
            known = ImposedChannels(part.channels, places, self.infrared, numbered=not self.said.names)
            failed: dict[str, str] = {}
            tests: tuple[Extraction, ...] = results[self.name].tests
            tick("align clocks", 0, len(tests))
            found = imposed_on(tests, read, known, self.clock, failed)
            if not found:
                raise StudyError("; ".join(f"{name}: {reason}" for name, reason in failed.items()))
            return ImposedOnTests(tuple(found), failed)

        settings = [
            hashes[path],
            record.model_dump(),
            [part.channels, part.thermocouples_mm],
            record_to_json(asdict(self.clock)),
            [part.infrared and part.infrared.model_dump(), [hashes[one] for one in self.images]],
        ]
        return Stage("record", "", settings, make, ImposedOnTests, (self.name,), name=self.record_name)

    # ---- its tests -------------------------------------------------------------------------------------------------

    def tests(self, results: Any) -> Iterator[tuple[str, Extraction, Imposed | None]]:
        """Name, extraction, and what its record says was imposed, of each test; none where the extraction failed."""
        extracted = results[self.name].tests if self.name in results else ()
        imposed = results[self.record_name].tests if self.record_name in results else ()
        by_name = {one.specimen: one for one in imposed}
        for one in extracted:
            yield f"{self.label} {one.name}", one, by_name.get(one.name)

    def failed(self, results: Any) -> list[Exclusion]:
        """Test pieces of which nothing could be extracted, or is known what was imposed; those the table excludes."""
        reasons = {
            piece: reason
            for stage in (self.name, self.record_name)
            if stage in results
            for piece, reason in results[stage].failed.items()
        }
        reasons |= {piece: row.excluded for piece, row in self._rows(results).items() if row.excluded}
        return [Exclusion(f"{self.label} {piece}", (), reason[:MOST_REASON]) for piece, reason in reasons.items()]

    def histories(self, results: Any) -> list[History]:
        """The tests, where no stage failed, without those that the table of alloys excludes."""
        rows, cameras = self._rows(results), range(len(self.file.model.camera))
        if self.alloys is not None and self.name in results:
            labels = [StudyCamera(self.file, k).label for k in cameras]
            with self.file.at("alloys", "file"):
                self.alloys.check(self.label, self._shown(results), labels)
        with self.file.at(*self.key()):
            return [
                self._history(name, one, under, row, several=len(rows) > 1)
                for name, one, under in self.tests(results)
                for row in [rows.get(one.name, Dimple("", self.label, one.name))]
                if not row.excluded and (under is not None or self.record_number is None)
            ]

    def _shown(self, results: Any) -> list[str]:
        """The test pieces in its field of view."""
        return [*(one.name for one in results[self.name].tests), *results[self.name].failed]

    def _rows(self, results: Any) -> Mapping[str, Dimple]:
        """{test piece: its row in the table of alloys}."""
        if self.alloys is None or self.name not in results:
            return {}
        return self.alloys.of_camera(self.label, self._shown(results))

    def _history(self, name: str, one: Extraction, under: Imposed | None, row: Dimple, *, several: bool) -> History:
        """A test; several : whether the camera shows several test pieces of the table of alloys."""
        part = self.part
        history = self._under_stated(one) if under is None else history_of(one, under)
        modulus = row.modulus or (None if part.modulus_GPa is None else 1e3 * part.modulus_GPa)
        alloy = row.alloy or part.alloy or (name if several else "")
        labels = {**history.labels, **part.labels, **row.labels}
        if several and alloy == name:
            assumed = "an alloy of its own, for the table of alloys names none"
            labels["assumed"] = "; ".join(filter(None, (labels.get("assumed"), assumed)))
        return history.replace(
            name=name,
            alloy=alloy,
            elastic=elastic_of(modulus, part.poisson),
            geometry={**history.geometry, **self.lengths, **row.lengths},
            labels=labels,
            source=f"{part.frames[0]} ({one.name})",
        )

    def _under_stated(self, one: Extraction) -> History:
        """A test under the load and the temperature that the study states, or that infrared images show."""
        assert self.stated_loading is not None
        loading, kelvin = self.stated_loading
        if kelvin is not None:
            return one.history_under(loading, kelvin)
        assert self.infrared is not None
        x, y = one.center
        kelvin, sd = self.infrared.at((float(x), float(y)), 0.5 * one.region.moving)
        history = one.history_under(loading, kelvin)
        return history.replace(labels={**history.labels, "temperature_sd_K": f"{sd:.2g}"})

    def priors(self, histories: Sequence[History]) -> list[Nuisance]:
        """What is known of single test pieces but for an error: their lengths and their temperatures."""
        places = {one.name: one.labels.get("place", "") for one in histories}
        own = [one for one in histories if one.name == f"{self.label} {places[one.name]}"]
        rows = {} if self.alloys is None else self.alloys.of_camera(self.label, [places[one.name] for one in own])
        kinds = {one.name: one.alias or one.name for one in dimensions_of(self.specimen)}
        found = []
        for history in own:
            row = rows.get(places[history.name])
            known = {kinds[name]: sd for name, sd in row.tolerances.items()} if row else {}
            if "temperature_sd_K" in history.labels:
                known["temperature"] = float(history.labels["temperature_sd_K"])
            found += [Nuisance(kind, sd=sd, tests=(history.name,)) for kind, sd in known.items()]
        return found


def flagged_frames(extractions: Mapping[str, Extraction]) -> list[Exclusion]:
    """Frames that extractions do not use, with the reasons, as the camera counts them."""
    return [
        Exclusion(name, flag.frames, f"{flag.kind}, frames as the camera counts them: {flag.reason}")
        for name, one in extractions.items()
        for flag in one.flags
    ]


def _without_folders(extraction: Extraction, folder: Path) -> Extraction:
    """Reasons of flags without the place of the files on this machine, which are the same wherever they lie."""
    flags = tuple(
        replace(flag, reason=flag.reason.replace(f"{folder}/", "").replace(f"{folder}\\", "")[:MOST_REASON])
        for flag in extraction.flags
    )
    return extraction.replace(flags=flags)
