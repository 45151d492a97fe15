"""The public names: each loads, none is the name of a sub-package, and the command line shares their defaults."""

import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import ArgumentError, FitError, HistoryError

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


@pytest.mark.parametrize("name", FUNCTIONS)
def test_public_functions_say_what_they_do_and_take_at_most_eight_arguments(name: str) -> None:
    function = getattr(ck, name)
    parameters = inspect.signature(inspect.unwrap(function)).parameters.values()  # options of records are beside
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
    settings = ck.IdentificationSettings()
    assert settings.changed({}) == settings
    assert settings.changed({"nuisances": None, "seed": 0}) == settings
    assert settings.changed({"nuisances": ["offset"]}).nuisances == (ck.Nuisance("offset"),)
    assert settings.changed({"nuisances": "rate"}).nuisances == (ck.Nuisance("rate"),)
    with pytest.raises(FitError, match=r"nuisances are names or such as Nuisance\('thickness', sd=0.01\), found 3"):
        settings.changed({"nuisances": [3]})
    assert settings.changed({"starts": 20}).sobol_points == 256
    assert settings.changed({"starts": 20, "sobol_points": 32}).sobol_points == 32
    with pytest.raises(ArgumentError, match="have no 'start'; did you mean 'starts'"):
        settings.changed({"start": 3})
    with pytest.raises(ArgumentError, match="suspect_frames is 'drop'; allowed is 'exclude' or 'keep'"):
        settings.changed({"suspect_frames": "drop"})
    with pytest.raises(ArgumentError, match="have no 'tolerance'"):
        ck.identify("norton", [ck.History("a", np.ones(1), {}, ck.constant_stress(1.0), 300.0)], tolerance=1)


# ---- import time -----------------------------------------------------------------------------------------------------

# What must not be imported: the reason why the door opens quickly (tests/benchmarks/import_time.py has the times).


HEAVY = ("torch", "sympy", "scipy", "pysindy", "llvmlite", "numpy", "h5py", "matplotlib", "sklearn")
REPORT = f"import sys; print('HEAVY', *sorted(set({HEAVY!r}) & set(sys.modules)), file=sys.stderr)"


def heavy_after(code: str, *more: str) -> list[str]:
    """Names of heavy libraries, and of `more`, that a new interpreter has imported at the end of `code`."""
    report = REPORT.replace(repr(HEAVY), repr(HEAVY + more))
    program = f"import atexit\natexit.register(lambda: exec({report!r}))\n{code}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    *_, last = done.stderr.splitlines()
    word, *names = last.split()
    assert word == "HEAVY"
    return names


def command(*words: str) -> str:
    return f"import sys; sys.argv = {['creepkit', *words]}; from creepkit.cli import main; main()"


DOORS = [
    "import creepkit; creepkit.__version__; dir(creepkit); creepkit.errors",
    "import creepkit.registry; creepkit.registry.default_registry()",
    *(command("--version"), command("list", "--help")),
]


@pytest.mark.parametrize("code", DOORS)
def test_the_door_opens_without_heavy_libraries(code: str) -> None:
    assert heavy_after(code) == []


LAW = "import creepkit as ck; ck.law('norton')"
EXPORT = "import creepkit as ck; ck.export('norton', 'python', {'A': 1e-16, 'n': 5})"
NOT_FOR_AN_EXPORT = [
    *("numpy", "scipy", "torch", "h5py", "matplotlib", "llvmlite", "pydantic", "pysindy"),
    *(
        f"creepkit.{name}"
        for name in ("inverse.checked_identification", "inverse", "reports", "readers", "cameras", "instruments")
    ),
    *(f"creepkit.{name}" for name in ("specimens", "fem", "integration", "core", "surrogates", "dataset", "jobs")),
    *(f"creepkit.exporters.{name}" for name in ("material_cards", "c", "javascript", "mfront")),
    *(f"creepkit.laws.{name}" for name in ("combined", "hyperbolic_sine", "time_hardening")),
    *("creepkit_classic", "creepkit_damage", "creepkit_logarithmic", "creepkit_specimens"),
]


@pytest.mark.parametrize(
    ("code", "others"),
    [
        ("import creepkit", ["pydantic", "sympy"]),
        (command("--help"), ["pydantic", "sympy"]),
        (LAW, [*NOT_FOR_AN_EXPORT, "creepkit.exporters", "creepkit.kernels", "creepkit.files", "creepkit.records"]),
        (EXPORT, NOT_FOR_AN_EXPORT),
    ],
)
def test_what_is_not_asked_for_is_not_imported(code: str, others: list[str]) -> None:
    assert set(heavy_after(code, *others)) - ({"sympy"} - {*others}) == set()


def test_the_watch_sees_what_is_heavy() -> None:
    assert "sympy" in heavy_after("import creepkit; creepkit.Param")
    assert "creepkit.laws.combined" in heavy_after(
        "import creepkit; creepkit.law('combined')", "creepkit.laws.combined"
    )
