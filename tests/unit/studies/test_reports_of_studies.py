"""Reports of studies: what they say of stages that failed, and studies run again from them."""

from __future__ import annotations

import base64
import io
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, StudyError
from creepkit.inverse import candidates
from creepkit.reports.attachments import embed
from creepkit.reports.contents import Attachment
from creepkit.reports.methods import methods_text
from creepkit.studies.inputs import input_files
from creepkit.studies.proposal import propose_study
from creepkit.studies.study import study_of_report
from creepkit.studies.study_file import parse_study
from helpers.command_line import creepkit
from helpers.rate_tables import GAS_CONSTANT
from helpers.study_runs import ONE_FIT, STUDY, numbers, states


def test_a_stage_that_fails_leaves_the_others(study: Path, plain_pages: None) -> None:
    """Two tests do not determine a law of temperature; whatever rests on it is missing, the rest is there."""
    text = STUDY + '[temperature]\n[[export]]\ntarget = "latex"\nlaw = "temperature"\ngroup = "A"\n[report]\n'
    study.write_text(text)
    result = ck.Study.load(study).run()
    assert states(result)["temperature of A"] == "failed"
    assert states(result)["export 2 of A: latex"] == "failed"
    assert set(result.rankings) == {"A", "B"}
    assert result.report is not None
    assert "temperature of A" in result.report.read_text()
    again = ck.Study.load(study).run()
    assert states(again)["report"] == "kept"
    assert states(again)["temperature of A"] == "failed"


def test_the_page_of_a_study_with_a_design_says_which_test_to_make_next(study: Path) -> None:
    rig = '[design]\ngoal = "exponent"\nat_stress_MPa = 60\nlevels = { stress_MPa = [40, 90] }\nlongest_h = 20\n'
    study.write_text(f"{ONE_FIT}{rig}[report]\n")
    result = ck.Study.load(study).run()
    (planned,) = result.designs[""].plan[:1]
    assert result.report is not None
    page = result.report.read_text()
    first, behind = page.split('id="values"')[0], page.split('id="design"')[1]
    shown = planned.description.replace(" MPa", "\u00a0MPa").replace(" h", "\u00a0h").replace(" °C", "\u00a0°C")
    assert shown in first.split("<b>Next:</b>")[1]
    assert shown in behind


def test_a_report_runs_again_from_what_it_carries(study: Path, plain_pages: None, tmp_path: Path) -> None:
    study.write_text(STUDY.replace("data/*.csv", "../elsewhere/*.csv") + "[report]\n")
    (study.parent / "data").rename(study.parent.parent / "elsewhere")
    first = ck.Study.load(study).run()
    assert first.report is not None
    assert ck.report(ck.Study.load(study), tmp_path / "other.html").read_bytes() == first.report.read_bytes()
    (study.parent.parent / "elsewhere").rename(tmp_path / "gone")
    assert numbers(study_of_report(first.report, tmp_path / "again").run()) == numbers(first)
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
    """A published citation stands first among the references, and in the settings."""
    source = "A. Smith (2020), Creep of A, doi 10.1000/1"
    study.write_text(ONE_FIT.replace("[data]\n", f'[data]\ncitation = "{source}"\n') + "[report]\n")
    result = ck.Study.load(study).run()
    contents = result.report_contents()
    assert contents.data_citations == (source,)
    text = methods_text(contents)
    assert text.startswith("The measured data are those of [1].")
    assert contents.provenance.settings["data"]["citation"] == [source]


# ---- carried studies -------------------------------------------------------------------------------------------------

# Forged reports, and names of exports: a study writes beside itself alone, and only over what is its own.


SMALL_STUDY = """\
[data]
files = ["data/*.csv"]
[identification]
laws = ["norton"]
group_by = "none"
temperature = "none"
starts = 1
frames = 8
[[export]]
target = "python"
file = "law.py"
"""


@pytest.fixture
def small_study(tmp_path: Path) -> Path:
    """A study of one test."""
    (tmp_path / "home" / "data").mkdir(parents=True)
    source = next(iter(sorted(ck.example_data("planted creep curves").glob("*750C*MPa.csv"))))
    (tmp_path / "home" / "data" / "one.csv").write_text(source.read_text())
    path = tmp_path / "home" / "study.toml"
    path.write_text(SMALL_STUDY)
    return path


@pytest.mark.parametrize("name", ["study.results/quality.json", "law.py", "inputs", "Makefile"])
def test_a_report_gives_back_study_and_data_alone(small_study: Path, tmp_path: Path, name: str) -> None:
    page = tmp_path / "page.html"
    data = (small_study.parent / "data" / "one.csv").read_bytes()
    carried = [Attachment("study.toml", SMALL_STUDY.encode())]
    page.write_text(embed([*carried, Attachment("inputs/data/one.csv", data)]))
    assert study_of_report(page, tmp_path / "sound").path.is_file()
    page.write_text(embed([*carried, Attachment(name, b"{}")]))
    with pytest.raises(StudyError, match="alone; use the report"):
        study_of_report(page, tmp_path / "made")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    "name", ["../stolen.csv", "inputs/../../stolen.csv", "/stolen.csv", "C:/stolen.csv", "..\\stolen.csv"]
)
def test_a_forged_report_writes_nothing_outside_its_folder_or_inside(
    small_study: Path, tmp_path: Path, name: str
) -> None:
    """A file of its archive is renamed: no name is followed, and not even the sound files are written."""
    page, before, archive = tmp_path / "page.html", sorted(tmp_path.rglob("*")), io.BytesIO()
    with zipfile.ZipFile(archive, "w") as packed:
        packed.writestr("study.toml", SMALL_STUDY)
        packed.writestr(name, "x")
    sound = embed([Attachment("study.toml", b"")])
    forged = base64.b64encode(archive.getvalue()).decode()
    page.write_text(re.sub(">.*<", lambda found: f">{forged}<", sound))
    with pytest.raises(CreepkitError, match="cannot be trusted: the name .* is not a plain path") as caught:
        study_of_report(page, tmp_path / "made")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == [*before, page]
    assert not Path("/stolen.csv").exists()


@pytest.mark.parametrize("name", ["data", "one.csv", "STUDY.toml", "-rf", ".law.py", "~law.py"])
def test_exports_replace_neither_data_nor_the_study(small_study: Path, name: str) -> None:
    if name == "one.csv":
        (small_study.parent / "data" / "one.csv").rename(small_study.parent / "one.csv")
    text = SMALL_STUDY.replace("law.py", name).replace("data/*.csv", "data" if name == "data" else "*.csv")
    small_study.write_text(text if name in ("data", "one.csv") else SMALL_STUDY.replace("law.py", name))
    with pytest.raises(CreepkitError, match=r"give file|plain name|of the study itself"):
        ck.Study.load(small_study)


# ---- exclusion proposal ----------------------------------------------------------------------------------------------

# A proposed study names what it will leave out of the tests.


def test_frames_that_fall_are_named_with_their_test_in_the_summary_and_in_the_file(tmp_path):
    times, rng = np.geomspace(60.0, 3.6e5, 40), np.random.default_rng(1)
    for k, stress in enumerate((80.0, 100.0, 120.0)):
        strain = 1e-18 * stress**5 * times + rng.normal(0.0, 2e-6, 40)
        if k == 1:
            strain[30:] = strain[29] - 2e-4 + rng.normal(0.0, 2e-6, 10)
        history = ck.History(f"P{k}", times, {"strain": strain}, ck.constant_stress(stress), 1073.15)
        ck.write_history(history, tmp_path / f"P{k}.csv")
    proposal = propose_study(tmp_path, tmp_path / "study.toml")
    (line,) = (one for one in proposal.summary if one.startswith("left out of"))
    assert line.startswith("left out of P1: frames ")
    assert "falling" in line
    assert f"# {line}" in proposal.text.splitlines()
    flags = ck.check_data_quality(ck.read_histories([tmp_path]))
    assert all(flag.reason in line for flag in flags if flag.kind == "falling")


# ---- rate tables in studies ------------------------------------------------------------------------------------------

# Studies of tables of minimum rates and rupture times: what is proposed, columns left out, and bounds of Q.


EXPONENT, ENERGY = 6.5, 430e3


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """15 tests whose rates are a power law at 1e-5 1/h at 150 MPa, 600 C, and which break ten times before Norton's."""
    rng, rows = np.random.default_rng(0), ["test,stress_MPa,T (C),min creep rate (1/h),t_r (h),heat"]
    for T, stresses in (
        (550, (200, 220, 240, 270, 300)),
        (600, (110, 130, 150, 175, 200)),
        (650, (60, 70, 85, 100, 125)),
    ):
        for stress in stresses:
            factor = np.exp(-ENERGY / GAS_CONSTANT * (1.0 / (T + 273.15) - 1.0 / 873.15))
            rate = 1e-5 * (stress / 150.0) ** EXPONENT * factor * np.exp(0.1 * rng.standard_normal())
            life = 0.015 / rate * np.exp(0.1 * rng.standard_normal())
            stated = "" if len(rows) % 5 == 0 else f"{rate:.4g}"
            rows.append(f"T{len(rows)},{stress},{T},{stated},{life:.0f},B7")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "table.csv").write_text("\n".join(rows) + "\n")
    return tmp_path


def identified(folder: Path, identification: str, data: str = "") -> ck.Identification:
    path = folder / "study.toml"
    path.write_text(f'[data]\nfiles = ["data/*.csv"]\n{data}\n[identification]\nstarts = 1\n{identification}\n')
    return ck.Study.load(path).run().rankings[""].best


def test_damage_is_proposed_for_tables_where_it_is_installed(folder, monkeypatch):
    study = folder / "study.toml"
    text = propose_study(folder / "data", study).text
    if "kachanov-rabotnov" in ck.available("laws"):
        assert 'laws = ["norton", "hyperbolic-sine", "kachanov-rabotnov", "sinh-damage"]' in text
    registered = candidates._law
    monkeypatch.setattr(
        candidates, "_law", lambda name: None if "damage" in name or "rabot" in name else registered(name)
    )
    text = propose_study(folder / "data", study).text
    assert 'laws = ["norton", "hyperbolic-sine"]  #' in text  # no law of hardening of minimum rates without curves


def test_forms_of_temperature_are_proposed_where_each_temperature_has_tests_enough(folder):
    table = folder / "data" / "table.csv"
    assert "\n[temperature]\n" in propose_study(folder / "data", folder / "study.toml").text
    rows = table.read_text().splitlines()
    table.write_text("\n".join([*rows[:5], rows[6], rows[11]]) + "\n")  # one rate at 600, and at 650 °C
    assert "\n[temperature]\n" not in propose_study(folder / "data", folder / "study.toml").text
    study = ck.temperature_study("norton", ck.read_histories(folder / "data"))
    assert any("and it is identified at 1" in note for note in study.notes)


def test_a_law_with_a_temperature_of_its_own_leaves_forms_of_it_out(folder):
    pytest.importorskip("creepkit_classic")
    path = folder / "study.toml"
    path.write_text('[data]\nfiles = ["data/*.csv"]\n[identification]\nstarts = 1\nlaws = ["dorn"]\n[temperature]\n')
    result = ck.Study.load(path).run()
    assert states(result)["temperature"] == "left out"
    assert not result.failures


def test_a_default_study_of_a_law_without_damage_gives_the_rates(folder):
    fit = identified(folder, 'laws = ["norton"]')
    values = {e.name: e for e in fit.estimates}
    _, low, high = fit.rate(150.0, 873.15)
    assert values["n"].low <= EXPONENT <= values["n"].high
    assert values["Q"].low <= ENERGY <= values["Q"].high
    assert low <= 1e-5 / 3600.0 <= high
    without = identified(folder, 'laws = ["norton"]', 'ignore = ["t_r (h)"]')
    assert without.values == pytest.approx(fit.values, rel=1e-6)
    assert len(without.tests) == len(fit.tests) == 12
    used = identified(folder, 'laws = ["norton"]\nrupture_times = "use"')
    assert used.adequacy.rejects


def test_a_factor_of_temperature_is_bounded_and_fixed(folder):
    bounded = identified(folder, 'laws = ["norton"]\nbounds = { Q = [1e5, 4e5] }')
    assert bounded.law.table["Q"].bounds == (1e5, 4e5)
    assert bounded.values["Q"] <= 4e5
    fixed = identified(folder, 'laws = ["norton"]\nfix = { Q = 4.2e5 }')
    assert "Q" not in fixed.values
    one, other = (fixed.rate(150.0, T, warn=False)[0] for T in (873.15, 900.0))
    assert np.log(other / one) == pytest.approx(4.2e5 / GAS_CONSTANT * (1.0 / 873.15 - 1.0 / 900.0), rel=1e-6)
    with pytest.raises(ck.errors.StudyError, match="no law has a parameter 'Q'"):
        identified(folder, 'laws = ["norton"]\ntemperature = "none"\nfix = { Q = 4.2e5 }')


def test_answers_beside_the_data_are_among_its_files(folder):
    """A report that carries the data of a study carries what was answered about them."""
    data, study = folder / "data", folder / "study.toml"
    (data / "other.csv").write_text("Last (MPa);T (C);t_r (h)\n120;600;900\n")
    (data / "tests.toml").write_text('["other.csv"]\ncolumns = {Last = "stress"}\n')
    files = input_files(parse_study(study, '[data]\nfiles = ["data"]\n'), [data], [])
    assert {one.path.name for one in files} == {"table.csv", "other.csv", "tests.toml"}


def test_what_is_fixed_at_zero_holds_of_laws_without_it(folder):
    """As when the laws with damage are taken out of a proposed study; another number, or no law's name, is an error."""
    assert identified(folder, 'laws = ["norton"]\nfix = { alpha = 0, m = 0 }').law.fingerprint
    (stage,) = [one for one in ck.Study.load(folder / "study.toml").run().stages if one.kind == "identification"]
    assert stage.sentence == "fix alpha and m = 0 holds of laws without alpha and m, too: it changes none"
    for fixed in ("alpha = 0.5", "alhpa = 0"):
        with pytest.raises(StudyError, match=f"no law has a parameter '{fixed[:5]}'"):
            identified(folder, f'laws = ["norton"]\nfix = {{ {fixed} }}')


def test_strengths_are_told_before_laws_are_identified(folder):
    path = folder / "study.toml"
    tables = '[identification]\nstarts = 1\nlaws = ["norton"]\n[temperature]\n[rupture]\ntimes_h = [10000]\n'
    path.write_text(f'[data]\nfiles = ["data/*.csv"]\n{tables}')
    strength = 150.0 * (0.015 / 1e-5 / 1e4) ** (1.0 / EXPONENT)  # MPa at 600 °C, for the life is 0.015 over the rate
    for _ in range(2):  # made, and kept from before
        told = creepkit("run", path, "--only", "rupture", "--only", "identification").stderr.splitlines()
        line = next(k for k, one in enumerate(told) if one.startswith("rupture strength, 10000 h: 550 °C "))
        assert line < told.index("identification ...")
        low, high = map(float, re.findall(r"600 °C [\d.]+ MPa \[([\d.]+), ([\d.]+)\]", told[line])[0])
        assert low < strength < high < 1.2 * low
    assert [one.kind for one in ck.Study.load(path).run().stages] == [
        "quality",
        "rupture",
        "identification",
        "temperature",
    ]
