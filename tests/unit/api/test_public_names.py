"""The public names: each loads, none is the name of a sub-package, and the command line shares their defaults."""

import inspect
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.api.identification import SettingChanges, change_settings
from creepkit.cli.app import COMMANDS
from creepkit.errors import FitError, HistoryError
from helpers.command_line import creepkit

SOURCES = Path(ck.__file__).parent
FUNCTIONS = [name for name in ck.__all__ if inspect.isfunction(getattr(ck, name))]

PLUGIN = """
from creepkit import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")


@hookimpl
def creepkit_laws():
    table = {
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1.0), scale="log", off=0.0),
        n: Param("stress exponent", bounds=(1.0, 12.0)),
    }
    return [CreepLaw("from-a-file", {"power law": A * stress**n}, table, title="Power law", references=("this test",))]
"""


def test_no_public_name_is_a_sub_package() -> None:
    modules = {path.parent.name for path in SOURCES.glob("*/__init__.py")} | {
        path.stem for path in SOURCES.glob("*.py")
    }
    assert set(ck.__all__) & modules == {"errors"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_public_functions_say_what_they_do_and_take_at_most_eight_arguments(name: str) -> None:
    function = getattr(ck, name)
    parameters = inspect.signature(function).parameters.values()
    assert sum(p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL) for p in parameters) <= 8
    assert inspect.getdoc(function)


def test_a_law_of_a_plugin_file_is_written_with_public_names_alone(tmp_path: Path) -> None:
    (tmp_path / "power.py").write_text(PLUGIN)
    ck.load_plugin(tmp_path / "power.py")
    law = ck.law("from-a-file")
    assert law.names == ("A", "n")
    assert ck.check_law(law, samples=8).passed
    assert "from-a-file" in ck.available("laws")


def test_example_data_are_found_in_words() -> None:
    folder = ck.example_data("planted creep curves")
    assert folder == ck.example_data("Planted_Creep-Curves")
    assert len(ck.read_histories(folder)) == 9
    assert (ck.example_data("planted bulge test") / "truth.json").is_file()
    with pytest.raises(HistoryError, match="no example data 'planted creep'; did you mean 'planted creep curves'"):
        ck.example_data("planted creep")


def test_settings_are_changed_by_name() -> None:
    assert SettingChanges.__annotations__.keys() == {field.name for field in fields(ck.IdentificationSettings)}
    settings = ck.IdentificationSettings()
    assert change_settings(settings, {}) is not None
    assert change_settings(settings, {"nuisances": None, "seed": 0}) == settings
    assert change_settings(settings, {"nuisances": ["offset"]}).nuisances == (ck.Nuisance("offset"),)
    assert change_settings(settings, {"nuisances": "rate"}).nuisances == (ck.Nuisance("rate"),)
    with pytest.raises(FitError, match=r"nuisances are names or such as Nuisance\('thickness', sd=0.01\), found 3"):
        change_settings(settings, {"nuisances": [3]})
    assert change_settings(settings, {"starts": 20}).sobol_points == 256
    assert change_settings(settings, {"starts": 20, "sobol_points": 32}).sobol_points == 32
    with pytest.raises(FitError, match="have no 'start'; did you mean 'starts'"):
        change_settings(settings, {"start": 3})  # type: ignore[typeddict-unknown-key]
    with pytest.raises(FitError, match="suspect_frames 'drop' is not known; allowed are exclude and keep"):
        change_settings(settings, {"suspect_frames": "drop"})  # type: ignore[typeddict-item]
    with pytest.raises(FitError, match="have no 'tolerance'"):
        ck.identify("norton", [ck.History("a", np.ones(1), {}, ck.constant_stress(1.0), 300.0)], tolerance=1)  # type: ignore[call-arg]


@pytest.mark.parametrize("command", ["identify", "discover", "screen"])
def test_the_command_line_has_no_defaults_of_its_own(command: str) -> None:
    """What nothing is said of is None, which leaves the defaults of IdentificationSettings; help quotes them."""
    parameters = inspect.signature(COMMANDS[command]).parameters
    settings = {field.name: field.default for field in fields(ck.IdentificationSettings)}
    shared = parameters.keys() & settings.keys()
    assert {"starts", "seed", "frames", "suspect_frames"} <= shared
    assert {parameters[name].default for name in shared} == {None}
    help_text = " ".join(creepkit(command, "--help").stdout.split())
    assert f"Frames of each test that are compared; {settings['frames']} by default." in help_text
    assert f"{settings['suspect_frames']} by default." in help_text
    assert "{settings" not in help_text


@pytest.mark.parametrize(
    ("command", "options", "defaults"),
    [
        ("screen", ("dense",), ck.ScreeningOptions()),
        ("generate", ("workers", "cluster", "part"), ck.ParallelExecution()),
    ],
)
def test_the_command_line_has_the_same_defaults(command: str, options: tuple[str, ...], defaults: object) -> None:
    parameters = inspect.signature(COMMANDS[command]).parameters
    for option in options:
        assert parameters[option].default == getattr(defaults, option), option


def test_every_verb_has_the_same_settings() -> None:
    assert ck.ScreeningOptions().settings == ck.IdentificationSettings()


def test_the_temperature_study_has_the_same_defaults_on_the_command_line() -> None:
    command, study = inspect.signature(COMMANDS["discover"]), inspect.signature(ck.temperature_study)
    for name in ("within", "moduli"):
        assert command.parameters[name].default == study.parameters[name].default
