"""Exported Fortran, compiled by gfortran into a shared library and called as Abaqus or CalculiX would call it."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np

from helpers.compilers import shared_library

FLAGS = ("-O1", "-Wall", "-Wno-zerotrip", "-Wno-unused-dummy-argument")
PARAMETERS = "      implicit real*8(a-h,o-z)\n      parameter (nprecd=2)\n"
"""What Abaqus' own ABA_PARAM.INC declares on double-precision machines."""


def compile_fortran(gfortran: str, text: str, folder: Path, stem: str) -> tuple[ctypes.CDLL, str]:
    """A shared library of Fortran, and the compiler's warnings."""
    (folder / "ABA_PARAM.INC").write_text(PARAMETERS)
    source = folder / f"{stem}.f"
    source.write_text(text)
    return shared_library([gfortran, *FLAGS, source], folder / f"{stem}.so")


class Routine:
    """The subroutine CREEP of one exported file."""

    def __init__(self, gfortran: str, text: str, folder: Path, stem: str) -> None:
        self.library, self.warnings = compile_fortran(gfortran, text, folder, stem)

    def creep(
        self,
        stress: float,
        strain: float,
        end: float,
        step: float,
        *,
        warm: tuple[float, float] = (1000.0, 1000.0),
        states: np.ndarray | None = None,
        pressure: float = 0.0,
        lend: int = 2,
        wanted: float = 0.0,
    ) -> tuple[np.ndarray, float]:
        """DECRA(1:5) and QTILD of one increment; `states` is STATEV, changed in place."""
        decra, deswa, nothing = np.zeros(5), np.zeros(5), np.zeros(10)
        decra[0] = wanted
        inner = np.zeros(10) if states is None else states
        q, integer = ctypes.c_double(stress), ctypes.c_int(1)
        name = ctypes.create_string_buffer(b"MATERIAL".ljust(80), 80)
        n = ctypes.byref(integer)
        self.library.creep_(
            pointer(decra), pointer(deswa), pointer(inner), _double(0.0), pointer(np.array([strain, strain], float)),
            pointer(nothing), _double(pressure), ctypes.byref(q), _double(warm[1]), _double(warm[1] - warm[0]),
            pointer(nothing), pointer(nothing), pointer(np.array([end, end, end], float)), _double(step), name, n,
            ctypes.byref(ctypes.c_int(lend)), pointer(nothing), n, n, n, n, n, n, n, ctypes.c_size_t(80),
        )  # fmt: skip
        return decra, q.value


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """The address of an array's first number."""
    return array.ctypes.data_as(ctypes.c_void_p)


def _double(value: float) -> object:
    return ctypes.byref(ctypes.c_double(value))
