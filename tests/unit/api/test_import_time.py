"""What must not be imported: the reason why the door opens quickly (tests/benchmarks/import_time.py has the times)."""

import subprocess
import sys

import pytest

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
    *(f"creepkit.exporters.{name}" for name in ("abaqus_cards", "c", "javascript", "mathml", "mfront")),
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
