"""The benchmark programs: what each measures, what it costs, and the command of its published tables.

    python tests/benchmarks/all.py                            list the programs
    python tests/benchmarks/all.py NAME ... [--write]         run the commands of some, one after another
    python tests/benchmarks/all.py everything [--write]       run all that need no further file or program
    python tests/benchmarks/all.py --short [NAME ...]         run the short forms, as .ci/run does, of all that have one
    python tests/benchmarks/all.py --nightly                  run the whole commands of those, as .ci/nightly does

With --write every program writes its tables to docs/measured. Commands run from the root of the project.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]


@dataclass(frozen=True)
class Benchmark:
    """A program with the options of its published tables.

    minutes : of CPU, expected, of all its commands on an AMD EPYC core. commands : options, a list for each run.
    needs : files and programs that are neither in the project nor among its dependencies, or "". short : options of a
    form of a minute or two, whose figures are compared with none; () where there is none.
    """

    minutes: float
    commands: tuple[tuple[str, ...], ...] = ((),)
    needs: str = ""
    short: tuple[str, ...] = ()


DATA = "measured data in ../shared/data"
BENCHMARKS = {
    "import_time": Benchmark(0.1),
    "page_latency": Benchmark(1, needs="Chromium and playwright"),
    "core_speed": Benchmark(2),
    "neon": Benchmark(15, needs="Debian, with qemu-user and gcc"),
    "random_simulations": Benchmark(
        30, (("--cases", "40000"),), short=("--cases", "1000", "--laws", "10", "--seed", "7", "--jobs", "2")
    ),
    "rendered_speckle": Benchmark(1, needs="pyvale 2026.10, here or in the Python of the option --python"),
    "studies": Benchmark(4, needs=DATA),
    "kernel_speed": Benchmark(1, needs="numba, for the hand-written code beside ours"),
    "dimple_accuracy": Benchmark(
        90, (("--cases", "145", "--cache", "build/dimple_references.jsonl"),), "reference cases in ../shared/data"
    ),
    "camera_extraction": Benchmark(3, needs=DATA),
    "plate_from_cameras": Benchmark(12),
    "reduced_order_model": Benchmark(2),
    "calculix": Benchmark(3, (("N3", "TH", "c3"),), "CalculiX (ccx)"),
    "verify_export": Benchmark(20, needs="gcc, gfortran, make, the network for CalculiX's source; CalculiX is built"),
    "verify_umat": Benchmark(10, needs="what verify_export needs"),
    "felupe_update": Benchmark(2, needs="FElupe 11.3, here or in the Python of the option --python"),
    "neml2_model": Benchmark(1, needs="NEML2 3.1, see the program"),
    "javascript_runtime": Benchmark(5, needs="node"),
    "clock_alignment": Benchmark(15, (("--tests", "20"),), DATA),
    "surrogate_accuracy": Benchmark(10, (("--samples", "150"),)),
    "specimen_recovery": Benchmark(25),
    "design_of_experiments": Benchmark(
        30, (("--bars", "40", "--dimples", "16", "--law-bars", "40", "--laws", "40", "--shares", "half"),)
    ),
    "law_recovery": Benchmark(45, (("--specimens", "24", "--others", "10"),)),
    "plate_of_alloys": Benchmark(8),
    "inconel_event": Benchmark(15, needs=DATA),
    "inconel_temperature": Benchmark(4, needs=DATA),
    "measured_creep": Benchmark(4, needs=DATA),
    "whole_life": Benchmark(4, needs=DATA),
    "rupture_methods": Benchmark(3, needs=DATA),
    "rupture_strength_coverage": Benchmark(5, (("--sets", "40"),)),
    "forecast_coverage": Benchmark(30, (("--campaigns", "50", "--dimples", "20"),)),
    "forecast_measured": Benchmark(12, needs=DATA),
    "causes": Benchmark(5, (("--campaigns", "20"),)),
    "forecast_beyond": Benchmark(4, (("--campaigns", "20"),), short=("--campaigns", "1", "--truths", "sinh")),
    "network_training": Benchmark(60, (("--networks", "128x3", "--precisions", "float32", "--samples", "2560"),)),
    "usual_errors": Benchmark(8, (("--campaigns", "20"),)),
    "noise_correlation": Benchmark(4),
    "conditions": Benchmark(30),
    "compositional_space": Benchmark(6, short=("--alloys", "10", "--repeats", "2")),
    "law_search": Benchmark(45, (("--laws", "13"),), short=("--laws", "1", "--budget", "10")),
    "law_search_outside": Benchmark(15, short=("--truths", "mechanisms in series", "--budget", "10")),
    "law_search_measured": Benchmark(6, needs=f"{DATA}; gplearn 0.4.3 elsewhere, with --gplearn PYTHON"),
    "rate_tables": Benchmark(20, needs=DATA),
    "hostile_files": Benchmark(40, needs="gcc, for exported C", short=("--short", "--first", "700000")),
    "mutations": Benchmark(90, (("build/mutations.jsonl",),), "g++"),
}
"""{name of the program: what it costs and how it is run}."""


def purpose(name: str) -> str:
    """The first sentence of a program's docstring."""
    documentation = ast.get_docstring(ast.parse((FOLDER / f"{name}.py").read_text(encoding="utf-8"))) or ""
    return " ".join(documentation.split("\n\n")[0].split()).rstrip(".:")


def command(name: str, options: tuple[str, ...]) -> list[str]:
    """The command of one run, from the root of the project."""
    return [f"tests/benchmarks/{name}.py", *options]


def list_programs() -> None:
    """Print what there is."""
    for name, benchmark in BENCHMARKS.items():
        print(f"{name}: {purpose(name)}")
        print(f"    {benchmark.minutes:g} CPU minutes" + (f"; needs {benchmark.needs}" if benchmark.needs else ""))
        for options in benchmark.commands:
            print("    python " + " ".join(command(name, options)))


def run(names: list[str], *, write: bool, short: bool) -> list[str]:
    """Run the commands of some programs in turn; those that failed."""
    failed = []
    for name in names:
        for options in (BENCHMARKS[name].short,) if short else BENCHMARKS[name].commands:
            arguments = command(name, options) + (["--write"] if write else [])
            print(f"\n$ python {' '.join(arguments)}", flush=True)
            start = time.monotonic()
            code = subprocess.run([sys.executable, *arguments], cwd=ROOT).returncode
            print(f"{name}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
            if code != 0:
                failed.append(" ".join(arguments))
    return failed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="programs to run, or 'everything'; none: list them")
    parser.add_argument("--write", action="store_true", help="write the tables to docs/measured")
    parser.add_argument("--short", action="store_true", help="the short forms, whose tables are not written")
    parser.add_argument("--nightly", action="store_true", help="the commands of programs with a short form")
    options = parser.parse_args()
    names, with_short = options.names, [name for name, benchmark in BENCHMARKS.items() if benchmark.short]
    if options.nightly:
        names = with_short
    elif options.short:
        if options.write or not set(names) <= set(with_short):
            parser.error(f"--short goes without --write, and with {', '.join(with_short)}")
        names = names or with_short
    elif not names:
        list_programs()
        return
    if names == ["everything"]:
        names = [name for name, benchmark in BENCHMARKS.items() if not benchmark.needs]
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"there is no program {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    failed = run(names, write=options.write, short=options.short)
    if failed:
        raise SystemExit("failed: " + "; ".join(failed))


if __name__ == "__main__":
    main()
