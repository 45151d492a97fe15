"""The text of a proposed study: its tables with comments, each as lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import dedent, wrap

from creepkit.inverse.duration import followed_duration
from creepkit.quality import FRAME_FLAG_KINDS, DataQuality
from creepkit.quality.flags import frame_ranges_text
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, dimensions_of, load_unit
from creepkit.studies.data_summary import FEWEST_RUPTURES, DataSummary

MOST_REMARKS = 20
"""Files that were not read, and flags, that the comments name."""


FEWEST_TEMPERATURES = 3
"""For forms of temperature."""


CITATION_LINE = '# citation = "authors (year), title, doi"  # of published data: the methods text cites it'
REPORT = ["[report]", 'file = "report.html"', "attach_MB = 3  # data files up to this size in all are put into it"]


def text_of(parts: Iterable[Iterable[str]]) -> str:
    """The text of tables, an empty line between them."""
    return "\n\n".join("\n".join(lines) for lines in map(list, parts) if lines) + "\n"


def quoted(text: str) -> str:
    """A text as TOML holds it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def quoted_list(texts: Iterable[str]) -> str:
    """Texts as a list of TOML."""
    return f"[{', '.join(map(quoted, texts))}]"


def one_line(text: str, length: int = 200) -> str:
    """A text without what cannot be seen, of bounded length."""
    return "".join(character if character.isprintable() else "?" for character in text)[:length]


def comment(text: str) -> str:
    """A text as a comment of one line."""
    return f"# {one_line(text)}"


def study(folder: Path) -> list[str]:
    """The beginning of a study file, with the table [study]."""
    return [
        "# A study: from measured files to a report. Carry it out: creepkit run study.toml",
        "# Paths are relative to this file. All tables but [data] may be left out; units stand in names of keys.",
        "",
        "[study]",
        f"title = {quoted(one_line(folder.absolute().name) or 'creep study')}  # say what it is about",
        "seed = 0  # of all random draws",
    ]


def tests_of_cameras(laws: Sequence[str]) -> list[list[str]]:
    """What follows the cameras of a study without files of tests: what they hold is known when it was extracted."""
    first = ["# The tests are not known before the frames are extracted.", "[identification]"]
    identification = [
        *first,
        f"laws = {quoted_list(laws)}  # creepkit list laws lists all",
        "",
        "[selection]",
        'by = "bic"',
    ]
    return [["# [data]", CITATION_LINE], identification, REPORT]


def _laws(names: Sequence[str]) -> str:
    return f"laws = {quoted_list(names)}  # creepkit list laws lists all"


def data(
    files: Sequence[str],
    reader: str | None,
    temperatures: Sequence[float],
    found: Sequence[str],
    left_out: Sequence[str],
    problems: Sequence[str],
) -> list[str]:
    """[data]; found : in the files, left_out : of the tests, problems : of files that were not read, in sentences."""
    only = f"# only = {{ temperature_C = [{temperatures[0] - ZERO_CELSIUS:.0f}] }}  # these tests alone"
    return [
        *map(comment, found),
        "[data]",
        f"files = {quoted_list(files)}",
        *([f"reader = {quoted(reader)}"] if reader is not None else []),
        '# ignore = ["load_kN", "date"]  # columns that nobody needs',
        *([only] if len(temperatures) > 1 else []),
        'suspect_frames = "exclude"  # frames that unload, fall or lie apart; or "keep"',
        *map(comment, left_out),
        CITATION_LINE,
        *map(comment, problems),
    ]


def left_out_lines(quality: DataQuality) -> list[str]:
    """What is left out of the tests: of each its suspect frames with their kind, and copies of other tests."""
    flags = [one for one in quality if one.kind in FRAME_FLAG_KINDS]
    lines = [f"left out of {one.history}: {frame_ranges_text(one.frames)} ({one.kind}: {one.reason})" for one in flags]
    lines += [f"left out: {one.history} ({one.reason})" for one in quality if one.kind == "copy"]
    more = len(lines) - MOST_REMARKS
    return [*lines[:MOST_REMARKS], *([f"left out: parts of {more} more tests"] if more > 0 else [])]


def exclude(quality: DataQuality) -> list[str]:
    """Copies of tests, left out; proposals for other suspect tests, as comments.

    Suspect frames are left out by [data] suspect_frames.
    """
    lines = []
    for copy in (one for one in quality if one.kind == "copy"):
        test, reason = quoted(one_line(copy.history)), quoted(one_line(copy.reason))
        lines += ["[[exclude]]", f"test = {test}", f"reason = {reason}", ""]
    flags = [one for one in quality if len(one.tests) == 1 and one.kind not in ("copy", *FRAME_FLAG_KINDS)]
    for flag in flags[:MOST_REMARKS]:
        said = wrap(one_line(str(flag), 2000), 116, break_long_words=False, break_on_hyphens=False)
        lines += [f"# {line}" for line in said]
        lines += ["# [[exclude]]", f"# test = {quoted(one_line(flag.history))}"]
        if flag.frames:
            lines.append(f"# frames = {quoted(frame_ranges_text(flag.frames).partition(' ')[2])}")
        elif flag.time is not None:
            lines.append(f"# from_h = {flag.time / SECONDS_PER_HOUR:.6g}")
        lines += [f"# reason = {quoted(flag.kind)}", "#"]
    return lines[:-1] or ["# [[exclude]]", '# test = "name of a test"', '# frames = "97-191, 193"', '# reason = "why"']


def stages(summary: DataSummary, laws: Sequence[str], of_tension: Iterable[str]) -> list[list[str]]:
    """The tables of what is made of the tests. of_tension : laws whose damage tests under tension do not determine."""
    rupture = ["[rupture]", "times_h = [1000, 10000, 100000]  # at which strengths are stated"]
    parts = [rupture] if summary.ruptured >= FEWEST_RUPTURES else []
    if summary.framed:
        temperature = [comment(f"[temperature] needs {FEWEST_TEMPERATURES} temperatures or more.")]
        if len(summary.temperatures) >= FEWEST_TEMPERATURES:
            temperature = ["[temperature]", '# forms = { n = ["constant", "linear"] }']
            temperature.append("within_K = 5  # tests so near are at one")
        parts = [_identification(summary, laws, of_tension), temperature, *parts, _forecast(summary)]
        parts += [dedent(text).strip().splitlines() for text in (DESIGN, EXPORT)]
    return [*parts, REPORT]


DESIGN = """
    # [design]
    # goal = "law"  # or "parameters", "rate", "exponent"
    # budget_h = 500
    """
EXPORT = """
    [[export]]
    target = "latex"  # creepkit export --to list names all

    [[export]]
    target = "python"

    # [[export]]
    # target = "abaqus"
    # stress_unit = "MPa"
    # time_unit = "h"
    """


def _identification(summary: DataSummary, laws: Sequence[str], of_tension: Iterable[str]) -> list[str]:
    import creepkit as ck
    from creepkit.surrogates.loading import reduced_order_models

    with_alpha = [name for name in laws if "alpha" in ck.law(name).names]
    alloys, heats = len(summary.alloys) > 1, len(summary.heats) > 1
    specimens = {history.specimen for history in summary.tests}
    reduced = [name for name, one in reduced_order_models().items() if {getattr(one, "name", name)} == specimens]
    less_accurate = "# its reduced-order model alone: far quicker, less accurate"
    lengths = dimensions_of(ck.available("specimens").get(summary.tests[0].specimen))
    lines = {
        "# All tests are at one load: how rates depend on stress they do not say.": len(summary.loads) == 1,
        "# Minimum rates of tests of unknown duration cannot judge laws that depend on strain or time.": (
            not summary.durations_known
        ),
        "# Without curves laws of hardening are not proposed: minimum rates do not test them.": (
            summary.durations_known and not any(history.outputs for history in summary.tests)
        ),
        "[identification]": True,
        _laws(laws): True,
        "fix = { alpha = 0, m = 0 }  # tables do not say how damage depends on principal stress and time": (
            with_alpha and summary.rupture_table
        ),
        "fix = { alpha = 0 }  # tests under tension do not say how damage depends on the principal stress": (
            with_alpha and not summary.rupture_table and set(with_alpha) <= set(of_tension)
        ),
        "# No law of damage is installed: rupture times of tests without curves are not used to identify.": (
            summary.rupture_table and not with_alpha
        ),
        'group_by = "alloy"  # each is identified by itself': alloys,
        '# group_by = "heat"  # each by itself; else their scatter is estimated': heats and not alloys,
        '# group_by = "alloy"  # or another label of the files': not heats and not alloys,
        'temperature = "auto"  # a factor of Arrhenius where tests are at several temperatures; or "none"': True,
        **{f"# predictor = {quoted(name)}  {less_accurate}": True for name in reduced},
        "# starts = 8": True,
        "# bounds = { n = [1, 12] }": True,
    }
    chosen = [line for line, shown in lines.items() if shown]
    for length in [one for one in lengths if one.tolerance > 0][:1]:
        nuisance = f"kind = {quoted(length.alias or length.name)}, sd_mm = {length.tolerance * length.default:.3g}"
        chosen.append(f"# nuisances = [{{ {nuisance} }}]  # the {length.long_name} differs a little")
    if len(laws) > 1:
        chosen += ["", "[selection]", 'by = "bic"  # or "aicc", "hold-out"']
        chosen.append("# sums = true  # try sums of two laws; by default where no law explains the tests")
    return chosen


def _forecast(summary: DataSummary) -> list[str]:
    history = summary.framed[0]
    load = "_".join(filter(None, (history.loading.quantity, load_unit(history))))
    lines = [
        "[[forecast]]",
        'name = "longer test"',
        f"specimen = {quoted(history.specimen)}",
        f"load = {{ {load} = {0.9 * float(history.loading.program().values.max()):.3g} }}",
        f"temperature_C = {history.mean_temperature - ZERO_CELSIUS:.0f}",
        f"end_h = {2 * followed_duration(history) / SECONDS_PER_HOUR:.3g}",
    ]
    if history.elastic is not None:
        lines.append(f"modulus_GPa = {history.elastic.at(history.mean_temperature).E / 1e3:.4g}")
    if len(summary.alloys) > 1:
        lines.append(f"group = {quoted(summary.alloys[0])}")
    return [f"# {line}" for line in lines]
