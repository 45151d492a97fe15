"""PerTest: a specimen or predictor of which its author writes one candidate in one test."""

from __future__ import annotations

import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked_with_own_words
from creepkit.errors import CreepkitError, SolveError, quoted
from creepkit.records import History, Prediction, Status
from creepkit.specimens.separate_tests import TestResponse, predict_separately
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import NuisanceValues


@checked_with_own_words("outputs", "status")
@dataclass(frozen=True)
class OneTest:
    """What one candidate does in one test, where it does not reach the end.

    outputs : {output: (times,)} in its unit, NaN after the end. status : how it ended. end_time : s, when.
    """

    outputs: Mapping[str, ArrayLike]
    status: Status = Status.RUPTURED
    end_time: float = float("nan")


class PerTest(TestPiece, ABC):
    """Predicts by a function of one candidate in one test: a beam of fibres, a formula, another program.

    A subclass states `name`, `title` and `outputs`, the first the one that grows with creep; `loads`, what can be
    imposed; and `workers`, how many tests are predicted at once by threads: more than one where one() waits for another
    program. A subclass that is a frozen dataclass has lengths, by fields that are `dimension()`. Batches, padding,
    lengths, nuisance parameters and errors are done here, sensitivities by differences where they are asked for.
    """

    workers: int = 1

    @abstractmethod
    def one(
        self, law: CreepLaw, values: Mapping[str, float], history: History, nuisances: Mapping[str, float]
    ) -> Mapping[str, ArrayLike] | OneTest:
        """{output: (times,)} at the times of the history, in the output's unit; a OneTest where it ends before.

        values : {parameter: value} in the law's units. nuisances : {kind: value} of this test; the lengths of the test
        piece, and the temperature and modulus of the history, are already as they say.
        SolveError where these values cannot be solved for: the candidate then counts as one that did not converge.
        """

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """All candidates in all tests; derivatives are left to differences.

        theta : (candidates, parameters) internal values.
        """

        def respond(row: Floats, k: int, of_test: Mapping[str, float]) -> TestResponse:
            values = {name: float(column[0]) for name, column in law.from_internal(row[None]).items()}
            return self._checked(law, values, histories[k], of_test)

        return predict_separately(respond, theta, histories, nuisances, self.outputs, self.workers)

    def _checked(
        self, law: CreepLaw, values: Mapping[str, float], history: History, nuisances: Mapping[str, float]
    ) -> TestResponse:
        """What one() gives; errors name test, values and line."""
        end = float(history.times[-1])
        piece, tested = self.of_test(history, nuisances)
        try:
            found = piece.one(law, values, tested, nuisances)
        except SolveError as error:
            nothing = np.full((history.times.size, len(self.outputs)), np.nan)
            return TestResponse(nothing, Status.NOT_CONVERGED, 0.0, str(error))
        except CreepkitError as error:
            raise SolveError(f"{self._place(values, history)}: {error}") from error
        except (Exception, SystemExit) as error:  # of the author's code, whatever it is
            last = traceback.extract_tb(error.__traceback__)[-1]
            raise SolveError(
                f"{self._place(values, history)}: {type(error).__name__}: {error} ({last.filename}:{last.lineno})"
            ) from error
        if not isinstance(found, (OneTest, Mapping)):
            raise SolveError(
                f"{self._place(values, history)}: one() gave {quoted(repr(found))}; it must return "
                f"{{output: values}}, or a "
                "OneTest where a test ends early"
            )
        if not isinstance(found, OneTest):
            found = OneTest(found, Status.COMPLETE, end)
        if not isinstance(found.status, Status):
            raise SolveError(
                f"{self._place(values, history)}: one() gave the status {quoted(repr(found.status))}; use ck.Status"
            )
        ended = end if np.isnan(found.end_time) else found.end_time
        return TestResponse(self._rows(found, values, history), found.status, ended)

    def _rows(self, found: OneTest, values: Mapping[str, float], history: History) -> Floats:
        missing = [name for name in self.outputs if name not in found.outputs]
        if missing:
            raise SolveError(
                f"{self._place(values, history)}: one() gave {_listed(found.outputs)}; it must give "
                f"{_listed(self.outputs)}"
            )
        rows = []
        for name in self.outputs:
            try:
                given = np.asarray(found.outputs[name])
                row = given.astype(float) if not np.iscomplexobj(given) else np.zeros(0)
            except (TypeError, ValueError):
                given = row = np.zeros(0)
            if np.iscomplexobj(given) or (not row.size and history.times.size):
                raise SolveError(
                    f"{self._place(values, history)}: one() gave '{name}' as "
                    f"{quoted(repr(found.outputs[name]), 60)}; real "
                    "numbers, one for each time, are needed"
                )
            if row.shape != history.times.shape:
                raise SolveError(
                    f"{self._place(values, history)}: one() gave '{name}' of shape {row.shape}; the test has "
                    f"{history.times.size} times"
                )
            if found.status is Status.COMPLETE and not np.isfinite(row).all():
                raise SolveError(
                    f"{self._place(values, history)}: one() gave no finite '{name}' at some time and no end; "
                    "return OneTest(outputs, status, end_time) where a test ends early"
                )
            rows.append(row)
        return np.stack(rows, axis=-1)

    def _place(self, values: Mapping[str, float], history: History) -> str:
        text = ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
        return f"specimen '{self.name}', test '{history.name}' with {text}"


def _listed(names: Iterable[object]) -> str:
    return quoted(" and ".join(f"'{name}'" for name in names) or "no output", 200)
