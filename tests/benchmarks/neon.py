"""The core with the vectors of NEON, run where the processor has none.

    python tests/benchmarks/neon.py [--folder build/neon] [--write]

The package ziglang compiles the core for 64-bit ARM, and qemu's user emulation runs it in Debian's Python for arm64
with wheels for that processor: the tests of the core, then a dimple under 8 MPa, 10 MPa from 4 h on, observed at 289
times of 12 h, by two laws of the paper. Times say nothing there. Instructions are those that qemu counts between
one run and two, millions; "differs" is the largest difference of an output from that of this machine's own core,
over its largest value. Needs Debian, for qemu-user, gcc and that Python, which stay in the folder for a next time.
"""

import json
import os
import shutil
import subprocess
import sys
from importlib.metadata import distribution, version
from pathlib import Path

import numpy as np
from core_speed import Case
from measured import Page, arguments, progress

from creepkit.arrays import Floats

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ("python3.11", "3.11")
LAWS = ("norton", "combined")
DEBIAN = """
    libc6 libgcc-s1 libstdc++6 python3.11-minimal libpython3.11-minimal libpython3.11-stdlib python3.11 zlib1g libexpat1
    libffi8 libssl3 libbz2-1.0 liblzma5 libsqlite3-0 libreadline8 libtinfo6 libncursesw6 libuuid1 libdb5.3 libcrypt1
"""
WHEELS = """
    numpy scipy llvmlite h5py safetensors pydantic_core hypothesis
    lazy_loader threadpoolctl sympy mpmath pluggy pydantic annotated_types typing_extensions typing_inspection openpyxl
    et_xmlfile pytest pytest_timeout iniconfig packaging pygments sortedcontainers jinja2 markupsafe
"""
SAY = "import platform; from creepkit import core; print(platform.machine(), core.library().creepkit_core_lanes())"
COUNTER = """
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
/* The part of qemu's interface of plugins that counts, declared here: Debian has no header of it. */
struct block;
extern void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t, void (*)(uint64_t, struct block*));
extern size_t qemu_plugin_tb_n_insns(const struct block*);
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct block*, int, void*, uint64_t);
extern void qemu_plugin_register_atexit_cb(uint64_t, void (*)(uint64_t, void*), void*);
int qemu_plugin_version = 1;
static uint64_t count;
static void add(uint64_t id, struct block* block) {
    (void)id;
    qemu_plugin_register_vcpu_tb_exec_inline(block, 0, &count, qemu_plugin_tb_n_insns(block));
}
static void print(uint64_t id, void* data) {
    (void)id, (void)data;
    fprintf(stderr, "instructions %llu\\n", (unsigned long long)count);
}
int qemu_plugin_install(uint64_t id, const void* info, int argc, char** argv) {
    (void)info, (void)argc, (void)argv;
    qemu_plugin_register_vcpu_tb_trans_cb(id, add);
    qemu_plugin_register_atexit_cb(id, print, NULL);
    return 0;
}
"""


def run(*command: object, **more) -> subprocess.CompletedProcess[str]:
    """A command that must succeed; its output is kept."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done


class Machine:
    """An emulated one; folder : of its system, packages and the core."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.root, self.site = folder, folder / "root", folder / "site"
        self.library = folder / "core" / "libcreepkit_core.so"

    def prepare(self) -> None:
        """Get what is missing, and compile the core and the counter."""
        if not (self.root / "usr/bin" / PYTHON[0]).exists():
            self._system()
        if not self.site.exists():
            self._packages()
        self._core()
        (self.folder / "counter.c").write_text(COUNTER)
        run("gcc", "-O2", "-shared", "-fPIC", "-o", self.folder / "counter.so", self.folder / "counter.c")

    def _system(self) -> None:
        progress("Debian's Python for arm64")
        lists, cache, packages = (self.folder / name for name in ("lists", "cache", "packages"))
        for one in (lists / "partial", cache / "archives/partial", packages):
            one.mkdir(parents=True, exist_ok=True)
        options = ["APT::Architecture=arm64", "APT::Architectures::=arm64", f"Dir::State::Lists={lists.resolve()}"]
        options += [f"Dir::Cache={cache.resolve()}", "APT::Sandbox::User=root"]
        apt = ["apt-get", "-qq", *(word for option in options for word in ("-o", option))]
        run(*apt, "update")
        run(*apt, "download", *DEBIAN.split(), cwd=packages)
        for package in sorted(packages.glob("*.deb")):
            run("dpkg", "-x", package, self.root)

    def _packages(self) -> None:
        progress("wheels for arm64")
        wheels = self.folder / "wheels"
        pip = [
            sys.executable,
            "-m",
            "pip",
            "download",
            "--quiet",
            "--no-deps",
            "--only-binary",
            ":all:",
            "--dest",
            wheels,
        ]
        platforms = [word for glibc in ("17", "27", "28") for word in ("--platform", f"manylinux_2_{glibc}_aarch64")]
        names = [f"{name}=={version(name)}" for name in WHEELS.split()]
        run(
            *pip,
            "--dest",
            wheels,
            "--python-version",
            PYTHON[1],
            "--platform",
            "manylinux2014_aarch64",
            *platforms,
            *names,
        )
        for wheel in wheels.glob("*.whl"):
            run(sys.executable, "-m", "zipfile", "-e", wheel, self.site)
        for ours in Path(str(distribution("creepkit").locate_file(""))).glob("creepkit*.dist-info"):
            shutil.copytree(ours, self.site / ours.name)  # what says where laws are

    def _core(self) -> None:
        progress("the core for arm64")
        build, cache = self.folder / "build", str((self.folder / "zig").resolve())
        compiler = f"{sys.executable};-m;ziglang;c++;-target;aarch64-linux-gnu.2.28"
        options = ["CMAKE_SYSTEM_NAME=Linux", "CMAKE_SYSTEM_PROCESSOR=aarch64", f"CMAKE_CXX_COMPILER={compiler}"]
        options += [f"CREEPKIT_OUTPUT={self.library.parent.resolve()}", "CMAKE_BUILD_TYPE=Release"]
        options.append("CMAKE_CXX_FLAGS=-nostdlib++")  # or CMake's first question compiles a C++ library for arm64
        environment = {**os.environ, "ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
        defined = [f"-D{option}" for option in options]
        run("cmake", "-S", ROOT / "src/core", "-B", build, *defined, env=environment)
        run("cmake", "--build", build, "--parallel", os.cpu_count() or 1, env=environment)

    def python(self, *words: object, count: bool = False) -> subprocess.CompletedProcess[str]:
        """Run its Python in the project's root; count : instructions, which the last line of stderr then says."""
        paths = [self.site.resolve(), ROOT / "src", ROOT / "tests", *(ROOT / "plugins").glob("*/")]
        environment = {
            "PYTHONPATH": os.pathsep.join(map(str, paths)), "CREEPKIT_CORE": str(self.library.resolve()),
            "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1",
            "HOME": str(self.folder.resolve()), "PATH": os.environ["PATH"],
        }  # fmt: skip
        plugin = ["-plugin", self.folder / "counter.so"] if count else []
        python = self.root / "usr/bin" / PYTHON[0]
        return run("qemu-aarch64", *plugin, "-L", self.root, python, *words, cwd=ROOT, env=environment)

    def seen(self, law: str) -> Floats:
        """(times, outputs) of a dimple."""
        return np.array(json.loads(self.python(__file__, "--dimple", law, 0, 1).stdout))

    def instructions(self, law: str, derivatives: bool) -> float:
        """Of one prediction of a dimple."""
        runs = [self.python(__file__, "--dimple", law, int(derivatives), k, count=True).stderr for k in (1, 2)]
        once, twice = (float(text.split()[-1]) for text in runs)
        return twice - once


def dimple(law: str, derivatives: bool, repeats: int) -> None:
    """Print what is seen of a dimple at 289 times, as JSON; simulated so often."""
    case = Case(law)
    for _ in range(repeats):
        found = case.predict(derivatives)
    print(json.dumps(found.values.tolist()))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--folder", default="build/neon", help="of the emulated machine")
    parser.add_argument("--dimple", nargs=3, help="law, derivatives and repeats, of the program within")
    options = parser.parse_args()
    if options.dimple:
        law, derivatives, repeats = options.dimple
        return dimple(law, derivatives == "1", int(repeats))
    machine = Machine((ROOT / options.folder).absolute())
    machine.prepare()
    page = Page("neon", __doc__)
    page.heading("The tests of the core")
    said = machine.python("-c", SAY).stdout.split()
    tests = machine.python("-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/unit/core").stdout.strip()
    page.paragraph(f"Processor {said[0]}, {said[1]} numbers in a vector: {tests.splitlines()[-1]}.")
    page.heading("A dimple")
    page.table("law", "prediction, millions", "with derivatives, millions", "differs")
    for law in LAWS:
        there, here = machine.seen(law), Case(law).predict().values  # first: it compiles the law, and keeps that
        counts = [machine.instructions(law, derivatives) / 1e6 for derivatives in (False, True)]
        page.row(
            law, *(f"{count:.0f}" for count in counts), f"{(np.abs(there - here) / np.abs(here).max(axis=0)).max():.1e}"
        )
    if options.write:
        page.write()
    return None


if __name__ == "__main__":
    main()
