"""One dome, written by code of the tests in the words of each system, comes back the same from all of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cameras.time_files import read_frame_times
from creepkit.errors import ArgumentError, HistoryError
from helpers.camera_samples import LOST, SAMPLES, dice, dice_blanks, dome, vic_3d, vic_3d_images, vic_3d_mat, zeiss
from helpers.paths import SHARED, needs_shared_data


def written(folder: Path, content: bytes, name: str) -> Path:
    (folder / name).write_bytes(content)
    return folder / name


@pytest.mark.parametrize("sample", SAMPLES)
def test_every_system_gives_the_same_dome(sample: str, tmp_path: Path) -> None:
    write, name, format = SAMPLES[sample]
    frames = ck.read_frames(written(tmp_path, write(), name))
    truth = dome()
    frame = frames[0]

    assert len(frames) == 1
    assert frames.system == ck.available("cameras")[format].title
    assert list(np.flatnonzero(~frame.valid)) == list(LOST)
    kept = frame.valid
    shift = np.array([0.0, 0.0, -300.0]) if sample.startswith("pyvale") else 0.0  # camera 0 is the origin
    np.testing.assert_allclose(frame.points[kept], truth.points[kept] + shift, atol=2e-7)
    np.testing.assert_allclose(frame.displacements[kept], truth.displacements[kept], atol=2e-8)
    assert np.isnan(frames.times).all()


@needs_shared_data
def test_frames_of_dice_itself() -> None:
    """Of its own examples; the numbers are those of the first and the last line of stereo_1.txt."""
    frames = ck.read_frames(SHARED / "cameras" / "dice")
    first, second = frames

    assert len(frames) == 2  # the two-dimensional tables beside them are none
    assert [frame.points.shape for frame in frames] == [(1089, 3), (1089, 3)]
    assert all(frame.valid.all() for frame in frames)
    np.testing.assert_array_equal(second.points[0], [-2.2699, 2.1956, -3.5498e-02])
    np.testing.assert_array_equal(second.displacements[0], [-3.0356e-02, 2.5451e-02, 3.5206e-02])
    np.testing.assert_array_equal(first.displacements[1], [6.4903e-09, -1.4425e-09, -1.3400e-08])


@needs_shared_data
def test_lost_subsets_of_a_two_dimensional_table(tmp_path: Path) -> None:
    """Refused as it is, and read where a format says that it has no out-of-plane columns."""
    path = SHARED / "cameras" / "dice" / "lost_subsets_4.txt"
    with pytest.raises(HistoryError, match="lost_subsets_4.txt:1: no camera format has its columns"):
        ck.read_frames(path)
    in_plane = ck.CameraFormat(
        "dice-2d",
        "DICe in the plane, at 0.05 mm a pixel",
        {"x": "COORDINATE_X", "y": "COORDINATE_Y", "u": "DISPLACEMENT_X", "v": "DISPLACEMENT_Y"},
        unit="mm",
        lost={"SIGMA": "< 0"},
    )
    (frame,) = ck.read_frames(path, format=in_plane)
    lost = sum(",-1.0000E+00,-1.0000E+00,-1.0000E+00," in line for line in path.read_text().splitlines())

    assert frame.valid.size == 784
    assert np.count_nonzero(~frame.valid) == lost
    assert not frame.displacements[:, 2].any()


def test_images_of_one_file(tmp_path: Path) -> None:
    """Each below its own title and head; and in the chunks in which a large file is searched."""
    frames = ck.read_frames(written(tmp_path, vic_3d_images((0.0, 0.2, 0.4)), "all.csv"))

    assert [frame.displacements[24, 2] for frame in frames] == pytest.approx([0.0, 0.2, 0.4])
    assert [frame.valid.size for frame in frames] == [49, 49, 49]
    assert frames[1].source.endswith("all.csv, image 2")


def test_a_broken_line_of_the_third_image_is_named(tmp_path: Path) -> None:
    content = vic_3d_images((0.0, 0.2, 0.4)).split(b"\n")
    content[2 * 51 + 10] = b"1,2,what,4,5,6,7,8"
    frames = ck.read_frames(written(tmp_path, b"\n".join(content), "all.csv"))

    assert frames[1].valid.size == 49
    with pytest.raises(HistoryError, match=r"all.csv:113: 'Z \[mm\]' is 'what'; write a finite number"):
        frames[2]


@pytest.mark.parametrize(("unit", "factor"), [("m", 1e3), ("in", 25.4), ("um", 1e-3), ("µm", 1e-3)])
def test_units_stand_in_the_head(unit: str, factor: float, tmp_path: Path) -> None:
    text = vic_3d().decode().replace("[mm]", f"[{unit}]").encode()
    frame = ck.read_frames(written(tmp_path, text, "a.csv"))[0]
    np.testing.assert_allclose(frame.points[5], factor * dome().points[5], rtol=1e-7)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[mm]", "[px]", r"a.csv:2: 'X \[px\]' is in pixels; calibrate the cameras"),
        (" [mm]", "", "a.csv:2: the unit of 'X' is not stated; write 'X [mm]'"),
        ("[mm]", "[furlong]", r"a.csv:2: 'X \[furlong\]' has the unit 'furlong'; allowed are mm, m, cm"),
        ('"W [mm]"', '"Q [mm]"', "a.csv:2: missing column 'W' (w of camera format 'vic-3d')"),
        ('"Z [mm]","U [mm]","V [mm]","W [mm]"', '"U [mm]","V [mm]"', "a.csv:2: missing column 'Z' (z of camera"),
        ('"X [mm]"', '"Q [mm]"', "a.csv:2: missing column 'X' (x of camera format 'vic-3d')"),
        ('"exx [1] - Lagrange"', '"X [mm]"', "both are the column x of camera format 'vic-3d'; keep one"),
    ],
)
def test_heads_that_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = written(tmp_path, vic_3d().decode().replace(old, new).encode(), "a.csv")
    with pytest.raises(HistoryError) as caught:
        ck.read_frames(path)
    assert message.replace("\\", "") in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ("1,2,3,4,5,6,7", "a.csv:5: number of cells 7, of columns 8"),
        ("1,2,3,4,5,6,7,8,9", "a.csv:5: number of cells 9, of columns 8"),
        ("1,2,3,4,5,1e400,0.01,8", "a.csv:5: 'W [mm]' is inf; a length is a finite number of at most 1e+06 mm"),
        ("1,2,3,4,-inf,6,0.01,8", "a.csv:5: 'V [mm]' is -inf"),
        ("1,2,3e7,4,5,6,0.01,8", "a.csv:5: 'Z [mm]' is 3e+07"),
        ("1,2,0x10,4,5,6,0.01,8", "a.csv:5: 'Z [mm]' is '0x10'; write a finite number with a decimal point"),
        ("1,2,1.5.2,4,5,6,0.01,8", "a.csv:5: 'Z [mm]' is '1.5.2'"),
        ("1,2,3E,4,5,6,0.01,8", "a.csv:5: 'Z [mm]' is '3E'"),
        ('1,2,"3,4,5,6,0.01,8', "a.csv:5: 'Z [mm]' is '\"3,4,5,6,0.01,8'"),
        ("1,2,\0,4,5,6,0.01,8", "a.csv:5: byte 0x00 is not text"),
    ],
)
def test_cells_that_are_refused(cells: str, message: str, tmp_path: Path) -> None:
    lines = vic_3d().decode().split("\n")
    lines[4] = cells
    path = written(tmp_path, "\n".join(lines).encode(), "a.csv")
    with pytest.raises(HistoryError) as caught:
        ck.read_frames(path)[0]
    assert message in str(caught.value)


@pytest.mark.parametrize("word", ["nan", "NaN", "-nan(ind)", "nan(snan)", "1.#QNAN", "-1.#IND", "", '""'])
def test_a_point_without_a_number_is_lost(word: str, tmp_path: Path) -> None:
    lines = vic_3d().decode().split("\n")
    lines[4] = f"1,2,inf,4,5,{word},0.01,8"  # infinity is no matter where a point is lost
    frame = ck.read_frames(written(tmp_path, "\n".join(lines).encode(), "a.csv"))[0]
    assert list(np.flatnonzero(~frame.valid)) == [2, *LOST]


def test_decimal_commas_in_quotes(tmp_path: Path) -> None:
    rows = [
        ",".join(f'"{cell}"' for cell in line.split(";"))
        for line in ["X [mm];Y [mm];Z [mm];U [mm];V [mm];W [mm];sigma", "1,5;2;3;0,25;0;-1,25e-1;0,01"]
    ]
    frame = ck.read_frames(written(tmp_path, "\n".join(rows).encode(), "a.csv"))[0]
    assert frame.points[0].tolist() == [1.5, 2.0, 3.0]
    assert frame.displacements[0].tolist() == [0.25, 0.0, -0.125]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_encodings_and_ends_of_lines(encoding: str, newline: str, tmp_path: Path) -> None:
    text = dice().decode().replace("\n", newline).encode(encoding)
    frame = ck.read_frames(written(tmp_path, text, "DICe_solution_1.txt"))[0]
    np.testing.assert_allclose(frame.displacements[30], dome().displacements[30], rtol=1e-9)


def test_columns_named_by_the_user(tmp_path: Path) -> None:
    head = b"time_s;PosX (m);PosY (m);PosZ (m);dx (mm);dy (mm);dz (mm);quality\n"
    path = written(tmp_path, head + b"12,5;1;2;3;4;5;6;0,9\n12,5;1;2;3;4;5;7;0,1\n", "lab.csv")
    names = {"x": "PosX", "y": "PosY", "z": "PosZ", "u": "dx", "v": "dy", "w": "dz", "time": "time"}
    with pytest.raises(HistoryError, match="no camera format has its columns"):
        ck.read_frames(path)

    frames = ck.read_frames(path, format=names)
    assert frames[0].points[0].tolist() == [1000.0, 2000.0, 3000.0]
    assert frames.times[0] == frames[0].time == 12.5

    ours = ck.CameraFormat("ours", "ours", names, lost={"quality": "< 0.5"}, axes=(1, -1, -1))
    frames = ck.read_frames(path, format=ours)
    assert frames[0].valid.tolist() == [True, False]
    assert frames[0].displacements[0].tolist() == [4.0, -5.0, -6.0]
    assert ck.read_frames(path, format={**names, "x": "posx"})[0].points[0, 0] == 1000.0  # other capitals do


def test_two_formats_for_one_head(tmp_path: Path) -> None:
    from creepkit.cameras.formats import FORMATS
    from creepkit.cameras.reading import read_frames

    twin = dataclasses.replace(ck.available("cameras")["zeiss"], name="twin")
    path = written(tmp_path, zeiss(), "nodemap.txt")
    with pytest.raises(HistoryError, match="the camera formats 'zeiss' and 'twin' both accept it; say which one"):
        read_frames(path, [*FORMATS, twin])
    assert len(read_frames(path, [*FORMATS, twin], "twin")) == 1


def test_arrays_of_matlab_written_in_other_ways(tmp_path: Path) -> None:
    """Without compression, of other types, as the HDF5 of version 7.3; and what is cut off is refused."""
    import h5py
    from scipy.io import savemat

    truth = dome()
    arrays = dict(zip("XYZUVW", (*truth.points.T, *truth.displacements.T), strict=True))
    savemat(tmp_path / "a.mat", {**arrays, "sigma": np.ones(49, dtype=np.int16), "names": ["a", "b"]})
    frame = ck.read_frames(tmp_path / "a.mat")[0]
    np.testing.assert_array_equal(frame.points, truth.points)

    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        for name, values in arrays.items():
            file[name] = values.reshape(7, 7).T  # as MATLAB's order of rows and columns lies in HDF5
    content = (tmp_path / "b.mat").read_bytes()
    (tmp_path / "b.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + content[512:])
    np.testing.assert_array_equal(ck.read_frames(tmp_path / "b.mat")[0].displacements, truth.displacements)

    with pytest.raises(HistoryError, match="cannot be read as arrays of MATLAB, it seems damaged"):
        ck.read_frames(written(tmp_path, vic_3d_mat()[:900], "c.mat"))


UNKNOWN = b"xpos_um;ypos_um;zpos_um;dx_um;dy_um;dz_um\n" + b"1;2;3;4;5;6\n" * 600


def test_what_is_no_frame_is_found_out_from_some_of_its_files(tmp_path: Path) -> None:
    for k in range(100):
        written(tmp_path, UNKNOWN, f"frame_{k:03d}.csv")
    with pytest.raises(HistoryError, match=r"000.csv:1: no camera format has its columns \(found: xpos_um.*--columns"):
        ck.read_frames(tmp_path)
    written(tmp_path, zeiss(), "frame_000.csv")  # damaged ones stay in the sequence of those that can be read
    assert len(ck.read_frames(tmp_path)) == 100


# ---- sequences -------------------------------------------------------------------------------------------------------

# Folders of frames: which files belong to a sequence, in which order, at which times; and one frame in memory.


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
        (["a", "b", "c"], "times of read_frames"),
    ]:
        with pytest.raises((HistoryError, ArgumentError), match=message):
            ck.read_frames(folder, times=times)


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
