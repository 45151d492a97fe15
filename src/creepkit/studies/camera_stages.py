"""Cameras and instrument records of a study: stages whose results are tests, which are identified like those of files.

Frames are extracted first, and what an instrument recorded is then put onto their clock; each is a stage of its own, so
that another time zone of a record, or another channel, leaves the frames alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.api.extraction import history_of, imposed_on
from creepkit.errors import CreepkitError, HistoryError, StudyError
from creepkit.extraction import Extraction
from creepkit.instruments.imposed import Imposed
from creepkit.inverse.fingerprints import predictor_fingerprint
from creepkit.language import Elastic
from creepkit.records import Frames, History
from creepkit.reports.contents import Exclusion
from creepkit.studies import arguments
from creepkit.studies.cameras import CameraFiles, StudyCameras, format_of
from creepkit.studies.inputs import InputFile
from creepkit.studies.model import CameraPart, RecordPart
from creepkit.studies.stage import Results, Stage, Tick

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
class CameraStages:
    """The stages of a study's cameras, and the tests that their results are."""

    cameras: StudyCameras

    def stages(self, cameras: Sequence[CameraFiles], files: Sequence[InputFile]) -> list[Stage]:
        """An extraction of each camera, and what its record imposed. files : with their hashes."""
        hashes = {one.path: [one.name, one.sha256] for one in files}
        stages = []
        for k, (part, own) in enumerate(zip(self.cameras.parts, cameras, strict=True)):
            stages.append(self._extraction(k, part, own, hashes))
            if part.record is not None:
                stages.append(self._imposed(k, part, own, hashes))
        return stages

    def _extraction(self, number: int, part: CameraPart, own: CameraFiles, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        specimen, operator, rest = (
            self.cameras.specimen(number),
            self.cameras.operator(number),
            self.cameras.rest(number),
        )
        centers = part.centers_mm or None
        named: Any = centers
        if centers is not None:
            names = part.names or [f"D{k + 1}" for k in range(len(centers))]
            named = {name: (x, y) for name, (x, y) in zip(names, centers, strict=True)}

        def make(results: Results, tick: Tick) -> ExtractedTests:
            frames = ck.read_frames(list(own.frames), format_of(part), own.times)
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
        return Stage(
            _extraction_name(part), "extraction", "", settings, make, _numbers_of_frames, record=ExtractedTests
        )

    def _imposed(self, number: int, part: CameraPart, own: CameraFiles, hashes: Mapping[Path, list[str]]) -> Stage:
        import creepkit as ck

        index = self.cameras.record_number(number)
        assert index is not None
        assert own.record is not None
        record, path, need = self.cameras.file.model.record[index], own.record, _extraction_name(part)
        search = None if part.search_s is None else (part.search_s[0], part.search_s[1])
        start = self.cameras.camera_start(number)

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
        return Stage(_record_name(part), "record", "", settings, make, _numbers_of_records, (need,), ImposedOnTests)

    # ---- tests -------------------------------------------------------------------------------------------------------

    def extractions(self, results: Any) -> dict[str, Extraction]:
        """{name of a test: its extraction} of the cameras whose stages did not fail."""
        made = (part for part in self.cameras.parts if _extraction_name(part) in results)
        return {f"{p.name} {one.name}": one for p in made for one in results[_extraction_name(p)].tests}

    def imposed(self, results: Any) -> dict[str, Imposed]:
        """{name of a test: what its record says was imposed}."""
        made = [p for p in self.cameras.parts if p.record is not None and _record_name(p) in results]
        return {
            f"{part.name} {one.name}": under
            for part in made
            for one, under in zip(results[_extraction_name(part)].tests, results[_record_name(part)].tests, strict=True)
        }

    def histories(self, results: Any) -> list[History]:
        """The tests of the cameras whose stages did not fail."""
        under, found = self.imposed(results), []
        numbers = {part.name: k for k, part in enumerate(self.cameras.parts)}
        for part in self.cameras.parts:
            for one in results[_extraction_name(part)].tests if _extraction_name(part) in results else ():
                name = f"{part.name} {one.name}"
                if part.record is not None and name not in under:
                    continue
                with self.cameras.file.at("camera", numbers[part.name]):
                    found.append(self._history(numbers[part.name], name, one, under.get(name)))
        return found

    def _history(self, number: int, name: str, one: Extraction, under: Imposed | None) -> History:
        part = self.cameras.parts[number]
        stated = self.cameras.loading(number)
        if stated is None:
            assert under is not None
            history = history_of(one, under)
        else:
            history = one.history_under(*stated)
        lengths = arguments.lengths_of(
            self.cameras.file, ("camera", number, "lengths"), part.lengths, self.cameras.specimen(number)
        )
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


def _extraction_name(part: CameraPart) -> str:
    return f"extraction of {part.name}"


def _record_name(part: CameraPart) -> str:
    return f"record of {part.name}"


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
