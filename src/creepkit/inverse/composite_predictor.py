"""Predictors of several specimens as one, and predictors that know a law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from creepkit.errors import FitError
from creepkit.records import History, NuisanceValues, Prediction, Predictor, concatenated_tests, values_of_tests

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class CompositePredictor(Predictor):
    """Predictors of different specimens as one: each history goes to the predictor of its specimen.

    Whether one knows a nuisance is asked of each group of histories, so that all are given to it.
    """

    predictors: Mapping[str, Predictor]

    @classmethod
    def of(cls, using: Predictor | Mapping[str, Predictor]) -> Predictor:
        """One predictor, of several by specimen."""
        return using if isinstance(using, Predictor) else cls(dict(using))

    @property
    def parts(self) -> Mapping[str, Predictor]:
        """{name of the specimen: predictor}."""
        return self.predictors

    @property
    def name(self) -> str:  # type: ignore[override]
        """The names of all, joined."""
        return " + ".join(one.label for one in self.predictors.values())

    @property
    def error(self) -> dict[str, float]:  # type: ignore[override]
        """{output: the largest standard deviation that one states}."""
        largest: dict[str, float] = {}
        for one in self.predictors.values():
            largest |= {name: max(sd, largest.get(name, 0.0)) for name, sd in one.error.items()}
        return largest

    @cached_property
    def specimen(self) -> Predictor:
        """The specimens that all stand for."""
        return self._with({name: one.specimen for name, one in self.predictors.items()})

    def for_history(self, history: History) -> Predictor:
        """The predictor of one history."""
        if history.specimen not in self.predictors:
            raise FitError(
                f"history '{history.name}' is of specimen '{history.specimen}', for which using= names no predictor; "
                f"it names {', '.join(self.predictors)}"
            )
        return self.predictors[history.specimen]

    def follows(self, key: str) -> bool:
        """Whether one of them knows an explicit nuisance."""
        return any(one.follows(key) for one in self.predictors.values())

    def for_law(self, law: CreepLaw) -> Predictor:
        """Each, or its specimen where the law is outside the class of laws that it knows."""
        return self._with({name: one.for_law(law) for name, one in self.predictors.items()})

    def single_threaded(self) -> Predictor:
        """All without threads."""
        return self._with({name: one.single_threaded() for name, one in self.predictors.items()})

    def outside_class(self, law: CreepLaw) -> str:
        """Why one of them does not know the class of a law; "" where all do."""
        return next(filter(None, (one.outside_class(law) for one in self.predictors.values())), "")

    def reduced_order_model(self) -> Predictor | None:
        """The reduced-order models, beside predictors that have none; None where none has."""
        return self._derived(lambda one: one.reduced_order_model())

    def refined(self) -> Predictor | None:
        """The more exact predictors, beside those that have none; None where none has."""
        return self._derived(lambda one: one.refined())

    def for_search(self) -> Predictor:
        """All at the tolerances of a global search."""
        return self._with({name: one.for_search() for name, one in self.predictors.items()})

    def _with(self, predictors: Mapping[str, Predictor]) -> Predictor:
        same = all(predictors[name] is one for name, one in self.predictors.items())
        return self if same else CompositePredictor(predictors)

    def _derived(self, derive: Callable[[Predictor], Predictor | None]) -> Predictor | None:
        derived = {name: derive(one) for name, one in self.predictors.items()}
        if not any(derived.values()):
            return None
        return CompositePredictor({name: derived[name] or one for name, one in self.predictors.items()})

    def _predict(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict each group of histories with its predictor; outputs that a test does not have are NaN."""

        def of_group(one: Predictor, group: list[History], tests: list[int]) -> Prediction:
            own = {key: values[:, tests] for key, values in nuisances.items() if one.follows(key)}
            return one.predict(law, values_of_tests(theta, tests), group, nuisances=own, sensitivities=sensitivities)

        return self._of_groups(histories, of_group)

    def _predict_to_rupture(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], sensitivities: bool
    ) -> Prediction:
        """As each predicts its tests to their rupture; theta : (candidates[, tests], parameters) internal values."""

        def of_group(one: Predictor, group: list[History], tests: list[int]) -> Prediction:
            return one.predict_to_rupture(law, values_of_tests(theta, tests), group, sensitivities=sensitivities)

        return self._of_groups(histories, of_group)

    def _of_groups(
        self, histories: Sequence[History], predict: Callable[[Predictor, list[History], list[int]], Prediction]
    ) -> Prediction:
        chosen = [self.for_history(h) for h in histories]
        groups = []
        for one in {id(p): p for p in chosen}.values():
            tests = [k for k, p in enumerate(chosen) if p is one]
            groups.append((tests, predict(one, [histories[k] for k in tests], tests)))
        return concatenated_tests(groups, histories)


def compared_outputs(predictor: Predictor, history: History) -> tuple[str, ...]:
    """What is both measured and predicted of a history, in the predictor's order; the first grows with creep."""
    known = predictor.for_history(history).outputs_of_test(history) or tuple(history.outputs)
    return tuple(name for name in known if name in history.outputs)


def predictors_for_law(
    law: CreepLaw, using: Predictor | Mapping[str, Predictor], through: Predictor | None
) -> tuple[Predictor, Predictor | None, tuple[str, ...]]:
    """Predictors that know a law, in the place of `using` and `through` of identify(), and notes of what changed."""
    asked = CompositePredictor.of(using)
    chosen, notes = asked.for_law(law), []
    if chosen is not asked:
        notes.append(f"identified with '{chosen.label}' in the place of '{asked.label}': {asked.outside_class(law)}")
    on_the_way = through_for_law(through, law)
    if through is not None and on_the_way is None:
        notes.append(f"identified without '{through.label}' on the way: {through.outside_class(law)}")
    return chosen, on_the_way, tuple(notes)


def through_for_law(through: Predictor | None, law: CreepLaw) -> Predictor | None:
    """A cheaper predictor on the way to the values, or None where it does not know the law."""
    return None if through is None or through.outside_class(law) else through
