"""PerTest: a specimen or predictor of which its author writes one candidate in one test."""

from __future__ import annotations

import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import CreepkitError, SolveError, quoted
from creepkit.records import History, NuisanceValues, Prediction, Status
from creepkit.specimens.separate_tests import TestResponse, predict_separately
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


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

    takes_values_of_tests: ClassVar[bool] = True

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
        stated = ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
        place = f"specimen '{self.name}', test '{history.name}' with {stated}"
        piece, tested = self.of_test(history, nuisances)
        try:
            found = piece.one(law, values, tested, nuisances)
        except SolveError as error:
            nothing = np.full((history.times.size, len(self.outputs)), np.nan)
            return TestResponse(nothing, Status.NOT_CONVERGED, 0.0, str(error))
        except CreepkitError as error:
            raise SolveError(f"{place}: {error}") from error
        except (Exception, SystemExit) as error:  # of the author's code, whatever it is
            last = traceback.extract_tb(error.__traceback__)[-1]
            raise SolveError(f"{place}: {type(error).__name__}: {error} ({last.filename}:{last.lineno})") from error
        end = float(history.times[-1])
        one = found if isinstance(found, OneTest) else OneTest(found, Status.COMPLETE, end)
        if problem := self._problem(found, one):
            raise SolveError(f"{place}: one() gave {problem}")
        columns = []
        for name in self.outputs:
            column = _real_numbers(one.outputs[name])
            if column is None or (not column.size and history.times.size):
                raise SolveError(
                    f"{place}: one() gave '{name}' as {quoted(repr(one.outputs[name]), 60)}; real numbers, one for "
                    "each time, are needed"
                )
            if column.shape != history.times.shape:
                raise SolveError(
                    f"{place}: one() gave '{name}' of shape {column.shape}; the test has {history.times.size} times"
                )
            if one.status is Status.COMPLETE and not np.isfinite(column).all():
                raise SolveError(
                    f"{place}: one() gave no finite '{name}' at some time and no end; "
                    "return OneTest(outputs, status, end_time) where a test ends early"
                )
            columns.append(column)
        return TestResponse(np.stack(columns, axis=-1), one.status, end if np.isnan(one.end_time) else one.end_time)

    def _problem(self, found: Any, one: Any) -> str:
        """What one() gave that is no answer, and what is; "" where it is one."""
        if not isinstance(found, OneTest | Mapping):
            return f"{quoted(repr(found))}; it must return {{output: values}}, or a OneTest where a test ends early"
        if not isinstance(one.status, Status):
            return f"the status {quoted(repr(one.status))}; use ck.Status"
        if set(self.outputs) - set(one.outputs):
            return f"{_listed(one.outputs)}; it must give {_listed(self.outputs)}"
        return ""


def _real_numbers(given: object) -> Floats | None:
    """(...,) of an author's answer; None where it holds others."""
    try:
        array = np.asarray(given)
        return None if np.iscomplexobj(array) else array.astype(float)
    except (TypeError, ValueError):
        return None


def _listed(names: Iterable[object]) -> str:
    return quoted(" and ".join(f"'{name}'" for name in names) or "no output", 200)
