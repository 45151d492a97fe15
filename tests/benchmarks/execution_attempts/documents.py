"""Every text in the files that creepkit reads back, replaced by texts that would be code elsewhere; then it is used."""

from __future__ import annotations

import copy
import json
import os
import re
import shutil
import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import creepkit as ck
from creepkit.cli.law_sources import read_law_file
from creepkit.errors import CreepkitError
from execution_attempts import texts
from execution_attempts.canaries import Attempt, Control, Found, left, planted
from execution_attempts.pickles import pickle_that_runs

SECTION = "Texts of files that are read back"
CHOSEN = (
    "end of a long string, then Python", "formats", "templates", "YAML", "commands of a shell", "a script", "controls",
    "directions", "an escape sequence",
)  # fmt: skip
MORE = {
    "a name of a function": "os:system",
    "a module": "planted_module",
    "a module with a function": "planted_module:made",
    "a path": "../../../../etc/passwd",
    "an absolute path": "/etc/passwd",
    "an address": "http://203.0.113.1/x",
    "a pickle": "gASVBQAAAAAAAAA=",
    "a long text": "x" * 20000,
    "nothing": "",
}
"""Beside texts.PAYLOADS: what a reader might import, open or ask the network for."""

_STEERING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")

Place = tuple[Any, ...]


def text_leaves(value: Any, place: Place = ()) -> Iterator[Place]:
    """Where texts are in a document."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        if isinstance(inner, str):
            yield (*place, key)
        yield from text_leaves(inner, (*place, key))


def replaced(document: Any, places: Sequence[Place], text: str) -> Any:
    """A copy of a document with a text at some places."""
    changed = copy.deepcopy(document)
    for place in places:
        inner = changed
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = text
    return changed


# ---- the kinds of files --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    document : its texts as a tree. write(path, document) : a file with other texts. use(path) : reads it, works with
    what it holds and returns all that a terminal would show.
    """

    suffix: str
    document: Any
    write: Callable[[Path, Any], object]
    use: Callable[[Path], str]


def _write_json(path: Path, document: Any) -> None:
    path.write_text(json.dumps(document), encoding="utf-8")


def _use_result(path: Path) -> str:
    found = read_law_file(path)
    for target in ("python", "c", "latex"):
        ck.export(found, target)
    return str(found)


def _use_network(path: Path) -> str:
    from creepkit.surrogates.loading import load_surrogate

    return str(load_surrogate(path))


def _use_samples(path: Path) -> str:
    return str(ck.read_dataset(path))


def fitted() -> Any:
    """The ranking of a fit of two curves."""
    import numpy as np

    times, rng = np.linspace(0.0, 36000.0, 12), np.random.default_rng(3)
    histories = []
    for stress in (60.0, 110.0):
        run = ck.simulate(
            "norton", "uniaxial", {"A": 3e-16, "n": 4.2}, loading=ck.constant_stress(stress), times=times
        )  # fmt: skip
        strain = run.outputs["strain"] + rng.normal(0.0, 2e-6, len(times))
        histories.append(run.replace(outputs={"strain": strain}, name=f"A{stress:g}", alloy="A"))
    return ck.select(["norton"], histories, starts=1, sums=False)


def _attributes(path: Path) -> dict[str, Any]:
    """The texts of a data set's header; those that are JSON as trees."""
    import h5py

    with h5py.File(path) as file:
        found: dict[str, Any] = {}
        for name, value in file.attrs.items():
            text = value if isinstance(value, str) else [str(one) for one in value] if value.dtype == object else None
            if isinstance(text, str) and text[:1] in "{[":
                text = json.loads(text)
            found |= {} if text is None else {name: text}
        return found


def _write_attributes(original: Path, trees: dict[str, Any]) -> Callable[[Path, Any], object]:
    def write(path: Path, document: Any) -> None:
        import h5py

        shutil.copy(original, path)
        with h5py.File(path, "r+") as file:
            for name, value in document.items():
                if value != trees[name]:
                    is_tree = isinstance(value, dict) or isinstance(trees[name], dict)
                    file.attrs[name] = json.dumps(value) if is_tree else value

    return write


def _header(path: Path) -> dict[str, Any]:
    """The metadata of a file of weights, those that are JSON as trees."""
    data = path.read_bytes()
    metadata = json.loads(data[8 : 8 + struct.unpack("<Q", data[:8])[0]])["__metadata__"]
    return {name: json.loads(text) if text[:1] in "{[" else text for name, text in metadata.items()}


def _write_header(original: Path) -> Callable[[Path, Any], object]:
    def write(path: Path, document: Any) -> None:
        data = original.read_bytes()
        size = struct.unpack("<Q", data[:8])[0]
        header = json.loads(data[8 : 8 + size])
        header["__metadata__"] = {k: v if isinstance(v, str) else json.dumps(v) for k, v in document.items()}
        text = json.dumps(header).encode()
        path.write_bytes(struct.pack("<Q", len(text)) + text + data[8 + size :])

    return write


def kinds(folder: Path, short: bool) -> dict[str, Kind]:
    """Files of all kinds, made in a folder."""
    law = texts.plain_law(texts.CURVED)
    made = {"an exported law": Kind(".json", json.loads(ck.export(law, "json")), _write_json, _use_result)}
    ck.generate("norton", "uniaxial", 4, seed=1, to=folder / "data.h5", every=3600.0)
    trees = _attributes(folder / "data.h5")
    made["a data set"] = Kind(".h5", trees, _write_attributes(folder / "data.h5", trees), _use_samples)
    if short:
        return made
    ranking = fitted()
    ranking.best.save(folder / "fit.json")
    made["an identification"] = Kind(".json", json.loads((folder / "fit.json").read_text()), _write_json, _use_result)
    from killed_runs import data_set

    from execution_attempts.canaries import creepkit, run

    (folder / "more").mkdir()
    data_set(folder / "more")
    words = (
        "surrogate",
        "train",
        "more/data.h5",
        "--to",
        "net.safetensors",
        "--hidden",
        "4",
        "--layers",
        "1",
        "--epochs",
        "1",
    )
    ended = run(creepkit(*words), folder)
    if ended.code:
        raise RuntimeError(ended.problem)
    network = folder / "net.safetensors"
    made["a network"] = Kind(".safetensors", _header(network), _write_header(network), _use_network)
    return made


# ---- the attempts --------------------------------------------------------------------------------------------------


@contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Work in a folder with a module that makes the canary where it is imported."""
    before = Path.cwd()
    (folder / "planted_module.py").write_text(planted(folder) + "def made(*_): pass\n")
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def outcome_of(kind: Kind, places: Sequence[Place], text: str, folder: Path) -> tuple[str, str]:
    """What comes of a file with a text at some places."""
    path = folder / f"changed{kind.suffix}"
    path.unlink(missing_ok=True)
    try:
        kind.write(path, replaced(kind.document, places, text))
    except (ValueError, TypeError, UnicodeError):
        return "refused", ""  # the format itself cannot hold it
    try:
        shown = kind.use(path)
    except CreepkitError as error:
        outcome, detail = ("traceback", repr(str(error))) if _STEERING.search(str(error)) else ("refused", "")
    except Exception as error:
        outcome, detail = "traceback", f"{type(error).__name__}: {str(error)[:200]}"
    else:
        steering = _STEERING.search(shown)
        outcome, detail = ("broken", f"a terminal is steered by {steering[0]!r}") if steering else ("harmless", "")
    return ("executed", said) if (said := left(folder)) else (outcome, detail)


def payloads(short: bool) -> dict[str, str]:
    """The texts, by what they try."""
    chosen = {name: texts.PAYLOADS[name] for name in CHOSEN}
    return {name: chosen[name] for name in CHOSEN[:2]} if short else chosen | MORE


def attempts(short: bool) -> Found:
    """Each text in each place of each file."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch).resolve()
        with inside(folder):
            for name, kind in kinds(folder, short).items():
                for place in text_leaves(kind.document):
                    for what, text in payloads(short).items():
                        outcome, detail = outcome_of(kind, [place], text, folder)
                        yield Attempt(SECTION, name, outcome, f"{'/'.join(map(str, place))}: {what}: {detail}")
            yield from _controls(folder)


def _controls(folder: Path) -> Iterator[Control]:
    """Readers that evaluate texts, import what they name, and load pickles."""
    import importlib
    import pickle
    import sys

    noticed = 0
    for what in ("end of a long string, then Python",):
        try:
            eval(f'"""{texts.PAYLOADS[what]}"""')
        finally:
            noticed += bool(left(folder))
    yield Control(SECTION, "a reader that evaluates a text", 1, noticed)
    sys.path.insert(0, str(folder))
    try:
        importlib.import_module(MORE["a module"])
    finally:
        sys.path.remove(str(folder))
        sys.modules.pop(MORE["a module"], None)
    yield Control(SECTION, "a reader that imports what a text names", 1, int(bool(left(folder))))
    pickle.loads(pickle_that_runs(folder))
    yield Control(SECTION, "a reader that loads a pickle", 1, int(bool(left(folder))))
