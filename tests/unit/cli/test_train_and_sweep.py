"""`creepkit surrogate train` and `sweep`: files, tables, pictures, and one line for what cannot be."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.dataset.storage import write_dataset
from creepkit.surrogates import training as sweeping
from creepkit.surrogates.evaluation import evaluate, training_split
from creepkit.surrogates.parameter_gru import NetworkSizes
from helpers.command_line import answers, creepkit
from helpers.planted_datasets import bars
from helpers.virtual_camera import Dimple, VirtualCamera

PNG = b"\x89PNG"


pytestmark = pytest.mark.usefixtures("one_torch_thread")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(bars(60), tmp_path_factory.mktemp("set") / "bars.h5")


def test_train_writes_a_surrogate_and_its_pictures(file: Path, tmp_path: Path) -> None:
    to = tmp_path / "m.safetensors"
    shown = creepkit(f"surrogate train {file} --to {to} --hidden 6 --layers 1 --epochs 3 --target log")
    assert shown.exit_code == 0, shown.output
    assert "validation loss (Eq. 4, outputs together)" in shown.stdout
    assert "48 samples for training, 12 for validation" in shown.stdout
    pictures = sorted(p.name for p in tmp_path.glob("*.png"))
    assert pictures == ["m-curves.png", "m-parity.png"]
    assert all((tmp_path / name).read_bytes().startswith(PNG) for name in pictures)
    model = ck.surrogate(tmp_path / "m.safetensors")
    assert model.recipe == ck.ParameterGru(6, 1, target="log", training=ck.Training(epochs=3))


def test_a_sweep_is_a_table_and_is_not_redone(file: Path, tmp_path: Path) -> None:
    sizes = "--layers 1 --hidden 4,6 --samples 20,48"
    words = f"surrogate sweep {file} --to {tmp_path} {sizes} --epochs 2 --json"
    first = creepkit(words)
    assert first.exit_code == 0, first.output
    found = json.loads(first.stdout)["trainings"]
    assert {(e["hidden"], e["layers"], e["samples"]) for e in found} == {(h, 1, n) for h in (4, 6) for n in (20, 48)}
    gru = next(e for e in found if e["hidden"] == 4)
    # 3 gates of (4 + 4 + 2) x 4 numbers for log10 A, n, off and the load, and a head of 4 + 1
    assert gru["weight_count"] == 3 * 4 * (4 + 4 + 2) + 5
    stamps = {p: p.stat().st_mtime_ns for p in tmp_path.glob("*.safetensors")}
    assert len(stamps) == 4
    (tmp_path / "gru-4x1-20.safetensors").unlink()
    again = creepkit(words)
    assert json.loads(again.stdout)["trainings"] == found
    assert sum(p.stat().st_mtime_ns == stamp for p, stamp in stamps.items()) == 3


def test_a_sweep_judges_every_number_of_samples_by_the_same_rows(tmp_path: Path) -> None:
    data, recipe = bars(60), ck.ParameterGru(4, 1, training=ck.Training(epochs=2))
    models = sweeping.size_study(data, recipe, NetworkSizes(samples=(10, 20, 48)), to=tmp_path)
    judged = [evaluate(ck.surrogate(tmp_path / file), data) for file in models]
    for samples, model, one in zip((10, 20, 48), models.values(), judged, strict=True):
        assert one.comparison.index.tolist() == judged[0].comparison.index.tolist()
        assert model.metadata.metrics["loss"] == pytest.approx(one.metrics["loss"], rel=1e-6)  # by torch, by NumPy
        learnt = training_split(len(data), ck.Training(samples=samples), 0)[0].tolist()
        assert (len(learnt), set(learnt) & set(one.comparison.index)) == (samples, set())
    assert len({one.metrics["loss"] for one in judged}) == 3


def test_what_cannot_be_is_one_line(file: Path, tmp_path: Path) -> None:
    train, sweep, to = "surrogate train", "surrogate sweep", tmp_path / "m.safetensors"
    missing = "there are not 900 samples to learn from: the data set has 60 accepted ones, of which 12"
    table = [
        (f"{train} {file} --to {to} --target sqrt", "--target is 'sqrt'; allowed is 'value' or 'log'"),
        (f"{train} {to} --to {to}", "no such"),
        (f"{sweep} {file} --to {to} --hidden '64;128'", "--hidden 64;128 is not known; write INTEGER,..."),
        (f"{sweep} {file} --to {to} --samples 900", missing),
    ]
    assert answers(table) == []


# ---- predict ---------------------------------------------------------------------------------------------------------

# creepkit predict: measured and planned tests on the command line.


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("predict")
    data = ck.example_data("planted creep curves")
    result = creepkit(f"identify {data} --law strain-hardening --law norton --starts 1 --to {folder / 'fits'}")
    assert result.exit_code == 0, result.output
    return folder / "fits", data


def test_a_planned_bar_is_forecast_as_in_python(saved):
    folder, _ = saved
    fit = folder / "strain-hardening-arrhenius.json"
    result = creepkit(f"predict {fit} --stress 75 --temperature-c 820 --end-h 200 --json")
    assert result.exit_code == 0, result.output
    (test,) = json.loads(result.stdout)["tests"]
    fit = ck.load(folder / "strain-hardening-arrhenius.json")
    plan = ck.History("plan", [72e4], {}, ck.constant_stress(75.0, "load"), 1093.15)
    value = fit.forecast(plan).tests[0].outputs["strain"].value[-1]
    assert test["outputs"]["strain"]["value"][-1] == pytest.approx(value, rel=1e-4)
    (time,) = test["times"]
    assert time["low"] < time["value"] < time["high"]


def test_targets_of_a_dimple(saved):
    folder, _ = saved
    words = "--pressure 8 --end-h 0.5 --temperature-c 850 --modulus-gpa 150 --target amplitude=0.05,0.06"
    result = creepkit(f"predict {folder} {words}")  # the ranking in a folder
    assert result.exit_code == 0, result.output
    empty = creepkit(f"predict {folder.parent} {words}")
    assert "name the identification in it (found: none; run" in empty.output
    assert "time to amplitude 0.05 mm " in result.stdout
    assert "time to amplitude 0.06 mm:" in result.stdout


WRONG = {
    "": "there is no test to forecast",
    "--stress 80": "--stress describes a planned test, which needs an end",
    "--stress 80 --end-h 100": "the fitted tests were made at 750 to 850 °C: give --temperature-c",
    "--pressure 8 --end-h 1 --temperature-c 800": "'bulge' needs a modulus",
    "--stress 80 --end-h 1 --temperature-c 800 --target strain=x": "write NAME=NUMBER,..., such as strain=0.01,0.05",
    "--stress 80 --end-h 1 --temperature-c 800 --level 2": "--level is 2.0; allowed is a number from 0.5 to 0.999999",
    "--stress 80 --end-h -1 --temperature-c 800": "--end-h is -1.0; allowed is a number from 1e-09 to 1000000000",
    "--stress 80 --end-h 1 --temperature-c 800 --plot x.txt": "is no format of pictures",
}


def test_what_is_wrong_is_said_in_one_line(saved):
    fit = saved[0] / "strain-hardening-arrhenius.json"
    assert answers((f"predict {fit} {words}", said) for words, said in WRONG.items()) == []


# ---- extract command -------------------------------------------------------------------------------------------------

# `creepkit extract`: from exports of a camera to histories, and what it refuses, in one sentence.


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


REFUSED = {
    "--to x": "a history needs what was imposed: give --record FILE, or --load-mpa and --temperature-c",
    "--window 5 --rings 0,2": "window and rings were given, of which one is enough",
    "--rings '0;2'": "--rings 0;2 is not known; write NUMBER,...",
    "--rest 5": "rest is 5: write the first and the last frame at rest, counted from 0, as in 0-39",
    "--center 5": "a center has two numbers, x and y in mm, as in 12.5,-3",
    "--interval-s -1": "--interval-s is -1.0; allowed is a number above 0 up to",
    "--specimen uniaxial": "specimen 'uniaxial' does not say how cameras see its surface",
    "--plot sheet.txt": "'.txt' is no format of pictures",
    "--lag 5": "--lag says something of a record; give --record FILE",
    "--names D1,D1": "names D1, D1: stand there twice",
    "": "their files hold no times; give times, a file with a row for each of the 20 frames",
}


def test_what_is_refused(exports):
    assert answers((f"extract {exports} {words}", said) for words, said in REFUSED.items()) == []
