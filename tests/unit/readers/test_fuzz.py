"""Whatever a file holds, reading it gives histories or a HistoryError; what is written reads back the same."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.readers.indexed_folders import INDEXED_FILES, INDEXED_TABLE
from creepkit.records import History, PressureJump, Program, Reader, StressSteps, constant_stress

# The one folder of a test function serves all its examples, each of which writes its files anew.
bounded = settings(
    max_examples=120,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

GOOD = (
    "# alloy: x\n# temperature_C: 850\n# stress_steps: 0 s 60 MPa; 1 h 70 MPa\n# modulus_GPa: 150\n"
    "# strain_sd_1: 1e-5\n# end_time_h: 2\n# geometry gauge_mm: 25\n# label heat: X7\n"
    "time_s,strain_1,used\n0,0,1\n10,0.1,1\n10,0.2,0\n20,0.3,1\n"
)
BULGE = (
    "# temperature_K: 1000\n# pressure_1_MPa: 8\n# pressure_2_MPa: 9\n# jump_time_h: 3\n# ramp_s: 5\n"
    "time_min,amplitude_um,width_mm,shape,temperature_C\n1,80,3.6,2,726.85\n2,81,3.6,2,726.85\n"
)
PIECES = [
    *("temperature_K", "stress_MPa", "stress_1_MPa", "pressure_program", "time_h", "strain_pct", "amplitude_mm", "_sd"),
    *(
        "nan",
        "inf",
        "1e308",
        "1e29",
        "-1",
        "0",
        "-0.0",
        "1e-320",
        "٣",
        "",
        " ",
        ",",
        "#",
        "# ",
        ":",
        ";",
        '"',
        "\n",
        "\r",
    ),
    *("\x00", "\x0c", "\u2028", "\ufeff", "label ", "geometry ", "specimen: bulge", "0 s 1 MPa", "used", "yes", "true"),
]


def attempt(reader: Reader, path: Path) -> tuple[list[History], str]:
    """The histories, or what the reader complains of; any other exception is a failure."""
    try:
        return reader.read(path), ""
    except HistoryError as error:
        return [], str(error)


def read_or_refuse(text: str | bytes, path: Path) -> None:
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", errors="surrogatepass"))
    assert HISTORY_CSV.accepts(path)
    histories, complaint = attempt(HISTORY_CSV, path)
    assert all(isinstance(history, History) and history.times.size > 1 for history in histories)
    assert bool(histories) != (str(path) in complaint)
    assert "\n" not in complaint


@bounded
@given(text=st.one_of(st.binary(max_size=200), st.text(max_size=200)))
def test_any_bytes(tmp_path, text):
    read_or_refuse(text, tmp_path / "x.csv")


@bounded
@given(data=st.data(), good=st.sampled_from([GOOD, BULGE]))
def test_good_files_with_pieces_cut_out_and_put_in(tmp_path, data, good):
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(good)))
        end = data.draw(st.integers(start, min(start + 12, len(good))))
        good = good[:start] + data.draw(st.sampled_from(PIECES) | st.text(max_size=3)) + good[end:]
    read_or_refuse(good, tmp_path / "x.csv")


@bounded
@given(cells=st.lists(st.lists(st.sampled_from(PIECES) | st.floats().map(repr), min_size=3, max_size=3), max_size=6))
def test_good_head_with_any_cells(tmp_path, cells):
    head = "# temperature_C: 850\n# stress_MPa: 60\ntime_s,strain_1,strain_sd_1\n"
    read_or_refuse(head + "\n".join(map(",".join, cells)), tmp_path / "x.csv")


@bounded
@given(data=st.data())
@pytest.mark.parametrize("reader", [INDEXED_TABLE, INDEXED_FILES], ids=lambda reader: reader.name)
def test_index_with_pieces_cut_out_and_put_in(tmp_path, reader, data):
    frames = {"curves.csv": "key,time_s,strain_1\na,0,0\na,1,1\n"}
    frames["a_creep.csv"] = "time_h,creep_extension_pct,T_top_C,T_mid_C,T_bot_C\n0,0,1,1,1\n1,1,1,1,1\n"
    for name, text in frames.items():
        (tmp_path / name).write_text(text)
    index = f"{reader.key_column},temperature_C,stress_MPa,state\na,850,60,x\n"
    start = data.draw(st.integers(0, len(index)))
    end = data.draw(st.integers(start, len(index)))
    index = index[:start] + data.draw(st.sampled_from(PIECES) | st.text(max_size=5)) + index[end:]
    (tmp_path / "index.csv").write_bytes(index.encode("utf-8", errors="surrogatepass"))
    reader.accepts(tmp_path)
    histories, complaint = attempt(reader, tmp_path)
    assert [history.times.size for history in histories] == [2] or str(tmp_path) in complaint


values = st.floats(-1e20, 1e20)
words = st.text(st.characters(exclude_categories=["C", "Z"]), max_size=8)
loadings = st.one_of(
    st.floats(0, 9e4).map(constant_stress),
    st.tuples(st.floats(0, 9e4), st.floats(1e-3, 1e9), st.floats(0, 9e4)).map(
        lambda x: StressSteps(((0.0, x[0]), (x[1], x[2])), "stress")
    ),
    st.tuples(st.floats(1e-9, 9e4), st.floats(1e-9, 9e4), st.floats(6, 1e9)).map(lambda x: PressureJump(*x)),
)


@bounded
@given(
    times=st.lists(st.floats(0, 1e12), min_size=2, max_size=5, unique=True).map(sorted),
    strain=st.lists(values, min_size=5, max_size=5),
    loading=loadings,
    temperature=st.floats(1e-3, 4499) | st.floats(1e-3, 4499).map(Program.constant),
    name=words.filter(bool),
    labels=st.dictionaries(words.filter(lambda key: key and ":" not in key), words, max_size=3),
)
def test_round_trip(tmp_path, times, strain, loading, temperature, name, labels):
    outputs = {"strain": strain[: len(times)]}
    history = History(name, np.array(times), outputs, loading, temperature, labels=labels)
    (back,) = HISTORY_CSV.read(write_history(history, tmp_path / "x.csv"))
    assert (back.name, back.loading, back.temperature, back.labels) == (name, loading, history.temperature, labels)
    np.testing.assert_array_equal(back.times, history.times)
    np.testing.assert_array_equal(back.outputs["strain"], history.outputs["strain"])
