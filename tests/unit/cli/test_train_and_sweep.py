"""`creepkit surrogate train` and `sweep`: files, tables, pictures, and one line for what cannot be."""

import json
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.dataset.storage import write_dataset
from creepkit.reports.surrogate import size_study_rows
from creepkit.surrogates import training as sweeping
from creepkit.surrogates.evaluation import evaluate, training_split
from creepkit.surrogates.parameter_gru import NetworkSizes
from helpers.command_line import answers, creepkit
from helpers.planted_datasets import bars

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


def test_train_tells_its_errors_as_json(file: Path, tmp_path: Path) -> None:
    words = f"surrogate train {file} --to {tmp_path / 'm.safetensors'} --hidden 4 --layers 1 --epochs 1 --json"
    told = json.loads(creepkit(words).stdout)
    assert set(told["metrics"]["outputs"]["strain"]) >= {"rse", "mse", "mae", "r2"}
    assert len(told["pictures"]) == 2


def test_a_sweep_is_a_table_and_is_not_redone(file: Path, tmp_path: Path) -> None:
    sizes = "--layers 1 --hidden 4,6 --cells gru,lstm --samples 20,48"
    words = f"surrogate sweep {file} --to {tmp_path} {sizes} --epochs 2 --json"
    first = creepkit(words)
    assert first.exit_code == 0, first.output
    found = json.loads(first.stdout)["trainings"]
    trained = {(e["cell"], e["hidden"], e["layers"], e["samples"]) for e in found}
    assert trained == {(c, h, 1, n) for c in ("gru", "lstm") for h in (4, 6) for n in (20, 48)}
    gru = next(e for e in found if (e["cell"], e["hidden"]) == ("gru", 4))
    # 3 gates of (4 + 4 + 2) x 4 numbers for log10 A, n, off and the load, and a head of 4 + 1
    assert gru["weight_count"] == 3 * 4 * (4 + 4 + 2) + 5
    stamps = {p: p.stat().st_mtime_ns for p in tmp_path.glob("*.safetensors")}
    assert len(stamps) == 8
    (tmp_path / "gru-4x1-20.safetensors").unlink()
    again = creepkit(words)
    assert json.loads(again.stdout)["trainings"] == found
    assert sum(p.stat().st_mtime_ns == stamp for p, stamp in stamps.items()) == 7


def test_a_sweep_judges_every_number_of_samples_by_the_same_rows(tmp_path: Path) -> None:
    data, recipe = bars(60), ck.ParameterGru(4, 1, training=ck.Training(epochs=2))
    entries = sweeping.size_study(data, recipe, NetworkSizes(samples=(10, 20, 48)), to=tmp_path)
    judged = [evaluate(ck.surrogate(tmp_path / e.file), data) for e in entries]
    for entry, one in zip(entries, judged, strict=True):
        assert one.comparison.index.tolist() == judged[0].comparison.index.tolist()
        assert entry.loss == one.metrics["loss"]
        learnt = training_split(len(data), ck.Training(samples=entry.samples), 0)[0].tolist()
        assert (len(learnt), set(learnt) & set(one.comparison.index)) == (entry.samples, set())
    assert len({e.loss for e in entries}) == 3


def test_the_best_of_a_sweep_stands_on_top(file: Path, tmp_path: Path) -> None:
    recipe = ck.ParameterGru(4, 1, training=ck.Training(epochs=2))
    entries = sweeping.size_study(bars(60), recipe, NetworkSizes(hidden=(2, 8)), to=tmp_path)
    _, rows = size_study_rows(entries)
    losses = [float(row[5]) for row in rows]
    assert losses == sorted(losses)


def test_what_cannot_be_is_one_line(file: Path, tmp_path: Path) -> None:
    train, sweep, to = "surrogate train", "surrogate sweep", tmp_path / "m.safetensors"
    missing = "there are not 900 samples to learn from: the data set has 60 accepted ones, of which 12"
    table = [
        (f"{train} {file} --to {to} --cell rnn", "--cell rnn is not known; write gru|lstm"),
        (f"{train} {to} --to {to}", "no such"),
        (f"{sweep} {file} --to {to} --hidden '64;128'", "--hidden 64;128 is not known; write INTEGER,..."),
        (f"{sweep} {file} --to {to} --samples 900", missing),
    ]
    assert answers(table) == []
