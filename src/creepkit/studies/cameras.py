"""Cameras and instrument records of a study: stages whose results are tests, which are identified like those of files.

Frames are extracted first, and what an instrument recorded is then put onto their clock; each is a stage of its own, so
that another time zone of a record, or another channel, leaves the frames alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.api.extraction import WATCHED, history_of, imposed_on, operator_of
from creepkit.api.planned_tests import stepped_load
from creepkit.cameras.sequences import in_order
from creepkit.errors import CreepkitError, HistoryError, StudyError, nearest
from creepkit.extraction import Extraction
from creepkit.instruments.imposed import Imposed
from creepkit.inverse.fingerprints import predictor_fingerprint
from creepkit.language import Elastic
from creepkit.records import Frames, History, Loading, Specimen, SupportsSurfaceObservation, loads_of
from creepkit.registry.arguments import frame_files
from creepkit.reports.contents import Exclusion
from creepkit.studies import arguments
from creepkit.studies.inputs import InputFile, resolve_paths
from creepkit.studies.model import CameraPart, RecordPart
from creepkit.studies.stages import Results, Stage, Tick
from creepkit.studies.study_file import StudyFile

MOST_REASON = 300
"""Characters of a reason for which frames were flagged."""


@dataclass(frozen=True)
class ExtractedTests:
    """What the frames of one camera gave, one extraction for each test piece."""

    tests: tuple[Extraction, ...]


@dataclass(frozen=True)
class ImposedOnTests:
    """What an instrument recorded of the test pieces of one camera, in their order."""

    tests: tuple[Imposed, ...]


@dataclass(frozen=True)
class CameraFiles:
    """Files of one camera. frames : in their order. times : of frames. record : of its instrument."""

    frames: tuple[Path, ...]
    times: Path | None
    record: Path | None

    @property
    def all(self) -> list[Path]:
        """Every one."""
        return [*self.frames, *(path for path in (self.times, self.record) if path is not None)]


@dataclass(frozen=True)
class StudyCameras:
    """The cameras of a study file. root : see resolve_paths."""

    file: StudyFile
    root: Path | None = None

    @property
    def parts(self) -> list[CameraPart]:
        """Tables of the file."""
        return self.file.model.camera

    def files(self) -> list[CameraFiles]:
        """The files of each camera; StudyError where there are none."""
        return [self._files(k, part) for k, part in enumerate(self.parts)]

    def _files(self, number: int, part: CameraPart) -> CameraFiles:
        place = ("camera", number)
        paths = resolve_paths(self.file, (*place, "frames"), part.frames, self.root)
        with self.file.at(*place, "frames"):
            if len(part.frames) == len(paths) == 1 and paths[0].is_dir():
                frames = frame_files(paths[0], _format(part))
            elif any(path.is_dir() for path in paths):
                raise HistoryError("names a folder beside others; give one folder, or files of frames")
            else:
                frames = in_order(paths) if len(part.frames) == 1 else paths
        times = self._one(("camera", number, "times"), part.times)
        index = self._record_number(number)
        record = None if index is None else self._one(("record", index, "file"), self.file.model.record[index].file)
        return CameraFiles(tuple(frames), times, record)

    def _one(self, key: tuple[str | int, ...], text: str | None) -> Path | None:
        """One existing file."""
        if text is None:
            return None
        found = resolve_paths(self.file, key, [text], self.root)
        if len(found) != 1 or not found[0].is_file():
            raise self.file.error(key, f"'{text}' is no single file; name one")
        return found[0]

    def _record_number(self, number: int) -> int | None:
        name = self.parts[number].record
        names = [one.name for one in self.file.model.record]
        if name is None:
            return None
        if name not in names:
            known = nearest(name, names) if names else "add a table [[record]] with name and file"
            raise self.file.error(("camera", number, "record"), f"there is no record '{name}'; {known}")
        return names.index(name)

    # ---- what can be said before anything is read ------------------------------------------------------------------

    def check(self) -> None:
        """StudyError for cameras and records that contradict themselves, or name what there is not."""
        model = self.file.model
        for table, parts in (("camera", model.camera), ("record", model.record)):
            names = [one.name for one in parts]
            for k, name in enumerate(names):
                if name in names[:k]:
                    raise self.file.error((table, k, "name"), f"two of them are called '{name}'; rename one of them")
        used = {part.record for part in model.camera}
        for k, record in enumerate(model.record):
            if record.name not in used:
                raise self.file.error(
                    ("record", k, "name"), f"no [[camera]] says record = '{record.name}'; add that, or leave it out"
                )
            self._check_name("instruments", ("record", k, "format"), record.format)
        for k, part in enumerate(model.camera):
            self._check(k, part)

    def _check_name(self, kind: Any, key: tuple[str | int, ...], name: str | None) -> None:
        import creepkit as ck

        known = ck.available(kind)
        if name is not None and name not in known:
            raise self.file.error(key, f"there is no format '{name}'; {nearest(name, known)}")

    def _check(self, number: int, part: CameraPart) -> None:
        place = ("camera", number)
        self._check_name("cameras", (*place, "format"), part.format)
        pairs: tuple[tuple[str, str], ...] = (
            ("format", "columns"),
            ("times", "interval_s"),
            ("operator", "window_mm"),
            ("operator", "rings_mm"),
        )
        pairs += (("window_mm", "rings_mm"), ("lag_s", "search_s"), ("record", "load"), ("record", "temperature_C"))
        for first, second in pairs:
            if getattr(part, first) not in (None, {}) and getattr(part, second) not in (None, {}):
                raise self.file.error((*place, second), f"contradicts {first}; leave one of them out")
        for name in ("channels", "lag_s", "search_s", "camera_start"):
            if part.record is None and getattr(part, name) not in (None, {}):
                raise self.file.error((*place, name), "belongs to a record; say record = its name")
        if part.record is None and (len(part.load) != 1 or part.temperature_C is None):
            raise self.file.error(
                place, "does not say what was imposed; give record, or load and temperature_C, as load = { ... = 5 }"
            )
        if part.names and part.centers_mm and len(part.names) != len(part.centers_mm):
            raise self.file.error(
                (*place, "names"),
                f"are {len(part.names)}, and centers_mm {len(part.centers_mm)}; give one name of each",
            )
        if len(set(part.names)) < len(part.names):
            raise self.file.error((*place, "names"), "stand there twice; each test piece has its own")
        self._record_number(number)
        self.operator(number)
        self.rest(number)
        self.camera_start(number)
        self.loading(number)
        arguments.lengths_of(self.file, (*place, "lengths"), part.lengths, self.specimen(number))

    # ---- settings as arguments --------------------------------------------------------------------------------------

    def specimen(self, number: int) -> Specimen:
        """What a camera watched: as it says, else the specimen of the study, else the one of ck.extract."""
        import creepkit as ck

        part, place = self.parts[number], ("camera", number)
        if part.specimen is None and self.file.model.specimen is not None:
            found, key = arguments.specimen_of_study(self.file), ("specimen", "name")
        else:
            key = (*place, "specimen") if part.specimen is not None else place  # type: ignore[assignment]
            with self.file.at(*key):
                found = ck.specimen(part.specimen or WATCHED)
        if not isinstance(found, SupportsSurfaceObservation):
            watched = [n for n, s in ck.available("specimens").items() if isinstance(s, SupportsSurfaceObservation)]
            raise self.file.error(
                key, f"specimen '{found.name}' does not say how cameras see its surface; {nearest(found.name, watched)}"
            )
        return found

    def operator(self, number: int) -> str:
        """What is made of the points."""
        part, specimen = self.parts[number], self.specimen(number)
        if part.operator is not None:
            return part.operator
        with self.file.at("camera", number, "rings_mm" if part.rings_mm else "window_mm"):
            return operator_of(specimen, part.window_mm, part.rings_mm or ())

    def rest(self, number: int) -> slice | None:
        """Frames at rest, where they are not to be found."""
        text = self.parts[number].rest_frames
        if text is None:
            return None
        first, _, last = (one.strip() for one in text.partition("-"))
        if not (first + last).isascii() or not first.isdecimal() or not last.isdecimal() or int(first) > int(last):
            raise self.file.error(
                ("camera", number, "rest_frames"), f"'{text}' is not known; write the first and the last, as \"0-39\""
            )
        return slice(int(first[:9]), int(last[:9]) + 1)

    def camera_start(self, number: int) -> float | None:
        """Unix time of the camera's time zero, s."""
        text = self.parts[number].camera_start
        if text is None:
            return None
        try:
            start = datetime.fromisoformat(text)
        except ValueError:
            start = None
        if start is None or start.tzinfo is None:
            raise self.file.error(
                ("camera", number, "camera_start"), f"'{text}' is not known; write \"2025-08-18T18:51:53-05:00\""
            )
        return start.timestamp()

    def loading(self, number: int) -> tuple[Loading | float, Any] | None:
        """Load and temperature, K, where there is no record."""
        part, place = self.parts[number], ("camera", number)
        if part.record is not None:
            return None
        specimen = self.specimen(number)
        kinds = {load.name: load.kind for load in loads_of(specimen)}
        ((key, steps),) = part.load.items()
        name, unit = arguments.quantity(self.file, (*place, "load", key), kinds)
        assert part.temperature_C is not None
        with self.file.at(*place, "load", key):
            levels = [(start, kinds[name].convert(v, unit, "it", name)) for start, v in arguments.steps_of(steps)]
            load = next(one for one in loads_of(specimen) if one.name == name)
            end = max(2.0 * levels[-1][0], 1e9)
            loading = stepped_load(name, load, levels, control=None, ramp=part.ramp_s, end=end)
        return loading, arguments.temperature_of(self.file, (*place, "temperature_C"), part.temperature_C)

    # ---- stages ------------------------------------------------------------------------------------------------------

    def stages(self, cameras: Sequence[CameraFiles], files: Sequence[InputFile]) -> list[Stage]:
        """An extraction of each camera, and what its record imposed. files : with their hashes."""
        hashes = {one.path: [one.name, one.sha256] for one in files}
        stages = []
        for k, (part, own) in enumerate(zip(self.parts, cameras, strict=True)):
            stages.append(self._extraction(k, part, own, hashes))
            if part.record is not None:
                stages.append(self._imposed(k, part, own, hashes))
        return stages

    def _extraction(self, number: int, part: CameraPart, own: CameraFiles, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        specimen, operator, rest = self.specimen(number), self.operator(number), self.rest(number)
        centers = part.centers_mm or None
        named: Any = centers
        if centers is not None:
            names = part.names or [f"D{k + 1}" for k in range(len(centers))]
            named = {name: (x, y) for name, (x, y) in zip(names, centers, strict=True)}

        def make(results: Results, tick: Tick) -> ExtractedTests:
            frames = ck.read_frames(list(own.frames), _format(part), own.times)
            if part.interval_s is not None:
                frames = replace(frames, times=part.interval_s * np.arange(len(frames), dtype=float))
            frames = replace(_reporting(frames, tick), name=part.name)
            found = ck.extract(frames, specimen, operator=operator, centers=named, rest=rest, subset=part.subset_mm)
            if part.names and centers is None:
                if len(part.names) != len(found):
                    raise HistoryError(
                        f"{len(found)} test pieces were found, and {len(part.names)} names are given; give their "
                        "centers_mm, or as many names"
                    )
                found = [one.replace(name=name) for one, name in zip(found, part.names, strict=True)]
            return ExtractedTests(tuple(_without_folders(one, own.frames[0].parent) for one in found))

        settings = [
            {"frames": [hashes[path] for path in own.frames], "times": own.times and hashes[own.times]},
            {name: getattr(part, name) for name in ("name", "format", "columns", "interval_s", "names", "subset_mm")},
            [operator, part.centers_mm, part.rest_frames, predictor_fingerprint(specimen)],
        ]
        return Stage(_extraction_name(part), "extraction", "", settings, make, record=ExtractedTests)

    def _imposed(self, number: int, part: CameraPart, own: CameraFiles, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        index = self._record_number(number)
        assert index is not None
        assert own.record is not None
        record, path, need = self.file.model.record[index], own.record, _extraction_name(part)
        search = None if part.search_s is None else (part.search_s[0], part.search_s[1])
        start = self.camera_start(number)

        def make(results: Results, tick: Tick) -> ImposedOnTests:
            read = ck.read_record(path, record.format, **_record_options(record))
            found = []
            tests: tuple[Extraction, ...] = results[need].tests
            for k, one in enumerate(tests):
                tick("align clocks", k, len(tests))
                channels = part.channels.get(one.name, part.channels.get(""))
                try:
                    found.append(imposed_on(one, read, channels, lag=part.lag_s, search=search, camera_start=start))
                except CreepkitError as error:
                    raise StudyError(f"{one.name}: {error}") from None
            return ImposedOnTests(tuple(found))

        settings = [hashes[path], record.model_dump(), part.channels, [part.lag_s, part.search_s, part.camera_start]]
        return Stage(_record_name(part), "record", "", settings, make, (need,), ImposedOnTests)

    # ---- tests -------------------------------------------------------------------------------------------------------

    def extractions(self, results: Any) -> dict[str, Extraction]:
        """{name of a test: its extraction} of the cameras whose stages did not fail."""
        made = (part for part in self.parts if _extraction_name(part) in results)
        return {f"{p.name} {one.name}": one for p in made for one in results[_extraction_name(p)].tests}

    def imposed(self, results: Any) -> dict[str, Imposed]:
        """{name of a test: what its record says was imposed}."""
        made = [p for p in self.parts if p.record is not None and _record_name(p) in results]
        return {
            f"{part.name} {one.name}": under
            for part in made
            for one, under in zip(results[_extraction_name(part)].tests, results[_record_name(part)].tests, strict=True)
        }

    def histories(self, results: Any) -> list[History]:
        """The tests of the cameras whose stages did not fail."""
        under, found = self.imposed(results), []
        numbers = {part.name: k for k, part in enumerate(self.parts)}
        for part in self.parts:
            for one in results[_extraction_name(part)].tests if _extraction_name(part) in results else ():
                name = f"{part.name} {one.name}"
                if part.record is not None and name not in under:
                    continue
                with self.file.at("camera", numbers[part.name]):
                    found.append(self._history(numbers[part.name], name, one, under.get(name)))
        return found

    def _history(self, number: int, name: str, one: Extraction, under: Imposed | None) -> History:
        part = self.parts[number]
        stated = self.loading(number)
        if stated is None:
            assert under is not None
            history = history_of(one, under)
        else:
            history = one.history_under(*stated)
        lengths = arguments.lengths_of(self.file, ("camera", number, "lengths"), part.lengths, self.specimen(number))
        return history.replace(
            name=name,
            alloy=part.alloy or "",
            elastic=None if part.modulus_GPa is None else Elastic(1e3 * part.modulus_GPa, part.poisson),
            geometry={**history.geometry, **lengths},
            labels={**history.labels, **part.labels},
            source=f"{part.frames[0]} ({one.name})",
        )

    def flagged(self, results: Any) -> list[Exclusion]:
        """Frames that an extraction does not use, with the reasons, as the camera counts them."""
        return [
            Exclusion(name, flag.frames, f"{flag.kind}, frames as the camera counts them: {flag.reason}")
            for name, one in self.extractions(results).items()
            for flag in one.flags
        ]


def _extraction_name(part: CameraPart) -> str:
    return f"extraction of {part.name}"


def _record_name(part: CameraPart) -> str:
    return f"record of {part.name}"


def _format(part: CameraPart) -> Any:
    return part.columns or part.format


def _record_options(part: RecordPart) -> Any:
    options: dict[str, Any] = {
        name: getattr(part, name)
        for name in ("time", "date", "time_unit", "date_order", "time_zone", "every", "units", "missing")
    }
    options["pressure_reference"] = part.pressure_reference or ""
    return {**options, "ambient_pressure": part.ambient_pressure_MPa}


def _reporting(frames: Frames, tick: Callable[[str, int, int], None]) -> Frames:
    """The same frames; each that is read counts as progress."""
    done: set[int] = set()

    def read(index: int) -> Any:
        done.add(index)
        tick("frames", len(done), len(frames))
        return frames.read_frame(index)

    return replace(frames, read_frame=read)


def _without_folders(extraction: Extraction, folder: Path) -> Extraction:
    """Reasons of flags without the place of the files on this machine, which are the same wherever they lie."""
    flags = tuple(
        replace(flag, reason=flag.reason.replace(f"{folder}/", "").replace(f"{folder}\\", "")[:MOST_REASON])
        for flag in extraction.flags
    )
    return extraction.replace(flags=flags)
