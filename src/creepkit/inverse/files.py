"""Identifications as JSON files: strict on reading, nothing in them is evaluated, half-written files never appear."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from creepkit.errors import FitError
from creepkit.inverse.coordinates import Reference
from creepkit.inverse.document import (
    KIND,
    VERSION,
    Document,
    ErrorsPart,
    RupturePart,
    ScatterPart,
    SettingsPart,
    SparsityPart,
    TestPart,
)
from creepkit.inverse.findings import NuisanceEstimate, OutputMisfit, RuptureMisfit, TestMisfit
from creepkit.inverse.identification import Identification, Settings
from creepkit.inverse.measures import Errors
from creepkit.inverse.scatter import OutputScatter, Scatter
from creepkit.inverse.sparsity.record import Sparsity
from creepkit.inverse.uncertainty import Estimate
from creepkit.inverse.writing import write_text
from creepkit.language.tree import law_from_json, law_to_json
from creepkit.records import Nuisance

LARGEST = 50_000_000
"""Bytes; no identification is near it, and a reader must not swallow what it cannot hold."""


def to_json(fit: Identification) -> dict[str, Any]:
    """The identification as JSON-able data."""
    return {
        "kind": KIND,
        "version": VERSION,
        "law": law_to_json(fit.law),
        "estimates": [vars(e) for e in fit.estimates],
        "u": fit.u.tolist(),
        "covariance": fit.covariance.tolist(),
        "reference": vars(fit.reference),
        "scatter": fit.scatter.to_dict(),
        "rms": _number(fit.rms),
        "log_likelihood": fit.log_likelihood,
        "size": fit.size,
        "freedom": fit.freedom,
        "tests": [_plain_test(m) for m in fit.misfits],
        "errors": {name: _plain(e) for name, e in fit.errors.items()},
        "nuisances": [_plain(n) for n in fit.nuisances],
        "ranges": {name: list(ends) for name, ends in fit.ranges.items()},
        "settings": _plain_settings(fit.settings),
        "provenance": dict(fit.provenance),
        "converged": fit.converged,
        "notes": list(fit.notes),
        "sparsity": None if fit.sparsity is None else _numbers(fit.sparsity.to_dict()),
    }


def _numbers(tree: Any) -> Any:
    """The same with every number as JSON can hold it."""
    if isinstance(tree, dict):
        return {key: _numbers(value) for key, value in tree.items()}
    return _number(tree) if isinstance(tree, float) else tree


def _number(value: float) -> float | str | None:
    """What JSON can hold: null for what is not a number, "inf" for what has no end."""
    return None if value != value else "inf" if value == np.inf else value


def _plain(record: Any) -> dict[str, Any]:
    return {k: _number(v) if isinstance(v, float) else v for k, v in vars(record).items()}


def _plain_test(m: TestMisfit) -> dict[str, Any]:
    outputs = [{**_plain(o), "errors": _plain(o.errors)} for o in m.outputs]
    return {**_plain(m), "outputs": outputs, "rupture": None if m.rupture is None else _plain(m.rupture)}


def _plain_settings(s: Settings) -> dict[str, Any]:
    nuisances = [{**_plain(n), "bounds": [v if np.isfinite(v) else None for v in n.bounds]} for n in s.nuisances]
    return {**vars(s), "nuisances": nuisances, "weights": s.weights if isinstance(s.weights, str) else dict(s.weights)}


def save(fit: Identification, path: Path) -> Path:
    """Write the identification; the file is whole or absent."""
    return write_text(json.dumps(to_json(fit), indent=1, allow_nan=False) + "\n", path)


def load(path: str | Path) -> Identification:
    """Read an identification; its law is rebuilt from data and its fingerprint checked."""
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST:
            raise FitError(f"{path}: larger than {LARGEST // 1_000_000} MB, which no identification is")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FitError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        where = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise FitError(f"{path}{where}: not JSON text; give a file that Identification.save wrote") from None
    return from_json(data, str(path))


def from_json(data: Any, source: str = "identification") -> Identification:
    """Rebuild an identification from JSON data, or say in one sentence what is wrong with it."""
    if isinstance(data, dict) and data.get("kind") == KIND and data.get("version") in range(1, VERSION):
        old = data["version"]
        raise FitError(f"{source}: written by an earlier creepkit, in version {old} of the format; identify again")
    try:
        document = Document.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the document"
        raise FitError(
            f"{source}: {place}: {first['msg'].lower()}; it is not an identification of this version"
        ) from None
    law = law_from_json(document.law, source)
    size = len(law.params)
    names, rows = tuple(e.name for e in document.estimates), document.covariance
    square = len(rows) == size and all(len(row) == size for row in rows)
    if names != law.names or len(document.u) != size or not square:
        raise FitError(f"{source}: estimates, u and covariance do not belong to the {size} parameters of the law")
    return Identification(
        law=law,
        estimates=tuple(Estimate(**e.model_dump()) for e in document.estimates),
        u=np.array(document.u),
        covariance=np.array(rows, float).reshape(size, size),
        reference=Reference(**document.reference.model_dump()),
        scatter=_scatter(document.scatter),
        rms=float("nan") if document.rms is None else document.rms,
        log_likelihood=document.log_likelihood,
        size=document.size,
        freedom=document.freedom,
        misfits=tuple(_test(t) for t in document.tests),
        ranges=document.ranges,
        settings=_settings(document.settings),
        provenance=document.provenance,
        errors={name: _errors(e) for name, e in document.errors.items()},
        nuisances=tuple(NuisanceEstimate(**{**n.model_dump(), "spread": float(n.spread)}) for n in document.nuisances),
        converged=document.converged,
        notes=tuple(document.notes),
        sparsity=None if document.sparsity is None else _sparsity(document.sparsity),
    )


def _sparsity(part: SparsityPart) -> Sparsity:
    given = part.model_dump()
    for name in ("whole", "reduced"):
        own = getattr(part, name).errors
        given[name]["errors"] = {k: vars(_errors(e)) for k, e in own.items()}
    return Sparsity.from_dict(given)


def _scatter(s: ScatterPart) -> Scatter:
    return Scatter({name: OutputScatter(**sizes.model_dump()) for name, sizes in s.outputs.items()}, s.rate)


def _settings(s: SettingsPart) -> Settings:
    nuisances = tuple(
        Nuisance(n.kind, n.scope, n.output, n.mean, None if n.sd is None else float(n.sd), _ends(n.bounds))
        for n in s.nuisances
    )
    return Settings(**{**s.model_dump(), "nuisances": nuisances})


def _ends(bounds: tuple[float | None, float | None]) -> tuple[float, float]:
    return (-np.inf if bounds[0] is None else bounds[0]), (np.inf if bounds[1] is None else bounds[1])


def _test(t: TestPart) -> TestMisfit:
    rms, bias = (float("nan") if v is None else v for v in (t.rms, t.bias))
    outputs = tuple(OutputMisfit(o.output, _errors(o.errors), o.offset, o.noise) for o in t.outputs)
    rupture = None if t.rupture is None else _rupture(t.rupture)
    return TestMisfit(t.name, t.condition, t.frames, rms, bias, t.rate_factor, t.weight, outputs, rupture)


def _rupture(r: RupturePart) -> RuptureMisfit:
    return RuptureMisfit(r.measured, r.stopped, float(r.predicted), float(r.low), float(r.high))


def _errors(e: ErrorsPart) -> Errors:
    numbers = [float("nan") if v is None else v for v in (e.rse, e.mse, e.mae, e.relative, e.chi_square)]
    return Errors(e.frames, *numbers)
