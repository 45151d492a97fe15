"""Files of every version are read; the schemas that are documented are those of today."""

import importlib.util
import json
import tomllib
from pathlib import Path

import h5py
import jsonschema
import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, FitError, HistoryError, SolveError, printable, quoted
from creepkit.fem.mesh_files import read_mesh
from creepkit.files.hdf5_files import open_hdf5
from creepkit.files.reading import FileKind
from creepkit.language.law_codec import law_from_json
from creepkit.records import histories_in
from helpers.paths import ROOT

FORMATS = ROOT / "tests" / "data" / "formats"
VERSIONS = sorted(path.name for path in FORMATS.glob("[0-9]*") if path.is_dir())
SCHEMAS = ROOT / "docs" / "reference" / "schemas"


def schema(name: str) -> dict:
    return json.loads((SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8"))


def problems(name: str, data) -> list[str]:
    return [
        f"{error.json_path}: {error.message[:200]}"
        for error in jsonschema.Draft202012Validator(schema(name)).iter_errors(data)
    ]


@pytest.mark.parametrize("version", VERSIONS)
def test_files_of_every_version_are_read(version: str) -> None:
    folder = FORMATS / version
    histories = ck.read_histories(folder)
    assert len(histories) == 6
    assert {history.times.size for history in histories} == {6}
    assert {round(history.temperature, 2) for history in histories} == {1023.15, 1073.15, 1123.15}
    fit, source = ck.load(folder / "identification.json"), ck.load(folder / "valued_law.json")
    for one in (fit, source):
        assert one.law.name == "norton"
        assert one.values["n"] == pytest.approx(5.0, rel=1e-3)  # planted
    assert fit.values["A"] == pytest.approx(1e-18, rel=0.05)
    assert ck.load(folder / "ranking.json").best.values == fit.values
    found = json.loads((folder / "temperature_law.json").read_text(encoding="utf-8"))  # for other programs
    assert law_from_json(found["law"]).name.startswith("norton")
    data = ck.read_dataset(folder / "data_set.h5")
    assert (data.law.name, data.status.size) == ("norton", 16)  # rejected samples among them
    assert ck.surrogate(folder / "surrogate.safetensors").metadata.law.name == "norton"
    assessment = ck.load(folder / "rupture_assessment.json")
    assert {one.fit.method for one in assessment.ranked} == {"larson-miller"}
    assert len(assessment.tests) == 8


def test_every_kind_of_file_is_made_by_the_program_that_is_to_make_the_next_version(tmp_path) -> None:
    program(FORMATS / "make.py").make(tmp_path / "next")
    made = {path.name for path in (tmp_path / "next").glob("[!.]*")}
    assert made == {path.name for path in (FORMATS / ck.__version__).glob("[!.]*")}
    assert ck.load(tmp_path / "next" / "ranking.json").best.law.name == "norton"


def program(path: Path):
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_schemas_are_current() -> None:
    module = program(ROOT / "docs" / "schemas.py")
    current = {name: module.text_of(one) for name, one in module.schemas().items()}
    assert current == {path.name: path.read_text(encoding="utf-8") for path in SCHEMAS.iterdir()}, (
        "run 'python docs/schemas.py'"
    )
    assert module.keywords_text() == module.KEYWORDS.read_text(encoding="utf-8"), "run 'python docs/schemas.py'"


def test_written_documents_follow_the_schemas_and_those_of_a_later_version_are_refused(tmp_path) -> None:
    for name in ("identification", "ranking", "valued-law", "rupture-assessment"):
        path = FORMATS / ck.__version__ / f"{name.replace('-', '_')}.json"
        document = json.loads(path.read_text(encoding="utf-8"))
        assert problems(name, document) == []
        assert problems(name, {**document, "colour": 1})
        assert problems(name, {key: value for key, value in document.items() if key != "version"})
        if name == "identification":
            assert problems("law", document["law"]) == []
            assert problems("law", {**document["law"], "version": 1})
            (tmp_path / "fit.json").write_text(json.dumps({**document, "version": document["version"] + 1}))
            with pytest.raises(CreepkitError, match="version"):
                ck.load(tmp_path / "fit.json")


@pytest.mark.parametrize(
    "path", [*ROOT.glob("src/creepkit/example_data/*/study.toml"), *ROOT.glob("examples/studies/*/*.toml")], ids=str
)
def test_studies_follow_the_schema(path: Path) -> None:
    assert problems("study", tomllib.loads(path.read_text(encoding="utf-8"))) == []


# ---- hostile files ---------------------------------------------------------------------------------------------------

# Files that are made to harm: one sentence with the file's name for each, and nothing else opened.


NOTE = FileKind("a note", FitError, "give a note", maximum_bytes=100)


def read_hdf5(path):
    with open_hdf5(path, FileKind("a note", FitError, "give a note")) as file:
        return {name: file[name][()] for name in file}


def test_messages_are_printable_and_quotes_short():
    text = "a\x1b[31m\n\u202eb\x00\ud800"
    assert printable(text) == "a\\u001b[31m\\u000a\\u202eb\\u0000\\ud800"
    assert str(FitError(f"x: {text}")).isprintable()
    assert printable(printable(text)) == printable(text)
    assert len(quoted("9" * 20_000)) == 40
    long = str(FitError("file: " + "9" * 20_000 + "; write less"))
    assert len(long) <= 2000
    assert (long[:6], long[-12:]) == ("file: ", "; write less")


def test_nothing_outside_an_hdf5_file_is_read(tmp_path):
    outside, secret = tmp_path / "secret", b"a line of another file"
    outside.write_bytes(secret)
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.frombuffer(secret, dtype="u1")
    layout = h5py.VirtualLayout((len(secret),), dtype="u1")
    layout[:] = h5py.VirtualSource("other.h5", "x", (len(secret),))
    raw = {"dtype": "u1", "external": [(str(outside), 0, len(secret))]}
    for number, write in enumerate((
        lambda file: file.update(x=h5py.ExternalLink("other.h5", "/x")),
        lambda file: file.update(x=h5py.SoftLink("/y")),
        lambda file: file.create_dataset("x", (len(secret),), **raw),
        lambda file: file.create_virtual_dataset("x", layout),
    )):  # fmt: skip
        path = tmp_path / f"x{number}.h5"
        with h5py.File(path, "w") as file:
            write(file)
        with pytest.raises(FitError, match="h5: 'x' is a link to elsewhere, which is not followed"):
            read_hdf5(path)


def test_an_hdf5_file_is_bounded_as_it_unpacks(tmp_path, monkeypatch):
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (10**9,), dtype="f8", chunks=(10**6,), compression="gzip")
    with pytest.raises(FitError, match="its arrays have more than 100 MB unpacked; give a note"):
        read_hdf5(path)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(10_000), chunks=(10_000,), compression="gzip")
    assert read_hdf5(path)["x"].shape == (10_000,)


def test_a_table_of_a_mesh_is_one(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text('id,r_mm,z_mm\n"' + "1" * 200_000 + '",0,0\n', encoding="utf-8")
    with pytest.raises(SolveError, match="x.csv:2: no line of a CSV table"):
        read_mesh(path, path, path)


def test_meshes_are_bounded_before_memory_is_taken():
    corners = ((1.0, 0.0), (2.0, 1.0))
    for columns, layers in ((10**9, 1), (1, 10**9), (10**5, 10**5)):
        with pytest.raises(SolveError, match="at most 1000000 are made"):
            ck.Section.rectangle(*corners, columns, layers)
    with pytest.raises(SolveError, match="allowed are whole numbers from 1 on"):
        ck.Section.rectangle(*corners, float("inf"), 1)


class FailingReader:
    """A reader of a plugin that raises what it is given."""

    name, title = "failing", "fails"

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def accepts(self, path: Path) -> bool:
        return True

    def read(self, path: Path) -> list[ck.History]:
        raise self.error


def test_whatever_a_reader_raises_names_file_and_reader(tmp_path):
    path = tmp_path / "x.dat"
    path.write_bytes(b"x")
    errors = (OSError(5, "Input/output error"), ValueError("bad\n\x1b[31m value " + "9" * 9000), RecursionError())
    for error in (*errors, MemoryError(), UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"), SystemExit(3)):
        with pytest.raises(HistoryError) as caught:
            histories_in(FailingReader(error), path)
        message = str(caught.value)
        assert message.startswith(f"{path}: read() of reader 'failing' ")
        assert message.isprintable()
        assert len(message) < 1000
