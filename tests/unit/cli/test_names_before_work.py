"""Options that name things, and temperatures that no solid has, are refused before the work."""

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.studies.execution import running_alone
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


def test_a_folder_of_results_that_cannot_be_written(tmp_path, monkeypatch):
    """The sentence that other commands say of such a folder; nothing stands in the place of results."""
    with monkeypatch.context() as patched:
        patched.setattr("creepkit.files.writing.os.access", lambda path, mode: False)
        with pytest.raises(StudyError) as caught, running_alone(tmp_path / "study.results"):
            pass
    assert str(caught.value).endswith(f"{tmp_path} is not open to writing; name another folder")
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match="file is no folder"), running_alone(tmp_path / "file"):
        pass
