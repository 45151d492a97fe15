"""The compilers that tests of exported code call. A test that needs one is skipped, with the reason, without it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

COMPILERS = ("gfortran", "gcc", "g++")
BROWSER = "chromium"
NOT_INSTALLED = "{} is not installed"


def compiler_or_skip(command: str) -> str:
    """The path of a compiler; the test that asks for it is skipped where there is none."""
    path = shutil.which(command)
    if path is None:
        pytest.skip(NOT_INSTALLED.format(command))
    return path


def shared_library(command: Sequence[str | Path], library: Path) -> tuple[ctypes.CDLL, str]:
    """What a compiler makes of `command`, loaded, and its warnings."""
    run = subprocess.run(
        [*command, "-shared", "-fPIC", "-o", library], cwd=library.parent, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[:3000]
    return ctypes.CDLL(str(library)), run.stderr


def skipped_without_need(reasons: Sequence[str]) -> list[str]:
    """Those reasons of skipped tests that do not hold here: the compiler is installed, the data are there."""
    from helpers.paths import NO_SHARED_DATA, SHARED

    hold = {NOT_INSTALLED.format(command) for command in (*COMPILERS, BROWSER) if shutil.which(command) is None}
    if not SHARED.is_dir():
        hold.add(NO_SHARED_DATA)
    return [reason for reason in reasons if reason.removeprefix("Skipped: ") not in hold]
