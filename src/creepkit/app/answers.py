"""Answers of the page's server: predictions of planned and measured tests, rates over stress, a deformed section."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from creepkit import kernels
from creepkit.app.contents import PageContents, PageLaw, specimen_name, temperature_warning
from creepkit.app.documents import compared_frames, finite, numbers, rate_point
from creepkit.app.requests import PredictRequest, ProgramRequest, RequestError
from creepkit.app.sections import section_document
from creepkit.app.turns import Turns
from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, quoted
from creepkit.inverse.composite_predictor import predict
from creepkit.language import Elastic
from creepkit.records import (
    History,
    Loading,
    Predictor,
    Status,
    SupportsReducedOrderModel,
    SupportsSearchTolerance,
    SupportsTraining,
    dimensions_of,
    load_steps,
    loads_of,
)
from creepkit.records.loading import StrainSteps, StressSteps
from creepkit.specimens.finite_element_run import FiniteElementRun
from creepkit.specimens.run import Runnable

PLANNED_FRAMES = 120
"""Of a planned test, half spread over time and half over its logarithm."""


RATE_STRESSES = 60
"""At which the creep rate is drawn."""


@dataclass
class PageAnswers:
    """Answers requests of pages on the same contents; one quick and one exact answer are worked out at a time.

    A request that waits, or goes from test to test, while a newer one of its page comes is given up.
    """

    contents: PageContents
    turns: Turns = field(default_factory=Turns, repr=False)
    _reduced: dict[str, Predictor] = field(default_factory=dict, repr=False)

    def prepare(self) -> None:
        """Compile the laws, and train reduced-order models of the specimens that the page shows first.

        What fails here fails again, with a reason, when it is asked for.
        """
        for page_law in self.contents.laws:
            kernels.lower(page_law.law, "compiled")
            kernels.lower(page_law.law, "numpy")
        shown = [self.contents.specimens[0].name, *(history.specimen for history in self.contents.histories)]
        for name in dict.fromkeys(shown):
            self.train(name)

    def train(self, name: str) -> None:
        """Have the reduced-order model of a specimen ready, where it has one."""
        specimen, surrogate = self.contents.specimen(name), self.contents.surrogate
        if surrogate is not None and specimen_name(surrogate) == name:
            self._reduced[name] = surrogate
        if name in self._reduced or not isinstance(specimen, SupportsReducedOrderModel):
            return
        reduced = specimen.reduced_order_model()
        if isinstance(reduced, SupportsTraining):
            reduced.train()
        self._reduced[name] = reduced.for_search() if isinstance(reduced, SupportsSearchTolerance) else reduced

    def answer(self, request: PredictRequest) -> dict[str, Any]:
        """The answer to a request; Superseded where a newer one came; a CreepkitError for what cannot be predicted."""
        if not request.law < len(self.contents.laws):
            raise RequestError(f"law {request.law} is none of the page's {len(self.contents.laws)} laws")
        for k in request.tests:
            if not k < len(self.contents.histories):
                raise RequestError(f"test {k} is none of the page's {len(self.contents.histories)} tests")
        turn = self.turns.announce(request.client, request.number)
        with self.turns.taken(turn, request.exact):
            page_law = self.contents.laws[request.law]
            values = page_law.law.values(request.values)
            theta = page_law.law.to_internal(values)
            answer: dict[str, Any] = {"number": request.number, "exact": request.exact}
            if request.rate_temperature is not None:
                answer["rate"] = rate_document(page_law, values, request.rate_temperature)
            if request.program is not None:
                answer["program"] = self._program_document(page_law, values, theta, request)
            warning = temperature_warning(page_law.law, [self.contents.histories[k] for k in request.tests])
            if warning:
                answer["warning"] = warning
            answer["tests"] = []
            for k in request.tests:
                self.turns.check(turn)
                answer["tests"].append({"test": k, **self._test_or_problem(page_law, theta, k, request.exact)})
            self.turns.check(turn)
            return answer

    # ---- tests -----------------------------------------------------------------------------------------------------

    def _predictor(self, name: str, exact: bool) -> Predictor:
        """The specimen, or its reduced-order model where that is ready and will do."""
        specimen = self.contents.specimen(name)
        return specimen if exact else self._reduced.get(name, specimen)

    def _program_document(
        self, page_law: PageLaw, values: dict[str, float], theta: Floats, request: PredictRequest
    ) -> dict[str, Any]:
        assert request.program is not None
        specimen = self.contents.specimen(request.program.specimen)
        plan = planned_history(request.program, specimen)
        predictor = self._predictor(specimen.name, request.exact)
        if isinstance(predictor, Runnable):
            run = predictor.run(page_law.law, values, plan)
            if isinstance(run, FiniteElementRun):
                return {**_run_document(run), "section": section_document(run)}
        prediction = predict(predictor, page_law.law, theta, [plan])
        return _prediction_document(prediction, plan)

    def _test_or_problem(self, page_law: PageLaw, theta: Floats, k: int, exact: bool) -> dict[str, Any]:
        """A test that cannot be predicted leaves the others as they are."""
        try:
            return self._test_document(page_law, theta, k, exact)
        except CreepkitError as error:
            return {"outputs": {}, "ended": "", "end": None, "problem": " ".join(str(error).split())}

    def _test_document(self, page_law: PageLaw, theta: Floats, k: int, exact: bool) -> dict[str, Any]:
        """A measured test at its own frames, with the nuisances and the offsets of the identification."""
        history = self.contents.histories[k]
        history = history.replace(times=history.times[compared_frames(history)], outputs={}, standard_deviation={})
        predictor, fit = self._predictor(history.specimen, exact), page_law.fit
        nuisances = {} if fit is None else fit.nuisance_values([history], using=predictor)
        prediction = predict(predictor, page_law.law, theta, [history], nuisances=nuisances)
        document = _prediction_document(prediction, history)
        document.pop("times")
        return document


def planned_history(program: ProgramRequest, specimen: Any) -> History:
    """The history without outputs that a request describes; SolveError for one that cannot be."""
    end, half = program.end, PLANNED_FRAMES // 2
    starts = np.array([start for start, _ in program.steps if 0.0 < start < end])
    times = np.union1d(np.geomspace(1e-4 * end, end, half), np.linspace(end / half, end, half))
    times = np.union1d(times, np.concatenate([starts, starts + max(program.ramp, 1e-6 * end)]))
    _check_lengths(program, specimen)
    return History(
        name="planned test",
        times=times[(times > 0.0) & (times <= end)],
        outputs={},
        loading=_loading(program, specimen),
        temperature=program.temperature,
        specimen=specimen.name,
        elastic=None if program.modulus is None else Elastic(program.modulus),
        geometry=program.lengths,
    )


def _check_lengths(program: ProgramRequest, specimen: Any) -> None:
    known = [d.name for d in dimensions_of(specimen)]
    for name in program.lengths:
        if name not in known:
            has = ", ".join(known) or "none"
            raise RequestError(f"specimen '{specimen.name}' has no length '{quoted(name, 60)}'; it has {has}")


def _loading(program: ProgramRequest, specimen: Any) -> Loading:
    if program.load not in (load.name for load in loads_of(specimen)):
        names = ", ".join(load.name for load in loads_of(specimen))
        raise RequestError(f"specimen '{specimen.name}' has no load '{quoted(program.load, 60)}'; it has {names}")
    if program.load == "stress":
        return StressSteps(tuple(program.steps), program.control)
    if program.load == "strain":
        return StrainSteps(tuple(program.steps), program.ramp)
    return load_steps(program.load, program.steps, program.ramp)


def _prediction_document(prediction: Any, history: History) -> dict[str, Any]:
    values, status = prediction.of(0), Status(int(prediction.status[0, 0]))
    end = finite(float(prediction.end_times[0, 0]))
    if status is Status.OUTSIDE_CLASS:
        raise RequestError(prediction.reason or status.text)
    ended = status in (Status.RUPTURED, Status.NOT_CONVERGED)
    return {
        "times": numbers(history.times),
        "outputs": {str(name): numbers(values[:, k]) for k, name in enumerate(prediction.outputs)},
        "ended": (prediction.reason or status.text) if ended else "",
        "end": end if ended else None,
    }


def _run_document(run: FiniteElementRun) -> dict[str, Any]:
    ended = run.status is not Status.COMPLETE
    return {
        "times": numbers(run.times),
        "outputs": {str(name): numbers(values) for name, values in run.outputs.items()},
        "ended": run.reason or run.status.text if ended else "",
        "end": finite(run.end_time) if ended else None,
    }


def rate_document(page_law: PageLaw, values: dict[str, float], temperature: float) -> dict[str, Any]:
    """The creep rate over stress, at the strain and the time that stand for the tests; log10 of 1/s."""
    point = rate_point(page_law.fit)
    low, high = point["stress"]
    stresses = np.geomspace(low, high, RATE_STRESSES)
    kernel = kernels.lower(page_law.law, "numpy")
    try:
        with np.errstate(all="ignore"):
            logs = kernel.log_rate(
                values, stress=stresses, strain=point["strain"], time=point["time"], temperature=temperature
            )
    except CreepkitError as error:
        return {"stress": [], "log_rate": [], "problem": str(error)}
    logs = np.broadcast_to(np.asarray(logs, float), stresses.shape) / np.log(10.0)
    return {"stress": numbers(stresses), "log_rate": numbers(np.where(logs < -1e3, np.nan, logs))}
