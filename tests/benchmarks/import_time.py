"""CPU time of `import creepkit` and `creepkit --help`, beside that of an empty interpreter: python import_time.py."""

from __future__ import annotations

import resource
import subprocess
import sys

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
    """Print the table; the times include the start of the interpreter."""
    print(f"{'':18} {'CPU s':>7} {'limit s':>8}")
    for label, (code, limit) in CASES.items():
        print(f"{label:18} {cpu_seconds(code):7.3f} {'' if limit is None else f'{limit:8.2f}'}")


if __name__ == "__main__":
    main()
