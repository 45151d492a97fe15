"""The documentation as it stands in the tree: its links, its snippets, and the files and names that it mentions."""

import json
import re
import runpy
import shlex
import shutil
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import creepkit as ck
from helpers.command_line import creepkit
from helpers.paths import ROOT

DOCS = ROOT / "docs"
WRITTEN_AT_BUILD = ("gallery", "laws/pages", "reference/pages")
"""Folders of docs/ that `make docs` fills."""

PAGES = [
    path
    for path in sorted([ROOT / "README.md", *ROOT.glob("plugins/*/README.md"), *DOCS.rglob("*.md")])
    if not any(path.is_relative_to(DOCS / folder) for folder in WRITTEN_AT_BUILD)
]


def page_name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def python_blocks(path: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.S)


def exists_after_build(path: Path) -> bool:
    """Whether a link into a folder that `make docs` fills will lead somewhere."""
    folder = next(DOCS / folder for folder in WRITTEN_AT_BUILD if path.is_relative_to(DOCS / folder))
    if folder.name != "gallery":
        return path.stem in {"index", "public_names"}
    return path.stem == "index" or (ROOT / "examples" / f"{path.stem}.py").is_file()


@cache
def reports_of_studies() -> set[str]:
    """{folder/name} of the reports that `make docs` has studies write."""
    studies = [(path, ck.Study.load(path).file.model.report) for path in ROOT.glob("examples/studies/*/*.toml")]
    return {f"{path.parent.name}/{report.file.removesuffix('.html')}" for path, report in studies if report}


def broken_links(page: Path) -> Iterator[str]:
    """Links of a page that lead nowhere, or out of the project."""
    text = re.sub(r"```.*?```|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?://|#", link):
            continue
        target = (page.parent / link.partition("#")[0]).resolve()
        if link.startswith("report:"):
            leads = link.removeprefix("report:") in reports_of_studies()
        elif any(target.is_relative_to(DOCS / folder) for folder in WRITTEN_AT_BUILD):
            leads = exists_after_build(target)
        else:
            leads = target.is_relative_to(ROOT) and target.exists()
        if not leads:
            yield f"{page_name(page)}: {link} leads nowhere inside the project"


def wrong_names(page: Path) -> Iterator[str]:
    """Files that a page mentions and that there are not, paths outside the project, and names that are not public."""
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"`((?:src|tests|docs|plugins|examples)/[\w./-]+)", text):
        if not (ROOT / name).exists():
            yield f"{page_name(page)}: {name} does not exist"
    for match in re.findall(r"(?<![\w.])/(?:home|tmp|work|root|usr|opt|mnt|Users)/|~/", text):
        yield f"{page_name(page)}: names {match}"
    for block in python_blocks(page):
        compile(block, str(page), "exec")
        for name in set(re.findall(r"\bck\.(\w+)", block)) - {*ck.__all__, "__version__"}:
            yield f"{page_name(page)}: creepkit has no public {name}"


def test_pages_link_and_name_what_there_is() -> None:
    assert [wrong for page in PAGES for wrong in (*broken_links(page), *wrong_names(page))] == []


def test_the_files_of_the_guide_are_read(tmp_path):
    """Each says what its head and its columns mean: nothing of it becomes a label that was not meant as one."""
    text = (DOCS / "how-to" / "write_a_test_file.md").read_text(encoding="utf-8")
    found, blocks = [], re.findall(r"```text\n(.*?)```", text, re.S)
    for k, block in enumerate(blocks):
        (tmp_path / f"{k}.csv").write_text(block, encoding="utf-8")
        found += ck.read_histories(tmp_path / f"{k}.csv")
    bar, dimple, rings, beam, correlated = found
    assert set(bar.labels) == {"heat", "laboratory", "assumed"}
    assert bar.standard_deviation["strain"] == pytest.approx(2e-5)
    assert (dimple.labels, dimple.geometry) == ({}, {"apex_thickness": 0.502})
    assert dimple.standard_deviation["amplitude"] == pytest.approx(2e-3)
    assert (rings.labels, rings.operator) == ({}, "rings 0, 2, 4 mm")
    assert list(rings.outputs) == ["displacement_1", "displacement_2", "displacement_3"]
    assert (beam.labels, beam.geometry) == ({}, {"height": 2.02})
    assert beam.outputs["deflection"] == pytest.approx([0.031, 0.052])
    assert correlated.noise_correlation["width", "shape"] == -0.5
    assert correlated.labels == {}
    alone = "\n".join(line.rsplit(",", 3)[0] if line[0] != "#" else line for line in blocks[1].splitlines())
    (tmp_path / "alone.csv").write_text(alone, encoding="utf-8")
    assert list(ck.read_histories(tmp_path / "alone.csv")[0].outputs) == ["amplitude"]


# ---- examples and readme ---------------------------------------------------------------------------------------------

# Every example, and every Python block and command of the README, runs as it stands.


EXAMPLES = sorted(p for p in (ROOT / "examples").glob("[0-9]*.py"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script), "--quick"])
    monkeypatch.syspath_prepend(script.parent)  # as Python does for a script
    runpy.run_path(str(script), run_name="__main__")


def test_example_of_a_law_agrees_with_its_closed_form(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["02"])
    runpy.run_path(str(ROOT / "examples" / "02_a_law_of_your_own.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert float(re.search(r"largest relative difference: (\S+)", told)[1]) < 1e-4
    assert "fading: conforms" in told


def readme_blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.S)


def test_readme_blocks_run_in_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    space: dict[str, object] = {}
    for block in readme_blocks("python"):
        exec(compile(block, "README.md", "exec"), space)
    assert space["fit"].adequacy.explains
    assert "subroutine creep" in capsys.readouterr().out


def test_readme_commands_run_in_order(tmp_path, monkeypatch, capsys):
    """In an empty folder; the study of the first lines finds the law that the curves were made with."""
    monkeypatch.chdir(tmp_path)
    for line in "".join(readme_blocks("sh")).splitlines():
        program, *words = shlex.split(line)
        assert program == "creepkit"
        result = creepkit(*words)
        assert result.exit_code == 0, f"{line}\n{result.output}"
        if words[0] == "run":
            truth = json.loads(Path("curves/truth.json").read_text())
            assert f"use {truth['law']}" in result.stdout
            assert "\n  decisive; weight " in result.stdout
            assert "not decisive" not in result.stdout


# ---- tutorials -------------------------------------------------------------------------------------------------------

# The tutorials that follow a person: their commands run in order on the shipped files, and their statements hold.


STUDIES = ROOT / "examples" / "studies"
TUTORIALS = ROOT / "docs" / "tutorials"
STUDY_OF_PAGE = {
    "from_a_plate_to_a_law": "plate_of_dimples",
    "from_a_spreadsheet_to_abaqus": "spreadsheet_to_abaqus",
    "strain_or_time_hardening": "strain_or_time_hardening",
}
"""{page: folder of its study}."""

WITHOUT_FIRST_REPORT = ('[report]\nfile = "constant_loads.html"\n', "")
"""`make docs` writes all reports; the tests of two pages write one each, in less time."""

NUMBER = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"


def blocks(page, language):
    text = (TUTORIALS / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.S)


def truth_of(page):
    return json.loads((STUDIES / STUDY_OF_PAGE[page] / "truth.json").read_text(encoding="utf-8"))


def run_page(page, folder, monkeypatch, smaller=lambda text: text):
    """All commands of a page in a copy of its data; a study file is there from the command that runs it on."""
    study = STUDIES / STUDY_OF_PAGE[page]
    shutil.copytree(study, folder, ignore=shutil.ignore_patterns("*.toml", "*.py", "truth.json"), dirs_exist_ok=True)
    monkeypatch.chdir(folder)
    printed = ""
    for line in "".join(blocks(page, "sh")).splitlines():
        program, *words = shlex.split(line)
        assert program == "creepkit"
        if words[0] == "run" and (study / words[1]).exists():
            (folder / words[1]).write_text(smaller((study / words[1]).read_text(encoding="utf-8")), encoding="utf-8")
        result = creepkit(*words)
        assert result.exit_code == 0, f"{line}\n{result.output}"
        printed += result.stdout
    return printed


def assert_printed(page, printed, precision=0.1):
    """What the page quotes was printed, in the same words and with nearly the same numbers."""
    lines = [" ".join(line.split()) for line in printed.splitlines()]
    words = {re.sub(NUMBER, "#", line): line for line in lines}
    for quoted in "".join(blocks(page, "text")).splitlines():
        quoted = " ".join(quoted.split())
        pattern = re.sub(NUMBER, "#", quoted)
        assert pattern in words, f"not printed: {quoted}"
        candidates = [line for line in lines if re.sub(NUMBER, "#", line) == pattern]
        stated = [float(number) for number in re.findall(NUMBER, quoted)]
        assert any(
            [float(number) for number in re.findall(NUMBER, line)] == pytest.approx(stated, rel=precision)
            for line in candidates
        ), f"other numbers: {quoted}\n{candidates}"


def assert_intervals_hold(fit, values):
    for one in fit.estimates:
        assert one.low < values[one.name] < one.high, one


@pytest.mark.parametrize("page", STUDY_OF_PAGE)
def test_study_files_hold_what_the_page_shows(page):
    paths = [*(STUDIES / STUDY_OF_PAGE[page]).glob("*.toml")]
    files = [path.read_text(encoding="utf-8") for path in paths]
    assert [block for block in blocks(page, "toml") if not any(block in text for text in files)] == []
    text = (TUTORIALS / f"{page}.md").read_text(encoding="utf-8")
    reports = {ck.Study.load(path).file.model.report.file.removesuffix(".html") for path in paths}
    linked = set(re.findall(r"\]\(report:([\w/]+)\)", text))
    assert linked == {f"{STUDY_OF_PAGE[page]}/{name}" for name in reports}


def test_constant_loads_leave_both_hardening_laws_and_a_step_decides(tmp_path, monkeypatch):
    page = "strain_or_time_hardening"
    printed = run_page(page, tmp_path, monkeypatch, lambda text: text.replace(*WITHOUT_FIRST_REPORT))
    assert_printed(page, printed)
    assert (tmp_path / "with_step.html").is_file()
    asked = ck.Study.load(tmp_path / "constant_loads.toml").run(only="design")
    second = ck.Study.load(tmp_path / "with_step.toml").run(only="identification").rankings[""]
    assert {one.fit.law.name for one in asked.rankings[""].credible} == {"strain-hardening", "time-hardening"}
    truth = truth_of(page)
    assert (second.decisive, second.best.law.name) == (True, truth["law"])
    for name in ("n", "m"):
        assert second.best.values[name] == pytest.approx(truth["values"][name], abs=0.1)
    planned = asked.designs[""].best.histories[0].loading.program()
    assert len(set(planned.values[planned.values > 0])) == 2, "a step of load is proposed"


def test_a_spreadsheet_becomes_a_subroutine_with_intervals_that_hold_the_truth(tmp_path, monkeypatch):
    page = "from_a_spreadsheet_to_abaqus"
    printed = run_page(page, tmp_path, monkeypatch)
    subroutine = (tmp_path / "creep.f").read_text(encoding="utf-8")
    assert_printed(page, printed + subroutine)
    assert "subroutine creep(decra, deswa, statev" in subroutine
    best = ck.Study.load(tmp_path / "study.toml").run(only="identification").rankings[""].best
    assert_intervals_hold(best, truth_of(page)["values"])


def test_an_alloy_of_the_plate_has_its_law(tmp_path, monkeypatch):
    """Three of its dimples; the documentation is built with all 25."""
    page = "from_a_plate_to_a_law"
    few = 'files = ["tests/A2-1.csv", "tests/A2-3.csv", "tests/A2-5.csv"]'
    run_page(page, tmp_path, monkeypatch, lambda text: text.replace('files = ["tests"]', few).replace("[report]", ""))
    ranking = ck.Study.load(tmp_path / "study.toml").run(only="identification").rankings["A2"]
    truth = truth_of(page)["A2"]
    assert ranking.best.law.name == truth["law"]
    assert_intervals_hold(ranking.best, truth["values"])
