"""CalculiX 2.20 built from Debian's source as a shared library, so that a preloaded `creep_` replaces its own routine.

The ccx of Debian's package is one program whose routines cannot be replaced. It is built once (some two minutes on two
cores) into a folder and found again there. Needs gfortran, gcc, make and the libraries named in PACKAGES.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import urllib.error
import urllib.request
from pathlib import Path

ADDRESS = "http://deb.debian.org/debian/pool/main/c/calculix-ccx/calculix-ccx_2.20.orig.tar.bz2"
SHA256 = "b9a6075e181a777bbcfadd3ad21a70749dfdbb439373df3b4895cd2f438343ab"
"""As listed in calculix-ccx_2.20-1.dsc."""

PACKAGES = "gcc gfortran make libspooles-dev libarpack2-dev liblapack-dev libblas-dev"
FOLDER = Path(".venv/calculix")

_RULES = """\
SRC = CalculiX/ccx_2.20/src
include $(SRC)/Makefile.inc
OBJECTS = $(addprefix objects/,$(SCCXF:.f=.o) $(SCCXC:.c=.o))
CFLAGS = -O1 -fPIC -w -I/usr/include/spooles -DARCH="Linux" -DSPOOLES -DARPACK -DMATRIXSTORAGE -DUSE_MT=1
ccx: libccx.so objects/ccx_2.20.o
\tgcc -o $@ objects/ccx_2.20.o -L. -lccx -Wl,-rpath,'$$ORIGIN' -lgfortran -lm -lpthread
libccx.so: $(OBJECTS)
\tgfortran -shared -fopenmp -o $@ $(OBJECTS) -lspooles -lpthread -larpack -llapack -lblas -lm
objects/%.o: $(SRC)/%.f
\tgfortran -O1 -fPIC -fallow-argument-mismatch -w -c $< -o $@
objects/%.o: $(SRC)/%.c
\tgcc $(CFLAGS) -c $< -o $@
"""


def built(folder: Path = FOLDER) -> Path:
    """The program, built if it is not there yet."""
    program = (folder / "ccx").resolve()
    if not program.exists():
        _require("gcc", "gfortran", "make")
        folder.mkdir(parents=True, exist_ok=True)
        print(f"building CalculiX 2.20 from Debian's source in {folder} ...", flush=True)
        _unpack(folder)
        _make(folder)
    return program


def compiled(text: str, folder: Path, stem: str) -> Path:
    """A shared library of exported Fortran, to be preloaded."""
    _require("gfortran")
    source, library = folder / f"{stem}.f", (folder / f"{stem}.so").resolve()
    source.write_text(text)
    subprocess.run(["gfortran", "-shared", "-fPIC", "-O2", "-o", library, source], check=True)
    return library


def _require(*programs: str) -> None:
    missing = [name for name in programs if shutil.which(name) is None]
    if missing:
        raise SystemExit(f"{', '.join(missing)} not found; on Debian: apt install {PACKAGES}")


def _unpack(folder: Path) -> None:
    archive = folder / "source.tar.bz2"
    try:
        with urllib.request.urlopen(ADDRESS, timeout=60) as response:
            archive.write_bytes(response.read())
    except (urllib.error.URLError, TimeoutError) as error:
        raise SystemExit(f"CalculiX's source cannot be fetched from {ADDRESS}: {error}") from None
    if hashlib.sha256(archive.read_bytes()).hexdigest() != SHA256:
        archive.unlink()
        raise SystemExit(f"{ADDRESS} is not the file that Debian lists: its SHA-256 differs")
    with tarfile.open(archive) as files:
        files.extractall(folder, filter="data")


def _make(folder: Path) -> None:
    (folder / "objects").mkdir(exist_ok=True)
    (folder / "Makefile").write_text(_RULES)
    log = folder / "build.log"
    with log.open("w") as out:
        done = subprocess.run(["make", f"-j{os.cpu_count() or 1}"], cwd=folder, stdout=out, stderr=subprocess.STDOUT)
    if done.returncode != 0:
        print(*log.read_text().splitlines()[-5:], sep="\n", file=sys.stderr)
        raise SystemExit(f"CalculiX does not build, see {log}; on Debian: apt install {PACKAGES}")
