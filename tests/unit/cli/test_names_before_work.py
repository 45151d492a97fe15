"""Options that name things, and temperatures that no solid has, are refused before the work."""

import pytest

import creepkit as ck
from helpers.command_line import creepkit, one_line

BARS = sorted(str(path) for path in ck.example_data("planted creep curves").glob("*.csv"))


@pytest.fixture
def no_identification(monkeypatch):
    def refuse(*arguments, **options):
        raise AssertionError("an identification began")

    monkeypatch.setattr("creepkit.discovery.discover.identify", refuse)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--form", "n=lin"), "no temperature form 'lin': did you mean 'linear'"),
        (("--form", "m=linear"), "'m'"),
        (("--prior", "A.arrhenus=10"), "did you mean 'arrhenius'"),
        (("--prior", "B.arrhenius=10"), "'B'"),
    ],
)
def test_forms_and_parameters_of_a_temperature_study(no_identification, tmp_path, words, said):
    assert said in one_line(creepkit("discover", *BARS, "--law", "norton", *words, "--to", str(tmp_path / "d")))


def test_a_target_of_exports_before_the_values_of_the_law():
    assert "did you mean 'abaqus'" in one_line(creepkit("export", "norton", "--to", "abaqs"))


@pytest.mark.parametrize("celsius", ["8000", "4227"])
def test_temperatures_above_which_nothing_is_solid(celsius):
    """Tungsten melts at 3695 K, hafnium carbonitride at about 4300 K; 4227 °C are 4500.15 K."""
    law = ("norton", "--set", "A=1e-15", "--set", "n=4", "--stress", "80", "--end-h", "1")
    line = creepkit("simulate", *law, "--temperature-c", celsius)
    assert line.exit_code == 1
    assert "4500 K" in line.stderr
