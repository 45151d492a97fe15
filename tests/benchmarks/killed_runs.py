"""Kills of long jobs at random moments: started again, they end with what an uninterrupted run writes.

    python tests/benchmarks/killed_runs.py [--runs 100] [--kills-in-a-run K] [--seed 1] [--commands NAME ...] [--jobs 1]
                                           [--write]

generate, train, sweep, screen and run are each done once without interruption, and then `runs` times: the process is
ended by SIGKILL after a random share of the time that the whole took, every third time once more during the second
attempt, or as often as asked for, and the same command is run to its end. Its numbers are compared bit by bit with
those of the uninterrupted run: all arrays of data sets and networks, all numbers of JSON documents but times of the
clock and durations. "other result" counts runs whose numbers differ, "failed" those whose last attempt ended with
another exit code than 0, "left behind" those after which a temporary file lies there or a worker process lives on.
"cut off" says how many kills found the process at work.
"""

from __future__ import annotations

import collections
import functools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck

CLOCK = (
    "created",
    "date",
    "seconds",
    "time_s",
    "duration",
    "elapsed",
    "cpu",
    "started",
    "ended",
    "wall",
    "when",
    "sha256",
)
"""Parts of names under which documents say when they were made, how long that took, and the hash of one that does."""

LEFT_BEHIND = (".part", ".tmp")
FAULTS = ("other result", "failed", "left behind")
PATIENCE = 600.0
"""s in which a command must end."""


@dataclass(frozen=True)
class Command:
    """A long job: its words, and what it is prepared with, in a folder; suffixes of the files that hold its result."""

    words: tuple[str, ...]
    prepare: Callable[[Path], None]
    results: tuple[str, ...]


def planted_tests(folder: Path) -> None:
    """Creep curves of two alloys with noise."""
    rng = np.random.default_rng(3)
    (folder / "tests").mkdir()
    for alloy, coefficient in (("A", 3e-16), ("B", 1e-15)):
        for stress in (60, 80, 110):
            run = ck.simulate(
                "norton",
                "uniaxial",
                {"A": coefficient, "n": 4.2},
                loading=ck.constant_stress(stress),
                times=np.linspace(0, 36000, 30),
            )
            strain = run.outputs["strain"] + rng.normal(0, 2e-6, 30)
            history = run.replace(outputs={"strain": strain}, alloy=alloy, name=f"{alloy}{stress}")
            ck.write_history(history, folder / "tests" / f"{alloy}{stress}.csv")


def study(folder: Path) -> None:
    """A study of both alloys."""
    planted_tests(folder)
    text = '[data]\nfiles = ["tests"]\n[identification]\nlaws = ["norton", "strain-hardening"]\ngroup_by = "alloy"\n'
    (folder / "study.toml").write_text(text + '[report]\nfile = "report.html"\n', encoding="utf-8")


def data_set(folder: Path) -> None:
    """Samples to train with."""
    ck.generate("norton", "uniaxial", 24, seed=1, to=folder / "data.h5", every=3600.0)


COMMANDS = {
    "generate": Command(
        (
            "surrogate",
            "generate",
            "norton",
            "--specimen",
            "uniaxial",
            "--samples",
            "600",
            "--to",
            "made.h5",
            "--workers",
            "2",
        ),
        lambda folder: None,
        ("made.h5",),
    ),
    "train": Command(
        (
            "surrogate",
            "train",
            "data.h5",
            "--to",
            "net.safetensors",
            "--hidden",
            "8",
            "--layers",
            "1",
            "--epochs",
            "60",
        ),
        data_set,
        ("net.safetensors",),
    ),
    "sweep": Command(
        ("surrogate", "sweep", "data.h5", "--to", "nets", "--hidden", "4,8", "--layers", "1,2", "--epochs", "25"),
        data_set,
        ("nets/*.safetensors",),
    ),
    "screen": Command(
        (
            "identify",
            "tests",
            "--by",
            "alloy",
            "--law",
            "norton",
            "--law",
            "strain-hardening",
            "--dense",
            "none",
            "--to",
            "screened",
        ),
        planted_tests,
        ("screened/**/*.json",),
    ),
    "run": Command(("run", "study.toml"), study, ("study.results/identified/*.json",)),
}


def numbers(document: Any, path: str = "") -> dict[str, Any]:
    """{path: value} of the leaves of a document, but for those that a clock gave."""
    if isinstance(document, dict):
        parts = {k: v for k, v in document.items() if not any(word in str(k).lower() for word in CLOCK)}
        return {k: v for name, part in parts.items() for k, v in numbers(part, f"{path}/{name}").items()}
    if isinstance(document, list):
        return {k: v for i, part in enumerate(document) for k, v in numbers(part, f"{path}/{i}").items()}
    return {path: document}


def content(path: Path) -> dict[str, Any]:
    """{name: value} of what a result file says."""
    if path.suffix == ".json":
        return numbers(json.loads(path.read_text(encoding="utf-8")))
    if path.suffix == ".h5":
        made = ck.read_dataset(path)
        names = ("parameters", "conditions", "values", "status", "end_times", "reasons", "index")
        return {name: np.asarray(getattr(made, name)).tobytes() for name in names}
    from safetensors.numpy import load_file

    return {name: array.tobytes() for name, array in load_file(path).items()}


def result_of(command: Command, folder: Path) -> dict[str, dict[str, Any]]:
    """What all result files in a folder say."""
    files = sorted({path for pattern in command.results for path in folder.glob(pattern)})
    return {str(path.relative_to(folder)): content(path) for path in files}


def start(command: Command, folder: Path) -> subprocess.Popen[str]:
    """The command, in its folder."""
    words = [sys.executable, "-P", "-m", "creepkit", *command.words]
    with (folder / "output.txt").open("w") as output:
        return subprocess.Popen(words, cwd=folder, stdout=output, stderr=subprocess.STDOUT, text=True)


def workers_in(folder: Path) -> int:
    """Processes that work in a folder."""
    count = 0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            count += os.readlink(process / "cwd") == str(folder)
        except OSError:
            continue
    return count


def killed_run(
    name: str, seed: int, kills: int, prepared: Path, reference: dict[str, Any], duration: float
) -> dict[str, Any]:
    """One run in a copy of a prepared folder that is killed so often, and then ends; what was wrong."""
    command, rng, found = COMMANDS[name], random.Random(seed), collections.Counter[str]()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve() / "folder"
        shutil.copytree(prepared, folder)
        for _ in range(kills):
            process = start(command, folder)
            try:
                process.wait(rng.uniform(0.0, duration))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                found["cut off"] += 1
            process.wait()
        process = start(command, folder)
        code = process.wait(PATIENCE)
        end = time.monotonic() + 10.0
        while workers_in(folder) and time.monotonic() < end:
            time.sleep(0.1)
        left = [str(p.relative_to(folder)) for p in folder.rglob("*") if p.name.endswith(LEFT_BEHIND)]
        found["failed"] += code != 0
        found["left behind"] += bool(left) or workers_in(folder) > 0
        detail = ""
        if code:
            detail = (folder / "output.txt").read_text(errors="replace")[-300:]
        else:
            made = result_of(command, folder)
            differing = [
                f"{file}: {key}"
                for file in sorted(set(made) | set(reference))
                for key in sorted(set(made.get(file, {})) | set(reference.get(file, {})))
                if made.get(file, {}).get(key) != reference.get(file, {}).get(key)
            ]
            found["other result"] += bool(differing)
            detail = ", ".join([*differing[:3], *left[:3]])
    return {"counts": found, "detail": detail}


def main() -> None:
    """Run every command once whole and then with kills."""
    parser = arguments(__doc__)
    for option, default in (("runs", 100), ("kills-in-a-run", 0), ("seed", 1), ("jobs", 1)):
        parser.add_argument(f"--{option}", type=int, default=default)
    parser.add_argument("--commands", nargs="+", choices=list(COMMANDS), default=list(COMMANDS))
    options = parser.parse_args()
    page, details, faults = Page("killed_runs", __doc__), [], 0
    page.table("command", "runs", "kills", "cut off", *FAULTS)
    for name in options.commands:
        seeds = [options.seed * 100_000 + i for i in range(options.runs)]
        kills = [options.kills_in_a_run or (2 if seed % 3 == 0 else 1) for seed in seeds]
        with tempfile.TemporaryDirectory() as scratch:
            prepared, folder = Path(scratch).resolve() / "prepared", Path(scratch).resolve() / "folder"
            prepared.mkdir()
            COMMANDS[name].prepare(prepared)
            shutil.copytree(prepared, folder)
            begin = time.monotonic()
            if start(COMMANDS[name], folder).wait(PATIENCE):
                raise SystemExit(f"{name} fails without a kill: {(folder / 'output.txt').read_text()[-500:]}")
            duration, reference = time.monotonic() - begin, result_of(COMMANDS[name], folder)
            if not reference:
                raise SystemExit(f"{name} has written no result that can be compared")
            progress(f"{name}: {duration:.1f} s, {sum(map(len, reference.values()))} numbers and arrays")
            run = functools.partial(killed_run, name, prepared=prepared, reference=reference, duration=duration)
            with ThreadPoolExecutor(options.jobs) as pool:
                runs = list(pool.map(run, seeds, kills))
        total = sum((run["counts"] for run in runs), collections.Counter[str]())
        page.row(name, len(runs), sum(kills), total["cut off"], *(total[fault] for fault in FAULTS))
        faults += sum(total[fault] for fault in FAULTS)
        details += [f"{name}: {run['detail']}" for run in runs if run["detail"]]
    for line in details[:20]:
        progress(line)
    if options.write:
        page.write()
    if faults:
        raise SystemExit("there were faults")


if __name__ == "__main__":
    main()
