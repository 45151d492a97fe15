"""Samples of what creepkit itself writes and reads again, of study files and of meshes."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.api.saved import load
from creepkit.errors import SurrogateError
from creepkit.fem.mesh_files import read_mesh
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.reading import FileKind
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.reports.attachments import embed, read_attachments
from creepkit.reports.contents import Attachment
from creepkit.studies.study_file import read_study_file
from helpers.planted_datasets import bars

STUDY = """[study]
title = "Planted creep curves"

[data]
files = ["*.csv"]

[identification]
laws = ["norton", "strain-hardening"]
weights = "equal"

[[forecast]]
name = "longer test"
load = { stress_MPa = 50 }
temperature_C = 800
end_h = 2000

[[export]]
target = "latex"
"""
NODES = "id,r_mm,z_mm\n1,0.0,0.0\n2,1.5,0.0\n3,1.5,1.25\n4,0.0,1.25\n5,3.0,0.0\n6,3.0,1.25\n"
ELEMENTS = "id,n1,n2,n3,n4\n1,1,2,3,4\n2,2,5,6,3\n"
SETS = '{"encastre": [5, 6],\n "top": [3, 4, 6],\n "pressure_face_S1": [1, 2]}\n'
WEIGHTS = DocumentFormat("creepkit-sample", 1, FileKind("a sample", SurrogateError, "make it again"), "make it again")


def accepted(first: Any, second: Any) -> str:
    """Of documents in which what was changed makes any reading wrong."""
    return "accepted"


def document(
    name: str, file: str, content: bytes, read: Callable[[Path], Any], keys: str = "", files: Mapping[str, bytes] = {}
) -> ReaderSample:
    """A sample of keys in quotes; keys : those that are written with a letter missing, and twice."""
    text = content.decode("utf-8", "replace")
    lines = [line + "\n" for line in text.split("\n") if re.match(r'\s*"[^"]*": .*,\s*$', line)]
    misspelt = tuple((key, key[:2] + key[3:]) for key in keys.split())
    return ReaderSample(name, {**files, file: content}, file, read, accepted, misspelt=misspelt, repeated=tuple(lines))


def written(write: Callable[[Path], object], name: str) -> bytes:
    """What is written to a file."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def read_sets(path: Path) -> Any:
    """The mesh of three files in a folder."""
    return read_mesh(path.parent / "nodes.csv", path.parent / "elements.csv", path.parent / "sets.json")


def law_text() -> str:
    """An exported law."""
    law = ck.law("norton")
    return ck.export(ck.law_with_values(law, {"A": 1.25e-15, "n": 4.25}), "json")


def samples() -> Iterator[ReaderSample]:
    """The samples of documents, data sets, weights, studies, reports and meshes."""
    yield document("law", "x.json", law_text().encode(), load, '"format" "version"')
    yield document("data set", "x.h5", written(lambda path: ck.write_dataset(bars(4), path), "x.h5"), ck.read_dataset)
    arrays = {"w": np.linspace(0.0, 1.0, 12).reshape(3, 4), "b": np.arange(3.0)}
    weights = written(lambda path: write_safetensors(path, arrays, {"domain": {"n": [3, 6]}}, WEIGHTS), "x.safetensors")
    yield document("weights", "x.safetensors", weights, lambda path: read_safetensors(path, WEIGHTS))
    study = document(
        "study", "study.toml", STUDY.encode(), read_study_file, "title files laws weights load end_h target"
    )
    keys = ('title = "Planted creep curves"\n', 'files = ["*.csv"]\n', 'weights = "equal"\n', "end_h = 2000\n")
    yield ReaderSample(**{**study.__dict__, "repeated": keys})
    files = [Attachment("study.toml", STUDY.encode()), Attachment("data/a.csv", NODES.encode())]
    report = f"<!doctype html><html><body>{embed(files)}</body></html>".encode()
    yield document("report", "x.html", report, read_attachments)
    mesh = {"nodes.csv": NODES.encode(), "elements.csv": ELEMENTS.encode(), "sets.json": SETS.encode()}
    for file, keys_of in (("nodes.csv", "r_mm z_mm"), ("elements.csv", "n1 n4"), ("sets.json", '"top"')):
        others = {name: content for name, content in mesh.items() if name != file}
        sample = document(f"mesh {file}", file, mesh[file], read_sets, keys_of, others)
        yield ReaderSample(**{**sample.__dict__, "reader": "mesh"})
