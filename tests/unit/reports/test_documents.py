"""Results as JSON-able data."""

import importlib
import inspect
import json
import pkgutil

import numpy as np
import pytest

import creepkit
from creepkit.inverse.selection import rank
from creepkit.laws.norton import NORTON
from creepkit.records import Histories, History, constant_stress
from creepkit.registry import default_registry, kinds
from creepkit.reports.documents import ALSO, SHOWN, document
from creepkit.reports.terminal import print_json
from helpers.log_rate_predictor import known_scatter, measured


def test_every_class_that_has_a_document_has_what_it_says() -> None:
    names = [
        one.name
        for one in pkgutil.walk_packages(creepkit.__path__, "creepkit.")
        if not one.name.endswith(("_core", "__main__"))
    ]
    members = {
        one.__name__: one
        for module in map(importlib.import_module, names)
        for _, one in inspect.getmembers(module, inspect.isclass)
        if one.__module__ == module.__name__
    }
    assert {*SHOWN, *ALSO} - members.keys() == set()
    for name, shown in SHOWN.items():
        paths = [key.rpartition("=")[2].split(".")[0] for key in shown.split() if key != "*"]
        known = {*dir(members[name]), *getattr(members[name], "__annotations__", {})}
        known |= {one for base in members[name].__mro__ for one in getattr(base, "__annotations__", {})}
        assert {*paths} - known == set(), name


def test_documents_are_json_of_plain_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    test = History("A", np.array([0.0, 3600.0]), {"strain": np.array([0.0, np.nan])}, constant_stress(50.0), 900.0)
    values = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
    fit = known_scatter(NORTON, measured(NORTON, values, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)
    law, bulge = (
        default_registry().all(kind)[name] for kind, name in ((kinds.LAWS, "norton"), (kinds.SPECIMENS, "bulge"))
    )
    print_json({"tests": Histories([test]), "ranking": rank([fit]), "known": [law, bulge]}, files=["a.json"])
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert told["files"] == ["a.json"]
    assert told["tests"][0]["loading"] == {"quantity": "stress", "program": {"times": [0.0], "values": [50.0]}}
    assert told["tests"][0]["outputs"]["strain"] == {"unit": "", "first": 0.0, "last": None}
    assert told["ranking"]["laws"][0]["parameters"]["n"]["value"] == fit.values["n"]
    assert told["known"][0]["terms"] == {"power law": "A*stress**n"}
    assert told["known"][1]["units"]["amplitude"] == "mm"
    assert document([np.inf, np.float64("nan"), np.int64(2)]) == [None, None, 2]
