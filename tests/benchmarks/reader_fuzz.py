"""Mutated files for every reader: no traceback, no hang, no wrong acceptance.

    python tests/benchmarks/reader_fuzz.py [--samples NAME ...] [--count 12000] [--first 0] [--jobs 2] [--only SEED]
                                            [--write]

Samples of each reader (tests/helpers/samples_*.py) are mutated `count` times in all, by seed, and read in a process
without privileges. Counted are tracebacks (anything but an error of creepkit in one sentence that names the file),
hangs (more than 5 s of CPU), files that take more than 1 GB of memory, and wrong acceptances: a file whose mutation
changes what it says (a column twice, another decimal sign, a unit removed, a name misspelt, no number in a cell, rows
in another order, a row cut amid its columns) was read with other values than the sample's, and the reader did not say
that it decided something. An emptied cell of an optional column is an unknown value: reading it as such is right where
the reader states what it leaves unknown, and a wrong acceptance where it does not. Swapped, lost or added digits make
other numbers that no reader can tell; they are among the mutations, and only have to be read or refused. "read" counts
files that gave a result, of all mutations.
"""

from __future__ import annotations

import codecs
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from measured import Page, arguments, progress

from helpers.file_mutations import ENCODINGS, mutation
from helpers.reader_samples import ReaderSample, all_samples

CPU_SECONDS, MEMORY_BYTES = 5.0, 1_000_000_000
NOBODY = 65534
WARM_UP, MOST_DEATHS = 40, 10
OUTCOMES = ("read", "refused", "traceback", "hang", "memory", "wrong acceptance")
FAULTS = OUTCOMES[2:]


class Hang(BaseException):
    """A file took more CPU time than allowed."""


def outcome(sample: ReaderSample, good: object, seed: int, folder: Path) -> tuple[str, str, str]:
    """Kind of the mutation, what came of it, and a detail of what went wrong."""
    from creepkit.errors import CreepkitError

    changed = mutation(sample, seed)
    path = sample.write(folder, changed.content)
    try:
        signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
        result = sample.read(path)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    except CreepkitError as error:
        if found := unforeseen(error):
            return changed.kind, *found
        text = str(error)
        sound = "\n" not in text and len(text) < 2000 and str(folder) in text
        return changed.kind, "refused" if sound else "traceback", "" if sound else text[:300]
    except Hang:
        return changed.kind, "hang", ""
    except MemoryError:
        return changed.kind, "memory", traceback.format_exc(limit=-1).strip().replace("\n", " ")[-200:]
    except Exception as error:
        return changed.kind, "traceback", f"{type(error).__name__}: {error}"[:300]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    gap = sample.difference(good, result) if changed.changed else ""
    if gap and sample.decided(result) == sample.decided(good):
        return changed.kind, "wrong acceptance", gap[:300]
    return changed.kind, "read", ""


def unforeseen(error: BaseException) -> tuple[str, str] | None:
    """Outcome and detail of an error that only stands for one that nobody has foreseen; None where it is foreseen.

    creepkit turns whatever a reader raises into one sentence, and gives what it was as its cause.
    """
    from creepkit.errors import CreepkitError

    below: BaseException | None = error
    foreseen = False  # an error that a reader replaces on purpose, `from None`, is foreseen with all that caused it
    while below is not None:
        if isinstance(below, MemoryError):
            return "memory", str(error)[-200:]
        cause = below.__cause__
        foreseen = foreseen or (cause is None and below.__suppress_context__)
        if not foreseen and cause is not None and not isinstance(cause, (CreepkitError, OSError, UnicodeError)):
            return "traceback", f"{type(cause).__name__}: {error}"[:400]
        below = cause or below.__context__
    return None


def work(name: str, first: int, last: int, folder: Path) -> None:
    """Read the mutations of one sample, and print a line of JSON for each; run in a process of its own."""
    sample = all_samples()[name]
    good = sample.read(sample.write(folder))

    def stop(number: int, frame: FrameType | None) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, stop)
    for seed in range(-WARM_UP, 0):  # imports what readers import late, while it may be read
        outcome(sample, good, seed, folder)
    _give_up_privileges()
    folder = Path(tempfile.mkdtemp(dir=folder))
    for seed in range(first, last):
        print(json.dumps([seed, *outcome(sample, good, seed, folder)]), flush=True)


def _give_up_privileges() -> None:
    """Limit the memory, and become nobody where the process is root's."""
    for encoding in (*ENCODINGS, "utf-16-le", "utf-32-le", "utf-32-be", "cp1252"):
        codecs.lookup(encoding)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, used + MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(NOBODY)
        os.setuid(NOBODY)


def outcomes(name: str, first: int, last: int) -> Iterator[tuple[int, str, str, str]]:
    """Seed, kind, outcome and detail of each mutation; a process that dies counts as a traceback and is replaced."""
    deaths = 0
    while first < last:
        with tempfile.TemporaryDirectory() as folder:
            Path(folder).chmod(0o777)  # the process that writes there is nobody's
            command = [sys.executable, __file__, "--work", name, str(first), str(last), folder]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
                assert process.stdout is not None
                for line in process.stdout:
                    seed, kind, found, detail = json.loads(line)
                    first = seed + 1
                    yield seed, kind, found, detail
            if first < last:
                yield first, "", "traceback", f"the process ended with status {process.returncode}"
                first, deaths = first + 1, deaths + 1
            if deaths > MOST_DEATHS:
                raise SystemExit(f"the process of '{name}' ended {deaths} times; see what it prints")


def main() -> int:
    if sys.argv[1:2] == ["--work"]:
        name, first, last, folder = sys.argv[2:]
        work(name, int(first), int(last), Path(folder))
        return 0
    parser = arguments(__doc__)
    parser.add_argument("--samples", nargs="*", help="names of samples, all by default")
    parser.add_argument("--count", type=int, default=12000, help="mutations for each reader, shared by its samples")
    parser.add_argument("--first", type=int, default=0, help="the first seed; others than those looked at before")
    parser.add_argument("--jobs", type=int, default=1, help="samples at a time")
    parser.add_argument("--only", type=int, help="one seed alone")
    options = parser.parse_args()
    page = Page("reader_fuzz", __doc__)
    page.table("reader", "sample", "mutations", *OUTCOMES)
    faults: list[str] = []
    kinds: dict[str, Counter[str]] = {}
    first = options.first if options.only is None else options.only
    samples = all_samples()
    readers = {name: sample.reader or name for name, sample in samples.items()}

    def found_of(name: str) -> list[tuple[int, str, str, str]]:
        share = -(-options.count // list(readers.values()).count(readers[name]))
        found = list(outcomes(name, first, first + share if options.only is None else first + 1))
        progress(f"{name}: {len(found)} read or refused")
        return found

    names = options.samples or list(samples)
    with ThreadPoolExecutor(options.jobs) as pool:  # each thread waits for a process that reads
        results = dict(zip(names, pool.map(found_of, names), strict=True))
    for name in sorted(names, key=lambda name: readers[name]):
        counts: Counter[str] = Counter()
        for seed, kind, found, detail in results[name]:
            counts[found] += 1
            kinds.setdefault(kind, Counter())[found] += 1
            if found in FAULTS and len(faults) < 60:
                faults.append(f"{name}, seed {seed}, {kind}: {found}: {detail}")
        page.row(readers[name], name, counts.total(), *(counts[o] for o in OUTCOMES))
    page.heading("By kind of mutation")
    page.table("mutation", *OUTCOMES)
    for kind in sorted(kinds):
        page.row(kind, *(kinds[kind][o] for o in OUTCOMES))
    for fault in faults:
        progress(fault)
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
