"""The compiled target: a law as C functions, generated, compiled once and kept on disk with checksums.

Each generated module has a folder of its own, named after the hash of all that it was made from, with the source, the
machine code and the SHA-256 of both. A folder is built under a temporary name and renamed into place whole; one whose
checksums do not match is built anew. What is checked is what is executed. Machine code from the cache is executed, so
nothing that another user owns or can write to is used (files.writing); without a folder, modules run from memory.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache, partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import llvmlite
import llvmlite.binding as llvm
import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.files.writing import cache_folder, is_ours_alone
from creepkit.kernels.interface import CompiledEntry, CompiledLaw
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, expression_source, law_comments
from creepkit.kernels.llvm_code import Module, add_entry
from creepkit.kernels.log_form import leading_exponents
from creepkit.kernels.symbolic_kernel import SymbolicKernel
from creepkit.language import symbols
from creepkit.language.law_record import structure_of

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


SOURCE_FILE, CODE_FILE, CHECKSUM_FILE = "law.py", "law.o", "SHA256SUMS"


_loaded_modules: dict[str, ModuleType] = {}


def load_module(key: str, source: Callable[[], str]) -> ModuleType:
    """Return the module of `key`: from memory, from disk, or made from source() now."""
    if key not in _loaded_modules:
        cache_of_kernels = cache_folder(KERNELS)
        folder = (cache_of_kernels or Path()) / f"law_{key}"
        files = None if cache_of_kernels is None else _stored_files(folder)
        if files is None:
            files = _made_files(source())
            if cache_of_kernels is not None:
                _store(folder, files)
        _loaded_modules[key] = _execute_module(key, folder, files)
    return _loaded_modules[key]


KERNELS = "kernels"
"""Name of the cache folder."""


# ---- reading -------------------------------------------------------------------------------------------------------


def _stored_files(folder: Path) -> dict[str, bytes] | None:
    """Source and code of a folder, {name: content}; None unless they are as they were written, and ours alone."""
    try:
        paths = [folder / name for name in (SOURCE_FILE, CODE_FILE, CHECKSUM_FILE)]
        if not all(is_ours_alone(path) for path in (folder, *paths)):
            return None
        contents = {path.name: path.read_bytes() for path in paths}
    except OSError:
        return None
    seal = contents.pop(CHECKSUM_FILE)
    return contents if seal == _seal(contents) else None


# ---- making and loading --------------------------------------------------------------------------------------------


def _made_files(source: str) -> dict[str, bytes]:
    """Source and machine code of a module, {name: content}."""
    return {SOURCE_FILE: source.encode(), CODE_FILE: object_code(assembly(source))}


def _store(folder: Path, files: dict[str, bytes]) -> None:
    """Write and seal a module in a temporary folder, then put the folder into its place.

    Where that is impossible (no permission, a full disk) the module runs from memory, and the next process makes it.
    """
    with suppress(OSError):
        temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f"new_{folder.name}_"))
        try:
            for name, content in {**files, CHECKSUM_FILE: _seal(files)}.items():
                (temporary / name).touch(mode=0o600)
                (temporary / name).write_bytes(content)
            shutil.rmtree(folder, ignore_errors=True)  # one whose checksums do not match
            os.rename(temporary, folder)  # fails where another process has just done it
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def _execute_module(key: str, folder: Path, files: dict[str, bytes]) -> ModuleType:
    """Run the source of a module and load its machine code, the entries of which become COMPILED."""
    source, code = files[SOURCE_FILE].decode(), LoadedCode(files[CODE_FILE])
    module = ModuleType(f"creepkit_kernel_{key}")
    exec(compile(source, str(folder / SOURCE_FILE), "exec"), module.__dict__)
    module.__dict__.update(
        SOURCE=source, COMPILED={entry: CompiledEntry(code.address(entry), code) for entry in ENTRIES}
    )
    return module


def _seal(files: dict[str, bytes]) -> bytes:
    """One line a file: its SHA-256 and its name."""
    return "".join(f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files)).encode()


_MODULE_HEADER = """# Kernel of a creep law; generated, do not edit.
{terms}
{imports}
VARIABLES, PARAMETERS, RATES = {sizes}
COEFFICIENTS = {coefficients}

"""


ENTRIES = ("rate", "update", "sensitivity")


def module_source(lowered: SymbolicKernel) -> str:
    """The generated module of a law: its entries as functions of a point's variables and theta."""
    functions = "\n\n".join(getattr(lowered, entry).source for entry in ENTRIES)
    parameters = len(lowered.names.theta)
    called = _called_functions(functions)
    header = _MODULE_HEADER.format(
        terms="\n".join(law_comments(lowered.law)),
        imports=f"\nfrom creepkit.kernels.llvm_functions import {', '.join(called)}\n" if called else "",
        sizes=f"{len(lowered.names.inputs) - parameters}, {parameters}, {1 + len(lowered.law.states)}",
        coefficients=repr(lowered.form.coefficients),
    )
    return f"{header}{_exponents_source(lowered)}\n\n{functions}"


def assembly(source: str) -> str:
    """The entries of a generated module in LLVM assembly."""
    namespace: dict[str, Any] = {}
    exec(source, namespace)
    module = Module()
    for entry in ENTRIES:
        sizes = (namespace["VARIABLES"], namespace["PARAMETERS"])
        add_entry(module, entry, namespace[entry], sizes, namespace["RATES"])
    return str(module)


def _called_functions(text: str) -> list[str]:
    """The kernel functions that a text calls."""
    return sorted({*re.findall(r"\w+(?=\()", text)} & {*TARGET_FUNCTIONS})


def _exponents_source(lowered: SymbolicKernel) -> str:
    """A function of arrays: for each term the exponents of time and of strain at t -> 0+."""
    pairs = [[expression_source(lowered.names.printable(e)) for e in pair] for pair in leading_exponents(lowered.form)]
    rows = "".join(f"        ({time}, {strain}),\n" for time, strain in pairs)
    called = _called_functions(rows)
    lines = [f"def exponents({', '.join(s.name for s in lowered.names.inputs)}):"]
    if called:
        lines.append(f"    from creepkit.kernels.numpy_functions import {', '.join(called)}\n")
    return "\n".join([*lines, f"    return (\n{rows}    )\n"])


_REFERENCE_POINT = (100.0, 0.0, 0.0, 1000.0, 100.0, 100.0 / 3.0)
"""Where exponents that vary with stress or temperature are taken unless a point is given."""


def compile_law(law: CreepLaw) -> CompiledLaw:
    """Return the law's compiled entries, from memory, from the disk cache or made now."""
    key = _cache_key(law)
    module = load_module(key, partial(_module_source, law))
    initial = frozen([state.initial for state in law.states.values()])
    return CompiledLaw(
        **module.COMPILED,
        names=law.names,
        initial=initial,
        limits=frozen([np.inf if state.limit is None else state.limit for state in law.states.values()]),
        back_stresses=frozen([float(symbol in law.back_stresses) for symbol in law.states]),
        leading_exponent=partial(_leading_exponent, module, (*_REFERENCE_POINT, *initial)),
        source=module.SOURCE,
        fingerprint=key,
    )


def _module_source(law: CreepLaw) -> str:
    from creepkit.kernels.symbolic_kernel import symbolic_kernel

    return module_source(symbolic_kernel(law))


@lru_cache(maxsize=1024)
def _cache_key(law: CreepLaw) -> str:
    """Kept, for printing a law takes a millisecond and a fit asks a thousand times."""
    return hashlib.sha256(f"{_code_fingerprint()}\n{structure_of(law)}".encode()).hexdigest()[:24]


@cache
def _code_fingerprint() -> str:
    """Hash of the code that makes kernels and of the machine they are for, so that no stale kernel survives."""
    digest = hashlib.sha256()
    for path in (*sorted(Path(__file__).parent.glob("*.py")), Path(str(symbols.__file__))):
        digest.update(path.read_bytes())
    for item in (sys.version, *processor()):
        digest.update(item.encode())
    return digest.hexdigest()


def _leading_exponent(
    module: ModuleType, reference_point: tuple[float, ...], theta: Floats, point: Floats | None = None
) -> Floats:
    """Smallest (1 + a)/(1 - b) among the terms that are not switched off, (...,); 1 when all are.

    theta : (..., P) internal parameters. point : (..., 6 + S) variables of the law, or None.
    """
    theta = np.asarray(theta, float)
    smallest = np.full(theta.shape[:-1], np.inf)
    point_columns = reference_point if point is None else np.moveaxis(np.asarray(point, float), -1, 0)
    pairs = module.exponents(*point_columns, *np.moveaxis(theta, -1, 0))
    for (a, b), coefficients in zip(pairs, module.COEFFICIENTS, strict=True):
        b = np.minimum(b, 1.0 - 1e-12)  # a term that starts with strain itself does not lead
        beta = (1.0 + np.asarray(a)) / (1.0 - b)
        active = np.isfinite(theta[..., list(coefficients)]).all(axis=-1)
        smallest = np.where(active, np.minimum(smallest, beta), smallest)
    return np.where(np.isfinite(smallest), smallest, 1.0)


def object_code(assembly: str) -> bytes:
    """Compile a module."""
    machine = _target_machine()
    module = llvm.parse_assembly(assembly)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = options.loop_unrolling = False  # vectors are written out
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    code: bytes = machine.emit_object(module)
    return code


class LoadedCode:
    """Object code in memory, for as long as this object lives."""

    def __init__(self, code: bytes) -> None:
        machine = _target_machine()
        self._engine: Any = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Where a function is; KeyError when there is none."""
        address = int(self._engine.get_function_address(name))
        if not address:
            raise KeyError(name)
        return address


@cache
def processor() -> tuple[str, ...]:
    """The compiler and the machine that code is made for."""
    features: str = llvm.get_host_cpu_features().flatten()
    return llvmlite.__version__, llvm.get_process_triple(), llvm.get_host_cpu_name(), features


def _target_machine() -> Any:
    """A description of this machine, anew each time, for an engine takes its own away with it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    _, triple, name, features = processor()
    target = llvm.Target.from_triple(triple)
    static = target.name.startswith("x86")  # what LLVM's loader wants there, and any distance between code and data
    return target.create_target_machine(
        cpu=name, features=features, opt=2, reloc="static" if static else "default", codemodel="jitdefault", jit=True
    )
