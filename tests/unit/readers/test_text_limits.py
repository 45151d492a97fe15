"""Limits of text tables, and characters that no name may hold."""

from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV

HEAD, FRAMES = "# stress_MPa: 100\n# temperature_C: 800\n", "time_h,strain_pct\n0,0\n1,.5\n2,.9\n"
COLUMNS = ",".join(f"c{k} strain (%)" for k in range(2000))

REFUSED = {
    "columns": (f"{HEAD}time_h,{COLUMNS}\n0{',0' * 2000}\n", "x.csv:3: number of columns 2001, more than 2000"),
    "line": (f"{HEAD}{FRAMES}{',' * 1_000_001}\n", "x.csv:7: the line has more than 1000000 characters"),
    "keys": (
        "".join(f"# label k{k}: 1\n" for k in range(1001)) + FRAMES,
        "x.csv:1001: number of keys above the table 1001",
    ),
    "list": (HEAD + "".join(f"# zz{k}qq: 1\n" for k in range(900)) + FRAMES, "x.csv:3: unknown key .* and 894 more$"),
    "escape": (f"# name: \x1b[2J\n{HEAD}{FRAMES}", r"x.csv:1: the character U\+001B cannot be printed"),
    "control": (f"{HEAD}# label a: \x9bb\n{FRAMES}", r"x.csv:3: the character U\+009B cannot be printed"),
    "direction": (f"{HEAD}# label a\u202e: b\n{FRAMES}", r"x.csv:3: the character U\+202E cannot be printed"),
    "separator": (f"{HEAD}# label a: b\u2028c\n{FRAMES}", r"x.csv:3: the character U\+2028 cannot be printed"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case: str, tmp_path: Path):
    text, message = REFUSED[case]
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    with pytest.raises(HistoryError, match=message) as caught:
        HISTORY_CSV.read(tmp_path / "x.csv")
    assert len(str(caught.value)) < 1000
    assert str(caught.value).isprintable()


def test_blanks_of_any_width_and_tabs_are_text(tmp_path: Path):
    (tmp_path / "x.csv").write_text(f"{HEAD}# label a: 1\u00a0mm\u202f\t\u2009b\n{FRAMES}\x0c", encoding="utf-8")
    (history,) = HISTORY_CSV.read(tmp_path / "x.csv")
    assert history.labels["a"].startswith("1\u00a0mm")


SKIPPED = {
    "empty": ("\n", "", "above the first row of a table"),
    "comments above": ("#\n", HEAD + FRAMES, "above the first row of a table"),
    "empty within": ("\n", "", "beside 4 rows"),
    "blanks within": (" \n", "", "beside 4 rows"),
    "comments within": ("# a: b\n", "", "beside 4 rows"),
    "empty cells": (",\n", "", "beside 4 rows"),
}


@pytest.mark.parametrize("case", SKIPPED)
def test_lines_that_say_nothing_are_bounded(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    line, below, where = SKIPPED[case]
    above, below = (f"{HEAD}{FRAMES}", "3,1\n") if "rows" in where else ("", below)
    path = tmp_path / "x.csv"
    path.write_text(f"{above}{line * 120_000}{below}", encoding="utf-8")
    with pytest.raises(
        HistoryError, match=f"x.csv: more than 100000 empty lines and comments {where}; remove them, or"
    ):
        HISTORY_CSV.read(path)
    if below:
        monkeypatch.setenv("CREEPKIT_LIMITS", "2")
        assert len(HISTORY_CSV.read(path)[0].times) == 3 + ("rows" in where)


def test_an_empty_line_between_any_two_rows_is_no_excess(tmp_path: Path):
    """Rows of times k and strains k / 1000, so that each value tells its row."""
    count = 150_000
    path = tmp_path / "x.csv"
    rows = "\n".join(f"{k},{k / 1000}\n" for k in range(count))
    for comment in ("", "# remark\n"):
        path.write_text(f"{HEAD}time_s,strain_pct\n{comment}{rows}", encoding="utf-8")
        (history,) = HISTORY_CSV.read(path)
        assert len(history.times) == count
        assert history.times[-1] == count - 1
