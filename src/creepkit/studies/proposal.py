"""A commented study file for measured files: what they hold, laws that suit it, and stages that it allows."""

from __future__ import annotations

import os.path
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from creepkit.errors import CreepkitError, StudyError
from creepkit.inverse.duration import needs_durations, rests_on_durations
from creepkit.records import History
from creepkit.registry.reading import read_those_that_can_be
from creepkit.studies import proposed_tables as tables
from creepkit.studies.camera_proposal import proposed_cameras
from creepkit.studies.data_summary import DataSummary
from creepkit.studies.study_file import parse_study
from creepkit.studies.swapped_units import swapped_units

SECONDARY_LAWS = ["norton", "strain-hardening", "time-hardening"]
SEVERAL_STRESSES_LAW = "hyperbolic-sine"
TERTIARY_LAWS = ["norton", "mpc-omega", "kachanov-rabotnov"]
DAMAGE_LAWS = ["norton", "kachanov-rabotnov"]
"""Candidates, those of them that are installed; of damage where rupture times stand beside minimum rates, for damage
gives rates and times exponents of stress and temperature of their own."""


TERTIARY_SHARE = 0.3
"""Of the tests with curves, from which on laws with tertiary creep are the candidates."""


STRESS_RATIO = 1.5
"""Largest over smallest load, from which laws with another dependence on stress can be told apart."""


MOST_FOLDERS, MOST_FILES_TRIED, MOST_FOLDERS_NAMED = 40, 3, 4
"""Folders below one without tests that are looked into, files that are read of each, and folders that are named."""


@dataclass(frozen=True)
class StudyProposal:
    """The text of a study file, and what the files were found to hold, in lines."""

    text: str
    summary: tuple[str, ...]


def propose_study(folder: Path, path: Path, reader: str | None = None) -> StudyProposal:
    """The study file at `path` for the measured files of a folder; StudyError where none of them can be read."""
    import creepkit as ck

    if not folder.is_dir():
        raise StudyError(f"{folder}: there is no such folder; name the one that holds the measured files")
    base = os.path.relpath(folder, path.absolute().parent).replace("\\", "/")
    names, tests, problems, failure = _readable(folder, path, reader)
    cameras = proposed_cameras(folder, path, [folder / name for name in names], base)
    if not tests and not cameras.lines:
        raise failure or StudyError(f"{folder}: none of its files holds a test")
    if not tests:
        parts = [tables.study(folder), cameras.lines, *tables.tests_of_cameras(_installed(SECONDARY_LAWS))]
        text = tables.text_of(parts)
        parse_study(path, text)
        return StudyProposal(text, cameras.summary)
    known = {str(one) for one in cameras.files}
    problems = [f"not read: {one}" for one in problems if one.split(":")[0] not in known][: tables.MOST_REMARKS]
    files = [name if base == "." else base if name == "." else f"{base}/{name}" for name in names]
    quality = ck.check_data_quality([history for history in tests if history.outputs])
    summary, left_out = DataSummary.of(tests), tables.left_out_lines(quality)
    doubts = [f"check the units: {one}" for one in swapped_units(tests)]
    found = [*summary.lines, *(f"C{one[1:]}" for one in doubts)]
    data = tables.data(files, reader, summary.temperatures, found, left_out, problems)
    parts = [tables.study(folder), cameras.lines, data, tables.exclude(quality)]
    text = tables.text_of([*parts, *tables.stages(summary, candidate_laws(summary), TERTIARY_LAWS)])
    parse_study(path, text)  # what is written must be valid
    return StudyProposal(text, (*summary.lines, *doubts, *left_out, *cameras.summary, *problems))


def _readable(
    folder: Path, path: Path, reader: str | None
) -> tuple[list[str], list[History], list[str], StudyError | None]:
    """Patterns of the files that hold tests, these tests, a sentence for each other file, and why there are none."""
    import creepkit as ck

    files = [one for one in sorted(folder.iterdir()) if one.is_file() and one.name[0] != "." and one != path]
    try:
        whole = ck.read_histories([folder], reader)
    except CreepkitError as error:
        reason = str(error)
    else:
        sources = {Path(history.source.partition(" (")[0]).name for history in whole}
        endings = {Path(name).suffix for name in sources}
        suffix = endings.pop() if len(endings) == 1 else ""
        complete = suffix and all(file.name in sources for file in files if file.suffix == suffix)
        return [f"*{suffix}" if complete else "."], whole, [], None
    read, tests, errors = read_those_that_can_be(files, reader)
    problems = [" ".join(str(error).split()) for error in errors]
    if not tests:
        below = _folders_with_tests(folder, reader)
        what = f"holds a test that can be read: {reason}"
        if below:
            named = " or ".join(f"'{one}'" for one in below)
            what = (
                f"holds a test, but those of {named} do: run 'creepkit init {below[0]}', or 'creepkit init {below[0]} "
                f"--to {path}' to keep the study file here"
            )
        return [], [], problems, StudyError(f"{folder}: none of its files {what}")
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


def _installed(names: Sequence[str]) -> list[str]:
    import creepkit as ck

    installed = ck.available("laws")
    return [name for name in names if name in installed]


def candidate_laws(summary: DataSummary) -> list[str]:
    """Names of laws that suit the tests, of those that are installed."""
    import creepkit as ck

    names = TERTIARY_LAWS if summary.tertiary > TERTIARY_SHARE * len(summary.framed) else SECONDARY_LAWS
    if summary.rupture_table and _installed(DAMAGE_LAWS) == DAMAGE_LAWS:
        names = DAMAGE_LAWS
    judged = summary.durations_known
    chosen = [name for name in _installed(names) if judged or not needs_durations(ck.law(name))]
    testable = [name for name in chosen if not rests_on_durations(ck.law(name), summary.tests)]
    judged, chosen = judged and testable == chosen, testable
    if len(summary.loads) > 2 and summary.loads[-1] > STRESS_RATIO * summary.loads[0] and names is SECONDARY_LAWS:
        chosen += _installed([SEVERAL_STRESSES_LAW])
    return chosen if len(chosen) > 1 or not judged else _installed(SECONDARY_LAWS)
