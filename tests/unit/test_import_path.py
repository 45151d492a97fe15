"""What creepkit and its workers can import: nothing from the working folder, nor what lies beside a script."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from creepkit.jobs.worker_process import setup_message

PLANTED = "import sys; open({ran!r}, 'a').write(__name__ + chr(10))\n"
NAMES = ("json", "numpy", "sympy", "lazy_loader", "typer", "pickle", "creepkit_plugin", "openpyxl")
"""Modules that creepkit imports first or last: of Python, of what it depends on, and of nothing at all."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A working folder with modules that say when they are executed."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(PLANTED.format(ran=str(tmp_path / "ran")))
    return tmp_path


def environment(**variables: str) -> dict[str, str]:
    path = os.pathsep.join(entry for entry in sys.path if os.path.isabs(entry) and not entry.endswith("tests"))
    return {**os.environ, "PYTHONPATH": path, **variables}


def test_the_command_as_a_module_imports_nothing_from_the_working_folder(folder: Path) -> None:
    words = [sys.executable, "-m", "creepkit", "list", "laws"]
    done = subprocess.run(words, cwd=folder, env=environment(), capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert "norton" in done.stdout
    assert not (folder / "ran").exists()


WORKER_OF_A_SCRIPT = """
import sys
sys.path[:] = [folder for folder in sys.path if folder]  # this process is not the one that is looked at
from creepkit.jobs.worker_pools import ProcessWorkers
from creepkit.jobs.worker_process import TaskResult
sys.path.insert(0, {beside!r})
from beside_the_script import AskedJob
sys.path.insert(0, "")
with ProcessWorkers(AskedJob({names!r}), 1) as workers:
    print(workers.submit(0).result().text)
"""

BESIDE_THE_SCRIPT = """
from creepkit.jobs.worker_process import TaskResult

class AskedJob:
    task_name = "question"

    def __init__(self, names):
        self.names = names

    def on_one_thread(self):
        return self

    def run(self, number):
        import importlib, os, sys
        working = os.getcwd()
        found = []
        for name in self.names:
            try:
                spec = importlib.util.find_spec(name)
            except ValueError:
                continue
            if spec is not None and (spec.origin or "").startswith(working):
                found.append(name)
        found += [entry for entry in sys.path if not os.path.isabs(entry) or entry == working]
        return TaskResult(number, "done", text=" ".join(found) or "nothing")
"""


def test_a_worker_finds_nothing_in_the_working_folder_but_the_class_of_its_job(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Both an empty entry of PYTHONPATH and '.' are the working folder."""
    beside = tmp_path_factory.mktemp("beside")
    (beside / "beside_the_script.py").write_text(BESIDE_THE_SCRIPT)
    for name in NAMES:
        (beside / f"{name}.py").write_text(PLANTED.format(ran=str(folder / "ran")))
    program = WORKER_OF_A_SCRIPT.format(beside=str(beside), names=(*NAMES, "beside_the_script_not_imported"))
    variables = environment()
    variables["PYTHONPATH"] = os.pathsep.join([variables["PYTHONPATH"], "", "."])
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], cwd=folder, env=variables, capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["nothing"]
    assert not (folder / "ran").exists()


def test_torch_with_its_made_up_attributes_leaves_workers_what_they_need():
    """torch.classes answers for any attribute, __path__ among them, with what is no list of folders."""
    import torch  # noqa: F401

    assert setup_message()
