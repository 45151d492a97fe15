"""Study files that name what is not there: refused in one sentence with its line, before anything is done."""

from __future__ import annotations

from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import StudyError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for source in ck.example_data("planted creep curves").glob("*850C*.csv"):
        (tmp_path / source.name).write_bytes(source.read_bytes())
    return tmp_path


BASE = '[data]\nfiles = ["*.csv"]\n[identification]\nlaws = ["norton"]\n'


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ('[data]\nfiles = ["*.csv"]\nreader = "cvs"\n', 3, "did you mean 'csv'"),
        ('[data]\nfiles = ["none/*.csv"]\n', 2, "none/*.csv"),
        ('[data]\nfiles = [\n "*.csv",\n "/etc/passwd"]\n', 2, "absolute"),
        ('[data]\nfiles = ["~/x.csv"]\n', 2, "absolute"),
        (BASE.replace("norton", "nortn"), 4, "did you mean 'norton'"),
        (BASE + "fix = { nn = 5 }\n", 5, "no law has a parameter 'nn'"),
        (BASE + "fix = { n = 50 }\n", 5, "n"),
        (BASE + "bounds = { n = [5, 2] }\n", 5, "n"),
        (BASE + "bounds = { n = [1, 1e308] }\n", 5, "at most 1e+100"),
        (BASE + 'predictor = "dimpel"\n', 5, "did you mean 'dimple'"),
        (BASE + 'predictor = "/etc/passwd"\n', 5, "absolute"),
        (BASE + 'loss = "lin"\n', 5, "must be one of these: linear, "),
        (BASE + 'without_nuisances = ["offst"]\n', 5, "did you mean 'offset'"),
        (BASE + '[[identification.nuisances]]\nkind = "thicknes"\n', 6, "thickness"),
        (BASE + '[[identification.nuisances]]\nkind = "thickness"\nsd = 0.1\n', 7, "given as sd_mm"),
        (BASE + '[[identification.nuisances]]\nkind = "temperature"\nsd_mm = 0.1\n', 7, "given as sd_K"),
        (BASE + '[specimen]\nname = "bulg"\n', 6, "did you mean 'bulge'"),
        (BASE + '[specimen]\nname = "bulge"\nlengths = { apex_mm = 1 }\n', 7, "did you mean"),
        (BASE + '[specimen]\nname = "bulge"\nlengths = { apex_thickness_kg = 1 }\n', 7, "no unit of 'apex_thickness'"),
        (BASE + '[[export]]\ntarget = "abacus"\n', 6, "did you mean 'abaqus'"),
        (BASE + '[[export]]\ntarget = "umat"\n', 6, "choose one of those that serve it: "),
        (BASE + '[[export]]\ntarget = "latex"\nfile = "../law.tex"\n', 7, "plain name"),
        (BASE + '[[export]]\ntarget = "latex"\nfile = "study.toml"\n', 7, "of the study itself"),
        (BASE + '[report]\nfile = "/tmp/report.html"\n', 6, "plain name"),
        (BASE + '[report]\nfile = "page.csv"\n', 6, "among the data files"),
        (BASE.replace("*.csv", ".") + '[[export]]\ntarget = "latex"\n[report]\nfile = "law.tex"\n', 8, "another table"),
        (BASE.replace("*.csv", "*") + "[report]\n", 5, "name those more exactly"),
        (BASE.replace("*.csv", "a" * 300), 2, "cannot be read"),
        (BASE + '[[export]]\ntarget = "latex"\n[[export]]\ntarget = "latex"\n', 7, "written by another table"),
        (BASE + '[rupture]\nmethods = ["larson-miler"]\n', 6, "did you mean 'larson-miller'"),
        (BASE + '[temperature]\nforms = { n = ["linar"] }\n', 6, "did you mean 'linear'"),
        (BASE + '[temperature]\nforms = { nn = ["linear"] }\n', 6, "no law has a parameter 'nn'"),
        ('[data]\nfiles = ["../**/*.csv"]\n', 2, "folders of any depth"),
        (BASE + '[[forecast]]\nname = "a"\n', 5, "a planned test has a load"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = 5 }\n', 5, "end_h"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stres_MPa = 5 }\nend_h = 1\n', 7, "did you mean 'stress_MPa'"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_C = 5 }\nend_h = 1\n', 7, "stress"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = -5 }\nend_h = 1\n', 7, "stress"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = [{ from_h = 1, level = 5 }] }\nend_h = 3\n', 7, "0"),
        (BASE + '[[forecast]]\nname = "a"\nload = { pressure_MPa = 5 }\nend_h = 1\n', 5, "modulus_GPa"),
        (BASE + '[[forecast]]\nname = "a"\ntests = ["*.csv"]\nend_h = 1\n', 8, "leave one of them out"),
        (BASE + '[design]\ngoal = "rate"\n', 6, "give at_stress"),
        (BASE + '[design]\ngoal = "law"\nat_stress_MPa = 5\n', 6, "belong to the goals"),
        ('[data]\nfiles = ["*.csv"]\n[temperature]\nlaw = "nortn"\n', 4, "did you mean 'norton'"),
    ],
)
def test_unknown_names_units_and_files_are_refused_before_anything_is_done(folder, text, line, words):
    (folder / "study.toml").write_text(text)
    with pytest.raises(StudyError) as caught:
        ck.Study.load(folder / "study.toml")
    told = str(caught.value)
    assert told.startswith(f"{folder / 'study.toml'}:{line}: "), told
    assert words in told
    assert "\n" not in told
    assert {path.name for path in folder.iterdir() if path.suffix != ".csv"} == {"study.toml"}


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (BASE + '[[exclude]]\ntest = "planted_85C"\nreason = "x"\n', 6, "did you mean 'planted_850C"),
        (BASE + '[[exclude]]\ntest = "*"\nreason = "x"\n', None, "no test is left"),
        (BASE + '[[exclude]]\ntest = "*70MPa"\nframes = "1-9999"\nreason = "x"\n', 7, "has frames 0 to"),
        (BASE + '[[exclude]]\ntest = "*70MPa"\nframes = "a"\nreason = "x"\n', 7, 'write frames = "97-191, 193"'),
        (BASE + '[[exclude]]\ntest = "*70MPa"\nfrom_h = 3\nto_h = 2\nreason = "x"\n', 8, "does not lie after"),
        (BASE + '[[exclude]]\ntest = "*70MPa"\nfrom_h = 1e6\nreason = "x"\n', 7, "no frame there"),
        ('[data]\nfiles = ["*.csv"]\nonly = { temperature_C = ["x"] }\n', 3, "must be a number in C"),
        (BASE + 'group_by = "heat"\n', 5, "no test has a label 'heat'"),
        (BASE + '[[export]]\ntarget = "latex"\ngroup = "X"\n', 7, "no group 'X'"),
        ('[data]\nfiles = ["*.csv"]\n[[export]]\ntarget = "latex"\n', 3, "needs the table [identification]"),
        ('[data]\nfiles = ["*.csv"]\n[temperature]\n', 3, "needs a law"),
        ('[data]\nfiles = ["*.csv"]\nonly = { heat = "a" }\n', 3, "no test has a label 'heat'"),
        ('[data]\nfiles = ["*.csv"]\nreader = "xlsx"\n', 3, ".csv"),
    ],
)
def test_what_the_tests_do_not_have_is_refused_with_its_line(folder, text, line, words):
    (folder / "study.toml").write_text(text)
    with pytest.raises(StudyError) as caught:
        ck.Study.load(folder / "study.toml").run()
    told = str(caught.value)
    assert line is None or told.startswith(f"{folder / 'study.toml'}:{line}: "), told
    assert words in told
    assert "\n" not in told


def test_a_predictor_is_no_file_of_the_working_folder(folder, tmp_path_factory, monkeypatch):
    """A name without a file beside the study must not be that of a file where the command happens to run."""
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "net.safetensors").write_bytes(b"of somebody else")
    (elsewhere / "net").write_bytes(b"of somebody else")
    monkeypatch.chdir(elsewhere)
    for name in ("net.safetensors", "net"):
        (folder / "study.toml").write_text(BASE + f'predictor = "{name}"\n')
        with pytest.raises(StudyError, match=rf"study\.toml:5: .*no file '{name}' lies beside the study"):
            ck.Study.load(folder / "study.toml").run()
