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


@pytest.mark.parametrize(
    "code",
    [
        "import creepkit",
        "import creepkit; creepkit.__version__; dir(creepkit); creepkit.errors",
        "import creepkit.registry; creepkit.registry.default_registry()",
        "import sys; sys.argv = ['creepkit', '--help']; from creepkit.cli import main; main()",
        "import sys; sys.argv = ['creepkit', '--version']; from creepkit.cli import main; main()",
        "import sys; sys.argv = ['creepkit', 'laws', '--help']; from creepkit.cli import main; main()",
    ],
)
def test_the_door_opens_without_heavy_libraries(code: str) -> None:
    assert heavy_after(code) == []


@pytest.mark.parametrize(
    "code", ["import creepkit", "import sys; sys.argv = ['creepkit', '--help']; from creepkit.cli import main; main()"]
)
def test_records_are_not_validated_before_there_are_any(code: str) -> None:
    assert heavy_after(code, "pydantic") == []  # typer imports it for the options of a command


def test_the_watch_sees_what_is_heavy() -> None:
    assert "sympy" in heavy_after("import creepkit; creepkit.Param")
