"""Options that name things, and temperatures that no solid has, are refused before the work."""

import pytest

import creepkit as ck
from helpers.command_line import answers, creepkit, one_line

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
