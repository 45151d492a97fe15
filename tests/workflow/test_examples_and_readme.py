"""Every example and every Python block of the README runs as it stands."""

import ast
import re
import runpy
import sys

import pytest

from helpers.paths import ROOT

EXAMPLES = sorted(p for p in (ROOT / "examples").glob("[0-9]*.py"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


QUICK_IN_ITSELF = {"02_a_law_of_your_own"}


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.stem)
def test_example_uses_the_public_interface_alone(script):
    source = script.read_text(encoding="utf-8")
    ours = {line for line in source.splitlines() if re.match(r"\s*(import|from)\s+creepkit", line)}
    assert ours == {"import creepkit as ck"}
    assert not re.search(r"\bck(\.[a-z_]+)*\._", source), "a private name"


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.stem)
def test_example_is_a_page_of_the_gallery(script):
    source = script.read_text(encoding="utf-8")
    title, underline = (ast.get_docstring(ast.parse(source)) or "").splitlines()[:2]
    assert underline == len(title) * "="
    for heading, rule in re.findall(r"^# %%\n# (.+)\n# (-+)$", source, flags=re.MULTILINE):
        assert len(rule) == len(heading)
    assert "--quick" in source or script.stem in QUICK_IN_ITSELF


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script), "--quick"])
    runpy.run_path(str(script), run_name="__main__")


def test_example_of_a_law_agrees_with_its_closed_form(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["02"])
    runpy.run_path(str(ROOT / "examples" / "02_a_law_of_your_own.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert float(re.search(r"largest relative difference: (\S+)", told)[1]) < 1e-4
    assert "fading: conforms" in told


def test_readme_blocks_run_in_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", README, flags=re.S)
    assert len(blocks) >= 3
    space: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), space)


def test_readme_opens_with_the_two_commands():
    first = README.split("```")[1]
    assert "make demo" in first
    assert "make test" in first
