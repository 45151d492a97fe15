"""Study files: every misspelt key, wrong type and unknown name is refused in one sentence, with its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.studies.study_file import known_keys, parse_study

FULL = """\
[study]
title = "everything"
seed = 3

[data]
files = ["*.csv"]
reader = "csv"
ignore = ["load_kN"]
only = { temperature_C = [750, 800], alloy = "X" }
up_to_strain = 0.1
suspect_frames = "keep"
check_quality = true

[[record]]
name = "rig"
file = "record.csv"
format = "csv"
time = "Clock"
date = "Day"
time_unit = "s"
date_order = "day first"
time_zone = "+01:00"
every = 2
units = { P1 = "bar" }
pressure_reference = "absolute"
ambient_pressure_MPa = 0.1
missing = ["OL"]

[[camera]]
name = "plate"
frames = ["frames/*.csv"]
format = "dice"
columns = { x = "X" }
times = "times.csv"
interval_s = 10
specimen = "bulge"
operator = "field 0-7.5 mm"
window_mm = 7
rings_mm = [0, 2]
names = ["D1"]
centers_mm = [[1, -2]]
rest_frames = "0-9"
subset_mm = 1
record = "rig"
channels = ["P1", "T1"]
lag_s = 3
search_s = [-10, 10]
camera_start = "2025-08-18T18:51:53+02:00"
load = { pressure_bar = 5 }
ramp_s = 5
temperature_C = 777
modulus_GPa = 150
poisson = 0.3
lengths = { apex_thickness_mm = 0.5 }
alloy = "X"
labels = { heat = "7" }

[[exclude]]
test = "a*"
reason = "why"
frames = "1-3, 5"
from_h = 0
to_h = 3

[specimen]
name = "bulge"
lengths = { apex_thickness_mm = 0.5 }

[identification]
laws = ["norton", "strain-hardening"]
group_by = "alloy"
temperature = "auto"
predictor = "specimen"
fix = { m = -0.3 }
bounds = { n = [1, 8] }
without_nuisances = ["rate"]
starts = 2
frames = 30
weights = "likelihood"
loss = "linear"
test_loss = "gaussian"
search = "multi-start"

[[identification.nuisances]]
kind = "thickness"
scope = "test"
mean_mm = 0.5
sd_mm = 0.02
tests = ["one"]

[[identification.nuisances]]
kind = "temperature step"
sd_K = 3
start_h = 2

[selection]
by = "aicc"
sums = false
further_laws = 2

[temperature]
law = "norton"
forms = { n = ["constant", "linear"] }
prior_odds = { A = { arrhenius = 10 } }
parameters = ["A", "n"]
moduli = false
within_K = 5

[rupture]
methods = ["larson-miller"]
times_h = [1000]
temperatures_C = [850]
tensile_strengths = [{ temperature_C = 850, strength_MPa = 400 }]
fixed = { larson-miller = { C = 20 } }
degrees = [1, 2]
distribution = "weibull"
criterion = "bic"
level = 0.9

[[forecast]]
name = "next"
group = "X"
specimen = "uniaxial"
load = { stress_MPa = [{ from_h = 0, level = 80 }, { from_h = 4, level = 90 }] }
control = "load"
temperature_C = 800
end_h = 100
modulus_GPa = 150
labels = { heat = "7" }
level = 0.9
targets = { strain = [0.01] }
tolerances = { temperature_K = 2 }
draws = 200

[design]
goal = "rate"
at_stress_MPa = 60
at_temperature_C = 800
group = "X"
budget_h = 300
specimen = "uniaxial"
levels = { stress_MPa = [20, 80] }
longest_h = 100
temperatures_C = [800]
tests_per_run = 2
setup_h = 1
frame_interval_s = 60

[[export]]
target = "abaqus"
file = "law.f"
group = "X"
law = "identified"
name = "steel"
stress_unit = "MPa"
time_unit = "h"
temperature_C = 800
modulus_GPa = 150
poisson = 0.3

[report]
file = "page.html"
attach_MB = 1
"""


KEY = re.compile(r"^(\w+) = ", re.MULTILINE)


def keys_of(text: str) -> Iterator[tuple[int, str]]:
    """(position, key) of every key at the beginning of a line."""
    for match in KEY.finditer(text):
        yield match.start(), match[1]


def misspelt(word: str) -> Iterator[str]:
    """The word with a letter left out, or swapped with the next, in its middle, and with one more."""
    middle = len(word) // 2
    yield word[:middle] + word[middle + 1 :]
    yield word[: middle - 1] + word[middle] + word[middle - 1] + word[middle + 1 :] if middle else word + "s"
    yield word + "x"


MISSPELT = [
    (position, key, wrong)
    for position, key in keys_of(FULL)
    for wrong in misspelt(key)
    if wrong != key and len(wrong) > 1
]


def refusal(text: str, path: Path = Path("study.toml")) -> str:
    with pytest.raises(StudyError) as caught:
        parse_study(path, text)
    return str(caught.value)


def test_the_full_file_is_valid_and_names_most_keys():
    model = parse_study(Path("study.toml"), FULL).model
    assert model.design is not None
    assert model.design.budget_h == 300
    top = set(known_keys(()))
    assert top == set(tomllib.loads(FULL))
    assert len(MISSPELT) > 200


def test_a_misspelt_key_is_refused_with_its_line_and_nearly_always_the_right_one():
    right = 0
    for position, key, wrong in MISSPELT:
        line = FULL.count("\n", 0, position) + 1
        told = refusal(FULL[:position] + wrong + FULL[position + len(key) :])
        assert told.startswith(f"study.toml:{line}: unknown key '{wrong}' in ["), told
        assert re.findall(r"^\[+([\w.]+)", FULL[:position], re.MULTILINE)[-1].split(".")[0] in told
        assert f"known: {', '.join(sorted(known_keys(_table_of(position))))}" in told
        assert "\n" not in told
        right += f"did you mean '{key}'" in told
    assert right >= 0.96 * len(MISSPELT)


def _table_of(position: int) -> list[str]:
    return re.findall(r"^\[+([\w.]+)", FULL[:position], re.MULTILINE)[-1].split(".")


@pytest.mark.parametrize("table", known_keys(()))
def test_a_misspelt_table_is_refused(table):
    for wrong in misspelt(table):
        text = FULL.replace(f"[{table}]", f"[{wrong}]").replace(f"[{table}.", f"[{wrong}.")
        told = refusal(text)
        assert f"unknown table [{wrong}] at the top of a study; did you mean '{table}'?" in told
        assert told.startswith(f"study.toml:{text[: text.index(wrong)].count(chr(10)) + 1}: ")


WRONG_VALUES = ('"text"', "true", "{ }", "nan", "1979-05-27", "[[1]]")


def test_values_of_a_wrong_type_are_refused_with_their_line():
    """No value of another type passes for a number, a text, a truth value or a table."""
    refused = 0
    for position, key in keys_of(FULL):
        end = FULL.index("\n", position)
        line = FULL.count("\n", 0, position) + 1
        right = tomllib.loads(f"value = {FULL[position:end].partition(' = ')[2]}")["value"]
        for wrong in WRONG_VALUES:
            value = tomllib.loads(f"value = {wrong}")["value"]
            if isinstance(value, type(right)) or (value == [] and isinstance(right, str)):
                continue
            text = f"{FULL[:position]}{key} = {wrong}{FULL[end:]}"
            try:
                parse_study(Path("study.toml"), text)
            except StudyError as error:
                told = str(error)
                refused += 1
                assert told.startswith(f"study.toml:{line}: "), told
                assert "\n" not in told
            else:
                allowed = {"only", "fix", "ignore", "tests", "without_nuisances", "load", "weights", "laws", "files"}
                allowed |= {
                    "methods",
                    "tensile_strengths",
                    "temperature_C",
                    "parameters",
                    "targets",
                    "frames",
                    "channels",
                }
                assert key in allowed, (key, wrong)
    assert refused > 300


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "has no 'data'"),
        ("[data]\n", 1, 'write files = ["*.csv"]'),
        ("[data]\nfiles = []\n", 2, "1 or more entries"),
        ("[data\nfiles = 1", 1, "not TOML"),
        ('[data]\nfiles = ["a"\n\n[study]\n', 4, "not TOML"),
        ('[data]\nfiles = ["a"]\nfiles = ["b"]\n', 3, "not TOML"),
        ('[data]\nfiles = ["a"]\n[[forecast]]\nend_h = 3\n', 3, "'name'"),
        ('[data]\nfiles = ["a"]\n[exclude]\ntest = "a"\n', 3, "must be a list"),
        ("a = " + "[" * 3000, None, "nested too deep"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = ' + "1" * 5000, 4, "too large"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = 0x' + "f" * 5000, 4, "too large"),
        ('[data]\nfiles = ["a"]\n[identification]\nlaws = ["norton"]\nweights = { s = 1' + "0" * 400 + "}", 5, "large"),
        ('[data]\nfiles = ["a"]\n[identification]\nlaws = ["norton"]\nweights = { s = 1e400 }', 5, "numbers by output"),
        ('[data]\nfiles = ["a"]\nonly = { temperature_C = 1' + "0" * 400 + " }", 3, "too large"),
        ('[data]\nfiles = ["a"]\n' + "a." * 100_000 + "a = 1", 3, "more than 20 parts"),
        ('[data]\nfiles = ["a"]\n[' + "'a' . " * 100_000 + "a]", 3, "more than 20 parts"),
        ("\n".join(f"a{k} = 1" for k in range(30_000)), None, "more than 20000 keys"),
    ],
)
def test_other_layouts_are_refused(text, line, words):
    told = refusal(text)
    assert words in told
    assert line is None or told.startswith(f"study.toml:{line}: ")


# ---- what names and files there are --------------------------------------------------------------------------------


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
        ('[data]\nfiles = [\n "*.csv",\n "/etc/passwd"]\n', 4, "absolute"),
        ('[data]\nfiles = ["~/x.csv"]\n', 2, "absolute"),
        (BASE.replace("norton", "nortn"), 4, "did you mean 'norton'"),
        (BASE + "fix = { nn = 5 }\n", 5, "no law has a parameter 'nn'"),
        (BASE + "fix = { n = 50 }\n", 5, "n"),
        (BASE + "bounds = { n = [5, 2] }\n", 5, "n"),
        (BASE + "bounds = { n = [1, 1e308] }\n", 5, "at most 1e+100"),
        (BASE + 'predictor = "dimpel"\n', 5, "did you mean 'dimple'"),
        (BASE + 'predictor = "/etc/passwd"\n', 5, "absolute"),
        (BASE + 'loss = "lin"\n', 5, "loss 'lin' is not known"),
        (BASE + 'without_nuisances = ["offst"]\n', 5, "did you mean 'offset'"),
        (BASE + '[[identification.nuisances]]\nkind = "thicknes"\n', 6, "thickness"),
        (BASE + '[[identification.nuisances]]\nkind = "thickness"\nsd = 0.1\n', 7, "given as sd_mm"),
        (BASE + '[[identification.nuisances]]\nkind = "temperature"\nsd_mm = 0.1\n', 7, "given as sd_K"),
        (BASE + '[specimen]\nname = "bulg"\n', 6, "did you mean 'bulge'"),
        (BASE + '[specimen]\nname = "bulge"\nlengths = { apex_mm = 1 }\n', 7, "did you mean"),
        (BASE + '[specimen]\nname = "bulge"\nlengths = { apex_thickness_kg = 1 }\n', 7, "no unit of 'apex_thickness'"),
        (BASE + '[[export]]\ntarget = "abacus"\n', 6, "did you mean 'abaqus'"),
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
        (BASE + '[[forecast]]\nname = "a"\n', 5, "one load"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = 5 }\n', 5, "end_h"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stres_MPa = 5 }\nend_h = 1\n', 7, "did you mean 'stress_MPa'"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_C = 5 }\nend_h = 1\n', 7, "stress"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = -5 }\nend_h = 1\n', 7, "stress"),
        (BASE + '[[forecast]]\nname = "a"\nload = { stress_MPa = [{ from_h = 1, level = 5 }] }\nend_h = 3\n', 7, "0"),
        (BASE + '[[forecast]]\nname = "a"\nload = { pressure_MPa = 5 }\nend_h = 1\n', 5, "modulus_GPa"),
        (BASE + '[[forecast]]\nname = "a"\ntests = ["*.csv"]\nend_h = 1\n', 8, "leave one of them out"),
        (BASE + '[design]\ngoal = "rate"\n', 6, "at_stress_MPa"),
        (BASE + '[design]\ngoal = "law"\nat_stress_MPa = 5\n', 7, "belongs to the goals"),
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
