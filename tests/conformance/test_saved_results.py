"""Saved results: each comes back as it was, and a damaged file of any of them is refused in one sentence."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.inverse.adequacy import Adequacy, LargestDeviation, OutputAdequacy, Remedy
from creepkit.inverse.defect_correction import NumericalError
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.nuisance_parameters import Perturbation
from helpers.paths import ROOT

FORMATS = ROOT / "tests" / "data" / "formats" / ck.__version__
KINDS = ("identification", "ranking", "rupture_assessment", "valued_law")
WRONG = (None, "text", -1e300, float("nan"), True, [], {}, [["text"]], {"text": 1})
CHANGES = 250
"""Of each document, at drawn places."""


def whole_identification() -> ck.Identification:
    """An identification in which every part has numbers of its own."""
    tests = ck.read_histories(FORMATS / "1073K_*.csv")
    settings = {"weights": "likelihood", "nuisances": [ck.Nuisance("offset"), ck.Nuisance("rate", sd=0.2)]}
    fit = ck.identify("norton", [h.replace(standard_deviation={"strain": 1e-6}) for h in tests], starts=1, **settings)
    adequacy = Adequacy(
        (OutputAdequacy("strain", 80, 2e-5, "estimated", 3.25, 1e-4, 3e-5),), 3.25, 78.0, 1e-4,
        0.4, LargestDeviation("bar 1", "strain", 5400.0, -4e-5, 2.0),
        (Remedy("thickness", "an error of 0.01 mm in the thickness", is_usual=False), Remedy("offset", "an offset")),
        critical_chi_square=1.5, smallest_p_value=5e-5,
    )  # fmt: skip
    effects = (
        Perturbation("thickness", 0.01, "mm", 0.08),
        Perturbation("temperature drift", 5.0, "K over a test", 0.05),
        Perturbation("temperature", 3.0, "K", -0.14, common=True, tests=2, per_kelvin=0.05, assumed=True),
    )
    return replace(
        fit,
        adequacy=adequacy,
        unmodelled=effects,
        numerical_error=NumericalError("bulge", "bulge on a finer mesh", {"amplitude": 5e-4}, 0.33, 0.2, ("D4",)),
        noise_model=NoiseModel({"strain": OutputNoise(2e-5, 0.01, 3e-5, 0.02, 0.3, 1.5e-5)}, 0.1, 2.5, 1.7),
        samples=np.random.default_rng(0).normal(size=(40, 2)),
        problem=None,
        linearised=None,
    )


@pytest.fixture(scope="module")
def documents(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """{kind: file}, with files beside those that name others."""
    folder = tmp_path_factory.mktemp("saved")
    for path in FORMATS.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "identification.json").unlink()
    with ck.overwriting():  # with what later versions added, as it is by default
        for name in ("ranking.json", "rupture_assessment.json"):
            ck.load(folder / name).save(folder / name)
    whole_identification().save(folder / "identification.json")
    return {kind: folder / f"{kind}.json" for kind in KINDS}


def test_a_result_comes_back_as_it_was(documents: dict[str, Path], tmp_path: Path) -> None:
    wrong = []
    for kind in KINDS[:-1]:
        loaded = ck.load(documents[kind])
        again = loaded.save(tmp_path / documents[kind].name)
        if json.loads(again.read_text()) != json.loads(documents[kind].read_text()):
            wrong.append(f"{kind}: the file differs")
        if str(ck.load(again)) != str(loaded):
            wrong.append(f"{kind}: the text differs")
    assert wrong == []


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The keys that lead to every value of a document."""
    if path:
        yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*path, key))


def damaged(document: Any, rng: random.Random) -> tuple[str, str]:
    """A document in which one value is wrong, missing, or beside one that nobody knows, and what was done."""
    changed, path = copy.deepcopy(document), rng.choice(list(places(document)))
    owner = changed
    for key in path[:-1]:
        owner = owner[key]
    kind = rng.choice(("wrong", "missing", "unknown"))
    if kind == "wrong":
        owner[path[-1]] = rng.choice(WRONG)
    elif kind == "missing":
        del owner[path[-1]]
    elif isinstance(owner, dict):
        owner["no such key"] = owner[path[-1]]
    return json.dumps(changed), f"{kind} at {'.'.join(map(str, path))}"


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_an_answer_or_one_sentence(kind: str, documents: dict[str, Path], tmp_path: Path) -> None:
    rng, original = random.Random(38), documents[kind].read_text(encoding="utf-8")
    document, wrong = json.loads(original), []
    texts = [damaged(document, rng) for _ in range(CHANGES)]
    texts += [(original[: int(share * len(original))], f"cut at {share}") for share in (0.0, 0.1, 0.5, 0.99)]
    refused = 0
    for path in documents[kind].parent.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    target = tmp_path / documents[kind].name
    for text, what in texts:
        target.write_text(text, encoding="utf-8")
        try:
            ck.load(target)
        except CreepkitError as error:
            refused += 1
            if "\n" in str(error) or target.name not in str(error):
                wrong.append(f"{what}: {error!r}")
        except Exception as error:
            wrong.append(f"{what}: {type(error).__name__}: {error}")
        else:
            if what.startswith("cut"):
                wrong.append(f"{what}: was read")
    assert wrong == []
    assert refused > CHANGES / 3


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("adequacy", "outputs", 0, "noise_source"), "splendid", "adequacy.outputs.0.noise_source"),
        (("adequacy", "outputs", 0, "noise"), 0.0, "adequacy.outputs.0.noise"),
        (("numerical_error", "noises"), -1.0, "numerical_error.noises"),
        (("unmodelled", 1, "size"), -0.5, "unmodelled.1.size"),
        (("noise_model", "discrepancy_length"), 0.0, "noise_model.discrepancy_length"),
        (("samples",), [[1.0]], "samples"),
        (("covariance",), [[1.0]], "covariance"),
        (("version",), 1, "identify again"),
    ],
)
def test_a_part_that_cannot_be_is_named(path, value, words, documents, tmp_path) -> None:
    document = json.loads(documents["identification"].read_text(encoding="utf-8"))
    owner = document
    for key in path[:-1]:
        owner = owner[key]
    owner[path[-1]] = value
    (tmp_path / "fit.json").write_text(json.dumps(document))
    with pytest.raises(CreepkitError, match=words.replace(".", r"\.")):
        ck.load(tmp_path / "fit.json")
