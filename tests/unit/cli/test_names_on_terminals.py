"""Names of files steer no terminal: whatever commands print of them for people is shown as codes.

Texts for programs (JSON, CSV, exported laws) are printed as they would stand in a file.
"""

from __future__ import annotations

import ast
import io
import os

import pytest

import creepkit as ck
from creepkit.reports import terminal
from helpers import source_tree
from helpers.command_line import creepkit

HOSTILE = "\x1b]0;owned\x07\x1b[31mred\rover\n\u202egnp\x9b"
BARS = ck.example_data("planted creep curves")
WAYS_TO_PRINT = {
    "creepkit.reports.terminal": "the functions that all others call",
    "creepkit.cli.ending": "what ends the command line, before anything is imported and without stderr that works",
}


def _prints(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call):
        return False
    name = ast.unparse(node.func)
    return name in ("print", "typer.echo", "typer.secho", "click.echo", "sys.stdout.write", "sys.stderr.write")


def test_everything_is_printed_by_one_module() -> None:
    printing = {name for name in source_tree.modules() if any(map(_prints, ast.walk(source_tree.tree(name))))}
    assert printing <= set(WAYS_TO_PRINT)


def test_controls_are_shown_as_codes_and_lines_and_tabs_stay(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.tell("two\tcolumns\nred \x1b[31m \x07 \r \x9b \u202e end")
    terminal.tell_written("a\nb\x1b.csv", ": 2 frames", err=True)
    terminal.print_table("of \x1b[31m [bold]", ["\x07 [red]"], [["cell \x1b[31m [/red]"]])
    terminal.ProgressBar().tick("file \x1b[31m", 1, 1, "\x07")
    terminal.put('{"name": "\x1b"}')
    out, err = capsys.readouterr()
    assert out.startswith("two\tcolumns\nred \\u001b[31m \\u0007 \\u000d \\u009b \\u202e end\nof \\u001b[31m [bold] ")
    assert "\\u0007 [red]" in out
    assert "cell \\u001b[31m [/red]" in out
    assert out.endswith('{"name": "\x1b"}')
    assert err == "wrote a\\u000ab\\u001b.csv: 2 frames\nfile \\u001b[31m ...\n"


@pytest.mark.skipif(os.name == "nt", reason="Windows allows no such names")
@pytest.mark.parametrize(
    "words",
    [
        ("read", "{h}/{h}.csv", "--to", "{h}", "--plot", "{h}.svg"),
        ("read", "{h}/{h}.csv", "broken-{h}.csv"),
        ("simulate", "norton", "--set", "A=1e-15", "--set", "n=4", "--end-h", "9", "--stress", "80", "--to", "{h}.csv"),
        ("identify", "{h}/{h}.csv", "--laws", "norton", "--to", "{h}"),
        ("export", "norton", "--to", "latex", "--set", "A=1e-15", "--set", "n=4", "--output", "{h}.tex"),
        ("report", "norton", "--app", "--tests", "{h}/{h}.csv", "--to", "{h}.html"),
        ("init", "{h}"),
        ("rupture", "{h}/{h}.csv"),
        ("{h}",),
        ("list", "laws", "{h}"),
        ("list", "laws", "norton", "{h}"),
        ("list", "laws", "--{h}"),
        ("simulate", "norton", "--end-h", "{h}"),
    ],
    ids=lambda words: " ".join(words[:3]).replace("{h}", "HOSTILE"),
)  # fmt: skip
def test_no_command_prints_a_name_as_it_is(words: tuple[str, ...], tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkdir(HOSTILE)
    (tmp_path / HOSTILE / f"{HOSTILE}.csv").write_bytes((BARS / "planted_800C_60MPa.csv").read_bytes())
    (tmp_path / f"broken-{HOSTILE}.csv").write_text("time_h,strain\nnothing,else\n")
    result = creepkit(*(word.format(h=HOSTILE) for word in words))
    printed = result.stdout + result.stderr
    assert printed
    assert "Traceback" not in printed
    assert not set(printed) & set("\x1b\x07\r\x9b\u202e")


def test_a_terminal_is_not_steered_by_tasks_of_a_progress_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    with terminal.ProgressBar() as progress:
        progress.tick("red \x1b]0;owned\x07 [/red]", 1, 1)
    assert "\x1b]0;" not in stream.getvalue()
    assert "[/red]" in stream.getvalue()


@pytest.mark.parametrize("target", ["latex", "python", "json"])
def test_texts_for_programs_are_printed_as_a_file_holds_them(target: str, tmp_path) -> None:
    values = ("--set", "A=1e-15", "--set", "n=4")
    printed = creepkit("export", "norton", "--to", target, *values)
    assert creepkit("export", "norton", "--to", target, *values, "--output", str(tmp_path / "law")).exit_code == 0
    assert printed.stdout.rstrip("\n") == (tmp_path / "law").read_text(encoding="utf-8").rstrip("\n")
