"""The commands that need no data: laws, plugins, check, simulate, the global options and the exit codes."""

import json
import os
from functools import partial
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.cli.app import COMMANDS
from creepkit.cli.asking import put_questions
from creepkit.errors import HistoryError
from helpers.command_line import answers, creepkit, one_line

FALLING = """
from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")
LAW = CreepLaw(
    name="falling",
    title="A rate that falls with stress",
    terms={"falling": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-20, 1e-5), scale="log"),
        n: Param("stress exponent", bounds=(-3, -1)),
    },
    references=("nobody",),
)


@hookimpl
def creepkit_laws():
    return [LAW]
"""


pytestmark = pytest.mark.usefixtures("own_registry")


# ---- global --------------------------------------------------------------------------------------------------------


def test_help_tells_every_command_in_a_line() -> None:
    result = creepkit("--help")

    assert result.exit_code == 0
    assert all(f"\n  {name} " in result.stdout for name in COMMANDS)
    assert "..." not in result.stdout.split("Begin:")[1]


@pytest.mark.parametrize(
    "words", [(), ("no-such-command",), ("list", "laws", "--no-such"), ("check",), ("new", "law", "Bad!")]
)
def test_wrong_usage_exits_2(words: tuple[str, ...]) -> None:
    assert creepkit(*words).exit_code == 2


def test_a_misspelt_command_is_suggested() -> None:
    assert "did you mean 'report'" in creepkit("reprot").stderr
    assert "Usage: creepkit fit" in creepkit("fit", "--help").stdout


UNKNOWN = {
    "report norton": "norton is a law: give --app for a page of its sliders",
    "export my-law --to latex": "creepkit --plugin FILE.py before the command, or ck.load_plugin",
    "export norton --to umat": "choose one of those that serve it: ",
}


def test_what_is_meant_is_said_for_what_there_is_not() -> None:
    assert answers(UNKNOWN.items()) == []


def test_debug_lets_the_traceback_through() -> None:
    quiet, loud = creepkit("list", "laws", "nortn"), creepkit("--debug", "list", "laws", "nortn")

    assert "did you mean 'norton'?" in one_line(quiet)
    assert loud.exit_code == 1
    assert type(loud.exception).__name__ == "LawError"


# ---- laws ----------------------------------------------------------------------------------------------------------


# ---- plugins -------------------------------------------------------------------------------------------------------


def test_a_plugin_file_joins_the_laws() -> None:
    Path("mine.py").write_text(FALLING)

    result = creepkit("--plugin", "mine.py", "list", "laws", "falling")

    assert result.exit_code == 0
    assert f"from plugin 'mine' ({Path('mine.py').resolve()})" in result.stdout


def test_plugins_are_listed_broken_ones_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("good.py").write_text(FALLING)
    Path("twin.py").write_text(FALLING)
    Path("bad.py").write_text("1 / 0\n")
    monkeypatch.setenv("CREEPKIT_PLUGINS", os.pathsep.join(["good.py", "twin.py", "bad.py"]))

    text, answer = creepkit("list", "plugins"), json.loads(creepkit("list", "plugins", "--json").stdout)

    by_name = {plugin["name"]: plugin for plugin in answer["plugins"]}
    assert by_name["norton"]["offers"] == {"law": ["norton"]}
    assert by_name["good"]["status"] == "ok"
    assert by_name["bad"]["status"] == "broken"
    assert "ZeroDivisionError: division by zero" in by_name["bad"]["problem"]
    assert by_name["bad"]["problem"] in text.stdout
    assert len(answer["clashes"]) == 1
    assert answer["clashes"][0] in text.stdout


# ---- check ---------------------------------------------------------------------------------------------------------


def test_a_law_that_breaks_a_promise_fails_the_check() -> None:
    Path("falling.py").write_text(FALLING)

    result = creepkit("check", "falling.py")

    assert result.exit_code == 1
    assert "stress" in result.stdout
    assert result.stderr == "creepkit: 1 of 1 laws failed the check\n"


def test_a_file_that_has_the_name_of_a_law_is_not_executed() -> None:
    Path("norton").write_text("raise SystemExit('executed')\n")
    Path("mine").write_text("raise SystemExit('executed')\n")

    result = creepkit("check", "norton")

    assert result.exit_code == 0
    assert result.stdout.startswith("norton: conforms\n")
    assert "the file mine is not executed" in one_line(creepkit("check", "mine"))


def test_specimens_readers_and_exporters_are_checked_by_name() -> None:
    result = creepkit("check", "uniaxial", "csv", "code_aster")

    assert result.exit_code == 0
    heads = [line for line in result.stdout.splitlines() if not line.startswith(" ")]
    assert heads == [f"{name}: conforms" for name in ("uniaxial", "csv", "code_aster")]


# ---- simulate ------------------------------------------------------------------------------------------------------

NORTON = "simulate norton --set A=5e-13 --set n=3 --end-h 2"
DIMPLE = f"{NORTON} --specimen bulge --modulus-gpa 150"


def test_a_dimple_is_simulated_with_all_it_needs_in_the_head() -> None:
    result = creepkit(
        f"{DIMPLE} --pressure 8 --pressure 3600:10 --apex-thickness 0.48 --every 600 --to run.csv --picture section.png"
    )

    assert result.exit_code == 0, result.output
    assert result.stdout == "wrote run.csv: 13 frames to 2 h\n"
    (run,) = ck.read_histories("run.csv")
    dimple = ck.specimen("bulge").replace(apex_thickness=0.48)
    loading = ck.PressureJump(8, 10, 3600)
    same = ck.simulate("norton", dimple, {"A": 5e-13, "n": 3}, loading=loading, times=run.times, elastic=run.elastic)
    assert (run.loading, run.elastic, run.operator) == (loading, ck.Elastic(E=150e3), "profile 0-7.5 mm")
    assert run.geometry == same.geometry
    assert run.outputs["amplitude"].tolist() == same.outputs["amplitude"].tolist()
    assert Path("section.png").stat().st_size > 20_000


def test_a_bar_relaxes() -> None:
    """Norton, n = 3: s^-2 grows by 2 E A t; at first s = 150 MPa."""
    held = "--specimen relaxation --strain 0.001 --modulus-gpa 150 --points 3"
    result = creepkit(f"{NORTON} {held} --to held.csv")

    assert result.exit_code == 0, result.output
    (run,) = ck.read_histories("held.csv")
    assert (run.name, run.specimen, run.loading) == ("held", "relaxation", ck.constant_strain(0.001))
    expected = [(150.0**-2 + 2 * 150e3 * 5e-13 * t) ** -0.5 for t in (0, 3600, 7200)]
    assert run.outputs["stress"].tolist() == pytest.approx(expected, rel=1e-4)


def test_a_point_is_loaded_by_components() -> None:
    """Tension, and torsion after an hour: q^2 = s^2 + 3 tau^2."""
    result = creepkit(f"{NORTON} --specimen point --stress 11=60 --stress 12=3600:40 --points 3 --to tube.csv")

    assert result.exit_code == 0, result.output
    (run,) = ck.read_histories("tube.csv")
    assert run.loading == ck.PointLoading(stress={"11": 60, "12": [(0, 0), (3600, 40)]})
    later = (60.0**2 + 3 * 40.0**2) ** 1.5
    assert run.outputs["strain"].tolist() == pytest.approx([0, 5e-13 * 60**3 * 3600, 5e-13 * (60**3 + later) * 3600])


SENSELESS = [
    (f"{DIMPLE} --stress 8", "there is no option --stress; --specimen bulge takes --pressure"),
    (f"{DIMPLE} --pressure 8 --control load", "control does not belong to pressure of specimen 'bulge'"),
    (f"{NORTON} --specimen uniaxial --pressure 8", "there is no option --pressure; --specimen uniaxial takes --stress"),
    (f"{NORTON} --stress 8 --picture x.png", "--picture: specimen 'uniaxial' has no section to draw; leave it out"),
    (f"{NORTON} --specimen cube", "there is no specimen 'cube'"),
    (NORTON, "specimen 'uniaxial' needs a stress: give --stress, such as 100"),
    (f"{NORTON} --specimen relaxation", "specimen 'relaxation' needs a strain: give --strain, such as 0.002"),
    (f"{NORTON} --specimen relaxation --strain 0.001", "'relaxation' needs a modulus"),
    (f"{NORTON} --stress 80 --ramp 5", "ramp does not belong to stress of specimen 'uniaxial'"),
    (f"{NORTON} --specimen point", "specimen 'point' needs a component: give --stress 11=100"),
    (f"{NORTON} --specimen point --stress 80", "--stress 80: name the component, such as 11=80"),
    (
        f"{NORTON} --specimen uniaxial --stress 11=80",
        "11 is a component of stress, which --specimen uniaxial has not; give --specimen",
    ),
    (
        f"{NORTON} --stress 80 --temperature-c 1800:500",
        "nothing is said of the temperature before; give its first level from 0 s on",
    ),
    (f"{NORTON} --specimen point --stress 21=80", "no component '21' to load; allowed are 11, 22, 33, 12, 23, 13"),
    (DIMPLE, "specimen 'bulge' needs a pressure: give --pressure, such as 9"),
    (
        f"{NORTON} --specimen bulge --pressure 8",
        "specimen 'bulge' needs a modulus: give --modulus-gpa or modulus_GPa, such",
    ),
    (f"{DIMPLE} --pressure 8 --set n=4", "--set A=5e-13 n=3 n=4: n is given twice; keep one of them"),
    (f"{DIMPLE} --pressure -8", "the first pressure starts at 0 s, none is negative, and each"),
    (f"{DIMPLE} --pressure 8 --pressure 2:9", "comes 5 s or more after the one before"),
    (f"{DIMPLE} --pressure high", "--pressure high is not known; write [S:]NUMBER"),
    (f"{DIMPLE} --load force=8", "there is no option --load force; --specimen bulge takes --pressure, --apex"),
    (f"{DIMPLE} --pressure 8 --apex-thickness thick", "--apex-thickness thick is not known; write [S:]NUMBER"),
    (
        f"{DIMPLE} --pressure 8 --every 60 --points 9",
        "--points and --every both say when frames are taken; give one of them",
    ),
    (f"{DIMPLE} --pressure 8 --every 9999", "--every 9999 s is not a step of a test of 7200 s (1 to 1000000 frames)"),
    (
        f"{DIMPLE} --pressure 8 --points 100000000000",
        "--points is 100000000000; allowed is a whole number from 2 to 1000000",
    ),
    (f"{DIMPLE} --pressure 8 --picture none/section.png", "none/section.png: cannot be written"),
]


def test_a_simulation_that_makes_no_sense_is_one_line() -> None:
    assert answers(SENSELESS) == []


UNWRITABLE = [
    ("--picture none/section.png", "none/section.png: cannot be written: there is no folder none"),
    ("--picture section.doc", "section.doc: '.doc' is no format of pictures"),
    ("--picture folder.png", "folder.png: cannot be written: it is a folder"),
    ("--to none/run.csv", "none/run.csv: cannot be written: there is no folder none"),
]


def test_a_file_that_cannot_be_written_is_said_before_the_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ck, "simulate", None)
    Path("folder.png").mkdir()
    assert answers((f"{DIMPLE} --pressure 8 {words}", said) for words, said in UNWRITABLE) == []


# ---- names before work -----------------------------------------------------------------------------------------------

# Options that name things, and temperatures that no solid has, are refused before the work.


BARS = sorted(str(path) for path in ck.example_data("planted creep curves").glob("*.csv"))


@pytest.fixture
def no_identification(monkeypatch):
    def refuse(*arguments, **options):
        raise AssertionError("an identification began")

    monkeypatch.setattr("creepkit.discovery.discover.identify", refuse)


def test_forms_and_parameters_of_a_temperature_study(no_identification, tmp_path):
    table = {"--form n=lin": "no temperature form 'lin'; did you mean 'linear'", "--form m=linear": "'m'"}
    line = f"discover {' '.join(BARS)} --law norton --to {tmp_path / 'd'}"
    assert answers((f"{line} {words}", said) for words, said in table.items()) == []


# ---- read with bad files ---------------------------------------------------------------------------------------------

# `creepkit read` of a folder with a file that cannot be read: the others are shown, then its error.


GOOD = "# stress_MPa: 150\n# temperature_C: 600\nTime (h),Creep strain (%)\n" + "".join(
    f"{h},{0.01 * h**0.6:.5f}\n" for h in range(1, 20)
)


def test_the_good_files_are_shown_and_the_errors_come_last(tmp_path):
    (tmp_path / "good.csv").write_text(GOOD)
    (tmp_path / "other.csv").write_text(GOOD.replace("150", "170"))
    (tmp_path / "spoilt.csv").write_text("# Ofenplatz: 3\n" + GOOD)
    result = creepkit("read", str(tmp_path))
    assert result.exit_code == 1
    assert "good: uniaxial, 150 MPa" in result.output
    assert "other: uniaxial, 170 MPa" in result.output
    assert "unknown key 'Ofenplatz'" in result.output


# ---- reduced model ---------------------------------------------------------------------------------------------------

# `creepkit surrogate reduce`: what it says.


def test_a_model_is_trained_and_described():
    said = creepkit("surrogate reduce --geometry apex_thickness=0.52")
    assert said.exit_code == 0, said.output
    assert "modes" in said.output
    assert "amplitude" in said.output


# ---- asking ----------------------------------------------------------------------------------------------------------

# `creepkit read --ask`: questions one after another, answers beside the data, nothing changed in the files.


TABLE = "Temp (C);Stress (MPa);tr (h);Status\n600;320;4454;A\n600;260;23220;B\n650;320;233;A\n"
CURVE = "# stress_MPa: 120\n# temperature_C: 600\nZeit (h);Dehnung (%);Kanal 7;W\n0;0;4;1\n10;0.1;4;1\n20;0.18;4;2\n"


def typing(*answers):
    left = list(answers)
    return lambda prompt: left.pop(0), left


def test_questions_are_answered_one_after_another(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(CURVE, encoding="utf-8")
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    answer, left = typing("1", "unused", "9", "")
    (file,) = put_questions(partial(ck.read_histories, tmp_path), answer)
    assert (file.name, left) == ("tests.toml", [])
    assert "'9' is none of these" in capsys.readouterr().out
    tests = {one.name: one for one in ck.read_histories(tmp_path)}
    assert [tests[name].unruptured for name in ("rates 2", "rates 3", "rates 4")] == [False, True, False]
    assert tests["a"].outputs["strain"][-1] == pytest.approx(0.0018)
    assert (tmp_path / "rates.csv").read_text(encoding="utf-8") == TABLE


def test_without_a_terminal_each_question_is_a_line(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(CURVE, encoding="utf-8")
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    with pytest.raises(HistoryError, match=r"3 questions open; answer them in tests.toml"):
        put_questions(partial(ck.read_histories, tmp_path), None)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert 'tests.toml beside it: ["rates.csv"] ended = {B = "stopped", A = "ruptured"}' in lines[2]


def test_a_modulus_that_nobody_stated_is_asked_for(tmp_path, capsys):
    """Of a relaxation without its ramp, whether strain is a condition or a column; an answer makes it complete."""
    head, stresses = "# temperature_C: 600\n", (180, 150, 120, 101, 92)
    body = "".join(f"{t},{s}\n" for t, s in zip((0, 1, 10, 50, 100), stresses, strict=True))
    held = body.replace("\n", ",0.15\n")
    (tmp_path / "a.csv").write_text(f"# hold_strain_pct: 0.15\n{head}time_h,stress_MPa\n{body}", encoding="utf-8")
    (tmp_path / "b.csv").write_text(f"{head}# control: strain\ntime_h,stress_MPa,strain_pct\n{held}", encoding="utf-8")
    assert "question" in creepkit("read", tmp_path, "--ask").stderr
    answer, left = typing("150", "160")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    assert left == []
    assert "how many GPa is it?" in capsys.readouterr().out
    moduli = [test.elastic.at(873.15).E for test in ck.read_histories(tmp_path)]
    assert sorted(moduli) == [150e3, 160e3]


def test_a_specimen_and_lengths_that_nobody_stated_are_asked_for(tmp_path):
    head = "# pressure_MPa: 8\n# temperature_C: 800\ntime_s,amplitude_mm\n"
    (tmp_path / "d.csv").write_text(f"{head}60,0.08\n300,0.09\n900,0.1\n", encoding="utf-8")
    answer, left = typing("", "0.48", "", "", "", "", "")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    (test,) = ck.read_histories(tmp_path)
    assert (test.specimen, test.geometry["apex_thickness"], test.geometry["cavity_radius"]) == ("bulge", 0.48, 7.5)
    assert (left, "by default" in test.labels.get("assumed", "")) == ([], False)
