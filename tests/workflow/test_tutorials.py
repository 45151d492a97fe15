"""The tutorials that follow a person: their commands run in order on the shipped files, and their statements hold."""

import json
import re
import shlex
import shutil

import pytest

import creepkit as ck
from helpers.command_line import creepkit
from helpers.paths import ROOT

STUDIES = ROOT / "examples" / "studies"
TUTORIALS = ROOT / "docs" / "tutorials"
PAGES = {
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
    return json.loads((STUDIES / PAGES[page] / "truth.json").read_text(encoding="utf-8"))


def run_page(page, folder, monkeypatch, smaller=lambda text: text):
    """All commands of a page in a copy of its data; a study file is there from the command that runs it on."""
    study = STUDIES / PAGES[page]
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


@pytest.mark.parametrize("page", PAGES)
def test_study_files_hold_what_the_page_shows(page):
    files = [path.read_text(encoding="utf-8") for path in (STUDIES / PAGES[page]).glob("*.toml")]
    assert [block for block in blocks(page, "toml") if not any(block in text for text in files)] == []


@pytest.mark.parametrize("page", PAGES)
def test_linked_reports_are_those_of_the_study(page):
    text = (TUTORIALS / f"{page}.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(report:([\w/]+)\)", text))
    written = {
        f"{PAGES[page]}/{ck.Study.load(path).file.model.report.file.removesuffix('.html')}"
        for path in (STUDIES / PAGES[page]).glob("*.toml")
    }
    assert linked == written


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
