"""Rows that are kept as the text of columns are the rows that were put in, however they are cut."""

import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers import table_rows
from creepkit.readers.table_rows import (
    TableRow,
    TextRows,
    cells_of,
    grouped,
    packed,
    with_columns,
    with_first,
    without_empty,
)

RECTANGULAR = [TableRow(k + 3, (str(k), f"{k / 7}", "a" if k % 3 else "b")) for k in range(50)]
RAGGED = [TableRow(k, tuple("x" * n for n in range(k % 4 + 1))) for k in range(50)]
HEAD = "# stress_MPa: 100\n# temperature_C: 800\n"


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    monkeypatch.setattr(table_rows, "_PART_CELLS", 20)


def plain(rows):
    return [(row.line, list(row.cells)) for row in rows]


@pytest.mark.parametrize("rows", [RECTANGULAR, RAGGED], ids=["rectangular", "ragged"])
def test_packed_rows_are_the_rows(rows):
    found = packed(rows)
    assert len(found.parts) > 1
    assert plain(found) == plain(rows)
    assert plain([found[k] for k in (0, 7, -1)]) == plain([rows[k] for k in (0, 7, -1)])
    for cut in (slice(0, 1), slice(5, 31), slice(3, None), slice(None, None, 9), slice(60, 70)):
        assert plain(found[cut]) == plain(rows[cut])
    assert found.lines.tolist() == [row.line for row in rows]
    assert plain(with_first(TableRow(1, ["names"]), found)) == plain([TableRow(1, ["names"]), *rows])
    with pytest.raises(IndexError):
        found[50]


def test_columns_and_groups_of_packed_rows_are_those_of_a_list():
    found = packed(RECTANGULAR)
    assert list(cells_of(found, 1)) == [row.cells[1] for row in RECTANGULAR]
    assert plain(with_columns(found, [2, 0])) == plain(with_columns(RECTANGULAR, [2, 0]))
    assert plain(with_columns(found, [])) == [(row.line, []) for row in RECTANGULAR]
    groups, same = grouped(found, 2, str), grouped(RECTANGULAR, 2, str)
    assert {name: plain(rows) for name, rows in groups.items()} == {name: plain(rows) for name, rows in same.items()}
    assert list(groups) == ["b", "a"]


@pytest.mark.parametrize("empty", [{0}, {49}, {10, 11}, set(range(50))], ids=str)
def test_empty_rows_are_left_out(empty):
    rows = [TableRow(k, ("", "") if k in empty else ("", str(k))) for k in range(50)]
    assert [row.line for row in without_empty(packed(rows))] == [k for k in range(50) if k not in empty]


def test_a_table_of_texts_reads_as_one_of_numbers(tmp_path):
    """A column of texts that is left out changes nothing in the numbers, over several parts."""
    frames = [(0.25 * k, 1e-3 * k**0.5) for k in range(200)]
    numbers, texts = tmp_path / "numbers.csv", tmp_path / "texts.csv"
    numbers.write_text(f"{HEAD}time_h,strain_pct\n" + "".join(f"{t},{e}\n" for t, e in frames))
    texts.write_text(
        f"{HEAD}# ignore: remark\ntime_h,strain_pct,remark\n" + "".join(f"{t},{e},ok\n" for t, e in frames)
    )
    (one,), (other,) = ck.read_histories(numbers), ck.read_histories(texts)
    assert one.times.tolist() == other.times.tolist()
    assert one.outputs["strain"].tolist() == other.outputs["strain"].tolist()


def test_an_error_names_its_line_in_any_part(tmp_path):
    path = tmp_path / "x.csv"
    cells = [f"{k},{k * 1e-3},ok" for k in range(100)]
    cells[77] = "77,1_0,ok"
    path.write_text(f"{HEAD}# ignore: remark\ntime_h,strain_pct,remark\n" + "\n".join(cells) + "\n")
    with pytest.raises(HistoryError, match=r"x.csv:82, column 2: 'strain_pct' is '1_0'"):
        ck.read_histories(path)


def test_no_rows():
    assert len(TextRows(())) == 0
    assert TextRows(()).lines.size == 0
