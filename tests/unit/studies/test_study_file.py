"""Study files: every misspelt key, wrong type and unknown name is refused in one sentence, with its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.studies.proposal import propose_study, title_of
from creepkit.studies.stages import export_name
from creepkit.studies.study_file import key_lines, known_keys, parse_study
from helpers.paths import ROOT

FULL = (ROOT / "tests" / "data" / "study_with_every_table.toml").read_text(encoding="utf-8")


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


def test_the_page_has_the_name_of_its_study_where_none_is_given():
    """Several studies in one folder then do not replace each other's page."""
    text = '[data]\nfiles = ["*.csv"]\n[report]\n'
    named = {"study": "report.html", "blades": "blades.html"}
    found = {name: parse_study(Path(f"{name}.toml"), text).model.report for name in named}
    assert {name: report.file for name, report in found.items()} == named
    exported = parse_study(Path("blades.toml"), text + '[[export]]\ntarget = "latex"\n')
    assert export_name(exported, 0) == "blades_law.tex"


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


SEVERAL_TYPES = (
    "only fix ignore tests nuisances load weights laws files methods tensile_strengths temperature_C "
    "parameters targets frames names channels missing"
)
"""Keys whose values may be of more than one type."""

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
                assert f" {key} " in f" {SEVERAL_TYPES} ", (key, wrong)
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
        ('[data]\nfiles = ["a"]\n[exclude]\ntest = "a"\n', 3, "in two brackets, [[exclude]]"),
        ('[data]\nfiles = ["a"]\n[forecast]\nname = "a"\n[forecast]\nname = "b"\n', 5, "write [[forecast]] above"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = 1\n[study]\ntitle = "b"\n', 5, "under one heading"),
        ('[data]\nfiles = ["a"]\n[[design]]\ngoal = "law"\n', 3, "in one bracket, [design]"),
        (
            '[data]\nfiles = ["a"]\n[design]\ngoal = "laws"\n',
            4,
            "must be one of these: law, parameters, rate, exponent",
        ),
        ("# stress_MPa: 100\nTime (h),Creep strain (%)\n0.5,0.1\n", 2, "but looks like data"),
        ("a = " + "[" * 3000, None, "too deep"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = ' + "1" * 5000, None, "too large"),
        (
            '[data]\nfiles = ["a"]\n[identification]\nlaws = ["norton"]\nusual_errors = { load = 1e400 }',
            5,
            "numbers by name",
        ),
        ('[data]\nfiles = ["a"]\n[identification]\nlaws = "a"\nusual_errors = { load = 1' + "0" * 400 + "}", 5, ""),
    ],
)
def test_other_layouts_are_refused(text, line, words):
    told = refusal(text)
    assert words in told
    assert line is None or told.startswith(f"study.toml:{line}: ")


# ---- names in studies ------------------------------------------------------------------------------------------------

# Study files that name what is not there: refused in one sentence with its line, before anything is done.


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
        (BASE + 'using = "dimpel"\n', 5, "did you mean 'dimple'"),
        (BASE + 'using = "/etc/passwd"\n', 5, "absolute"),
        (BASE + 'rupture_times = "lin"\n', 5, "must be one of these: auto, "),
        (BASE + 'nuisances = ["offst=none"]\n', 5, "did you mean 'offset'"),
        (BASE + 'nuisances = ["thicknes=0.5"]\n', 5, "thickness"),
        (BASE + 'nuisances = ["thickness=thin"]\n', 5, "write KIND"),
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
        (
            BASE + '[[forecast]]\nname = "a"\nload = { pressure_MPa = -5 }\nmodulus_GPa = 150\nend_h = 1\n',
            7,
            "pressure",
        ),
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
        (folder / "study.toml").write_text(BASE + f'using = "{name}"\n')
        with pytest.raises(StudyError, match=rf"study\.toml:5: .*no file '{name}' lies beside the study"):
            ck.Study.load(folder / "study.toml").run()


# ---- key lines -------------------------------------------------------------------------------------------------------

# Lines of the keys of a TOML text are found for all that the parser of the standard library reads.


NAMES = st.sampled_from(["a", "b-c", "d_1", '"e f"', "'g.h'", '"i\\"j"'])
SCALARS = st.sampled_from(["1", "-2.5e3", "true", '"x # y"', "'''l\n]m'''", '"""n\n"} o"""', "1979-05-27", "[]", "{}"])
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, min_size=1, max_size=3).map(lambda items: "[ # c ]\n" + ",\n ".join(items) + ",\n]"),
    max_leaves=5,
)


def paths_of(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Of keys and tables; items of a list that is a value stand on the line of its key."""
    tables = isinstance(data, list) and bool(data) and all(isinstance(one, dict) and one for one in data)
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if tables else ():
        yield (*path, key)
        yield from paths_of(value, (*path, key))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["[{}]", "[[{}]]", ""]), NAMES, NAMES, VALUES), max_size=6))
def test_the_lines_are_those_of_all_keys_that_tomllib_reads(parts):
    """Whatever tomllib reads, the same keys and tables are found."""
    text = "# begin\n"
    for heading, table, key, value in parts:
        text += f"{heading.format(table)} # h\n" if heading else "\n"
        text += f"{key} = {value} # v\n"
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    lines = key_lines(text)
    assert set(paths_of(data)) == set(lines)
    for path, line in lines.items():
        name = next(part for part in reversed(path) if isinstance(part, str))
        shown = text.splitlines()[line - 1]
        if isinstance(path[-1], str):
            assert name in shown or name.replace('"', '\\"') in shown


def test_a_proposed_study_asks_for_forms_of_temperature_only_of_tests_at_three_held_temperatures(tmp_path):
    """Two tests are held, at 700 and 740 C; one goes through three levels, or is held at 720 C."""
    for third, expected in (([700] * 20 + [720] * 20 + [740] * 20, False), ([720] * 60, True)):
        for name, celsius in (("a", [700] * 60), ("b", [740] * 60), ("c", third)):
            rows = "".join(f"{k},{one},{0.01 * (k + k**0.5):.4f}\n" for k, one in enumerate(celsius))
            (tmp_path / f"{name}.csv").write_text(f"# stress_MPa: 60\ntime_h,temperature_C,strain_pct\n{rows}")
        assert ("\n[temperature]\n" in propose_study(tmp_path, tmp_path / "study.toml").text) == expected


def test_a_proposed_study_is_called_after_what_was_tested_and_never_data(tmp_path):
    def bars(**stated):
        return [ck.History("a", [1.0], {"strain": [0.01]}, ck.constant_stress(50.0), 900.0, **stated)]

    folder = tmp_path / "9Cr" / "data"
    assert title_of(bars(alloy="CMSX-6"), folder) == "CMSX-6"
    assert title_of([*bars(alloy="A"), *bars(alloy="B")], folder) == "A, B"
    assert title_of(bars(labels={"heat": "B07"}), folder) == "heat B07"
    assert title_of([*bars(labels={"heat": "B07"}), *bars(labels={"heat": "C1"})], folder) == "9Cr"
    assert title_of(bars(), folder.parent) == title_of([], folder) == "9Cr"
