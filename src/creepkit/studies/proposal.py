"""A commented study file for measured files: what they hold, laws that suit it, and stages that it allows."""

from __future__ import annotations

import json
import os.path
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import Any

from creepkit.errors import CreepkitError, StudyError
from creepkit.inverse.candidates import measured_exponent, named_candidates
from creepkit.inverse.compared_tests import duration_known, followed_duration
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.quality import FRAME_FLAG_KINDS, DataQuality
from creepkit.quality.curve_shapes import shows_tertiary_creep
from creepkit.quality.flags import frame_ranges_text
from creepkit.readers.questions import ANSWERS_FILE, Question, single_errors
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, History, dimensions_of, load_unit
from creepkit.records.held_levels import held_temperatures
from creepkit.records.units import celsius_text
from creepkit.registry.reading import read_those_that_can_be
from creepkit.reports.histories import kind_of_test, strain_rate
from creepkit.studies.camera_proposal import found_cameras
from creepkit.studies.study_file import parse_study

PLANNED_LAWS = ["norton", "strain-hardening", "time-hardening", "hyperbolic-sine"]
"""Of tests that cameras are still to be read of: those of Table 1 of Chen et al."""


FEWEST_TEMPERATURES, FEWEST_RATES = 3, 3
"""For forms of temperature; and minimum rates at each of these, where there is no curve: one more than A and n."""


FEWEST_TO_JUDGE = 30
"""Readings of a test below which its noise is not known from them (inverse.known_noise)."""


MOST_REMARKS = 20
"""Files that were not read, and flags, that the comments name."""


MOST_FOLDERS, MOST_FILES_TRIED, MOST_FOLDERS_NAMED = 40, 3, 4
"""Folders below one without tests that are looked into, files that are read of each, and folders that are named."""


@dataclass(frozen=True)
class StudyProposal:
    """The text of a study file, and what the files were found to hold, in lines; alloys : of a table beside it."""

    text: str
    summary: tuple[str, ...]
    alloys: str = ""


def propose_study(folder: Path, path: Path, reader: str | None = None) -> StudyProposal:
    """The study file at `path` for the measured files of a folder; StudyError where none of them can be read."""
    import creepkit as ck

    if not folder.is_dir():
        raise StudyError(f"{folder}: there is no such folder; name the one that holds the measured files")
    base = os.path.relpath(folder, path.absolute().parent).replace("\\", "/")
    names, tests, problems, failure = _readable(folder, path, reader)
    cameras = found_cameras(folder, path, [folder / name for name in names], base)
    known: dict[str, Any] = {"title": title_of(tests, folder.absolute()), "cameras": cameras, "summary": None}
    known["report"] = "report.html" if path.stem == "study" else f"{path.stem}.html"
    lines = cameras.summary
    if tests:
        named = {str(one) for one in cameras.names}
        problems = [f"not read: {one}" for one in problems if one.split(":")[0] not in named][:MOST_REMARKS]
        if any(ANSWERS_FILE in one for one in problems):
            problems.append(f"'creepkit read {folder} --ask' puts what is open as questions")
        quality = ck.check_data_quality([history for history in tests if history.outputs])
        problems += [str(one) for one in quality if one.kind == "modulus"]
        summary, left_out = DataSummary.of(tests), left_out_lines(quality)
        lines = (*summary.lines, *left_out, *cameras.summary, *problems)
        known |= {
            "files": [name if base == "." else base if name == "." else f"{base}/{name}" for name in names],
            "reader": reader, "summary": summary, "left_out": left_out, "problems": problems,
            "copies": [one for one in quality if one.kind == "copy"],
            "flags": [
                one
                for one in quality
                if len(one.tests) == 1 and one.kind not in ("copy", "modulus", *FRAME_FLAG_KINDS)
            ][:MOST_REMARKS],
            **(_identification(summary) if summary.framed else {}),
        }  # fmt: skip
    elif cameras.cameras:
        known["laws"] = PLANNED_LAWS
    else:
        raise failure or StudyError(f"{folder}: none of its files holds a test")
    text = rendered(known)
    parse_study(path, text)  # what is written must be valid
    return StudyProposal(text, lines, cameras.empty_alloys)


CAMPAIGN_LABELS = "heat", "cast", "batch", "campaign", "project"
"""Of tests, beside their alloy: what a study may be called after."""


PLAIN_FOLDERS = {"data", "daten", "raw", "tests", "measurements", "messdaten", "messungen", "curves", "csv", "input"}
"""Names that say nothing of what was tested; the folder around says more."""


MOST_TITLED = 3
"""Alloys that a title names."""


def title_of(tests: Sequence[History], folder: Path) -> str:
    """What a study is called: the alloys of its tests, a label that all of them share, or a folder that says more."""
    alloys = dict.fromkeys(one.alloy for one in tests)
    if tests and all(alloys) and len(alloys) <= MOST_TITLED:
        return ", ".join(alloys)
    for key in CAMPAIGN_LABELS:
        values = {one.labels.get(key, "") for one in tests}
        if len(values) == 1 and (value := values.pop()):
            return f"{key} {value}"
    return next((one.name for one in (folder, folder.parent) if one.name.casefold() not in PLAIN_FOLDERS), "")


def one_line(text: str, length: int = 200) -> str:
    """A text without what cannot be seen, of bounded length."""
    return "".join(character if character.isprintable() else "?" for character in text)[:length]


def rendered(known: Mapping[str, Any]) -> str:
    """The text of the study file of which this is known."""
    from jinja2 import Environment, StrictUndefined

    filters: dict[str, Any] = {
        "toml": lambda value: json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f"),
        "line": one_line,
        "comment": lambda text: f"# {one_line(text)}",
        "wrapped": lambda flag: wrap(one_line(str(flag), 2000), 116, break_long_words=False, break_on_hyphens=False),
        "ranges": frame_ranges_text,
    }
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= filters
    template = environment.from_string(
        files("creepkit.studies").joinpath("proposed_study.toml.jinja").read_text("utf-8")
    )
    limits = {
        "fewest_temperatures": FEWEST_TEMPERATURES,
        "fewest_ruptures": FEWEST_RUPTURES,
        "fewest_rates": FEWEST_RATES,
    }
    return re.sub(r"\n{3,}", "\n\n", template.render({**known, **limits})).rstrip("\n") + "\n"


def left_out_lines(quality: DataQuality) -> list[str]:
    """What is left out of the tests: of each its suspect frames with their kind, and copies of other tests."""
    flags = [one for one in quality if one.kind in FRAME_FLAG_KINDS]
    lines = [f"left out of {one.history}: {frame_ranges_text(one.frames)} ({one.kind}: {one.reason})" for one in flags]
    lines += [f"left out: {one.history} ({one.reason})" for one in quality if one.kind == "copy"]
    more = len(lines) - MOST_REMARKS
    return [*lines[:MOST_REMARKS], *([f"left out: parts of {more} more tests"] if more > 0 else [])]


def _identification(summary: DataSummary) -> dict[str, Any]:
    """What the tables [identification] and [[forecast]] say of the laws, and of the first test that has a curve."""
    import creepkit as ck
    from creepkit.surrogates.surrogate import reduced_order_models

    laws, one = list(named_candidates(summary.framed)), summary.framed[0]
    damage = {name for name in laws if "alpha" in ck.law(name).names}
    specimens = {history.specimen for history in summary.tests}
    lengths = dimensions_of(ck.available("specimens").get(summary.tests[0].specimen))
    longer = {
        "specimen": one.specimen,
        "load": "_".join(filter(None, (one.loading.quantity, load_unit(one)))),
        "level": 0.9 * float(one.loading.program().values.max()),
        "celsius": one.mean_temperature - ZERO_CELSIUS,
        "hours": 2 * followed_duration(one) / SECONDS_PER_HOUR,
        "modulus": None if one.elastic is None else one.elastic.at(one.mean_temperature).E / 1e3,
    }
    return {
        "laws": laws,
        "damage": damage,
        "damage_of_tension": damage <= {"kachanov-rabotnov", "sinh-damage"},
        "reduced": [name for name, one in reduced_order_models().items() if {one.name} == specimens],
        "lengths": [length for length in lengths if length.tolerance > 0][:1],
        "longer": longer,
    }


def _readable(
    folder: Path, path: Path, reader: str | None
) -> tuple[list[str], list[History], list[str], StudyError | None]:
    """Patterns of the files that hold tests, these tests, a sentence for each other file, and why there are none."""
    import creepkit as ck

    files = [one for one in sorted(folder.iterdir()) if one.is_file() and one.name[0] != "."]
    files = [one for one in files if one not in (path, folder / ANSWERS_FILE)]
    try:
        whole = ck.read_histories([folder], reader)
    except CreepkitError as error:
        reason, single = str(error), single_errors(error)
    else:
        sources = {Path(history.source.partition(" (")[0]).name for history in whole}
        endings = {Path(name).suffix for name in sources}
        suffix = endings.pop() if len(endings) == 1 else ""
        complete = suffix and all(file.name in sources for file in files if file.suffix == suffix)
        return [f"*{suffix}" if complete else "."], whole, [], None
    read, tests, errors = read_those_that_can_be(files, reader)
    problems = [" ".join(str(one).split()) for error in errors for one in single_errors(error)]
    if not tests:
        below = _folders_with_tests(folder, reader)
        what = f"holds a test that can be read: {reason}"
        if below:
            named = " or ".join(f"'{one}'" for one in below)
            what = (
                f"holds a test, but those of {named} do: run 'creepkit init {below[0]}', or 'creepkit init {below[0]} "
                f"--to {path}' to keep the study file here"
            )
        failure = StudyError(f"{folder}: none of its files {what}")
        if not below and any(isinstance(one, Question) for one in single):
            hint = f"{folder}: no test can be read yet; 'creepkit read {folder} --ask' puts what is open as questions"
            failure.errors = (*single, StudyError(hint))  # type: ignore[attr-defined]
        return [], [], problems, failure
    return [file.name for file in read], tests, problems, None


def _folders_with_tests(folder: Path, reader: str | None) -> list[Path]:
    """Folders below, at most two levels down, of which a file can be read as a test."""
    import creepkit as ck

    def holds_tests(one: Path) -> bool:
        for file in sorted(path for path in one.iterdir() if path.is_file())[:MOST_FILES_TRIED]:
            try:
                ck.read_histories([file], reader)
            except CreepkitError:
                continue
            return True
        return False

    below = [one for pattern in ("*", "*/*") for one in sorted(folder.glob(pattern)) if one.is_dir()]
    shown = [
        one
        for one in below
        if not any(part.startswith(".") or part.endswith(".results") for part in one.relative_to(folder).parts)
    ]
    return [one for one in shown[:MOST_FOLDERS] if holds_tests(one)][:MOST_FOLDERS_NAMED]


# ---- what tests hold -------------------------------------------------------------------------------------------------


FEWEST_RUPTURES = 5
"""For methods of rupture times."""


@dataclass(frozen=True)
class DataSummary:
    """What tests hold that decides which stages make sense.

    loads : levels but zero that are held, of all tests. temperatures : K, of distinct levels. alloys, heats : that
    are named. ruptured, tertiary : tests that ended by rupture, and those with tertiary creep.
    """

    tests: tuple[History, ...]
    loads: tuple[float, ...]
    temperatures: tuple[float, ...]
    alloys: tuple[str, ...]
    heats: tuple[str, ...]
    ruptured: int
    tertiary: int

    @classmethod
    def of(cls, tests: Sequence[History]) -> DataSummary:
        """The summary of tests."""
        levels: list[float] = []
        for temperature in sorted(value for history in tests for value in held_temperatures(history)):
            if not levels or temperature > levels[-1] + ISOTHERMAL_RANGE:
                levels.append(temperature)
        exponent = measured_exponent(tests)
        return cls(
            tuple(tests),
            tuple(sorted({round(float(v), 6) for h in tests for v in _held_levels(h)})),
            tuple(levels),
            tuple(dict.fromkeys(h.alloy for h in tests if h.alloy)),
            tuple(dict.fromkeys(h.labels["heat"] for h in tests if h.labels.get("heat"))),
            sum(history.rupture_time is not None for history in tests),
            sum(shows_tertiary_creep(history, exponent) for history in tests),
        )

    @property
    def framed(self) -> list[History]:
        """Tests with frames or a minimum rate, from which a law can be identified."""
        return [h for h in self.tests if h.outputs or h.minimum_rate is not None]

    @property
    def law_at_each(self) -> int:
        """How many temperatures have tests, held there, of which a law may be identified: a curve, or enough rates."""
        from creepkit.discovery.discover import isothermal_tests

        levels = list[tuple[float, int]]()
        for test in sorted(isothermal_tests(self.framed)[0], key=lambda one: one.mean_temperature):
            count = FEWEST_RATES if test.outputs else 1
            if levels and test.mean_temperature <= levels[-1][0] + ISOTHERMAL_RANGE:
                levels[-1] = levels[-1][0], levels[-1][1] + count
            else:
                levels.append((test.mean_temperature, count))
        return sum(count >= FEWEST_RATES for _, count in levels)

    @property
    def with_curves(self) -> bool:
        """Whether any test has a curve."""
        return any(history.outputs for history in self.tests)

    @property
    def durations_known(self) -> bool:
        """Whether all tests say how long they lasted."""
        return all(map(duration_known, self.tests))

    @property
    def rupture_table(self) -> bool:
        """Whether most tests have no curves, and enough of these ended by rupture to identify damage from."""
        without_curves = [history for history in self.tests if not history.outputs]
        ruptured = sum(history.rupture_time is not None for history in without_curves)
        return 2 * len(without_curves) > len(self.tests) and ruptured >= FEWEST_RUPTURES

    @property
    def lines(self) -> list[str]:
        """It in sentences."""
        low, high, several = self.temperatures[0], self.temperatures[-1], len(self.loads) > 1
        at = celsius_text(low, high, digits=0) + (f" ({len(self.temperatures)} levels)" if high - low >= 1 else "")
        units = {load_unit(history) for history in self.tests}
        loads = f"{len(self.loads)} level{'s' if several else ''} of load"
        if len(units) == 1:
            ends = dict.fromkeys((f"{self.loads[0]:.4g}", f"{self.loads[-1]:.4g}"))
            loads += f", {' to '.join(ends)} {units.pop() or self.tests[0].loading.quantity}"
        rates = [rate for history in self.tests if (rate := strain_rate(history)) is not None]
        if len(rates) == len(self.tests):
            loads = f"strain rates of {min(rates):.2g} to {max(rates):.2g} 1/s"
        kinds = ", ".join(dict.fromkeys(h.specimen if strain_rate(h) is None else kind_of_test(h) for h in self.tests))
        stopped = sum(history.unruptured for history in self.tests)
        count = f"{len(self.tests)} test{'s' if len(self.tests) > 1 else ''} ({kinds})"
        lines = [
            f"{count}, {len(self.framed)} with curves or rates; {loads}; {at}",
            f"ended by rupture: {self.ruptured}; stopped before: {stopped}; with tertiary creep: {self.tertiary}",
        ]
        few = sum(bool(h.outputs) and h.used.sum() < FEWEST_TO_JUDGE and not h.standard_deviation for h in self.tests)
        what = f"{few} with fewer than {FEWEST_TO_JUDGE} readings, too few to judge a law by: state their strain_sd"
        return [*lines, what] if few else lines


def _held_levels(history: History) -> list[float]:
    """Levels of the load but zero that last: those of a ramp are passed."""
    values = history.loading.program().values
    held = [float(v) for v, later in pairwise((*values, values[-1])) if v == later and v != 0]
    return held or [float(max(values, key=abs))]
