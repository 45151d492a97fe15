"""Kernels on disk: found again, safe from each other, from damage and from folders that cannot be written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from creepkit.kernels import compilation, lower
from creepkit.kernels.compilation import CHECKSUM_FILE, CODE_FILE, SOURCE_FILE
from creepkit.language import CreepLaw, stress
from helpers.literature_laws import POWER, RATE, A, law, n

PROGRAM = """
import sys
import numpy
from creepkit.kernels import compilation, lower
from creepkit.kernels.interface import call_entry
from creepkit.laws.norton import NORTON

made, object_code = [], compilation.object_code
compilation.object_code = lambda text: made.append(text) or object_code(text)
compiled = lower(NORTON, "compiled")
theta = NORTON.to_internal({"A": 1e-16, "n": 4.0})[0]
out, flags = call_entry(compiled, "rate", numpy.array([[100.0] + 5 * [0.0]]), theta)
print(out[0, 0], flags, len(made))
"""


class Other(subprocess.Popen[str]):
    """Another interpreter that asks for Norton's kernel."""

    def __init__(self, cache: Path, **environment: str) -> None:
        variables = {**os.environ, "CREEPKIT_CACHE": str(cache), **environment}
        super().__init__([sys.executable, "-c", PROGRAM], stdout=-1, stderr=-1, text=True, env=variables)

    def answer(self) -> tuple[float, int, int]:
        """Rate at 100 MPa, flags, and how often machine code was made."""
        out, err = self.communicate(timeout=120)
        assert self.returncode == 0, err
        rate, flags, made = out.split()
        return float(rate), int(flags), int(made)


NEW, KNOWN = (pytest.approx(1e-8, rel=1e-12), 0, 1), (pytest.approx(1e-8, rel=1e-12), 0, 0)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache folder; nothing is remembered in memory."""
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(compilation, "_loaded_modules", {})
    return tmp_path / "cache"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What machine code is made from, as it is made."""
    texts, object_code = [], compilation.object_code

    def counted(text: str) -> bytes:
        texts.append(text)
        return object_code(text)

    monkeypatch.setattr(compilation, "object_code", counted)
    return texts


def some_law(factor: int = 1) -> CreepLaw:
    """A law that nothing else has compiled."""
    return law(factor * A * stress**n, {A: RATE, n: POWER})


def folder_of(cache: Path) -> Path:
    (folder,) = (cache / "kernels").glob("law_*")
    return folder


def kept(cache: Path) -> list[str]:
    """Names in the cache folder."""
    return sorted(path.name for path in (cache / "kernels").iterdir())


def is_intact(folder: Path) -> bool:
    return compilation._stored_files(folder) is not None


def test_a_law_is_compiled_once_for_all_processes(cache: Path) -> None:
    assert Other(cache).answer() == NEW
    assert Other(cache).answer() == KNOWN
    assert kept(cache) == [folder_of(cache).name]


def test_processes_may_build_the_same_law_at_once(cache: Path) -> None:
    others = [Other(cache), Other(cache)]

    answers = [other.answer() for other in others]

    assert all(answer[:2] == NEW[:2] for answer in answers)
    assert kept(cache) == [folder_of(cache).name]
    assert is_intact(folder_of(cache))
    assert Other(cache).answer() == KNOWN


@pytest.mark.parametrize(
    ("name", "damage", "factor"),
    [
        *((SOURCE_FILE, *one) for one in (("truncated", 2), ("changed", 3))),
        *((CODE_FILE, *one) for one in (("emptied", 5), ("truncated", 7), ("changed", 11), ("removed", 13))),
        *((CODE_FILE, *one) for one in (("pipe", 53), ("link", 59))),
        *((CHECKSUM_FILE, *one) for one in (("removed", 17), ("emptied", 41), ("truncated", 43), ("pipe", 47))),
    ],
)
def test_what_is_damaged_is_made_anew(cache: Path, made: list[str], name: str, damage: str, factor: int) -> None:
    """A pipe that nobody writes to is not waited for."""
    lower(some_law(factor), "compiled")
    victim = folder_of(cache) / name
    content = victim.read_bytes()
    if damage in ("removed", "pipe"):
        victim.unlink()
        if damage == "pipe":
            os.mkfifo(victim)
    elif damage == "link":
        victim.symlink_to(victim.rename(cache / name))
    else:
        changed = content[: len(content) // 2] + b"#" + content[len(content) // 2 + 1 :]
        victim.write_bytes({"truncated": content[:-20], "emptied": b"", "changed": changed}[damage])
    assert not is_intact(folder_of(cache))

    compilation._loaded_modules.clear()
    lower(some_law(factor), "compiled")

    assert is_intact(folder_of(cache))
    assert len(made) == 2
    compilation._loaded_modules.clear()
    lower(some_law(factor), "compiled")
    assert len(made) == 2
    assert kept(cache) == [folder_of(cache).name]


def test_without_a_folder_to_write_to_each_process_compiles_for_itself(tmp_path: Path) -> None:
    """A file lies where the cache folder should be, which stops root too."""
    (tmp_path / "cache").write_text("not a folder")
    temporary = tmp_path / "temporary"
    temporary.mkdir()

    assert Other(tmp_path / "cache", TMPDIR=str(temporary)).answer() == NEW
    assert (tmp_path / "cache").read_text() == "not a folder"
    assert list(temporary.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="modes of files say nothing of others here")
@pytest.mark.parametrize("shared", ["folder", CODE_FILE, SOURCE_FILE, CHECKSUM_FILE])
def test_what_others_can_write_is_not_run(cache: Path, made: list[str], shared: str) -> None:
    lower(some_law(71), "compiled")
    folder = folder_of(cache)
    path = folder if shared == "folder" else folder / shared
    path.chmod(path.stat().st_mode | 0o020)
    assert not is_intact(folder)
    compilation._loaded_modules.clear()
    lower(some_law(71), "compiled")
    assert len(made) == 2
    assert is_intact(folder)
