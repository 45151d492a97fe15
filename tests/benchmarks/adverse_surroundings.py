"""Commands in adverse surroundings: full disks, closed streams, signals, no home, a wrong clock, strange paths.

    python tests/benchmarks/adverse_surroundings.py [--commands NAME ...] [--cases NAME ...] [--jobs 1] [--short]
                                                    [--write]

Every command is run once in plain surroundings, and then in each of the cases, in a folder of its own with measured
tests, a data set, an identification and older results. Expected is, in every case: it ends within 120 s, by an exit
code of docs/how-to/write_and_overwrite_files.md; an error is one sentence at the end of stderr, never a traceback;
measured files and older results are byte for byte as before, unless the older result was replaced as a whole; no
temporary file and no process stays. Where the exit code is 0, the numbers of the result are bit by bit those of plain
surroundings. "same" counts such runs, "refused" those that ended with a sentence, "interrupted" those that a signal
ended; after a signal the same command is run again, which has to give the same result. A run of a case that hinders
nobody (strange paths, encodings, no home, a wrong clock) has to succeed; one without any space, or in a working folder
that was deleted, has to be refused. Without any temporary folder, PyTorch cannot train: that may be refused.
With --short each case meets one of the commands, in turn.

Full and read-only disks are file systems in memory, mounted where the program is root's; elsewhere these cases are left
out, and a limit on the size of files stands for a full disk. Users without rights have the right to read alone.
"""

from __future__ import annotations

import collections
import contextlib
import functools
import hashlib
import itertools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from killed_runs import LEFT_BEHIND, content, data_set, planted_tests, workers_in
from measured import Page, arguments, progress

import creepkit as ck

OF_TORCH = "torchinductor_"
"""An empty folder that PyTorch makes among temporary files when it is imported, and keeps."""

LIMIT = 120.0
"""s in which a command must end."""

OUTCOMES = ("same", "refused", "interrupted", "no reader")
FAULTS = ("no end", "exit code", "traceback", "no sentence", "harmed", "left behind", "other result")
HEEDING_SIGNALS = """
import os, signal, sys
for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"):
    signal.signal(getattr(signal, name), signal.SIG_DFL)
os.execvp(sys.argv[1], sys.argv[1:])
"""
UNKNOWN_USER = 54321
VALUES = ("--set", "A=1e-16", "--set", "n=4")
SIMULATED = ("simulate", "norton", *VALUES, "--stress", "60", "--end-h", "100")
STUDY = """[data]
files = ["tests"]
[identification]
laws = ["norton"]
[report]
file = "report.html"
"""


@dataclass(frozen=True)
class Command:
    """Words of a command, "@" before those that are paths; files of its result; words that make an older result."""

    words: tuple[str, ...]
    results: tuple[str, ...] = ()
    older: tuple[str, ...] = ()


COMMANDS = {
    "simulate": Command((*SIMULATED, "--to", "@made.csv"), ("made.csv",), ("--points", "7")),
    "printed simulate": Command(SIMULATED),
    "generate": Command(
        (
            "surrogate",
            "generate",
            "norton",
            "--specimen",
            "uniaxial",
            "--samples",
            "16",
            "--to",
            "@made.h5",
            "--workers",
            "2",
        ),
        ("made.h5",),
    ),
    "identify": Command(
        ("identify", "@tests", "--law", "norton", "--starts", "2", "--to", "@identified"),
        ("identified/**/*.json",),
        ("--seed", "3", "--frames", "9"),
    ),
    "run": Command(("run", "@study.toml"), ("study.results/identified/*.json",)),
    "report": Command(("report", "@fit.json", "--to", "@made.html"), ("made.html",), ("--title", "Older")),
    "export": Command(("export", "@fit.json", "--to", "abaqus", "-o", "@made.f"), ("made.f",), ("--name", "older")),
    "train": Command(
        (
            "surrogate",
            "train",
            "@data.h5",
            "--to",
            "@net.safetensors",
            "--hidden",
            "4",
            "--layers",
            "1",
            "--epochs",
            "2",
        ),
        ("net.safetensors",),
    ),
}


@dataclass(frozen=True)
class Case:
    """Surroundings in which a command is run.

    codes : exit codes that are right here. around : makes a prepared folder adverse, and plain again. before : words
    before those of the command. shell : how a shell starts "$@", for streams. variables : of the environment, None
    for those that are taken out. start : sitecustomize of the processes. absolute : whether paths are absolute.
    name : of the folder. signal, share : sent after this share of the time that a plain run takes. twice : two at once.
    """

    codes: tuple[int, ...] = (0,)
    around: Callable[[Path], contextlib.AbstractContextManager[object]] = contextlib.nullcontext
    before: tuple[str, ...] = ()
    shell: str = ""
    variables: Mapping[str, str | None] = field(default_factory=dict)
    start: str = ""
    absolute: bool = False
    name: str = "folder"
    signal: int = 0
    share: float = 0.0
    twice: bool = False


# ---- surroundings --------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def small_disk(folder: Path, free: int) -> Iterator[None]:
    """The folder as a file system with so many bytes to spare."""
    with mounted(folder, "size=64m"):
        filling = folder / "filling"
        with contextlib.suppress(OSError), filling.open("wb", buffering=0) as file:
            while True:
                file.write(bytes(1 << 16))
        with filling.open("rb+") as file:
            file.truncate(max(filling.stat().st_size - free, 0))
        yield


@contextlib.contextmanager
def read_only_disk(folder: Path) -> Iterator[None]:
    """The folder as a file system that nobody can write to."""
    with mounted(folder, "size=64m"):
        subprocess.run(["mount", "-o", "remount,ro", folder], check=True)
        yield


@contextlib.contextmanager
def mounted(folder: Path, options: str) -> Iterator[None]:
    """A file system in memory over a folder, with what lies in the folder."""
    kept = folder.with_name("kept")
    folder.rename(kept)
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "creepkit-test", folder], check=True)
    try:
        shutil.copytree(kept, folder, dirs_exist_ok=True)
        yield
    finally:
        subprocess.run(["mount", "-o", "remount,rw", folder], check=True)
        (folder / "filling").unlink(missing_ok=True)
        after = folder.with_name("after")
        shutil.copytree(folder, after)
        subprocess.run(["umount", folder], check=True)
        folder.rmdir()
        after.rename(folder)


@contextlib.contextmanager
def read_only_folders(folder: Path) -> Iterator[None]:
    """All folders without the right to write."""
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    for one in folders:
        one.chmod(0o555)
    try:
        yield
    finally:
        for one in folders:
            one.chmod(0o755)


@contextlib.contextmanager
def of_another_user(folder: Path) -> Iterator[None]:
    """The folder, with all in it, as the unknown user's."""
    for one in (folder, *folder.rglob("*")):
        os.chown(one, UNKNOWN_USER, UNKNOWN_USER)
    yield


@contextlib.contextmanager
def from_the_future(folder: Path) -> Iterator[None]:
    """All files changed in the year 2100."""
    for one in folder.rglob("*"):
        os.utime(one, (4102444800, 4102444800))
    yield


CLOCK = """
import time
def set_back(name, to):
    true, begin = getattr(time, name), getattr(time, name)()
    setattr(time, name, lambda: to - 1000 * (true() - begin))
set_back("time", 1e9)
true_ns = time.time_ns
time.time_ns = lambda: int(time.time() * 1e9)
"""
"""A clock in 2001 that goes backwards, a thousand times as fast as true time goes on."""

NO_TEMPORARY_FOLDER = """
import tempfile
tempfile._candidate_tempdir_list = lambda: ["/proc/none"]
"""

READ_ALONE = ("--inh-caps=-all,+dac_read_search", "--ambient-caps=-all,+dac_read_search")
UNPRIVILEGED = ("setpriv", "--clear-groups", "--bounding-set=-all,+dac_read_search", *READ_ALONE)
STRANGER = (*UNPRIVILEGED, f"--reuid={UNKNOWN_USER}", f"--regid={UNKNOWN_USER}")
ROOT_ALONE = hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("setpriv") is not None
NO_HOME: Mapping[str, str | None] = {
    "HOME": None, "XDG_CACHE_HOME": None, "CREEPKIT_CACHE": None, "USER": None, "LOGNAME": None
}  # fmt: skip
NARROW = {"LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
UNICODE = "Prüfung α 試験 é"
LONG = os.path.join(*["a" * 240] * 14)


def limited(size: int) -> tuple[str, ...]:
    """Words by which no file can be longer than so many bytes."""
    program = f"import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size})); "
    return (sys.executable, "-P", "-c", program + "os.execv(sys.argv[1], sys.argv[1:])")


def signals() -> dict[str, Case]:
    """Each signal early, amid the work and late."""
    sent = {"SIGINT": (0.03, 0.3, 0.6, 0.9), "SIGTERM": (0.3, 0.8), "SIGHUP": (0.5,)}
    return {
        f"{name} after {share:.0%}": Case((0, 128 + signal.Signals[name]), signal=signal.Signals[name], share=share)
        for name, shares in sent.items()
        for share in shares
    }


PRIVILEGED_CASES = {
    "full disk": Case((1,), functools.partial(small_disk, free=0)),
    "disk with 4 kB": Case((0, 1), functools.partial(small_disk, free=4096)),
    "disk with 60 kB": Case((0, 1), functools.partial(small_disk, free=61440)),
    "read-only disk": Case((1,), read_only_disk),
    "read-only folders": Case((1,), read_only_folders, UNPRIVILEGED),
    "no home, unknown user": Case((0,), of_another_user, STRANGER, variables=NO_HOME),
    "another user's folder": Case((1,), before=STRANGER),
}
CASES = {
    **(PRIVILEGED_CASES if ROOT_ALONE else {}),
    "files of 0 bytes at most": Case((1,), before=limited(0)),
    "files of 3 kB at most": Case((0, 1), before=limited(3000)),
    "two at once": Case((0, 1), twice=True),
    **signals(),
    "closed stdout": Case((0,), shell='"$@" >&-'),
    "closed stderr": Case((0,), shell='"$@" 2>&-'),
    "all streams closed": Case((0,), shell='"$@" <&- >&- 2>&-'),
    "full stdout": Case((0, 1), shell='"$@" >/dev/full'),
    "head -1": Case((0, 1, 141), shell='set -o pipefail; "$@" | head -1'),
    "no reader": Case((0, 1, 141), shell='set -o pipefail; "$@" | true'),
    "LANG=C": Case(variables=NARROW, name=UNICODE),
    "ascii": Case(variables={**NARROW, "PYTHONIOENCODING": "ascii"}, name=UNICODE, absolute=True),
    "cp1252": Case(variables={"PYTHONIOENCODING": "cp1252"}, name=UNICODE, absolute=True),
    "unwritable TMPDIR": Case(variables={"TMPDIR": "/proc/none"}),
    "no temporary folder": Case(
        (0, 1), start=NO_TEMPORARY_FOLDER, variables={"CREEPKIT_CACHE": "/proc/none"}
    ),
    "clock set back": Case((0,), from_the_future, start=CLOCK),
    "working folder deleted": Case(
        (1,), shell='mkdir ../gone && cd ../gone && rmdir "$PWD" && exec "$@"', absolute=True
    ),
    "paths of 3,400 characters": Case((0, 1), name=LONG, absolute=True),
    "blanks and unicode in paths": Case(name=f" {UNICODE} 'a' \"b\" $(touch ran) ; %s", absolute=True),
    "line end in paths": Case(name="one\ntwo\ttab", absolute=True),
}  # fmt: skip


# ---- runs ----------------------------------------------------------------------------------------------------------


def prepare(folder: Path) -> None:
    """Measured tests, a data set, a study and an identification; older results of the commands that replace them."""
    planted_tests(folder)
    data_set(folder)
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    tests = [history for path in sorted((folder / "tests").glob("A*.csv")) for history in ck.read_histories(path)]
    ck.identify("norton", tests).save(folder / "fit.json")


def words_of(command: Command, folder: Path, *, absolute: bool) -> list[str]:
    """A command as it is typed."""
    named = [str(folder / w[1:]) if absolute else w[1:] for w in command.words if w[:1] == "@"]
    given = iter(named)
    return [sys.executable, "-P", "-m", "creepkit", *(next(given) if w[:1] == "@" else w for w in command.words)]


def result_of(command: Command, folder: Path, printed: bytes) -> dict[str, Any]:
    """What a command has made, as far as it repeats."""
    found: dict[str, Any] = {} if command.results else {"stdout": printed}
    for path in sorted({path for pattern in command.results for path in folder.glob(pattern)}):
        name = str(path.relative_to(folder))
        if path.suffix in (".json", ".h5", ".safetensors"):
            found[name] = content(path)
        else:
            found[name] = path.read_bytes() if path.suffix != ".html" else b"</html>" in path.read_bytes()
    return found


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
    }


@dataclass(frozen=True)
class Reference:
    """A command in plain surroundings: the prepared folder, with older results, its result, and s it took."""

    folder: Path
    result: dict[str, Any]
    duration: float


def environment(case: Case, scratch: Path) -> dict[str, str]:
    """The variables of a case, with a folder of its own for temporary files."""
    (scratch / "temporary").mkdir(exist_ok=True)
    (scratch / "temporary").chmod(0o1777)
    given: dict[str, str | None] = {**os.environ, "TMPDIR": str(scratch / "temporary"), **case.variables}
    if case.start:
        (scratch / "start").mkdir(exist_ok=True)
        (scratch / "start" / "sitecustomize.py").write_text(case.start, encoding="utf-8")
        given["PYTHONPATH"] = os.pathsep.join([str(scratch / "start"), os.environ.get("PYTHONPATH", "")])
    return {name: value for name, value in given.items() if value is not None}


def started(words: list[str], case: Case, folder: Path, scratch: Path, number: int = 0) -> subprocess.Popen[bytes]:
    """The command in its surroundings; its streams go to files beside the folder."""
    words = [*case.before, *words]
    if case.shell:
        words = ["bash", "-c", case.shell, "bash", *words]
    # a program that nohup or a shell's & started hands on that signals are ignored
    words = [sys.executable, "-P", "-c", HEEDING_SIGNALS, *words]
    with (scratch / f"stdout{number}").open("wb") as output, (scratch / f"stderr{number}").open("wb") as problems:
        return subprocess.Popen(
            words, cwd=folder, env=environment(case, scratch), stdout=output, stderr=problems, start_new_session=True
        )


def ended(process: subprocess.Popen[bytes]) -> int | None:
    """The exit code; None where a process did not end in time, and had to be killed."""
    try:
        return process.wait(LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return None


def messages(scratch: Path, number: int = 0) -> str:
    """What a command said on stderr."""
    return (scratch / f"stderr{number}").read_text(encoding="utf-8", errors="replace")


def judged_end(code: int | None, text: str, case: Case, command: Command) -> list[str]:
    """Faults of an end: by exit code and stderr."""
    codes = case.codes if command.results else (*case.codes, 0)  # what is only printed needs no space
    if case.signal and code == -case.signal and "creepkit: " not in text and "/creepkit/cli/" not in text:
        return []  # while Python itself started, before a line of the command line ran
    if code is None:
        return ["no end"]
    faults = [] if code in codes else ["exit code"]
    lines = [line for line in text.replace("\r", "\n").splitlines() if line.strip()]
    if "Traceback" in text or "internal error" in text or "Exception ignored" in text:
        faults.append("traceback")
    silent = "2>&-" in case.shell or "| " in case.shell or case.before == limited(0)
    if code == 1 and not silent and not (lines and "creepkit: " in lines[-1]):
        faults.append("no sentence")
    return faults


def one_run(name: str, label: str, reference: Reference) -> tuple[collections.Counter[str], str]:
    """One command in one case: counts of what came of it, and a detail of what was wrong."""
    command, case = COMMANDS[name], CASES[label]
    found = collections.Counter[str]()
    with tempfile.TemporaryDirectory(dir=reference.folder.parent) as temporary:
        scratch = Path(temporary).resolve()
        scratch.chmod(0o755)
        folder = scratch / case.name
        folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(reference.folder, folder)
        before = hashes(folder)
        words = words_of(command, folder, absolute=case.absolute)
        with case.around(folder):
            runs = [started(words, case, folder, scratch, k) for k in range(2 if case.twice else 1)]
            if case.signal:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    runs[0].wait(case.share * reference.duration)
                runs[0].send_signal(case.signal)
            codes = [ended(process) for process in runs]
            until = time.monotonic() + 5.0
            while workers_in(folder) and time.monotonic() < until:
                time.sleep(0.1)
            found["left behind"] += workers_in(folder) > 0
        for k, code in enumerate(codes):
            found.update(judged_end(code, messages(scratch, k), case, command))
        detail = messages(scratch, 0)[-400:] if found.total() else ""
        if 0 not in codes and case.twice:
            found["exit code"] += 1
        after = hashes(folder)
        left = [n for n in after if n.endswith(LEFT_BEHIND)]
        temporary_files = (path.name for path in (scratch / "temporary").iterdir())
        left += [f"TMPDIR/{name}" for name in temporary_files if not name.startswith(OF_TORCH)]
        found["left behind"] += bool(left)
        results = {str(p.relative_to(folder)) for pattern in command.results for p in folder.glob(pattern)}
        replaceable = {n for n in before if n in results or n.startswith("identified/")}
        harmed = [n for n in before if after.get(n) != before[n] and n != ".creepkit-written" and n not in replaceable]
        if 0 in codes:
            printed = (scratch / "stdout0").read_bytes()
            same = result_of(command, folder, printed) == reference.result
            if not command.results and case.shell:  # printed, and the reader went away
                same = True
            found["other result" if not same else "same"] += 1
        elif case.signal and command.results:
            harmed += [n for n in replaceable if n not in after]
            again = started(words, Case(), folder, scratch)
            code = ended(again)
            made = result_of(command, folder, b"") if code == 0 else None
            found["interrupted" if made == reference.result else "other result"] += 1
            if made != reference.result:
                detail += f" again: {code}: {messages(scratch)[-300:]}"
        elif case.signal and codes[0] in (128 + case.signal, -case.signal):
            found["interrupted"] += 1
        elif codes == [141] or (codes == [1] and "| " in case.shell):
            found["no reader"] += 1
        elif codes == [1] or codes == [1, 1]:
            found["refused"] += 1
            if result_of(command, folder, b"") != reference.result:  # refused after the whole result was written
                harmed += [n for n in replaceable if n not in after or (n in results and after[n] != before[n])]
        found["harmed"] += bool(harmed)
        if any(found[fault] for fault in FAULTS):
            listed = ", ".join([*harmed[:3], *left[:4]])
            detail = f"{name}, {label}: exit {codes}: {dict(found)} {listed} {detail.strip()}"
        else:
            detail = ""
    return found, detail


def plain(name: str, prepared: Path, scratch: Path) -> Reference:
    """A command in plain surroundings."""
    command, folder = COMMANDS[name], scratch / f"plain {name}"
    shutil.copytree(prepared, folder)
    if command.older:
        words = [*words_of(command, folder, absolute=False), *command.older]
        code = ended(started(words, Case(), folder, scratch))
        if code != 0:
            raise SystemExit(f"{name}: no older result can be made: {messages(scratch)[-500:]}")
    kept = scratch / f"prepared {name}"
    shutil.copytree(folder, kept)
    begin = time.monotonic()
    code = ended(started(words_of(command, folder, absolute=False), Case(), folder, scratch))
    duration = time.monotonic() - begin
    if code != 0:
        raise SystemExit(f"{name} fails in plain surroundings: {messages(scratch)[-500:]}")
    result = result_of(command, folder, (scratch / "stdout0").read_bytes())
    if not result:
        raise SystemExit(f"{name} has written no result that can be compared")
    return Reference(kept, result, duration)


def main() -> int:
    """Run every command in every case."""
    parser = arguments(__doc__)
    parser.add_argument("--commands", nargs="+", choices=list(COMMANDS), default=list(COMMANDS))
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    parser.add_argument("--short", action="store_true", help="one of the commands for each case")
    options = parser.parse_args()
    page = Page("adverse_surroundings", __doc__)
    total = {label: collections.Counter[str]() for label in options.cases}
    details: list[str] = []
    with tempfile.TemporaryDirectory() as temporary:
        scratch = Path(temporary).resolve()
        scratch.chmod(0o755)
        prepared = scratch / "prepared"
        prepared.mkdir()
        prepare(prepared)
        references = {name: plain(name, prepared, scratch) for name in options.commands}
        for name, reference in references.items():
            progress(f"{name}: {reference.duration:.1f} s in plain surroundings")
        if options.short:
            given = itertools.cycle(options.commands)
            pairs = [(next(given), label) for label in options.cases]
        else:
            pairs = [(name, label) for label in options.cases for name in options.commands]
        with ThreadPoolExecutor(options.jobs) as pool:
            runs = pool.map(lambda pair: one_run(*pair, references[pair[0]]), pairs)
            for (_, label), (found, detail) in zip(pairs, runs, strict=True):
                total[label].update(found)
                details += [detail] if detail else []
                if detail:
                    progress(detail)
    page.paragraph(f"Commands: {', '.join(options.commands)}.")
    page.table("case", "runs", *OUTCOMES, *FAULTS)
    for label, found in total.items():
        page.row(label, sum(one[1] == label for one in pairs), *(found[one] for one in (*OUTCOMES, *FAULTS)))
    if options.write:
        page.write()
    return 1 if details else 0


if __name__ == "__main__":
    sys.exit(main())
