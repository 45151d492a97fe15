"""Reports of studies: what they say of stages that failed, and studies run again from them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.reports.methods import methods_text
from creepkit.studies.proposal import propose_study
from creepkit.studies.study import study_of_report
from creepkit.studies.study_file import parse_study
from helpers.study_runs import ONE_FIT, STUDY, numbers, states


def test_a_stage_that_fails_leaves_the_others(study: Path, plain_pages: None) -> None:
    """Two tests do not determine a law of temperature; whatever rests on it is missing, the rest is there."""
    text = STUDY + '[temperature]\n[[export]]\ntarget = "latex"\nlaw = "temperature"\ngroup = "A"\n[report]\n'
    study.write_text(text)
    result = ck.Study.load(study).run()
    assert states(result)["temperature of A"] == "failed"
    assert states(result)["export 2 of A: latex"] == "failed"
    assert "three temperatures" in " ".join(f.sentence for f in result.failures) or result.failures[0].sentence
    assert set(result.rankings) == {"A", "B"}
    assert result.report is not None
    page = result.report.read_text()
    assert "temperature of A" in page
    again = ck.Study.load(study).run()
    assert states(again)["report"] == "kept"
    assert states(again)["temperature of A"] == "failed"


def test_a_report_runs_again_from_what_it_carries(study: Path, plain_pages: None, tmp_path: Path) -> None:
    study.write_text(STUDY.replace("data/*.csv", "../elsewhere/*.csv") + "[report]\n")
    (study.parent / "data").rename(study.parent.parent / "elsewhere")
    first = ck.Study.load(study).run()
    assert first.report is not None
    assert ck.report(ck.Study.load(study), tmp_path / "other.html").read_bytes() == first.report.read_bytes()
    (study.parent.parent / "elsewhere").rename(tmp_path / "gone")
    again = study_of_report(first.report, tmp_path / "again").run()
    assert again.changes == ()
    assert numbers(again) == numbers(first)
    lock = tmp_path / "again" / "study.lock"
    content = json.loads(lock.read_text())
    content["stages"]["identification of A"]["numbers"]["values"]["norton"]["n"] *= 1.001
    lock.write_text(json.dumps(content))
    (change,) = study_of_report(first.report, tmp_path / "again").run().changes
    assert change.startswith("result of identification of A: values.norton.n was ")
    assert (tmp_path / "again" / "inputs" / "up" / "elsewhere").is_dir()
    (tmp_path / "again" / "study.toml").write_text(STUDY)
    with pytest.raises(StudyError, match="differs from what"):
        study_of_report(first.report, tmp_path / "again")


def test_a_report_of_large_data_carries_their_hashes(study: Path, plain_pages: None, tmp_path: Path) -> None:
    study.write_text(STUDY + "[report]\nattach_MB = 0.001\n")
    result = ck.Study.load(study).run()
    assert result.report is not None
    with pytest.raises(StudyError, match="hashes of its data alone"):
        study_of_report(result.report, tmp_path / "again")
    (tmp_path / "again" / "inputs").mkdir()
    (study.parent / "data").rename(tmp_path / "again" / "inputs" / "data")
    assert numbers(study_of_report(result.report, tmp_path / "again").run()) == numbers(result)


def test_the_source_of_the_data_is_cited_and_kept(study: Path, plain_pages: None) -> None:
    """A published citation stands first among the references, in the settings, and in the lock."""
    source = "A. Smith (2020), Creep of A, doi 10.1000/1"
    study.write_text(ONE_FIT.replace("[data]\n", f'[data]\ncitation = "{source}"\n') + "[report]\n")
    result = ck.Study.load(study).run()
    contents = result.report_contents()
    assert contents.data_citations == (source,)
    text = methods_text(contents, [])
    assert text.startswith("The measured data are those of [1].")
    assert f"\n[1] {source}" in text
    assert contents.provenance.settings["data"]["citation"] == [source]
    lock = json.loads((study.parent / "study.lock").read_text())
    assert lock["declared"]["data"]["citation"] == [source]


def test_a_proposed_study_has_a_place_for_the_source_of_its_data(study: Path) -> None:
    text = propose_study(study.parent / "data", study).text
    assert text.count("# citation = ") == 1
    assert parse_study(study, text.replace("# citation", "citation")).model.data.citation


def test_a_study_and_its_result_are_printed_in_few_lines(study: Path, plain_pages: None) -> None:
    study.write_text(ONE_FIT + "[report]\n")
    loaded = ck.Study.load(study)
    assert repr(loaded) == f"Study 'one law' ({study}): data, identification, report"
    result = loaded.run()
    first, verdict, report = repr(result).splitlines()
    assert first == "StudyResult 'one law': 2 tests; stages: 3 made"
    assert verdict.strip().startswith("norton describes strains to ")
    assert report.strip() == f"report: {result.report}"
