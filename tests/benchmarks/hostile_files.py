"""Damaged and hostile files: no traceback, no hang, and nothing in them or beside them is executed.

    python tests/benchmarks/hostile_files.py [--short] [--each 400] [--first 0] [--only SAMPLE SEED] [--write]

Samples of every format that creepkit reads (tests/benchmarks/file_samples) are changed in `--each` ways by seed: cut,
garbled, repeated, in other encodings, with columns, units or keys that say something else; replaced by a file of
another kind; and enlarged to 1.5 GB that are stored nowhere. Counted are "read", "refused" (one sentence that names the
file), and faults: "traceback", any exception but an error of creepkit, or an error of several lines; "hang", more than
30 s of CPU; "wrong", a table that says something else was read as before and nothing was said of it.

Then code is offered: texts that would be code in place of every text of a document; modules, programs and pickles in
the working folder of commands; laws whose words end comments of exported programs, which are then compiled and run.
Each makes a file where it is executed, and so does a control that executes it on purpose.
"""

from __future__ import annotations

import copy
import ctypes
import json
import os
import pickle
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from file_samples.mutations import mutation
from file_samples.samples import ReaderSample, all_samples
from measured import Page, arguments, progress

CPU_SECONDS, WALL_SECONDS, MEMORY_BYTES, ENORMOUS = 30.0, 120, 3_000_000_000, 1_500_000_000
EACH_IN_SHORT = 5
OUTCOMES = ("read", "refused", "traceback", "hang", "wrong")
CANARY = "executed"
PLANTED = "open({path!r}, 'a').write(__name__ + ' ')\n"
SHELL = f"touch {CANARY}"
PYTHON = f"__import__('os').system('{SHELL}')"
C_CODE = f'int system(const char *); __attribute__((constructor)) static void made(void) {{ system("{SHELL}"); }}'
TEXTS = {
    "end of a string, then Python": f"'); {PYTHON} #",
    "end of a long string, then Python": f'""" + str({PYTHON}) + """',
    "line, then Python": f"x\n{PYTHON} #",
    "Python": PYTHON,
    "YAML": f"!!python/object/apply:os.system ['{SHELL}']",
    "a module": "planted:made",
    "a path": "../../../etc/passwd",
    "formats": "%s%n {0.__class__} ${stress} {{ 7 * 7 }}",
    "end of a C comment, then C": f"*/ {C_CODE} /*",
    "line, then C": f"x\n{C_CODE} //",
    "line, then Fortran": f"x\n      call system('{SHELL}')",
    "commands of a shell": f"$({SHELL}) `{SHELL}`; {SHELL}",
    "controls": "\x1b]0;title\x07 \x9b31m \u202e",
}
"""{what it tries: the text}."""


class Hang(BaseException):
    """A file took more CPU time than allowed."""


# ---- damaged files -------------------------------------------------------------------------------------------------


def changed_files(sample: ReaderSample, others: Sequence[bytes], first: int, each: int) -> Iterator[tuple[str, Any]]:
    """Kind and content of each changed file: bytes and whether they say something else; an int is a size."""
    yield "huge", ENORMOUS
    for content in others:
        yield "another kind of file", (content, False)
    for seed in range(first, first + each):
        one = mutation(sample, seed)
        yield one.kind.partition(":")[0], (one.content, one.changed)


def outcome_of(sample: ReaderSample, good: object, change: Any, folder: Path) -> tuple[str, str]:
    """What comes of a changed file, and a detail of a fault."""
    from creepkit.errors import CreepkitError

    path = sample.write(folder, None if isinstance(change, int) else change[0])
    if isinstance(change, int):
        os.truncate(path, change)
    signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
    signal.alarm(WALL_SECONDS)  # ends a process that a library holds
    try:
        result = sample.read(path)
    except CreepkitError as error:
        cause = error.__cause__
        if cause is not None and not isinstance(cause, CreepkitError | OSError | UnicodeError | MemoryError):
            return "traceback", f"{type(cause).__name__}: {error}"[:300]
        text = str(error)
        return ("refused", "") if "\n" not in text and str(folder) in text else ("traceback", text[:300])
    except Hang:
        return "hang", ""
    except Exception as error:
        return "traceback", f"{type(error).__name__}: {error}"[:300]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.alarm(0)
    says_more = not isinstance(change, int) and change[1]
    gap = sample.difference(good, result) if says_more else ""
    if gap and sample.decided(result) == sample.decided(good):
        return "wrong", gap[:300]
    return "read", ""


def read_changed(names: Sequence[str], first: int, each: int) -> None:
    """Read the changed files of samples, and print a line of JSON before and after each; in a process of its own."""

    def stop(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, stop)
    samples = all_samples()
    by_kind = {one.mutated.rpartition(".")[2]: one.files[one.mutated] for one in samples.values()}
    with tempfile.TemporaryDirectory() as scratch:
        good = {}
        for name in names:
            (Path(scratch) / name.replace("/", "_")).mkdir()
            good[name] = samples[name].read(samples[name].write(Path(scratch) / name.replace("/", "_")))
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, used + MEMORY_BYTES))
        for name in names:
            sample, folder = samples[name], Path(scratch) / name.replace("/", "_")
            own = sample.mutated.rpartition(".")[2]
            others = [b"", b"\x7fELF" + bytes(60), *(content for kind, content in by_kind.items() if kind != own)]
            for number, (kind, change) in enumerate(changed_files(sample, others, first, each)):
                print(json.dumps([name, number, kind]), flush=True)
                print(json.dumps(outcome_of(sample, good[name], change, folder)), flush=True)


def damaged_files(page: Page, names: Sequence[str], first: int, each: int) -> list[str]:
    """The table of changed files; the faults. A process that dies is a fault of the file that it was reading."""
    counts: dict[str, Counter[str]] = {name: Counter() for name in names}
    faults, remaining = [], list(names)
    while remaining:
        command = [sys.executable, __file__, "--work", json.dumps([remaining, first, each])]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        lines = [json.loads(line) for line in done.stdout.splitlines()]  # two a file: before it is read and after
        for (name, number, kind), (outcome, detail) in zip(lines[::2], lines[1::2], strict=False):
            counts[name][outcome] += 1
            if outcome not in OUTCOMES[:2]:
                faults.append(f"{name}, change {number} ({kind}): {outcome}: {detail}")
        if done.returncode == 0:
            break
        name, number, kind = lines[-1] if len(lines) % 2 else (remaining[0], -1, "none")
        outcome = "hang" if done.returncode == -signal.SIGALRM else "traceback"
        counts[name][outcome] += 1
        faults.append(f"{name}, change {number} ({kind}): the process ended with status {done.returncode}")
        remaining = remaining[remaining.index(name) + 1 :]
    page.heading("Damaged files")
    page.table("sample", "changes", *OUTCOMES)
    for name, found in counts.items():
        page.row(name, found.total(), *(found[one] for one in OUTCOMES))
    return faults


# ---- attempts to have code executed --------------------------------------------------------------------------------


def executed(folder: Path) -> bool:
    """Whether code ran in a folder; what it left is removed."""
    found = (folder / CANARY).exists()
    (folder / CANARY).unlink(missing_ok=True)
    return found


class Runs:
    """Pickled as a call of exec."""

    def __init__(self, source: str) -> None:
        self.source = source

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, (self.source, {})


def texts_of(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where texts are in a document."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        if isinstance(inner, str):
            yield (*place, key)
        yield from texts_of(inner, (*place, key))


def hostile_documents(folder: Path) -> Iterator[tuple[str, bool, str]]:
    """Every text of a law with values replaced by each text that would be code; what is read is exported."""
    import creepkit as ck
    from creepkit.errors import CreepkitError

    document = json.loads(ck.export("norton", "json", values={"A": 3e-17, "n": 4.25}))
    for place in texts_of(document):
        for what, text in TEXTS.items():
            changed = copy.deepcopy(document)
            inner = changed
            for key in place[:-1]:
                inner = inner[key]
            inner[place[-1]] = text
            (folder / "law.json").write_text(json.dumps(changed), encoding="utf-8")
            detail = ""
            try:
                found = ck.load(folder / "law.json")
                programs = {target: ck.export(found, target) for target in ("python", "c", "latex")}
            except CreepkitError:
                programs = {}
            except Exception as error:
                programs, detail = {}, f"{type(error).__name__}: {error}"
            if "python" in programs:
                exec(compile(programs["python"], "law.py", "exec"), {"__name__": "law"})
            if "c" in programs and "C" in what and shutil.which("gcc"):
                (folder / "law.c").write_text(programs["c"], encoding="utf-8")
                library = folder / f"law{abs(hash((place, what)))}.so"
                words = ["gcc", "-shared", "-fPIC", "-o", str(library), "law.c", "-lm"]
                if subprocess.run(words, cwd=folder, capture_output=True, check=False).returncode:
                    detail = "the C file cannot be compiled"
                else:
                    ctypes.CDLL(str(library))
            yield f"{what} in {'/'.join(map(str, place))}", executed(folder), detail


def hostile_folders(folder: Path) -> Iterator[tuple[str, bool, str]]:
    """Commands in a folder of modules, programs and pickles that nobody installed."""
    import creepkit as ck

    shutil.copytree(ck.example_data("planted creep curves"), folder / "tests")
    source = PLANTED.format(path=str(folder / CANARY))
    names = sys.stdlib_module_names | {"numpy", "sympy", "typer", "torch", "h5py", "openpyxl", "norton", "planted"}
    for name in names - set(sys.builtin_module_names) - {"encodings", "runpy", "importlib", "zipimport"}:
        (folder / f"{name}.py").write_text(source)
    (folder / "matplotlibrc").write_text("backend: module://planted\n")
    for name in ("gcc", "gfortran", "latex", "git"):
        (folder / name).write_text(f"#!/bin/sh\n{SHELL}\n")
        (folder / name).chmod(0o755)
    for name in ("data.pkl", "fit.json", "net.safetensors", "net.pt"):
        (folder / name).write_bytes(pickle.dumps(Runs(source)))
    (folder / "x.csv").write_text(source)
    script = Path(sys.executable).with_name("creepkit")
    command = [str(script)] if script.exists() else [sys.executable, "-P", "-m", "creepkit"]
    for words in (
        ["--version"],
        ["list"],
        ["check", "norton"],
        ["read", "tests", "--plot", "x.svg"],
        ["read", "data.pkl"],
        ["read", "x.csv"],
        ["report", "fit.json", "--to", "report.html"],
        ["predict", "net.pt", "tests"],
        ["predict", "net.safetensors", "tests"],
        [
            "surrogate",
            "generate",
            "norton",
            "--specimen",
            "uniaxial",
            "--draws",
            "4",
            "--interval",
            "2400",
            "--seed",
            "1",
            "--to",
            "a.h5",
        ],
    ):
        done = subprocess.run([*command, *words], cwd=folder, capture_output=True, text=True, check=False)
        detail = "a traceback" if "Traceback" in done.stderr or done.returncode in (70, -6, -11) else ""
        yield f"creepkit {' '.join(words)}", executed(folder), f"{detail} {done.stderr[-300:]}" if detail else ""


def attempts(page: Page) -> list[str]:
    """The table of attempts; the faults."""
    faults = []
    page.heading("Attempts to have code executed")
    page.table("attempts", "number", "executed", "tracebacks and files that cannot be compiled")
    for title, made in (("texts of documents", hostile_documents), ("working folders", hostile_folders)):
        with tempfile.TemporaryDirectory() as scratch:
            folder, before = Path(scratch).resolve(), Path.cwd()
            (folder / "planted.py").write_text(PLANTED.format(path=str(folder / CANARY)))
            os.chdir(folder)
            try:
                exec(TEXTS["Python"], {})
                if not executed(folder):
                    faults.append(f"{title}: code that is executed on purpose goes unnoticed")
                found = list(made(folder))
            finally:
                os.chdir(before)
        faults += [f"{title}: {what}: {'executed' if ran else detail}" for what, ran, detail in found if ran or detail]
        page.row(title, len(found), sum(ran for _, ran, _ in found), sum(bool(detail) for *_, detail in found))
    return faults


def main() -> int:
    if sys.argv[1:2] == ["--work"]:
        read_changed(*json.loads(sys.argv[2]))
        return 0
    parser = arguments(__doc__)
    parser.add_argument("--each", type=int, default=400, help="changes by seed of each sample")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--samples", nargs="*", help="names of samples, all by default")
    parser.add_argument("--short", action="store_true", help=f"{EACH_IN_SHORT} changes by seed of each sample")
    options = parser.parse_args()
    page = Page("hostile_files", __doc__)
    each = EACH_IN_SHORT if options.short else options.each
    faults = [*damaged_files(page, options.samples or sorted(all_samples()), options.first, each), *attempts(page)]
    for fault in faults:
        progress(fault)
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
