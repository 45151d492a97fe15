"""A commented study file for measured files: what they hold, laws that suit it, and stages that it allows."""

from __future__ import annotations

import os.path
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from creepkit.errors import CreepkitError, StudyError
from creepkit.inverse.duration import duration_known, followed_duration, needs_durations, rests_on_durations
from creepkit.inverse.held_levels import held_temperatures
from creepkit.quality import DataQuality
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, History, dimensions_of, load_unit
from creepkit.records.units import celsius_text
from creepkit.studies.camera_proposal import CameraProposal, proposed_cameras, text_of_cameras
from creepkit.studies.exclusion_proposal import MOST_REMARKS, exclude_part, left_out_lines
from creepkit.studies.folders import folders_with_tests
from creepkit.studies.study_file import parse_study
from creepkit.studies.swapped_units import swapped_units
from creepkit.studies.tertiary_creep import shows_tertiary_creep
from creepkit.studies.toml_text import CITATION_LINE, comment, quoted, quoted_list, study_part

SECONDARY_LAWS = ("norton", "strain-hardening", "time-hardening")
SEVERAL_STRESSES_LAW = "hyperbolic-sine"
TERTIARY_LAWS = ("norton", "mpc-omega", "kachanov-rabotnov")
DAMAGE_LAWS = ("norton", "kachanov-rabotnov")
"""Candidates, those of them that are installed; of damage where rupture times stand beside minimum rates, for damage
gives rates and times exponents of stress and temperature of their own."""


TERTIARY_SHARE = 0.3
"""Of the tests with curves, from which on laws with tertiary creep are the candidates."""


STRESS_RATIO = 1.5
"""Largest over smallest load, from which laws with another dependence on stress can be told apart."""


FEWEST_TEMPERATURES = 3
FEWEST_RUPTURES = 5
"""For forms of temperature, and for methods of rupture times."""


SAME_TEMPERATURE = 5.0
"""K."""


@dataclass(frozen=True)
class StudyProposal:
    """The text of a study file, and what the files were found to hold, in lines."""

    text: str
    summary: tuple[str, ...]


@dataclass(frozen=True)
class DataSummary:
    """What tests hold that decides which stages make sense.

    loads : levels above zero that are held, of all tests. temperatures : K, of distinct levels. alloys, heats : that
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
            if not levels or temperature > levels[-1] + SAME_TEMPERATURE:
                levels.append(temperature)
        return cls(
            tuple(tests),
            tuple(sorted({round(float(v), 6) for h in tests for v in _held_levels(h)})),
            tuple(levels),
            tuple(dict.fromkeys(h.alloy for h in tests if h.alloy)),
            tuple(dict.fromkeys(h.labels["heat"] for h in tests if h.labels.get("heat"))),
            sum(history.rupture_time is not None for history in tests),
            sum(shows_tertiary_creep(history) for history in tests),
        )

    @property
    def framed(self) -> int:
        """Tests with frames or a minimum rate, from which a law can be identified."""
        return sum(bool(h.outputs) or h.minimum_rate is not None for h in self.tests)

    @property
    def rupture_table(self) -> bool:
        """Whether most tests have no curves, and enough of these ended by rupture to identify damage from."""
        tables = [history for history in self.tests if not history.outputs]
        ruptured = sum(history.rupture_time is not None for history in tables)
        return 2 * len(tables) > len(self.tests) and ruptured >= FEWEST_RUPTURES

    @property
    def lines(self) -> list[str]:
        """It in sentences."""
        low, high = self.temperatures[0], self.temperatures[-1]
        kinds = ", ".join(dict.fromkeys(history.specimen for history in self.tests))
        at = celsius_text(low, high, digits=0)
        at += f" ({len(self.temperatures)} levels)" if high - low >= 1 else ""
        unit = load_unit(self.tests[0])
        loads = f"{len(self.loads)} level{'s' if len(self.loads) > 1 else ''} of load"
        if len({load_unit(history) for history in self.tests}) == 1:
            loads += (
                f", {self.loads[0]:g} to {self.loads[-1]:g} {unit or self.tests[0].loading.quantity}"
                if len(self.loads) > 1
                else f", {self.loads[0]:g}"
            )
        count = f"{len(self.tests)} test{'s' if len(self.tests) > 1 else ''}"
        return [
            f"{count} ({kinds}), {self.framed} with curves or rates; {loads}; {at}",
            f"ended by rupture: {self.ruptured}; with tertiary creep: {self.tertiary}",
        ]


def _held_levels(history: History) -> list[float]:
    """Levels of the load above zero that last: those of a ramp are passed."""
    program = history.loading.program()
    values = program.values
    held = [float(v) for v, later in pairwise((*values, values[-1])) if v == later and v > 0]
    return held or [float(values.max())]


def propose_study(folder: Path, path: Path, reader: str | None = None) -> StudyProposal:
    """The study file at `path` for the measured files of a folder; StudyError where none of them can be read."""
    import creepkit as ck

    if not folder.is_dir():
        raise StudyError(f"{folder}: there is no such folder; name the one that holds the measured files")
    base = os.path.relpath(folder, path.absolute().parent).replace("\\", "/")
    try:
        names, tests, problems = _readable(folder, path, reader)
    except StudyError:
        cameras = proposed_cameras(folder, path, (), base)
        if not cameras.lines:
            raise
        text = text_of_cameras(folder, cameras, SECONDARY_LAWS)
        parse_study(path, text)
        return StudyProposal(text, cameras.summary)
    cameras = proposed_cameras(folder, path, [folder / name for name in names], base)
    known = {str(one) for one in cameras.files}
    problems = [one for one in problems if one.split(":")[0] not in known]
    files = [name if base == "." else base if name == "." else f"{base}/{name}" for name in names]
    quality = ck.check_data_quality([history for history in tests if history.outputs])
    summary = DataSummary.of(tests)
    text = _text(folder, files, reader, summary, quality, problems, cameras)
    parse_study(path, text)  # what is written must be valid
    doubts = [f"check the units: {line}" for line in swapped_units(tests)]
    return StudyProposal(
        text,
        (
            *summary.lines,
            *doubts,
            *left_out_lines(quality),
            *cameras.summary,
            *(f"not read: {line}" for line in problems[:MOST_REMARKS]),
        ),
    )


def _visible_files(folder: Path) -> list[Path]:
    return sorted(one for one in folder.iterdir() if one.is_file() and one.name[0] != ".")


def _readable(folder: Path, path: Path, reader: str | None) -> tuple[list[str], list[History], list[str]]:
    """Patterns of the files that hold tests, these tests, and a sentence for each other file."""
    import creepkit as ck

    try:
        whole = ck.read_histories([folder], reader)
        files = [one for one in _visible_files(folder) if one != path]
        sources = {Path(history.source.partition(" (")[0]).name for history in whole}
        if not all(file.name in sources for file in files if file.suffix == _suffix(sources)):
            return ["."], whole, []
        return [f"*{_suffix(sources)}"] if _suffix(sources) else ["."], whole, []
    except CreepkitError as error:
        reason = str(error)
    tests: list[History] = []
    read: list[Path] = []
    problems: list[str] = []
    for file in (one for one in _visible_files(folder) if one != path):
        try:
            found = ck.read_histories([file], reader)
        except CreepkitError as error:
            problems.append(" ".join(str(error).split()))
            continue
        read.append(file)
        tests += found
    if not tests:
        below = folders_with_tests(folder, reader)
        if below:
            named = " or ".join(f"'{one}'" for one in below)
            raise StudyError(
                f"{folder}: none of its files holds a test, but those of {named} do: run 'creepkit init {below[0]}', "
                f"or 'creepkit init {below[0]} --to {path}' to keep the study file here"
            )
        raise StudyError(f"{folder}: none of its files holds a test that can be read: {reason}")
    counts: dict[str, int] = {}
    for history in tests:
        counts[history.name] = counts.get(history.name, 0) + 1
    if max(counts.values()) > 1:
        tests = ck.read_histories(read, reader)
    return [file.name for file in read], tests, problems


def _suffix(names: Iterable[str]) -> str:
    """The ending that all names share, "" where there are several."""
    endings = {Path(name).suffix for name in names}
    return endings.pop() if len(endings) == 1 else ""


def candidate_laws(summary: DataSummary) -> list[str]:
    """Names of laws that suit the tests, of those that are installed."""
    import creepkit as ck

    installed = ck.available("laws")
    judged = all(map(duration_known, summary.tests))
    names: tuple[str, ...] = TERTIARY_LAWS if summary.tertiary > TERTIARY_SHARE * summary.framed else SECONDARY_LAWS
    if summary.rupture_table and not set(DAMAGE_LAWS) - set(installed):
        names = DAMAGE_LAWS
    chosen = [name for name in names if name in installed and (judged or not needs_durations(ck.law(name)))]
    testable = [name for name in chosen if not rests_on_durations(ck.law(name), summary.tests)]
    judged, chosen = judged and testable == chosen, testable
    several = len(summary.loads) > 2 and summary.loads[-1] > STRESS_RATIO * summary.loads[0]
    if several and names is SECONDARY_LAWS and SEVERAL_STRESSES_LAW in installed:
        chosen.append(SEVERAL_STRESSES_LAW)
    return chosen if len(chosen) > 1 or not judged else [name for name in SECONDARY_LAWS if name in installed]


# ---- the text ------------------------------------------------------------------------------------------------------


def _text(
    folder: Path,
    files: Sequence[str],
    reader: str | None,
    summary: DataSummary,
    quality: DataQuality,
    problems: Sequence[str],
    cameras: CameraProposal,
) -> str:
    parts = [
        study_part(folder),
        list(cameras.lines),
        _data_part(files, reader, summary, problems, left_out_lines(quality)),
        exclude_part(quality),
    ]
    if summary.framed:
        parts += [_identification_part(summary), _temperature_part(summary)]
    parts += [_rupture_part(summary)]
    if summary.framed:
        parts += [_forecast_part(summary), _design_part(), _export_part()]
    parts.append(
        ["[report]", 'file = "report.html"', "attach_MB = 3  # data files up to this size in all are put into it"]
    )
    return "\n\n".join("\n".join(lines) for lines in parts if lines) + "\n"


def _data_part(
    files: Sequence[str], reader: str | None, summary: DataSummary, problems: Sequence[str], left_out: Sequence[str]
) -> list[str]:
    """left_out : what is going to be left out of the tests, in sentences."""
    doubts = [comment(f"Check the units: {line}") for line in swapped_units(summary.tests)]
    lines = [*map(comment, summary.lines), *doubts, "[data]", f"files = {quoted_list(files)}"]
    lines += [f"reader = {quoted(reader)}"] if reader is not None else []
    lines += ['# ignore = ["load_kN", "date"]  # columns that nobody needs']
    if len(summary.temperatures) > 1:
        lines.append(
            f"# only = {{ temperature_C = [{summary.temperatures[0] - ZERO_CELSIUS:.0f}] }}  # these tests alone"
        )
    lines.append('suspect_frames = "exclude"  # frames that unload, fall or lie apart; or "keep"')
    lines += map(comment, left_out)
    lines.append(CITATION_LINE)
    return [*lines, *(comment(f"not read: {line}") for line in problems[:MOST_REMARKS])]


def _identification_part(summary: DataSummary) -> list[str]:
    import creepkit as ck

    laws = candidate_laws(summary)
    lines = []
    if len(summary.loads) == 1:
        lines.append("# All tests are at one load: how rates depend on stress they do not say.")
    if not all(map(duration_known, summary.tests)):
        lines.append("# Minimum rates of tests of unknown duration cannot judge laws that depend on strain or time.")
    elif not any(history.outputs for history in summary.tests):
        lines.append("# Without curves laws of hardening are not proposed: minimum rates do not test them.")
    lines += ["[identification]", f"laws = {quoted_list(laws)}  # creepkit list laws lists all"]
    with_alpha = [name for name in laws if "alpha" in ck.law(name).names]
    if with_alpha and summary.rupture_table:
        lines.append("fix = { alpha = 0, m = 0 }  # tables do not say how damage depends on principal stress and time")
    elif with_alpha and not set(with_alpha) - set(TERTIARY_LAWS):
        lines.append("fix = { alpha = 0 }  # tests under tension do not say how damage depends on the principal stress")
    if summary.rupture_table and not with_alpha:
        lines.append("# No law of damage is installed: rupture times of tests without curves are not used to identify.")
    if len(summary.alloys) > 1:
        lines.append('group_by = "alloy"  # each is identified by itself')
    elif len(summary.heats) > 1:
        lines.append('# group_by = "heat"  # each by itself; else their scatter is estimated')
    else:
        lines.append('# group_by = "alloy"  # or another label of the files')
    lines.append('temperature = "auto"  # a factor of Arrhenius where tests are at several temperatures; or "none"')
    lines += _predictor_lines(summary)
    lines += ["# starts = 8", "# bounds = { n = [1, 12] }"]
    specimen = ck.available("specimens").get(summary.tests[0].specimen)
    for length in dimensions_of(specimen):
        if length.tolerance > 0:
            name = length.alias or length.name
            sd = length.tolerance * length.default
            nuisance = f"# nuisances = [{{ kind = {quoted(name)}, sd_mm = {sd:.3g} }}]"
            lines.append(f"{nuisance}  # the {length.long_name} differs a little")
            break
    selection = ["", "[selection]", 'by = "bic"  # or "aicc", "hold-out"']
    selection.append("# sums = true  # try sums of two laws; by default where no law explains the tests")
    return [*lines, *(selection if len(laws) > 1 else [])]


def _predictor_lines(summary: DataSummary) -> list[str]:
    """A comment on the reduced-order model of the tests' specimen, where it has one."""
    from creepkit.surrogates.loading import reduced_order_models

    names = {history.specimen for history in summary.tests}
    fits = [name for name, one in reduced_order_models().items() if {getattr(one, "name", name)} == names]
    return [
        f"# predictor = {quoted(name)}  # its reduced-order model alone: far quicker, less accurate" for name in fits
    ]


def _temperature_part(summary: DataSummary) -> list[str]:
    if len(summary.temperatures) < FEWEST_TEMPERATURES:
        return [comment(f"[temperature] needs {FEWEST_TEMPERATURES} temperatures or more.")]
    return ["[temperature]", '# forms = { n = ["constant", "linear"] }', "within_K = 5  # tests so near are at one"]


def _rupture_part(summary: DataSummary) -> list[str]:
    if summary.ruptured < FEWEST_RUPTURES:
        return []
    return ["[rupture]", "times_h = [1000, 10000, 100000]  # at which strengths are stated"]


def _forecast_part(summary: DataSummary) -> list[str]:
    history = next(h for h in summary.tests if h.outputs or h.minimum_rate is not None)
    quantity, unit = history.loading.quantity, load_unit(history)
    level = float(history.loading.program().values.max())
    celsius, hours = history.mean_temperature - ZERO_CELSIUS, 2 * followed_duration(history) / SECONDS_PER_HOUR
    lines = [
        "[[forecast]]",
        'name = "longer test"',
        f"specimen = {quoted(history.specimen)}",
        f"load = {{ {'_'.join(filter(None, (quantity, unit)))} = {0.9 * level:.3g} }}",
        f"temperature_C = {celsius:.0f}",
        f"end_h = {hours:.3g}",
    ]
    if history.elastic is not None:
        lines.append(f"modulus_GPa = {history.elastic.at(history.mean_temperature).E / 1e3:.4g}")
    if len(summary.alloys) > 1:
        lines.append(f"group = {quoted(summary.alloys[0])}")
    return [f"# {line}" for line in lines]


def _design_part() -> list[str]:
    return [
        f"# {line}" for line in ("[design]", 'goal = "law"  # or "parameters", "rate", "exponent"', "budget_h = 500")
    ]


def _export_part() -> list[str]:
    lines = [
        "[[export]]",
        'target = "latex"  # creepkit export --to list names all',
        "",
        "[[export]]",
        'target = "python"',
    ]
    return [*lines, "", "# [[export]]", '# target = "abaqus"', '# stress_unit = "MPa"', '# time_unit = "h"']
