"""Laws as `simulate` and `export` name them: a registered law first, then a file that holds one with its values."""

import numpy as np

import creepkit as ck
from creepkit.cli.shared import is_file_name
from helpers.command_line import creepkit, one_line

TEST = ("--stress", "100", "--end-h", "10", "--points", "5", "--temperature-c", "20")


def test_a_file_of_a_law_with_values_is_simulated_as_its_values_are(tmp_path):
    file = tmp_path / "valued.json"
    ck.export("norton", "json", {"A": 1e-16, "n": 4.0}, to=file)
    assert creepkit("simulate", str(file), *TEST, "--to", str(tmp_path / "own.csv")).exit_code == 0
    times = np.linspace(0.0, 36000.0, 5)
    creep = -np.log(1 - 4 * 1e-16 * 100.0**4 * times) / 4  # under constant load, true strain by Norton's law
    (own,) = ck.read_histories(tmp_path / "own.csv")
    assert np.allclose(own.outputs["strain"], creep, rtol=1e-4)
    changed = creepkit("simulate", str(file), "--set", "n=5", *TEST)
    named = creepkit("simulate", "norton", "--set", "A=1e-16", "--set", "n=5", *TEST)
    assert changed.exit_code == 0
    assert [line for line in changed.stdout.splitlines() if not line.startswith("#")] == [
        line for line in named.stdout.splitlines() if not line.startswith("#")
    ]


def test_names_of_laws_come_before_files_and_a_file_without_a_suffix_needs_its_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "norton+strain-hardening").write_text("{}")
    named = {"norton": False, "norton+strain-hardening": False, "./norton": True, "fit.json": True, "unknown": False}
    assert {word: is_file_name(word) for word in named} == named
    for name in ("norton", "mine"):
        ck.export("norton", "json", {"A": 1e-16, "n": 4.0}, to=f"{name}.json")
        (tmp_path / f"{name}.json").rename(name)
    assert "'norton' needs a value for A, n" in one_line(creepkit("simulate", "norton", *TEST))
    assert creepkit("simulate", "./norton", *TEST).exit_code == 0
    for command in (("simulate", "mine", *TEST), ("export", "mine", "--to", "latex")):
        assert "for the file of that name write ./mine" in one_line(creepkit(*command))


def test_values_that_the_law_of_a_file_does_not_have_are_refused(tmp_path):
    file = tmp_path / "valued.json"
    ck.export("norton", "json", {"A": 1e-16, "n": 4.0}, to=file)
    assert "has no parameter 'm'" in one_line(creepkit("simulate", str(file), "--set", "m=5", *TEST))
