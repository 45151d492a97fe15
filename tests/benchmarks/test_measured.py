"""Pages of measured figures, and the list of benchmark programs."""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
sys.path.append(str(FOLDER))
measured = importlib.import_module("measured")
programs = importlib.import_module("all")

DOCUMENTATION = """A title over
    two lines.

        python tests/benchmarks/program.py [--write]

    What is measured,
    against what.

    Columns: none.
    """


def test_title_and_paragraphs_of_a_docstring_without_its_usage() -> None:
    title, description = measured.title_and_description(DOCUMENTATION)
    assert title == "A title over two lines"
    assert description == "What is measured, against what.\n\nColumns: none."


def test_a_page_holds_what_was_printed(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(measured, "FOLDER", tmp_path / "measured")
    monkeypatch.setattr(sys, "argv", ["anywhere/program.py", "--samples", "4"])
    page = measured.Page("program_jump", DOCUMENTATION)
    page.heading("Section")
    page.table("law", "error, %")
    page.row("a|b", 0.05)
    printed = capsys.readouterr().out
    assert printed.splitlines() == ["", "## Section", "", "| law | error, % |", "|-|-|", "| a\\|b | 0.05 |"]
    text = page.write().read_text()
    assert text.startswith("# A title over two lines\n\nWhat is measured, against what.\n")
    assert printed.strip() in text
    assert "Repeat with `python tests/benchmarks/program.py --samples 4`." in text.splitlines()[-1]


def test_every_program_is_listed_and_writes_a_page() -> None:
    with_main = {p.stem for p in FOLDER.glob("*.py") if "\ndef main(" in p.read_text()} - {"all"}
    assert with_main == set(programs.BENCHMARKS)
    for name in with_main:
        text = (FOLDER / f"{name}.py").read_text()
        assert "arguments(__doc__)" in text, name
        assert "page.write()" in text, name
        assert ast.get_docstring(ast.parse(text)), name


def test_an_unknown_program_is_an_error(monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["all.py", "nonsense"])
    with pytest.raises(SystemExit):
        programs.main()
    assert "there is no program nonsense" in capsys.readouterr().err


def test_short_forms_are_run_as_they_are_listed(monkeypatch, capsys) -> None:
    run = []

    def done(words, cwd):
        run.append(words[1:])
        return programs.argparse.Namespace(returncode=0)

    monkeypatch.setattr(programs.subprocess, "run", done)
    monkeypatch.setattr(sys, "argv", ["all.py", "--short"])
    programs.main()
    short = {name: one.short for name, one in programs.BENCHMARKS.items() if one.short}
    assert run == [[f"tests/benchmarks/{name}.py", *words] for name, words in short.items()]
    for words in (["--short", "--write"], ["--short", "import_time"]):
        monkeypatch.setattr(sys, "argv", ["all.py", *words])
        with pytest.raises(SystemExit):
            programs.main()
