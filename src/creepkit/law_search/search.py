"""search_laws: sentences are proposed, changed one factor at a time, fitted in full, and ranked beside registered laws.

1. All products are fitted to rates of smoothed curves; sparse regression says which of them to add. A beam of the best
   is changed, one factor at a time, until no change helps on those rates.
2. The best, and the best of each number of parameters, are identified from the curves; of the best of these the changes
   are tried too.
3. The sentences on the front and near the best, and the registered laws that suit the tests, are identified and
   ranked as by select().
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import process_time
from typing import TYPE_CHECKING, Any, Unpack

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.candidates import candidates
from creepkit.inverse.compared_tests import common_rupture_times
from creepkit.inverse.evidence import DECISIVE_EXCESS
from creepkit.inverse.history_checks import loading_notes, rig_notes, sound_tests
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures, with_arrhenius
from creepkit.inverse.search.multistart import StartingEstimate, refined, search_problem
from creepkit.inverse.selection.discrimination import score_under_own_covariance
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.selection.select import as_shown
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw
from creepkit.law_search.grammar import Product, Sentence, allowed
from creepkit.law_search.proposals import proposed_sums
from creepkit.law_search.results import LawSearch, SearchedLaw
from creepkit.law_search.smoothed_rates import RateFit, SmoothedRates
from creepkit.limits import Limits
from creepkit.options import Options, option, takes_options
from creepkit.records import History, Predictor
from creepkit.registry.arguments import resolve_predictors

if TYPE_CHECKING:
    from creepkit.option_keywords import LawSearchOptionsKeywords

BEAM, TRIED = 4, 6
"""Sentences that are changed in turn, and best ones on the smoothed rates that are identified from the curves."""


SHARE_OF_SCREEN = 0.75
"""Of the time of trying, for changes that smoothed rates judge."""


MOST_RANKED, NEAR, REGISTERED_RANKED = 4, 20.0, 1
"""Sentences that are ranked at the end, their criterion above the least up to which they are, and registered laws."""


SHARE_OF_BEAM = 0.8
"""Of the budget; what is left is for the ranking."""


@checked
@dataclass(frozen=True)
class LawSearchOptions(Options, title="options of a search of laws"):
    """What search_laws() is asked beside the settings of its identifications.

    budget : CPU seconds; no further sentence is tried after them, and the ranking at the end is whole. registered :
    whether the registered laws that suit the tests are ranked beside.
    """

    budget: float = option(60.0, "CPU time for trying laws; what is left out is said.", Limits(1, 1e6), unit="s")
    registered: bool = option(True, "Rank the registered laws that suit the tests beside.")


@takes_options(LawSearchOptions)
@checked
def search_laws(
    tests: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    optimizer: Any = None,
    settings: IdentificationSettings | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    **changes: Unpack[LawSearchOptionsKeywords],
) -> LawSearch:
    """Search laws that nobody wrote down: sentences of a grammar of rate equations, ranked beside registered laws.

    tests : creep curves of bars. using : as of identify(). optimizer : of pysindy, which proposes sentences; by default
    STLSQ with several thresholds. settings : of the last identifications.
    FitError for tests without creep curves of bars. See law_search.grammar for what a sentence is.
    """
    started, options = process_time(), LawSearchOptions().changed(changes)
    settings = settings or IdentificationSettings()
    predictor = resolve_predictors(using, tests)
    sound, left_out = sound_tests(list(tests), settings)
    registered = [with_arrhenius(one, sound) for one in candidates(sound)] if options.registered else []
    end = started + SHARE_OF_BEAM * options.budget
    search = _Search(sound, predictor, _quick(settings, registered), registered, end, progress)
    search.run(optimizer)
    if not search.best(1):
        raise FitError(f"no sentence of the grammar could be identified: {next(iter(search.failed.values()), 'none')}")
    best = search.best(MOST_RANKED)
    ranked = [one for one in best if search.score(one) < search.score(best[0]) + NEAR]
    ranked += [one for one in search.best(REGISTERED_RANKED, search.registered) if one not in ranked]
    notes = (*left_out, *loading_notes(sound), *rig_notes(sound, settings))
    ranking = _ranked({one: search.fits[one] for one in ranked}, sound, predictor, settings, notes)
    least = min(map(search.score, search.fits))
    tried = tuple(
        SearchedLaw(fit.law, fit.rms, search.score(key) - least, key in search.registered)
        for key, fit in sorted(search.fits.items(), key=lambda pair: search.score(pair[0]))
    )
    return LawSearch(ranking, tried, options.budget, process_time() - started, search.untried)


def _ranked(
    fits: Mapping[Sentence | str, Identification],
    tests: Sequence[History],
    predictor: Any,
    settings: IdentificationSettings,
    notes: Sequence[str],
) -> Ranking:
    """The laws identified in full, each from where its quick identification ended, and ranked as by select()."""
    full = replace(common_rupture_times([fit.law for fit in fits.values()], settings), weights="likelihood")
    found, failed, parts = list[Identification](), dict[str, str](), list[int]()
    for key, fit in fits.items():
        start = StartingEstimate.from_identification(fit)
        try:
            one = identify(fit.law, tests, predictor, settings=full, start=start)
            found.append(replace(one, notes=(*one.notes, *notes)))
            parts.append(further_parts(key))
        except CreepkitError as error:
            failed[fit.law.name] = str(error)
    if not found:
        raise FitError(f"no law of the search could be identified in full: {next(iter(failed.values()))}")
    ranking = rank(found, failed, further_parts=parts)
    shown = {id(one) for one in (ranking.laws[0], *ranking.credible)}
    laws = [replace(one, fit=as_shown(one.fit, settings, None)) if id(one) in shown else one for one in ranking.laws]
    return replace(ranking, laws=tuple(laws))


def _quick(settings: IdentificationSettings, registered: Sequence[CreepLaw]) -> IdentificationSettings:
    """Those of identifications on the way, alike for laws that can rise to rupture and others."""
    alike = common_rupture_times([*registered, Product(softening="strain").law], settings)
    return replace(alike, starts=2, sobol_points=64, frames=20, weights="likelihood", usual_errors="none")


def further_parts(key: Sentence | str) -> int:
    """How many products and factors a sentence has beside its first; none of a registered law."""
    return sum(1 + one.factors for one in key.products) - 1 if isinstance(key, Sentence) else 0


@dataclass
class _Search:
    """What was tried so far: criteria on smoothed rates, and quick identifications from the curves."""

    tests: Sequence[History]
    predictor: Any
    settings: IdentificationSettings
    registered_laws: Sequence[CreepLaw]
    end: float
    progress: Callable[[str, int, int], None] | None
    screened: dict[Sentence, RateFit] = field(default_factory=dict)
    fits: dict[Sentence | str, Identification] = field(default_factory=dict)
    scores: dict[Sentence | str, float] = field(default_factory=dict)
    failed: dict[Sentence | str, str] = field(default_factory=dict)
    registered: list[Sentence | str] = field(default_factory=list)
    expanded: set[Sentence] = field(default_factory=set)
    untried: int = 0

    def run(self, optimizer: Any) -> None:
        """Fill `fits`."""
        self.rates = SmoothedRates.of_tests(self.tests)
        several = spans_temperatures(self.tests)
        self.temperatures = ("arrhenius", "arrhenius of each") if several else ("none",)
        first = Sentence((), self.temperatures[0], reference_temperature(self.tests))
        self.screen([replace(first, products=(one,)) for one in Product.all() if one.factors < 2])
        fitted = {one.products[0]: self.screened[one].log_rate for one in self.by_screen()[: 4 * BEAM]}
        self.screen(
            [replace(first, products=one) for one in proposed_sums(self.rates, fitted, optimizer) if allowed(one)]
        )
        end, self.end = self.end, process_time() + SHARE_OF_SCREEN * (self.end - process_time())
        self.expand(lambda: self.by_screen()[:BEAM])
        self.end = end
        self.identify(self.simpler())
        self.identify(self.by_screen()[:TRIED])
        while self.fits and process_time() < self.end and self.expand(lambda: self.best(BEAM), 1):
            least = self.screen_score(self.by_screen()[0])
            self.identify([one for one in self.by_screen()[: 2 * TRIED] if self.screen_score(one) < least + NEAR])
        self.untried = sum(one not in self.expanded for one in self.best(BEAM))
        self.identify_registered()

    def expand(self, beam: Callable[[], list[Sentence]], most: int = 1000) -> int:
        """Screen the neighbours of sentences of a beam, one after the other; returns of how many."""
        count = 0
        while count < most and process_time() < self.end:
            chosen = next((one for one in beam() if one not in self.expanded), None)
            if chosen is None:
                break
            near, count = self.screened[chosen], count + 1
            for one in chosen.neighbours(self.temperatures):
                self.screen([one], near)
                if one in self.screened and self.screen_score(one) < near.score - NEAR:
                    break  # to go on from there; the rest when it is the best again
            else:
                self.expanded.add(chosen)
        return count

    def by_screen(self) -> list[Sentence]:
        """The sentences screened, the least criterion first."""
        return sorted(self.screened, key=self.screen_score)

    def simpler(self) -> list[Sentence]:
        """The sentences of which none of fewer parameters is better on smoothed rates, the simplest first."""
        found, least = list[Sentence](), 10**6
        for one in self.by_screen():
            if len(one.law.params) < least:
                found, least = [one, *found], len(one.law.params)
        return found

    def screen(self, sentences: Sequence[Sentence], near: RateFit | None = None) -> None:
        """Fit sentences to the smoothed rates, some starts from the values of a similar one."""
        for one in self._in_time([s for s in sentences if s not in self.screened], "smoothed rates"):
            self.screened[one] = self.rates.fitted(one, near)

    def screen_score(self, sentence: Sentence) -> float:
        """The criterion of a sentence on the smoothed rates."""
        return self.screened[sentence].score

    def identify(self, sentences: Sequence[Sentence]) -> None:
        """Identify sentences from the curves, with few starts and frames."""
        fresh = [s for s in dict.fromkeys(sentences) if s not in self.fits and s not in self.failed]
        for one in self._in_time(fresh, "curves"):
            self._identify(one, one.law)

    def identify_registered(self) -> None:
        """Identify the registered laws; one that a sentence is stands under it."""
        known = {fit.law.fingerprint: key for key, fit in self.fits.items()}
        for law in self.registered_laws:
            key = known.get(law.fingerprint, law.name)
            self.registered.append(key)
            if key not in self.fits:
                self._identify(key, law)

    def _identify(self, key: Sentence | str, law: CreepLaw) -> None:
        try:
            start = self._start(law, self.screened[key].theta) if isinstance(key, Sentence) else None
            self.fits[key] = identify(law, self.tests, self.predictor, settings=self.settings, start=start)
        except CreepkitError as error:
            self.failed[key] = str(error)

    def _start(self, law: CreepLaw, theta: Floats) -> StartingEstimate:
        """Where least squares of the curves end that begin at values from the smoothed rates.

        theta : (starts, parameters) internal values.
        """
        problem = LeastSquaresProblem.from_histories(law, self.tests, self.predictor, self.settings)
        searched = search_problem(problem, problem.predictor.for_search())
        ends = refined(searched, [*searched.bounds.clip(searched.coordinates.u(theta))])
        return StartingEstimate(ends[0].x, reference=problem.coordinates.reference, values_only=True)

    def _in_time(self, sentences: Sequence[Sentence], to: str) -> Iterator[Sentence]:
        """Sentences, one after the other, while there is time."""
        for k, one in enumerate(sentences):
            if process_time() > self.end and self.fits:
                return
            if self.progress is not None:
                self.progress(f"laws fitted to {to}", k + 1, len(sentences))
            yield one

    def score(self, key: Sentence | str) -> float:
        """The criterion of a quick identification."""
        if key not in self.scores:
            fit = self.fits[key]
            self.scores[key] = score_under_own_covariance(fit, fit.linear_problem, fit.effective_frames)
            self.scores[key] += DECISIVE_EXCESS * further_parts(key)
        return self.scores[key]

    def best(self, count: int, among: Collection[Sentence | str] | None = None) -> list[Any]:
        """The keys of lowest criterion, of sentences or `among` others."""
        keys = [key for key in self.fits if (isinstance(key, Sentence) if among is None else key in among)]
        return sorted(keys, key=self.score)[:count]
