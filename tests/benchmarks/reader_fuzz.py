"""Mutated files for every reader: no traceback, no hang, no wrong acceptance.

    python tests/benchmarks/reader_fuzz.py [--samples NAME ...] [--per-kind 12000] [--first 0] [--jobs 2] [--short]
                                            [--only SEED] [--state FILE] [--write]

Samples of each reader (tests/helpers/samples_*.py) are mutated, `--per-kind` times for each kind of file, by seed, and
read in processes without privileges that read many, with a limit of memory. `--short` reads a few of each sample, in
one process. With `--state`, counts are kept in a file as they come: a run that was ended goes on behind the last
seed that it has counted.

Counted are tracebacks, hangs (more than 5 s of CPU), files that take more than 1 GB of memory, unclear messages and
wrong acceptances. "read" counts files that gave a result, of all mutations.

A traceback is any exception but an error of creepkit; an error of creepkit that only stands for one that nobody has
foreseen, as the last handler of each reader makes it; and one of more than one line or without the name of the file. A
message is unclear where it is merely the text of another exception, where it names a class of exceptions of Python, an
object at an address, or where it says nothing behind the name of the file.

A wrong acceptance: a file whose mutation changes what it says was read with other values than the sample's, and the
reader did not say that it decided something. The classes are, of tables: a column twice, another decimal sign, a unit
removed, a name misspelt, no number in a cell (NaN and infinity among them), rows in another order (time goes back), a
time twice, a time below zero, a row cut amid its columns, the line of names missing; of documents: a key misspelt, a
key twice. An emptied cell of an optional column is an unknown value: reading it as such is right where the reader
states what it leaves unknown, and a wrong acceptance where it does not.

What no reader can know from the file alone is among the mutations, and only has to be read or refused: swapped, lost
or added digits, a unit replaced by another of the same quantity, a file that ends behind a whole row, and one that ends
amid the last number.
"""

from __future__ import annotations

import argparse
import codecs
import json
import re
import resource
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from adverse_surroundings import ROOT_ALONE, STRANGER
from measured import Page, arguments, progress

from helpers.file_mutations import ENCODINGS, mutation
from helpers.fuzz_counts import FuzzCounts
from helpers.reader_samples import ReaderSample, all_samples

CPU_SECONDS, PATIENCE, MEMORY_BYTES = 5.0, 60.0, 1_000_000_000
WARM_UP, WARM_UP_OF_MANY, MOST_DEATHS, SAVED_EVERY = 40, 6, 10, 250
SHORT = 60
OUTCOMES = ("read", "refused", "traceback", "hang", "memory", "unclear message", "wrong acceptance")
FAULTS = OUTCOMES[2:]


class Hang(BaseException):
    """A file took more CPU time than allowed."""


def outcome(sample: ReaderSample, good: object, seed: int, folder: Path) -> tuple[str, str, str]:
    """Kind of the mutation, what came of it, and a detail of what went wrong."""
    from creepkit.errors import LONGEST_MESSAGE, CreepkitError

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
        if "\n" in text or len(text) > LONGEST_MESSAGE or str(folder) not in text:
            return changed.kind, "traceback", text[:300]
        unclear = is_unclear(error, folder)
        return changed.kind, "unclear message" if unclear else "refused", text[:300] if unclear else ""
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


RAW = re.compile(r"Traceback|<class|<[\w.]+ object|\b0x[0-9a-f]{8,}|\b[A-Z]\w*(Error|Exception)\b|KeyError|\bb'\\\\x")
"""What a message for a user does not hold, unless in quotes: there stands what the file holds."""


def is_unclear(error: BaseException, folder: Path) -> bool:
    """Whether a message is merely the text of another exception, or names what only a programmer knows."""
    from creepkit.errors import CreepkitError

    text = str(error)
    said = re.sub(rf"{re.escape(str(folder))}/[^:, ]*(:\d+)?:?", "", text).strip()
    below: BaseException | None = error
    raw = set()
    while below is not None:
        below = below.__cause__ or below.__context__
        if below is not None and not isinstance(below, CreepkitError):
            raw |= {str(below).strip(), repr(below)}
    return len(said) < 12 or said in raw or RAW.search(re.sub(r"'[^']*'", "''", said)) is not None


def work(folder: Path) -> None:
    """Read mutations of samples, and print a line of JSON for each; run in a process of its own.

    Which, [[sample, first seed, last], ...], comes from standard input.
    """
    ranges = json.loads(sys.stdin.readline())
    warm_up = WARM_UP if len(ranges) < WARM_UP else WARM_UP_OF_MANY
    samples, results, folders = all_samples(), {}, {}

    def stop(number: int, frame: FrameType | None) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, stop)
    for name, _, _ in ranges:
        own = Path(tempfile.mkdtemp(dir=folder))
        results[name] = samples[name].read(samples[name].write(own))
        for seed in range(-warm_up, 0):  # imports what readers import late, while it may be read
            outcome(samples[name], results[name], seed, own)
    _limit_memory()
    for name, _, _ in ranges:
        folders[name] = Path(tempfile.mkdtemp(dir=folder))
    for name, first, last in ranges:
        for seed in range(first, last):
            signal.setitimer(signal.ITIMER_REAL, PATIENCE)  # for what holds Python up: SIGALRM ends the process
            found = outcome(samples[name], results[name], seed, folders[name])
            print(json.dumps([name, seed, *found]), flush=True)


def _limit_memory() -> None:
    """Take what is used now and MEMORY_BYTES for the most; codecs are looked up while there is enough."""
    for encoding in (*ENCODINGS, "utf-16-le", "utf-32-le", "utf-32-be", "cp1252"):
        codecs.lookup(encoding)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, used + MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def outcomes(ranges: list[tuple[str, int, int]]) -> Iterator[tuple[str, int, str, str, str]]:
    """Sample, seed, kind, outcome and detail of each mutation of samples, from a first seed to before a last.

    A process that dies counts as a traceback of the mutation that it was reading, one that does not come back from it
    as a hang; it is replaced.
    """
    deaths = 0
    while ranges := [one for one in ranges if one[1] < one[2]]:
        with tempfile.TemporaryDirectory() as folder:
            Path(folder).chmod(0o777)  # the process that writes there is a stranger's
            # a reader that may read alone: it can start Python again, as the trial of HDF5 files does
            command = [*(STRANGER if ROOT_ALONE else ()), sys.executable, __file__, "--work", folder]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
                assert process.stdout is not None
                assert process.stdin is not None
                print(json.dumps(ranges), file=process.stdin, flush=True)
                following = {name: first for name, first, _ in ranges}
                for line in process.stdout:
                    name, seed, kind, found, detail = json.loads(line)
                    following[name] = seed + 1
                    yield name, seed, kind, found, detail
        ranges = [(name, following[name], last) for name, _, last in ranges if following[name] < last]
        if ranges:
            name, seed, last = ranges[0]
            found = "hang" if process.returncode == -signal.SIGALRM else "traceback"
            yield name, seed, "", found, f"the process ended with status {process.returncode}"
            ranges, deaths = [(name, seed + 1, last), *ranges[1:]], deaths + 1
        if deaths > MOST_DEATHS:
            raise SystemExit(f"the process of '{ranges[0][0]}' ended {deaths} times; see what it prints")


def options_of(words: list[str]) -> argparse.Namespace:
    """The options of a command."""
    parser = arguments(__doc__)
    parser.add_argument("--samples", nargs="*", help="names of samples, all by default")
    parser.add_argument("--per-kind", type=int, default=12000, help="mutations for each reader, shared by its samples")
    parser.add_argument("--first", type=int, default=0, help="the first seed; others than those looked at before")
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    parser.add_argument("--short", action="store_true", help=f"{SHORT} files of each sample")
    parser.add_argument("--only", type=int, help="one seed alone")
    parser.add_argument("--state", type=Path, help="a file of counts, with which a run that was ended goes on")
    return parser.parse_args(words)


def main() -> int:
    if sys.argv[1:2] == ["--work"]:
        work(Path(sys.argv[2]))
        return 0
    options = options_of(sys.argv[1:])
    samples = all_samples()
    readers = {name: sample.reader or name for name, sample in samples.items()}
    names = sorted(options.samples or samples, key=lambda name: readers[name])
    first = options.first if options.only is None else options.only
    counts = FuzzCounts(options.state, names, first)

    def range_of(name: str) -> tuple[str, int, int]:
        count = SHORT if options.short else -(-options.per_kind // list(readers.values()).count(readers[name]))
        return name, counts.next_seed(name), first + (count if options.only is None else 1)

    def count(ranges: list[tuple[str, int, int]]) -> None:
        for number, (name, seed, kind, found, detail) in enumerate(outcomes(ranges), 1):
            counts.add(name, seed, kind, found, detail, fault=found in FAULTS)
            if number % SAVED_EVERY == 0:
                counts.save()
        counts.save()
        progress(", ".join(f"{name} {counts.outcomes(name).total()}" for name, _, _ in ranges))

    ranges = [range_of(name) for name in names]
    by_reader = {readers[name]: [one for one in ranges if readers[one[0]] == readers[name]] for name in names}
    together = [ranges] if options.short else list(by_reader.values())
    with ThreadPoolExecutor(options.jobs) as pool:  # each thread waits for a process that reads
        list(pool.map(count, together))
    faults = list(counts.faults(names))
    page = Page("reader_fuzz", __doc__)
    page.table("reader", "sample", "mutations", *OUTCOMES)
    for name in names:
        found = counts.outcomes(name)
        page.row(readers[name], name, found.total(), *(found[o] for o in OUTCOMES))
    page.heading("By kind of mutation")
    page.table("mutation", *OUTCOMES)
    for kind, found in sorted(counts.kinds(names).items()):
        page.row(kind, *(found[o] for o in OUTCOMES))
    for fault in faults:
        progress(fault)
    if options.write:
        page.write()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
