"""Instructions of the parts of a simulation, for core_speed.py: what valgrind's callgrind counts in one library.

The process that is watched imports neither NumPy nor creepkit, for what valgrind runs is fifty times slower: it reads
the model as bytes. The law is Norton's, in C.
"""

import ctypes
import json
import re
import subprocess
import sys
from pathlib import Path

PARTS = {0: "assembly with tangent", 1: "assembly without", 2: "factorisation", 3: "solution", 4: "error forces"}
COPY = 5  # of the tangent, which each factorisation needs
REPEATS = 100
LAW = """
#include <math.h>
#include <stdint.h>
int64_t norton(int64_t rows, const double* x, const double* theta, double* out) {
    for (int64_t k = 0; k < rows; ++k) {
        for (int64_t j = 2; j < 7; ++j) out[j * rows + k] = 0.0;
        out[k] = theta[0] + theta[1] * log(x[k]);
        out[rows + k] = theta[1] / x[k];
    }
    return 0;
}
"""
STAGE = (3600.0, 8.188689124444202, 7200.0, 1000.0, 125e3, 57692.3, 8.0)
THETA = (-32.2362, 4.0)


def write_problem(model, displacement, folder: Path) -> None:
    """Write a finite element model, displacements (2 nodes,) mm and the law into a folder."""
    structure = model.compiled.structure
    kinds = [(name, kind is ctypes.c_int64) for name, kind in structure._fields_]
    for name, array in model.compiled._kept.items():
        (folder / name).write_bytes(array.tobytes())
    (folder / "displacement").write_bytes(displacement.tobytes())
    (folder / "history").write_bytes(bytes(8 * 4 * 4 * model.compiled.elements))
    (folder / "law.c").write_text(LAW)
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", "law.so", "law.c", "-lm"], cwd=folder, check=True)
    fields = [(name, getattr(structure, name) if number else None) for name, number in kinds]
    (folder / "problem.json").write_text(json.dumps(fields))


def repeat_part(library: str, folder: Path, part: int, repeats: int) -> None:
    """Repeat one part of a simulation; the arrays are what `write_problem` wrote."""

    def array(data: bytes) -> ctypes.Array:
        return (ctypes.c_double * (len(data) // 8)).from_buffer_copy(data)

    law = ctypes.CDLL(str(folder / "law.so"))
    fields = json.loads((folder / "problem.json").read_text())
    kept = [None if value is not None else array((folder / name).read_bytes()) for name, value in fields]
    model = (ctypes.c_int64 * len(fields))(
        *(ctypes.addressof(data) if data is not None else value for (_, value), data in zip(fields, kept, strict=True))
    )
    theta, stage = (ctypes.c_double * 2)(*THETA), (ctypes.c_double * 7)(*STAGE)
    update = ctypes.cast(law.norton, ctypes.c_void_p).value
    entries = (ctypes.c_int64 * 5)(update, update, ctypes.addressof(theta), 2, 0)
    history, displacement = (array((folder / name).read_bytes()) for name in ("history", "displacement"))
    call = ctypes.CDLL(library).creepkit_repeat_part
    flag = call(model, entries, stage, history, displacement, ctypes.c_int64(part), ctypes.c_int64(repeats))
    if flag != 0:
        raise SystemExit(f"the part gave {flag}")


def counted(library: str, folder: Path, lanes: int) -> dict[str, float]:
    """Instructions of one pass of every part, in thousands, with vectors of so many numbers."""

    def total(part: int, repeats: int) -> float:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
        command += [sys.executable, "-S", "-I", __file__, library, str(folder), str(part), str(repeats)]
        done = subprocess.run(
            command,
            env={"CREEPKIT_LANES": str(lanes), "PYTHONHASHSEED": "0"},
            capture_output=True,
            text=True,
            check=True,
        )
        return float(re.search(r"Collected : (\d+)", done.stderr)[1])

    start = total(COPY, 0)
    once = {part: (total(part, REPEATS) - start) / REPEATS / 1e3 for part in (*PARTS, COPY)}
    once[2] -= once[COPY]
    return {name: once[part] for part, name in PARTS.items()}


if __name__ == "__main__":
    repeat_part(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
