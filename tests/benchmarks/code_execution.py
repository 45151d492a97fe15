"""Attempts to have code executed that nobody installed: planted modules, files as plugins, hostile names in exports.

    python tests/benchmarks/code_execution.py [--short] [--payloads NUMBER] [--write]

Modules of every name that Python and all installed packages have, settings of matplotlib and programs by the names of
compilers lie in the working folder and beside the data while commands run; data files are named as plugins and as laws;
cache folders that others can write to hold kernels that say when they are loaded, and the commands run as user nobody
where the program is root's; and texts that try to end what they stand in are put into every text field of a law, one at
a time, and written by every exporter. What is accepted is compiled (gfortran, gcc, g++) and run (node, Python) where
these programs are installed; JSON and XHTML are parsed. An attempt is successful when the file that it wants to make is
there ("executed"); "broken" counts texts that do not compile, parse or load, and commands that end with another exit
code than they should, "refused" errors of creepkit in one sentence, "harmless" what was accepted and did nothing. The
last table says that the same canaries are noticed on what is unsafe on purpose.
"""

from __future__ import annotations

import collections
import json
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from execution_attempts import caches, working_folders
from execution_attempts.canaries import CANARY, FAULTS, OUTCOMES, Attempt, Control, run
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import LawWithValues

MOST_SHORT = 1
"""Hostile texts of the short form."""

PAYLOADS = (
    f"$(touch {CANARY})", f'"; system("touch {CANARY}"); "', f"`touch {CANARY}`",
    f"</script><script>require('fs').writeFileSync('{CANARY}','')</script>", f"\\input{{{CANARY}}}",
    f'x\n#include "{CANARY}.h"', f'x\n      call system("touch {CANARY}")', f"*/ int x = touch_{CANARY}; /*",
    f'"""\nimport os; os.system("touch {CANARY}")\n"""', f"x ??/\n system({CANARY}) ??/",
    f"x & \n! & call system({CANARY})",
    "%s%n%x {0.__class__} {{7*7}}", f"__import__('os').system('touch {CANARY}')", f"x\u2028import os; {CANARY}",
    "x\r      call abort()", "trailing backslash \\", "]]><x/>&bad;<!--", "\x00\x1b[2J",
)  # fmt: skip
FIELDS = ("name", "title", "term", "meaning", "unit", "parameter", "reference", "note")
COMPILED = {
    ".f": ("gfortran", "-c", "-I.", "-o", "out.o"),
    ".c": ("gcc", "-std=c99", "-trigraphs", "-c", "-o", "out.o"),
    ".mjs": ("node",),
    ".py": (sys.executable, "-I"),
}


def law_with(field: str, text: str) -> LawWithValues:
    """A law with a text in one field."""
    name = text if field == "parameter" else "A"
    coefficient, n = parameters(name + " n") if field != "parameter" else (_symbol(text), _symbol("n"))
    meaning = text if field == "meaning" else "rate coefficient"
    unit = text if field == "unit" else "1/s"
    law = CreepLaw(
        name=text if field == "name" else "hostile",
        terms={text if field == "term" else "creep": coefficient * stress**n},
        params={coefficient: Param(meaning, (1e-40, 1e-5), unit, "log", 0.0), n: Param("exponent", (1, 8))},
    )
    if field == "title":
        law = replace(law, title=text)
    if field == "reference":
        law = replace(law, references=(text,))
    return LawWithValues(law, {coefficient.name: 1e-16, "n": 4.0}, (text,) if field == "note" else ())


def _symbol(name: str):  # type: ignore[no-untyped-def]
    import sympy

    return sympy.Symbol(name, real=True, positive=True)


def judged_text(text: str, suffix: str, folder: Path) -> tuple[str, str]:
    """What comes of an exported text: compiled, run or parsed."""
    (folder / "ABA_PARAM.INC").write_text("      implicit real*8(a-h,o-z)\n      parameter (nprecd=2)\n")
    path = folder / f"law{suffix}"
    path.write_text(text, encoding="utf-8")
    commands = [COMPILED[suffix]] if suffix in COMPILED else []
    if suffix == ".c":
        commands.append(("g++", "-x", "c++", "-trigraphs", "-c", "-o", "out.o"))
    for words in commands:
        if shutil.which(words[0]):
            ended = run([*words, path.name], folder)
            if (folder / CANARY).exists():
                return "executed", words[0]
            if ended.code:
                return "broken", f"{words[0]}: {ended.problem[-200:]}"
    try:
        if suffix == ".json":
            json.loads(text)
        if suffix == ".xhtml":
            found = [e.tag.rpartition("}")[2] for e in ElementTree.fromstring(text).iter()]
            if {"script", "x", "img"} & set(found):
                return "executed", "an element of the text is one of the page"
    except (ValueError, ElementTree.ParseError) as error:
        return "broken", str(error)
    return ("executed", "canary") if (folder / CANARY).exists() else ("harmless", "")


def exports(count: int) -> Iterator[tuple[str, str, str, str]]:
    """Exporter, field, outcome and detail of each hostile text through each exporter."""
    exporters = ck.available("exporters")
    for text in PAYLOADS[:count]:
        for field in FIELDS:
            try:
                source = law_with(field, text)
            except CreepkitError:
                yield "the law itself", field, "refused", ""
                continue
            except Exception as error:
                yield "the law itself", field, "traceback", f"{text!r}: {type(error).__name__}: {error}"
                continue
            for name, exporter in exporters.items():
                with tempfile.TemporaryDirectory() as folder:
                    try:
                        outcome, detail = judged_text(exporter.text(source), exporter.suffix, Path(folder))
                    except CreepkitError:
                        outcome, detail = "refused", ""
                    except Exception as error:
                        outcome, detail = "traceback", f"{type(error).__name__}: {error}"
                yield name, field, outcome, f"{text!r}: {detail}" if detail else ""


NAIVE = {
    ".py": '"""A law: {text}"""\n',
    ".mjs": "// {text}\n",
    ".c": "/* {text} */ int law;\n",
    ".f": "! {text}\n      end\n",
}
"""Texts of an exporter that takes what it is given as it is."""


def naive_exports() -> Iterator[Control]:
    """The same hostile texts through exporters that protect nothing; in each language one at least is noticed."""
    for suffix, text in NAIVE.items():
        if shutil.which(COMPILED[suffix][0]):
            noticed = 0
            for payload in PAYLOADS:
                with tempfile.TemporaryDirectory() as folder:
                    outcome, _ = judged_text(text.replace("{text}", payload), suffix, Path(folder))
                noticed += outcome in FAULTS
            yield Control("Hostile texts through exporters", f"a naive exporter to {suffix}", len(PAYLOADS), noticed, 1)


def folders_and_caches(page: Page, short: bool) -> Iterator[Attempt | Control]:
    """What was found in working folders and caches; its tables are printed."""
    counts: dict[str, dict[str, collections.Counter[str]]] = {}
    for module in (working_folders, caches):
        for found in module.attempts(short):
            if isinstance(found, Attempt):
                rows = counts.setdefault(found.section, {})
                rows.setdefault(found.target, collections.Counter())[found.outcome] += 1
            yield found
    for section, rows in counts.items():
        page.heading(section)
        page.table("attempt", *OUTCOMES)
        for target, outcomes in rows.items():
            page.row(target, *(outcomes[one] for one in OUTCOMES))


def main() -> int:
    """Try everything, and count what came of it."""
    parser = arguments(__doc__)
    parser.add_argument("--payloads", type=int, default=len(PAYLOADS), help="hostile texts, from the first on")
    parser.add_argument("--short", action="store_true", help="a few attempts of each kind")
    options = parser.parse_args()
    page, faults, controls = Page("code_execution", __doc__), [], []
    number = min(options.payloads, MOST_SHORT) if options.short else options.payloads
    for found in folders_and_caches(page, options.short):
        if isinstance(found, Control):
            controls.append(found)
        elif found.outcome in FAULTS:
            faults.append(f"{found.target}: {found.outcome}: {found.detail}")
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for name, field, outcome, detail in exports(number):
        counts[name][outcome] += 1
        faults += [f"{name}, {field}: {outcome}: {detail}"] if outcome in FAULTS else []
    page.heading("Hostile texts through exporters")
    page.paragraph(f"{number} texts in each of the fields {', '.join(FIELDS)}.")
    page.table("exporter", *OUTCOMES)
    for name, outcomes in counts.items():
        page.row(name, *(outcomes[one] for one in OUTCOMES))
    controls += naive_exports()
    page.heading("What would have been noticed")
    page.table("attempt", "on what is unsafe on purpose", "tried", "noticed")
    for control in controls:
        page.row(control.section, control.consumer, control.tried, control.noticed)
        faults += [f"{control.consumer}: the canary goes unnoticed"] if control.is_fault else []
    for fault in faults[:60]:
        progress(fault)
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
