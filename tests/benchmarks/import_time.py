"""CPU time of what a command line waits for, over that of `import sympy`.

    python tests/benchmarks/import_time.py [--write]

CPU time, user and system, of a new interpreter, the least of ten runs each, all in turn; the start of the interpreter
is included; byte code is kept, as after an installation.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys

from measured import Page, arguments

REPEATS = 10
COMMAND = "import sys; sys.argv = ['creepkit', {}]; from creepkit.cli import main; main()"
EXPORT = "'export', 'norton', '--to', 'python', '--set', 'A=1e-16', '--set', 'n=5'"
CASES = {
    "import sympy": ("import sympy", None),
    'ck.law("norton")': ("import creepkit as ck; ck.law('norton')", 1.4),
    "creepkit export norton --to python --set A=1e-16 --set n=5": (COMMAND.format(EXPORT), 2.0),
    "creepkit --help": (COMMAND.format("'--help'"), 0.6),
}


def cpu_seconds(code: str) -> float:
    """CPU time, user and system, of a new interpreter that runs `code`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    options = arguments(__doc__).parse_args()
    runs = [{label: cpu_seconds(code) for label, (code, _) in CASES.items()} for _ in range(REPEATS)]
    least = {label: min(run[label] for run in runs) for label in CASES}
    page = Page("import_time", __doc__)
    page.table("what runs", "CPU time, s", "over `import sympy`", "goal")
    for label, (_, goal) in CASES.items():
        ratio = least[label] / least["import sympy"]
        page.row(f"`{label}`", f"{least[label]:.3f}", f"{ratio:.2f}", "" if goal is None else f"{goal:.1f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
