"""Machine code for this processor from LLVM assembly."""

from __future__ import annotations

from functools import cache
from typing import Any

import llvmlite
import llvmlite.binding as llvm


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
