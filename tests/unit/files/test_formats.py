"""Files of every version are read; the schemas that are documented are those of today."""

import importlib.util
import json
import tomllib
from pathlib import Path

import h5py
import jsonschema
import pytest

import creepkit as ck
from creepkit.cli.shared import read_law_file
from creepkit.language.law_codec import law_from_json
from creepkit.studies.lock import read_lock
from helpers.paths import ROOT

FORMATS = ROOT / "tests" / "data" / "formats"
VERSIONS = sorted(path.name for path in FORMATS.iterdir() if path.is_dir())
SCHEMAS = ROOT / "docs" / "reference" / "schemas"


def schema(name: str) -> dict:
    return json.loads((SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8"))


def problems(name: str, data) -> list[str]:
    return [
        f"{error.json_path}: {error.message[:200]}"
        for error in jsonschema.Draft202012Validator(schema(name)).iter_errors(data)
    ]


def test_there_are_files_of_this_version() -> None:
    assert ck.__version__ in VERSIONS


@pytest.mark.parametrize("version", VERSIONS)
def test_tests_are_read(version) -> None:
    histories = ck.read_histories(FORMATS / version)
    assert len(histories) == 6
    assert {history.times.size for history in histories} == {6}
    assert {round(history.temperature, 2) for history in histories} == {1023.15, 1073.15, 1123.15}


@pytest.mark.parametrize("version", VERSIONS)
def test_documents_are_read(version) -> None:
    fit = ck.load(FORMATS / version / "identification.json")
    assert fit.law.name == "norton"
    assert fit.values["n"] == pytest.approx(5.0, rel=1e-3)  # planted
    assert fit.values["A"] == pytest.approx(1e-18, rel=0.05)
    assert ck.load_ranking(FORMATS / version / "ranking.json").rate(stress=80.0)[0] > 0
    found = json.loads((FORMATS / version / "temperature_law.json").read_text(encoding="utf-8"))  # for other programs
    assert law_from_json(found["law"]).name.startswith("norton")


@pytest.mark.parametrize("version", VERSIONS)
def test_laws_with_values_are_exported_again(version) -> None:
    source = read_law_file(FORMATS / version / "valued_law.json")
    assert source.law.name == "norton"
    assert source.values["n"] == pytest.approx(5.0, rel=1e-3)


def test_a_document_of_a_later_version_is_refused(tmp_path) -> None:
    document = json.loads((FORMATS / ck.__version__ / "identification.json").read_text(encoding="utf-8"))
    (tmp_path / "fit.json").write_text(json.dumps({**document, "version": document["version"] + 1}))
    with pytest.raises(ck.errors.CreepkitError, match="version"):
        ck.load(tmp_path / "fit.json")


@pytest.mark.parametrize("version", VERSIONS)
def test_plates_and_locks_are_of_a_version_that_is_read(version) -> None:
    with h5py.File(FORMATS / version / "plate.h5") as file:
        assert (file.attrs["format"], file["alloys/0000"].attrs["law"]) == ("creepkit-plate", "norton")
    lock = read_lock(FORMATS / version / "study.lock")
    assert {stage.state for stage in lock.stages.values()} == {"done"}


def test_every_kind_of_file_is_made_by_the_program_that_is_to_make_the_next_version(tmp_path) -> None:
    program(FORMATS / "make.py").make(tmp_path / "next")
    made = {path.name for path in (tmp_path / "next").glob("[!.]*")}
    assert made == {path.name for path in (FORMATS / ck.__version__).glob("[!.]*")}
    assert ck.load_ranking(tmp_path / "next" / "ranking.json").fits[0].law.name == "norton"


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


def test_written_documents_follow_the_schemas() -> None:
    document = json.loads((FORMATS / ck.__version__ / "identification.json").read_text(encoding="utf-8"))
    assert problems("identification", document) == []
    assert problems("law", document["law"]) == []
    assert problems("identification", {**document, "colour": 1})
    assert problems("law", {**document["law"], "version": 1})


@pytest.mark.parametrize("name", ["ranking", "valued-law", "rupture-assessment"])
def test_documents_follow_the_schemas_of_their_kind(name: str) -> None:
    path = FORMATS / ck.__version__ / f"{name.replace('-', '_')}.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    assert problems(name, document) == []
    assert problems(name, {**document, "colour": 1})
    assert problems(name, {key: value for key, value in document.items() if key != "version"})


@pytest.mark.parametrize("version", VERSIONS)
def test_data_sets_surrogates_and_rupture_assessments_are_read(version: str) -> None:
    data = ck.read_dataset(FORMATS / version / "data_set.h5")
    assert (data.law.name, data.status.size) == ("norton", 16)  # rejected samples among them
    surrogate = ck.surrogate(FORMATS / version / "surrogate.safetensors")
    assert surrogate.metadata.law.name == "norton"
    assessment = ck.load_rupture_assessment(FORMATS / version / "rupture_assessment.json")
    assert {one.fit.method for one in assessment.ranked} == {"larson-miller"}
    assert len(assessment.tests) == 8


@pytest.mark.parametrize(
    "path", [*ROOT.glob("src/creepkit/example_data/*/study.toml"), *ROOT.glob("examples/studies/*/*.toml")], ids=str
)
def test_studies_follow_the_schema(path: Path) -> None:
    assert problems("study", tomllib.loads(path.read_text(encoding="utf-8"))) == []
