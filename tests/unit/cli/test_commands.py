"""The commands that need no data: laws, plugins, check, simulate, the global options and the exit codes."""

import json
import os
from functools import partial
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.cli.app import COMMANDS
from creepkit.cli.asking import put_questions
from creepkit.cli.command_options import parsed_integer, parsed_number
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

BRITTLE = """
from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, states, stress

(A,), (w,) = parameters("A"), states("w")
RATE = A * stress / (1 - w)
COEFFICIENT = Param("rate coefficient", unit="1/s", bounds=(1e-20, 1e-5), scale="log")


@hookimpl
def creepkit_laws():
    return [CreepLaw("brittle", {"creep": RATE}, {A: COEFFICIENT}, states={w: State(0, RATE, "damage", limit=0.9)})]
"""

COMMAND = """
from creepkit.language import hookimpl


@hookimpl
def creepkit_commands(app):
    app.command("greet")(lambda: None)
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


def test_version() -> None:
    assert creepkit("--version").stdout.startswith("creepkit 0.")


def test_debug_lets_the_traceback_through() -> None:
    quiet, loud = creepkit("list", "laws", "nortn"), creepkit("--debug", "list", "laws", "nortn")

    assert "did you mean 'norton'?" in one_line(quiet)
    assert loud.exit_code == 1
    assert type(loud.exception).__name__ == "LawError"


# ---- laws ----------------------------------------------------------------------------------------------------------


def test_laws_are_listed_with_their_parameters() -> None:
    result = creepkit("list", "laws")

    assert result.exit_code == 0
    assert "norton" in result.stdout
    assert "A n_0 n_inf C tau_d tau_r" in result.stdout


def test_laws_as_json_hold_what_table_1_says() -> None:
    laws = {law["name"]: law for law in json.loads(creepkit("list", "laws", "--json").stdout)}

    m = laws["strain-hardening"]["parameters"]["m"]
    assert (m["bounds"], m["off"]) == ([-1, 0], 0)
    assert laws["combined"]["parameters"]["A_1"]["bounds"] == [1e-40, 1e-5]
    assert laws["norton"]["provenance"].startswith("plugin 'norton' (creepkit ")


def test_one_law_in_full() -> None:
    shown = creepkit("list", "laws", "norton").stdout

    assert "A*stress**n" in shown
    assert r"A \sigma_e^{n}" in shown
    assert "Norton (1929)" in shown
    assert json.loads(creepkit("list", "laws", "norton", "--json").stdout)["terms"] == {"power law": "A*stress**n"}


# ---- plugins -------------------------------------------------------------------------------------------------------


def test_a_plugin_file_joins_the_laws() -> None:
    Path("mine.py").write_text(FALLING)

    result = creepkit("--plugin", "mine.py", "list", "laws", "falling")

    assert result.exit_code == 0
    assert f"from plugin 'mine' ({Path('mine.py').resolve()})" in result.stdout


def test_a_state_as_json_says_where_the_material_ends() -> None:
    Path("brittle.py").write_text(BRITTLE)

    law = json.loads(creepkit("--plugin", "brittle.py", "list", "laws", "brittle", "--json").stdout)

    rate = "A*stress/(1 - w)"
    assert law["states"] == {"w": {"meaning": "damage", "unit": "1", "rate": rate, "initial": 0.0, "limit": 0.9}}


def test_a_plugin_file_that_is_asked_for_must_work() -> None:
    Path("mine.py").write_text("A = (\n")

    assert f"({Path('mine.py').resolve()}, line 1)" in one_line(creepkit("--plugin", "mine.py", "list", "laws"))
    assert "plugin file none.py does not exist" in one_line(creepkit("--plugin", "none.py", "list", "laws"))


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


def test_a_file_without_laws_cannot_be_checked() -> None:
    Path("commands.py").write_text(COMMAND)

    assert "offers no law" in one_line(creepkit("check", "commands.py"))


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


def test_the_cameras_of_a_dimple_take_a_frame_every_150_s() -> None:
    lines = creepkit(f"{DIMPLE} --pressure 8").stdout.splitlines()

    assert "# pressure_1_MPa: 8.0" in lines
    assert [line.split(",")[0] for line in lines[-2:]] == ["7050.0", "7200.0"]


def test_more_pressures_are_a_program_of_ramps() -> None:
    lines = creepkit(f"{DIMPLE} --pressure 8 --pressure 3600:10 --pressure 5000:0").stdout.splitlines()

    assert (
        "# pressure_program: 0.0 s 0.0 MPa; 5.0 s 8.0 MPa; 3600.0 s 8.0 MPa; 3605.0 s 10.0 MPa; 5000.0 s 10.0 MPa; "
        "5005.0 s 0.0 MPa"
    ) in lines


def test_a_burst_is_told_and_the_history_ends_there() -> None:
    result = creepkit(f"{DIMPLE} --pressure 8 --to run.csv".replace("5e-13", "1e-9"))

    assert result.exit_code == 0
    assert " h: the surface reached the deflection limit; the history ends there\n" in result.stderr
    (run,) = ck.read_histories("run.csv")
    assert run.times[-1] < run.rupture_time < 7200
    assert run.labels["ended"] == "the surface reached the deflection limit"


def test_a_bar_with_a_modulus_has_its_elastic_strain() -> None:
    creepkit(f"{NORTON} --stress 100 --control stress --modulus-gpa 100 --points 3 --to bar.csv")

    (run,) = ck.read_histories("bar.csv")
    assert run.outputs["strain"].tolist() == pytest.approx([1e-3, 1e-3 + 5e-7 * 3600, 1e-3 + 5e-7 * 7200], rel=1e-6)
    assert run.includes_elastic


def test_specimens_are_listed_with_their_outputs() -> None:
    listed = {one["name"]: one for one in json.loads(creepkit("list", "specimens", "--json").stdout)}

    assert {"uniaxial", "relaxation", "point", "bulge"} <= listed.keys()
    assert listed["relaxation"]["outputs"] == ["stress"]
    assert listed["relaxation"]["nuisances"] == ["temperature", "modulus"]
    assert "strain strain_11" in creepkit("list", "specimens").stdout


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
    (f"{DIMPLE} --pressure 8 --control load", "--control does not belong to --pressure of --specimen bulge"),
    (f"{NORTON} --specimen uniaxial --pressure 8", "there is no option --pressure; --specimen uniaxial takes --stress"),
    (f"{NORTON} --stress 8 --picture x.png", "--picture: specimen 'uniaxial' has no section to draw; leave it out"),
    (f"{NORTON} --specimen cube", "there is no specimen 'cube'"),
    (NORTON, "specimen 'uniaxial' needs a stress: give --stress, such as 100"),
    (f"{NORTON} --specimen relaxation", "specimen 'relaxation' needs a strain: give --strain, such as 0.002"),
    (f"{NORTON} --specimen relaxation --strain 0.001", "'relaxation' needs a modulus"),
    (f"{NORTON} --stress 80 --ramp 5", "--ramp does not belong to --stress of --specimen uniaxial"),
    (f"{NORTON} --specimen point", "specimen 'point' needs a component: give --stress 11=100"),
    (f"{NORTON} --specimen point --stress 80", "--stress 80: name the component, such as 11=80"),
    (
        f"{NORTON} --specimen uniaxial --stress 11=80",
        "11=80 names a component, which --specimen uniaxial has not; give --specimen",
    ),
    (
        f"{NORTON} --stress 80 --temperature-c 1800:500",
        "--temperature-c: nothing is said of the time before; give the first one from 0 s on",
    ),
    (f"{NORTON} --specimen point --stress 21=80", "no component '21' to load; allowed are 11, 22, 33, 12, 23, 13"),
    (DIMPLE, "specimen 'bulge' needs a pressure: give --pressure, such as 9"),
    (f"{NORTON} --specimen bulge --pressure 8", "specimen 'bulge' needs a modulus: give --modulus-gpa, such as 150"),
    (f"{DIMPLE} --pressure 8 --set n=4", "--set A=5e-13 n=3 n=4: n is given twice; keep one of them"),
    (f"{DIMPLE} --pressure -8", "--pressure -8: the first pressure starts at 0 s, none is negative, and each"),
    (f"{DIMPLE} --pressure 8 --pressure 2:9", "comes 5 s or more after the one before"),
    (f"{DIMPLE} --pressure high", "--pressure high: write a number, or SECONDS:NUMBER for a later step"),
    (
        f"{DIMPLE} --pressure 8 --thicknes 1",
        "there is no option --thicknes; --specimen bulge takes --pressure, --apex-thickness",
    ),
    (f"{DIMPLE} --pressure 8 --apex-thickness thick", "--apex-thickness thick: write a number"),
    (
        f"{DIMPLE} --pressure 8 --every 60 --points 9",
        "--points and --every both say when frames are taken; give one of them",
    ),
    (f"{DIMPLE} --pressure 8 --every 9999", "--every 9999 s is not a step of a test of 7200 s (1 to 1000000 frames)"),
    (
        f"{DIMPLE} --pressure 8 --points 100000000000",
        "--points is 100000000000; allowed are whole numbers from 2 to 1000000",
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


@pytest.mark.parametrize("text", ["٣", "1_0", "２"])
def test_digits_of_other_scripts_are_no_numbers(text: str):
    assert parsed_number(" 1e3 ") == 1000.0
    assert parsed_integer("-3") == -3
    for parsed in (parsed_number, parsed_integer):
        with pytest.raises(ValueError, match=text):
            parsed(text)


# ---- names before work -----------------------------------------------------------------------------------------------

# Options that name things, and temperatures that no solid has, are refused before the work.


BARS = sorted(str(path) for path in ck.example_data("planted creep curves").glob("*.csv"))


@pytest.fixture
def no_identification(monkeypatch):
    def refuse(*arguments, **options):
        raise AssertionError("an identification began")

    monkeypatch.setattr("creepkit.discovery.discover.identify", refuse)


def test_forms_and_parameters_of_a_temperature_study(no_identification, tmp_path):
    table = {
        "--form n=lin": "no temperature form 'lin': did you mean 'linear'",
        "--form m=linear": "'m'",
        "--prior A.arrhenus=10": "did you mean 'arrhenius'",
        "--prior B.arrhenius=10": "'B'",
    }
    line = f"discover {' '.join(BARS)} --law norton --to {tmp_path / 'd'}"
    assert answers((f"{line} {words}", said) for words, said in table.items()) == []


def test_a_target_of_exports_before_the_values_of_the_law():
    assert "did you mean 'abaqus'" in one_line(creepkit("export", "norton", "--to", "abaqs"))


def test_temperatures_above_which_nothing_is_solid():
    """Tungsten melts at 3695 K, hafnium carbonitride at about 4300 K; 4227 °C are 4500.15 K."""
    line = "simulate norton --set A=1e-15 --set n=4 --stress 80 --end-h 1 --temperature-c"
    assert answers((f"{line} {celsius}", "4500 K") for celsius in (8000, 4227)) == []


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


def test_a_bar_has_no_reduced_order_model_to_train():
    words = "it has no reduced-order model that is trained; name one of those that have one: bulge"
    assert words in one_line(creepkit("surrogate reduce --specimen uniaxial"))


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


def test_the_same_question_of_several_files_is_put_once(tmp_path):
    head = "Stress (MPa);120\nTemperature (C);600\nTime (h);Extension (mm)\n"
    for name in ("RX1.csv", "RX2.csv"):
        (tmp_path / name).write_text(f"{head}0;0,01\n10;0,05\n50;0,1\n100;0,16\n", encoding="utf-8")
    answer, left = typing("40")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    assert left == []
    assert (tmp_path / "tests.toml").read_text(encoding="utf-8") == '["RX*.csv"]\ngauge_length_mm = 40\n'
    assert [one.outputs["strain"][-1] for one in ck.read_histories(tmp_path)] == pytest.approx([0.004, 0.004])


def test_a_question_may_stay_open(tmp_path):
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    answer, _ = typing("?")
    assert put_questions(partial(ck.read_histories, tmp_path), answer) == []
    assert not (tmp_path / "tests.toml").exists()


def test_without_a_terminal_each_question_is_a_line(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(CURVE, encoding="utf-8")
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    with pytest.raises(HistoryError, match=r"3 questions open; answer them in tests.toml"):
        put_questions(partial(ck.read_histories, tmp_path), None)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert 'tests.toml beside it: ["rates.csv"] ended = {B = "stopped", A = "ruptured"}' in lines[2]


def test_a_specimen_and_lengths_that_nobody_stated_are_asked_for(tmp_path):
    head = "# pressure_MPa: 8\n# temperature_C: 800\ntime_s,amplitude_mm\n"
    (tmp_path / "d.csv").write_text(f"{head}60,0.08\n300,0.09\n900,0.1\n", encoding="utf-8")
    answer, left = typing("", "0.48", "", "", "", "", "")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    (test,) = ck.read_histories(tmp_path)
    assert (test.specimen, test.geometry["apex_thickness"], test.geometry["cavity_radius"]) == ("bulge", 0.48, 7.5)
    assert (left, "by default" in test.labels.get("assumed", "")) == ([], False)
