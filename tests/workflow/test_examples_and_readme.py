"""Every example, and every Python block and command of the README, runs as it stands."""

import json
import re
import runpy
import shlex
import sys
from pathlib import Path

import pytest

from helpers.command_line import creepkit
from helpers.paths import ROOT

EXAMPLES = sorted(p for p in (ROOT / "examples").glob("[0-9]*.py"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script), "--quick"])
    monkeypatch.syspath_prepend(script.parent)  # as Python does for a script
    runpy.run_path(str(script), run_name="__main__")


def test_example_of_a_law_agrees_with_its_closed_form(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["02"])
    runpy.run_path(str(ROOT / "examples" / "02_a_law_of_your_own.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert float(re.search(r"largest relative difference: (\S+)", told)[1]) < 1e-4
    assert "fading: conforms" in told


def readme_blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.S)


def test_readme_blocks_run_in_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    space: dict[str, object] = {}
    for block in readme_blocks("python"):
        exec(compile(block, "README.md", "exec"), space)
    assert space["fit"].adequacy.explains
    assert "subroutine creep" in capsys.readouterr().out


def test_readme_commands_run_in_order(tmp_path, monkeypatch, capsys):
    """In an empty folder; the study of the first lines finds the law that the curves were made with."""
    monkeypatch.chdir(tmp_path)
    for line in "".join(readme_blocks("sh")).splitlines():
        program, *words = shlex.split(line)
        assert program == "creepkit"
        result = creepkit(*words)
        assert result.exit_code == 0, f"{line}\n{result.output}"
        if words[0] == "run":
            truth = json.loads(Path("curves/truth.json").read_text())
            assert f"decisive; weights: {truth['law']}" in result.stdout
            assert "not decisive" not in result.stdout
