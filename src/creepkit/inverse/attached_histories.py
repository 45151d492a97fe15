"""Histories attached to an identification that was loaded: whether they are those that it was made from."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

from creepkit.errors import FitWarning
from creepkit.inverse.history_checks import sound_tests
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_notes import data_digest
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.rupture_use import compared_tests
from creepkit.records import History, Predictor


def with_attached(fit: Identification, tests: Sequence[History], predictor: Predictor) -> Identification:
    """The identification with its tests and what predicts them, copies and suspect frames left out as they were.

    FitWarning where the tests are not those that it was made from: other frames, values, weights or nuisances.
    """
    tests = compared_tests(fit.law, tests, fit.settings).histories
    attached = replace(fit, histories=tuple(tests), predictor=predictor, problem=None)
    known = fit.provenance.get("data")
    sound = tuple(sound_tests(tests, fit.settings)[0])
    if known is None or _digest(attached) == known:
        return attached
    without_suspect = replace(attached, histories=sound)
    if _digest(without_suspect) == known:
        return without_suspect
    warnings.warn(
        f"the tests given differ from those that {fit.law.name} was identified from, although they have the same "
        "names: identify it again, or give the same files",
        FitWarning,
        stacklevel=5,
    )
    return attached


def _digest(fit: Identification) -> str:
    assert fit.predictor is not None
    return data_digest(
        LeastSquaresProblem.from_histories(fit.law, fit.histories, fit.predictor, fit.settings, fit.reference)
    )
