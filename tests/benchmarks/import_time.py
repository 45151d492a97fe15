"""CPU time of starting creepkit, in new interpreters.

    python tests/benchmarks/import_time.py [--write]

CPU time, user and system, of an empty interpreter, of `import creepkit` and of `creepkit --help`: the least of seven
runs each, the start of the interpreter included. The limit is that of the tests.
"""

from __future__ import annotations

import resource
import subprocess
import sys

from measured import Page, arguments

REPEATS = 7
CASES = {
    "python -c ''": ("", None),
    "import creepkit": ("import creepkit", 0.15),
    "creepkit --help": ("import sys; sys.argv = ['creepkit', '--help']; from creepkit.cli import main; main()", 0.30),
}


def cpu_seconds(code: str) -> float:
    """Least CPU time, user and system, of a new interpreter that runs `code`, over a few runs."""
    spent = []
    for _ in range(REPEATS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return min(spent)


def main() -> None:
    options = arguments(__doc__).parse_args()
    page = Page("import_time", __doc__)
    page.table("what runs", "CPU time, s", "limit, s")
    for label, (code, limit) in CASES.items():
        page.row(f"`{label}`", f"{cpu_seconds(code):.3f}", "" if limit is None else f"{limit:.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
