"""Cameras of a study file: their files, what contradicts itself, and what their tables say as arguments."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from creepkit.api.extraction import WATCHED, operator_of
from creepkit.api.planned_tests import stepped_load
from creepkit.cameras.sequences import in_order
from creepkit.errors import HistoryError, nearest
from creepkit.records import Loading, Specimen, SupportsSurfaceObservation, loads_of
from creepkit.registry.reading import frame_files
from creepkit.studies import arguments
from creepkit.studies.inputs import resolve_paths
from creepkit.studies.model import CameraPart
from creepkit.studies.study_file import StudyFile


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
                frames = frame_files(paths[0], format_of(part))
            elif any(path.is_dir() for path in paths):
                raise HistoryError("names a folder beside others; give one folder, or files of frames")
            else:
                frames = in_order(paths) if len(part.frames) == 1 else paths
        times = self._one(("camera", number, "times"), part.times)
        index = self.record_number(number)
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

    def record_number(self, number: int) -> int | None:
        """Which [[record]] a camera names; None where it names none."""
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
        for k, part in enumerate(model.camera):
            self._check(k, part)
        used = {part.record for part in model.camera}
        for k, record in enumerate(model.record):
            if record.name not in used:
                raise self.file.error(
                    ("record", k, "name"), f"no [[camera]] says record = '{record.name}'; add that, or leave it out"
                )
            self._check_name("instruments", ("record", k, "format"), record.format)

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
        self.record_number(number)
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
            levels = [(start, kinds[name].convert(v, unit, "", name)) for start, v in arguments.steps_of(steps)]
            load = next(one for one in loads_of(specimen) if one.name == name)
            end = max(2.0 * levels[-1][0], 1e9)
            loading = stepped_load(name, load, levels, control=None, ramp=part.ramp_s, end=end)
        return loading, arguments.temperature_of(self.file, (*place, "temperature_C"), part.temperature_C)


def format_of(part: CameraPart) -> Any:
    """The camera format as ck.read_frames takes it."""
    return part.columns or part.format
