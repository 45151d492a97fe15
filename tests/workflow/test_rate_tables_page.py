"""The table and the snippet of the guide to tables of rates and rupture times, run as they stand."""

import re

import pytest

import creepkit as ck
from helpers.paths import ROOT

PAGE = ROOT / "docs" / "how-to" / "use_rate_and_rupture_tables.md"


def test_the_guide_to_rate_tables_runs(tmp_path, monkeypatch, capsys):
    text = PAGE.read_text(encoding="utf-8")
    (table,) = re.findall(r"```text\n(.*?)```", text, re.S)
    (snippet,) = re.findall(r"```python\n(.*?)```", text, re.S)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text(table, encoding="utf-8")
    tests = ck.read_histories("table.csv")
    assert [h.unruptured for h in tests] == [False, True, *[False] * 5]
    assert tests[6].minimum_rate == pytest.approx(1.4e-4 / 3600)
    exec(compile(snippet, str(PAGE), "exec"), {})
    printed = capsys.readouterr().out
    assert "minimum rates of 7 tests without frames" in printed
    assert (tmp_path / "rates.png").is_file()
