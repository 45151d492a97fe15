"""Attempts to have code executed that nobody installed: planted modules, files as plugins, hostile names in exports.

    python tests/benchmarks/code_execution.py [--payloads NUMBER] [--write]

Modules that say when they are executed lie in the working folder and beside the data while commands that start workers
run; data files are named as plugins and as laws; and texts that try to end what they stand in are put into every text
field of a law, one at a time, and written by every exporter. What is accepted is compiled (gfortran, gcc, g++) and run
(node, Python) where these programs are installed; JSON and XHTML are parsed. An attempt is successful when the file
that it wants to make is there ("executed"), or when the text does not compile, parse or load ("broken"). "refused"
counts errors of creepkit in one sentence, "harmless" what was accepted and did nothing.
"""

from __future__ import annotations

import collections
import json
import os
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from killed_runs import data_set, planted_tests
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import LawWithValues

OUTCOMES = ("refused", "harmless", "executed", "broken", "traceback")
FAULTS = OUTCOMES[2:]
CANARY = "executed_canary"
LIMIT = 120.0
PLANTED = f"open({{folder!r}} + '/{CANARY}', 'a').write(__file__ + chr(10))\n"
MODULES = ("json", "numpy", "sitecustomize", "usercustomize", "distutils", "pickle", "torch", "h5py", "typer", "norton")
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


def run(words: list[str], folder: Path, **variables: str) -> tuple[int, str]:
    """Exit code and stderr of a program in a folder."""
    done = subprocess.run(
        words, cwd=folder, capture_output=True, timeout=LIMIT, env={**os.environ, **variables}, check=False
    )
    return done.returncode, done.stderr.decode(errors="replace")


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
            code, problem = run([*words, path.name], folder)
            if (folder / CANARY).exists():
                return "executed", words[0]
            if code:
                return "broken", f"{words[0]}: {problem[-200:]}"
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


COMMANDS = {
    "generate": ("generate", "norton", "--specimen", "uniaxial", "--samples", "8", "--to", "m.h5", "--workers", "2"),
    "screen": ("screen", "tests", "--law", "norton", "--dense", "none", "--to", "screened"),
    "train": ("train", "data.h5", "--to", "n.safetensors", "--hidden", "4", "--layers", "1", "--epochs", "1"),
    "sweep": ("sweep", "data.h5", "--to", "nets", "--hidden", "4", "--layers", "1", "--epochs", "1"),
    "check a law": ("check", "norton"),
}
REFUSED = {
    "--plugin x.csv": ("--plugin", "x.csv", "laws"),
    "--plugin without suffix": ("--plugin", "plain", "laws"),
    "check x.csv": ("check", "x.csv"),
    "check without suffix": ("check", "plain"),
    "simulate ./plain": ("simulate", "./plain", "--set", "A=1", "--end-h", "1"),
}


def commands() -> Iterator[tuple[str, str, str]]:
    """Name, outcome and detail of each command in a folder of planted modules."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve()
        planted_tests(folder)
        data_set(folder)
        source = PLANTED.format(folder=str(folder))
        for name in MODULES:
            for place in (folder, folder / "tests"):
                (place / f"{name}.py").write_text(source)
        for name in ("x.csv", "plain", "norton"):
            (folder / name).write_text(source)
        for name, words in {**COMMANDS, **REFUSED}.items():
            start = [sys.executable, "-P", "-m", "creepkit", *words]
            code, problem = run(start, folder)
            if (folder / CANARY).exists():
                yield name, "executed", (folder / CANARY).read_text()[:200]
                (folder / CANARY).unlink()
            elif "Traceback" in problem or code not in ((1, 2) if name in REFUSED else (0,)):
                yield name, "traceback", f"exit {code}: {problem[-300:]}"
            else:
                yield name, "refused" if name in REFUSED else "harmless", ""


def main() -> int:
    """Try everything, and count what came of it."""
    parser = arguments(__doc__)
    parser.add_argument("--payloads", type=int, default=len(PAYLOADS), help="hostile texts, from the first on")
    options = parser.parse_args()
    page, faults = Page("code_execution", __doc__), []
    page.heading("Planted modules, and data named as code")
    page.table("command", *OUTCOMES)
    for name, outcome, detail in commands():
        page.row(name, *(int(outcome == one) for one in OUTCOMES))
        faults += [f"{name}: {outcome}: {detail}"] if outcome in FAULTS else []
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for name, field, outcome, detail in exports(options.payloads):
        counts[name][outcome] += 1
        faults += [f"{name}, {field}: {outcome}: {detail}"] if outcome in FAULTS else []
    page.heading("Hostile texts through exporters")
    page.paragraph(f"{options.payloads} texts in each of the fields {', '.join(FIELDS)}.")
    page.table("exporter", *OUTCOMES)
    for name, found in counts.items():
        page.row(name, *(found[one] for one in OUTCOMES))
    for fault in faults[:60]:
        progress(fault)
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
