"""Attempts to have code executed that nobody installed: planted modules, forged caches, hostile texts and names.

    python tests/benchmarks/code_execution.py [--short] [--only NAME ...] [--jobs N] [--write]

Modules of every name that Python and all installed packages have, settings of matplotlib and programs by the names of
compilers lie in the working folder and beside the data while commands run; data files are named as plugins and as laws;
cache folders that others can write to hold kernels that say when they are loaded, and the commands run as user nobody
where the program is root's. Texts that try to end what they stand in are put into every text field of a law, one at a
time and all at once, and written by every exporter; what is written is compiled (gfortran, gcc, g++) and run (also node
and Python) where these programs are installed, and has to give the numbers of the same law with plain words. Every text
in files that are read back is replaced, and the file is used. Reports and pages with hostile names are opened in
Chromium, whose obedience to the pages' own policy is switched off.

An attempt is successful when the file, or in a page the number, that it wants to make is there ("executed"); "broken"
counts what does not compile, parse or load, numbers that differ, and commands that end with another exit code than they
should, "refused" errors of creepkit in one sentence, "harmless" what was accepted and did nothing. The last table says
that the same canaries are noticed on what is unsafe on purpose.
"""

from __future__ import annotations

import collections
import importlib
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from execution_attempts.canaries import FAULTS, OUTCOMES, Attempt, Control
from measured import Page, arguments, progress

KINDS = ("working_folders", "caches", "exports", "documents", "pages")
"""Modules of execution_attempts, one for each place that texts or files are taken from."""


def tried(kind: str, short: bool) -> list[Attempt | Control]:
    """All attempts of one kind."""
    found = []
    for one in importlib.import_module(f"execution_attempts.{kind}").attempts(short):
        found.append(one)
        if isinstance(one, Attempt) and one.outcome in FAULTS:
            progress(f"{one.target}: {one.outcome}: {one.detail}"[:1000])
    return found


def print_tables(page: Page, attempts: list[Attempt]) -> None:
    """A table a section, with a row for each target."""
    counts: dict[str, dict[str, collections.Counter[str]]] = {}
    for one in attempts:
        counts.setdefault(one.section, {}).setdefault(one.target, collections.Counter())[one.outcome] += 1
    for section, rows in counts.items():
        page.heading(section)
        page.table("attempt", *OUTCOMES)
        for target, outcomes in rows.items():
            page.row(target, *(outcomes[one] for one in OUTCOMES))


def main() -> int:
    """Try everything, and count what came of it."""
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="+", choices=KINDS, default=KINDS, help="some kinds of attempts")
    parser.add_argument("--jobs", type=int, default=1, help="kinds that are tried at the same time")
    parser.add_argument("--short", action="store_true", help="a few attempts of each kind")
    options = parser.parse_args()
    page = Page("code_execution", __doc__)
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        found = [one for kind in pool.map(tried, options.only, [options.short] * len(options.only)) for one in kind]
    attempts, controls = ([one for one in found if isinstance(one, kind)] for kind in (Attempt, Control))
    print_tables(page, attempts)
    page.heading("What would have been noticed")
    page.table("attempt", "on what is unsafe on purpose", "tried", "noticed")
    for control in controls:
        page.row(control.section, control.consumer, control.tried, control.noticed)
        if control.is_fault:
            progress(f"{control.consumer}: the canary goes unnoticed")
    faults = [one for one in attempts if one.outcome in FAULTS] + [one for one in controls if one.is_fault]
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
