"""Identifications kept in a folder: within `keep_fits(folder)` one that was made there before is read, not made again.

Every function that identifies, through whatever verb it is called, looks there first; so that work that was interrupted
goes on where it was, with the same result. A file is known by a hash of all that decides the identification: the law,
the data, what predicts them, the settings, where it begins, the versions of what computes, and the code of this
package.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.files.json_documents import (
    DocumentFormat,
    canonical_json,
    check_heading,
    check_keys,
    read_json,
    write_json,
)
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.inverse.composite_predictor import predictors_for_law
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import identification_from_json, identification_to_json, with_shapes
from creepkit.inverse.predictor_documents import history_text, predictor_fingerprint, short_hash
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.limits import ANY_NUMBER
from creepkit.records import Predictor

KEPT_FIT = DocumentFormat(
    "creepkit-kept-fit",
    2,
    FileKind("a kept identification", FitError, "remove it: it is made again", maximum_bytes=200_000_000),
    remedy="remove it: it is made again",
)


COMPUTING = ("creepkit", "numpy", "scipy")
"""Packages whose versions may change the last digits."""


CODE_SUFFIXES = (".py", ".so", ".dll", ".dylib", ".js", ".css", ".html")


@functools.cache
def code_fingerprint() -> str:
    """Hash of the files of this package: a checkout that is being worked on changes under the same version."""
    root, digest = Path(__file__).parent.parent, hashlib.sha256()
    for path in sorted(file for file in root.rglob("*") if file.suffix in CODE_SUFFIXES):
        content = path.read_bytes()  # files of the package itself, not of a user
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


PLAIN = RecordCodec(default_range=ANY_NUMBER)


def kept_to_json(fit: Identification) -> dict[str, Any]:
    """An identification with what files of identifications leave out and rankings need, as JSON-able data."""
    linearised = None if fit.linearised is None else PLAIN.to_json(fit.linearised)
    changes = [PLAIN.to_json(effect.residual_change) for effect in fit.unmodelled]
    return {"identification": identification_to_json(fit), "linearised": linearised, "residual_changes": changes}


def kept_from_json(data: Any, source: str) -> Identification:
    """The identification of kept_to_json(), without tests and predictor; FitError or RecordError for other data."""
    problem = "it is no object" if not isinstance(data, dict) else check_keys(data, KEPT_PARTS, "identification")
    if problem:
        raise RecordError(problem)
    fit = identification_from_json(data["identification"], source)
    stored = data["linearised"]
    linearised = None if stored is None else PLAIN.from_json(LinearisedProblem, stored)
    if linearised is not None:
        unknowns, residuals = (linearised.free.size,), linearised.residuals
        shapes = {**dict.fromkeys(("precision", "prior_residual", "free"), unknowns), "step_bounds": (2, *unknowns)}
        residuals = with_shapes(residuals, {"jacobian": (*residuals.values.shape, *unknowns)})
        linearised = with_shapes(replace(linearised, residuals=residuals), shapes)
    changes = PLAIN.from_json(list[Floats], data["residual_changes"], "residual_changes")
    if len(changes) != len(fit.unmodelled):
        raise RecordError("residual_changes are not those of the unmodelled effects")
    unmodelled = tuple(
        # JSON holds no shape of empty arrays
        replace(effect, residual_change=change) if change.size else effect
        for effect, change in zip(fit.unmodelled, changes, strict=True)
    )
    return replace(fit, linearised=linearised, unmodelled=unmodelled)


KEPT_PARTS = ("identification", "linearised", "residual_changes")


@dataclass
class FitFolder:
    """Identifications as files of a folder, and how many of them were made and read since."""

    folder: Path
    made: int = 0
    read: int = 0

    def path(self, key: str) -> Path:
        """The file of an identification."""
        return self.folder / f"{key}.json"

    def load(self, key: str, histories: Any, predictor: Predictor) -> Identification | None:
        """The identification of a key, as it was when it was made; None where there is none."""
        try:
            content = check_heading(read_json(self.path(key), KEPT_FIT.kind), str(self.path(key)), KEPT_FIT)
            fit = kept_from_json(content, str(self.path(key)))
        except (FitError, RecordError):
            return None
        return replace(fit, histories=tuple(histories), predictor=predictor)

    def save(self, key: str, fit: Identification) -> None:
        """Write an identification, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        write_json({**KEPT_FIT.heading, **kept_to_json(fit)}, self.path(key), KEPT_FIT.kind, force=True)


Identify = TypeVar("Identify", bound=Callable[..., Identification])


_FOLDER: ContextVar[FitFolder | None] = ContextVar("folder of kept fits", default=None)


@contextmanager
def keep_fits(folder: Path) -> Iterator[FitFolder]:
    """Keep identifications that are made within the context, and read those that were made before."""
    kept = FitFolder(folder)
    token = _FOLDER.set(kept)
    try:
        yield kept
    finally:
        _FOLDER.reset(token)


def kept_where_asked(identify: Identify) -> Identify:
    """A function that identifies a law from histories with a predictor, which keeps what it makes where that is asked.

    What it identifies on the way is not kept.
    """

    @functools.wraps(identify)
    def run(law: Any, histories: Any, using: Any, **how: Any) -> Identification:
        kept = _FOLDER.get()
        if kept is None:
            return identify(law, histories, using, **how)
        predictor, through, _ = predictors_for_law(law, using, how.get("through"))
        key = _key(law, histories, predictor, {**how, "through": through, "by": identify.__name__})
        fit = kept.load(key, histories, predictor)
        if fit is not None:
            kept.read += 1
            return fit
        token = _FOLDER.set(None)
        try:
            fit = identify(law, histories, using, **how)
        finally:
            _FOLDER.reset(token)
        kept.made += 1
        kept.save(key, fit)
        return fit

    return cast(Identify, run)


def _key(law: Any, histories: Any, predictor: Predictor, how: Mapping[str, Any]) -> str:
    """Hash of all that decides an identification."""
    start, through = how.get("start"), how.get("through")
    others = {name: value for name, value in how.items() if name not in ("start", "through", "progress")}
    parts = {
        "versions": {name: version(name) for name in COMPUTING},
        "code": code_fingerprint(),
        "law": [law.name, law.fingerprint, [(name, repr(p.bounds), repr(p.off)) for name, p in law.table.items()]],
        "histories": [history_digest(history) for history in histories],
        "predictor": predictor_fingerprint(predictor),
        "through": None if through is None else predictor_fingerprint(through),
        "others": repr(sorted(others.items())),
        "start": None
        if start is None
        else [
            None if start.u is None else np.asarray(start.u).tolist(),
            repr([start.nuisances, start.reference, start.values_only, start.is_near]),
        ],
    }
    return short_hash(canonical_json(parts))


def history_digest(history: Any) -> str:
    """Hash of a history, its labels included, wherever its file lies."""
    return short_hash(f"{history_text(history)}\n{sorted(history.labels.items())}".encode())
