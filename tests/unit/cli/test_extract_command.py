"""`creepkit extract`: from exports of a camera to histories, and what it refuses, in one sentence."""

import shutil

import numpy as np
import pytest

import creepkit as ck
from helpers.command_line import answers, creepkit
from helpers.virtual_camera import Dimple, VirtualCamera


@pytest.fixture(scope="module")
def exports(tmp_path_factory):
    """Twenty frames in the format of VIC-3D, without times."""
    folder = tmp_path_factory.mktemp("frames")
    radii = np.linspace(0.0, 10.0, 21)
    growth = np.r_[np.zeros(10), np.linspace(0.1, 0.3, 10)]
    rise = growth[:, None] * np.where(radii < 7.5, (1 - (np.minimum(radii, 7.5) / 7.5) ** 2) ** 2, 0.0)
    dimple = Dimple(np.arange(20.0), radii, rise, 0.0 * rise)
    frames = VirtualCamera(seed=9, points=1700).frames(dimple)
    for k in range(20):
        frame = frames[k]
        sigma = np.where(frame.valid, 0.02, -1.0)
        rows = np.c_[frame.points, frame.displacements, sigma]
        head = '"X [mm]","Y [mm]","Z [mm]","U [mm]","V [mm]","W [mm]","sigma [pixel]"'
        np.savetxt(folder / f"frame_{k:03d}.csv", rows, "%.7f", ",", header=head, comments="")
    return folder


def run(*words):
    return creepkit("extract", *words)


def test_from_exports_to_a_history_and_a_picture(exports, tmp_path):
    result = run(
        exports, "--interval-s", 60, "--subset", 1.2, "--load-mpa", 8, "--temperature-c", 776.85, "--names", "E5",
        "--rest", "0-9", "--to", tmp_path / "out", "--plot", tmp_path / "sheet.png",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "20 of 20 frames used, field 0-7.5 mm" in result.stdout
    assert (tmp_path / "sheet.png").stat().st_size > 50_000
    (history,) = ck.read_histories(tmp_path / "out" / "E5.csv")
    assert history.operator == "field 0-7.5 mm"
    assert history.mean_temperature == pytest.approx(1050.0)
    np.testing.assert_allclose(np.diff(history.times), 60.0)
    assert history.outputs["amplitude"][-1] == pytest.approx(0.3, rel=0.02)


def test_other_frames_do_not_replace_what_was_extracted(exports, tmp_path):
    """Names of test pieces, such as D1, are the same for many recordings."""
    others = tmp_path / "others"
    shutil.copytree(exports, others)
    (others / "frame_019.csv").unlink()
    words = ("--interval-s", 60, "--load-mpa", 8, "--temperature-c", 776.85, "--rest", "0-9", "--to", tmp_path / "out")
    for _ in range(2):
        assert run(exports, *words).exit_code == 0
    (path,) = (tmp_path / "out").glob("*.csv")
    before = path.read_bytes()
    refused = run(others, *words)
    assert refused.exit_code == 1
    assert "it is there, and creepkit made it from ../" in refused.stderr
    assert path.read_bytes() == before
    assert run(others, *words, "--force").exit_code == 0
    assert path.read_bytes() != before


def test_rings_about_a_given_centre(exports):
    result = run(exports, "--interval-s", 60, "--center", "12.4,-7.7", "--rings", "0,2,4", "--rest", "0-9")
    assert result.exit_code == 0, result.output
    assert "rings 0, 2, 4 mm" in result.stdout
    assert "as given" in result.stdout


REFUSED = {
    "--to x": "a history needs what was imposed: give --record FILE, or --load-mpa and --temperature-c",
    "--window 5 --rings 0,2": "window and rings were given, of which one is enough",
    "--rings '0;2'": "--rings 0;2 is not known; write NUMBER,...",
    "--rest 5": "rest is 5: write the first and the last frame at rest, counted from 0, as in 0-39",
    "--center 5": "a center has two numbers, x and y in mm, as in 12.5,-3",
    "--interval-s -1": "--interval-s is -1.0; allowed are numbers above 0 up to",
    "--specimen uniaxial": "specimen 'uniaxial' does not say how cameras see its surface",
    "--plot sheet.txt": "'.txt' is no format of pictures",
    "--lag 5": "--lag says something of a record; give --record FILE",
    "--names D1,D1": "names D1, D1: stand there twice",
    "": "their files hold no times; give times, a file with a row for each of the 20 frames",
}


def test_what_is_refused(exports):
    assert answers((f"extract {exports} {words}", said) for words, said in REFUSED.items()) == []
