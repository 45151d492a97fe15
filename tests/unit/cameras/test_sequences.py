"""Folders of frames: which files belong to a sequence, in which order, at which times; and one frame in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import HistoryError
from helpers.camera_samples import dice, dice_blanks, dome, pyvale, vic_3d, zeiss


def folder_of(path: Path, names: list[str], write=dice) -> Path:
    """Frames whose apex rises by 0.1 mm from one name to the next."""
    path.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        (path / name).write_bytes(write(dome(0.1 * k)))
    return path


def apexes(frames: ck.Frames) -> list[float]:
    return [round(float(frame.displacements[24, 2]), 6) for frame in frames]


def test_natural_order_and_missing_numbers(tmp_path: Path) -> None:
    names = [f"DICe_solution_{k}.txt" for k in (2, 3, 9, 10, 12)]
    frames = ck.read_frames(folder_of(tmp_path / "test", names))

    assert apexes(frames) == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert frames.missing == (4, 5, 6, 7, 8, 11)
    assert frames[-1].source.endswith("DICe_solution_12.txt")


def test_what_else_lies_in_the_folder_is_no_frame(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["f_1.txt", "f_2.txt"])
    (folder / "frame_times.csv").write_text("index,time\n0,1755561113266\n")
    (folder / "notes.txt").write_text("two frames")
    (folder / ".hidden_3.txt").write_bytes(dice())
    (folder / "f_3.tif").write_bytes(b"II*\0")
    assert apexes(ck.read_frames(folder)) == [0.0, 0.1]


@pytest.mark.parametrize("content", [b"", b"***\n***\n", b"SUBSET_ID,SIGMA\n1,2\n", b"\xff\xd8\xff\x00"])
def test_a_broken_frame_is_missed_when_it_is_read(content: bytes, tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["f_1.txt", "f_2.txt", "f_3.txt"])
    (folder / "f_2.txt").write_bytes(content)
    frames = ck.read_frames(folder)

    assert len(frames) == 3
    assert frames[2].valid.size == 49
    with pytest.raises(HistoryError, match="f_2.txt"):
        frames[1]


def test_frames_of_other_columns(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["f_1.txt", "f_2.txt", "f_3.txt"])
    (folder / "f_2.txt").write_bytes(dice_blanks())  # the same columns, with blanks
    (folder / "f_3.txt").write_bytes(dice().replace(b"GAMMA", b"GAMMA_2"))
    frames = ck.read_frames(folder)

    assert frames[1].valid.size == 49
    with pytest.raises(HistoryError, match=r"f_3.txt:5: its columns are not those of f_1.txt \('GAMMA'"):
        frames[2]


def test_an_image_that_comes_twice_in_a_file_of_a_folder(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["f_1.csv", "f_2.csv"], vic_3d)
    (folder / "f_2.csv").write_bytes(vic_3d() + vic_3d())
    with pytest.raises(HistoryError, match="f_2.csv:53: the line of columns comes again"):
        ck.read_frames(folder)[1]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["left_1.txt", "left_2.txt", "right_1.txt"], "left_#.txt and right_#.txt, are no one sequence"),
        (["cam0_1.txt", "cam0_2.txt", "cam1_1.txt", "cam1_2.txt"], "look like 2 sequences in one folder"),
        (["f_1.txt", "f_01.txt"], "have the same number"),
    ],
)
def test_files_that_are_no_one_sequence(names: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(HistoryError, match=message):
        ck.read_frames(folder_of(tmp_path / "test", names))


def test_the_reference_comes_first(tmp_path: Path) -> None:
    """As pyvale calls it, beside the numbered frames."""
    names = ["dic_results_ref_img.csv", *(f"dic_results_def_img_{k}.csv" for k in (1, 2, 10, 12))]
    frames = ck.read_frames(folder_of(tmp_path / "test", names, pyvale))
    assert apexes(frames) == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert frames.missing == (3, 4, 5, 6, 7, 8, 9, 11)


def test_patterns_and_lists(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["cam0_1.txt", "cam0_2.txt", "cam1_1.txt", "cam1_2.txt"])
    assert apexes(ck.read_frames(f"{folder}/cam1_*.txt")) == [0.2, 0.3]
    assert apexes(ck.read_frames([folder / "cam1_2.txt", folder / "cam0_1.txt"])) == [0.3, 0.0]
    with pytest.raises(HistoryError, match="no file matches this pattern"):
        ck.read_frames(f"{folder}/cam2_*.txt")
    with pytest.raises(HistoryError, match="there is no such file"):
        ck.read_frames(folder / "cam2_1.txt")
    with pytest.raises(HistoryError, match="no files are given"):
        ck.read_frames([])


def test_times_given(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "test", ["f_1.txt", "f_2.txt", "f_3.txt"])
    frames = ck.read_frames(folder, times=[0.0, 5.0, 7.5])
    assert frames.times.tolist() == [0.0, 5.0, 7.5]
    assert frames[1].time == 5.0
    for times, message in [
        ([0, 1], "2 times for 3 frames"),
        ([0, 2, 2], "the time of frame 2 is 2 s, after 2 s"),
        ([0, np.nan, 2], "the time of frame 1 is no finite number"),
        (["a", "b", "c"], "give an array of s"),
    ]:
        with pytest.raises(HistoryError, match=message):
            ck.read_frames(folder, times=times)


def test_times_in_heads_and_names_with_decimals(tmp_path: Path) -> None:
    import dataclasses

    folder = folder_of(tmp_path / "test", ["map_100.25.txt", "map_350.5.txt"], zeiss)
    for k, file in enumerate(sorted(folder.iterdir())):
        file.write_bytes(file.read_bytes().replace(b"# force :", f"# clock: {k + 2} min\n# force :".encode()))
    system = ck.available("cameras")["zeiss"]
    assert np.isnan(ck.read_frames(folder).times).all()
    by_head = dataclasses.replace(system, time=("head", "clock", "min"))
    assert ck.read_frames(folder, format=by_head).times.tolist() == [120.0, 180.0]
    by_name = dataclasses.replace(system, time=("name", "", "ms"))
    assert ck.read_frames(folder, format=by_name).times.tolist() == pytest.approx([0.10025, 0.3505])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("index,time\n0,1755561113266\n1,1755561113466\n", [1755561113.266, 1755561113.466]),
        ("0\n20\n", [0.0, 20.0]),
        ("# remarks\nt [ms];frame\n500,5;1\n1500,0;2\n", [0.5005, 1.5]),
        ("Time (min)\n0\n2\n", [0.0, 120.0]),
    ],
)
def test_times_of_frames_from_a_file(tmp_path, text, expected):
    (tmp_path / "times.csv").write_text(text)
    np.testing.assert_allclose(read_frame_times(tmp_path / "times.csv"), expected, rtol=1e-12)


def test_numbers_may_count_in_steps(tmp_path: Path) -> None:
    frames = ck.read_frames(folder_of(tmp_path / "test", [f"run2_{k:05d}_0.csv" for k in (10, 20, 30, 50)], vic_3d))
    assert frames.missing == (40,)
