"""screen: the tests of a plate of alloys, alloy after alloy on all cores, kept as they are done."""

from __future__ import annotations

import logging
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

from creepkit.dataset.pace import duration
from creepkit.dataset.shards import Answer
from creepkit.dataset.worker import attempt
from creepkit.dataset.workers import ProcessWorkers
from creepkit.errors import FitError
from creepkit.inverse.selection.select import FRAMES
from creepkit.inverse.settings import Settings
from creepkit.inverse.sparsity.penalties import Penalty, Subsets, check_penalty
from creepkit.language import CreepLaw
from creepkit.plates import files
from creepkit.plates.alloys import alloys_of
from creepkit.plates.answer import AlloyAnswer
from creepkit.plates.compositions import Compositions, compositions_given
from creepkit.plates.given import folder_made, histories_given, laws_given, size_given, using_given
from creepkit.plates.plate import Plate
from creepkit.plates.work import FITS, Screening
from creepkit.records import History, Nuisance, Predictor

Progress: TypeAlias = Callable[[str, int, int, str], None]
"""Called with a task, alloys done, alloys in all, and a note on the time left."""

LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
"""Those of Table 1 of Chen et al."""
DENSE = "combined"
"""The law of Eq. (2), to be had without sparsity."""
DEATHS = 2
"""How often an alloy may kill its worker process."""
PATIENCE = 1.0
"""s between looks at who has died."""

_log = logging.getLogger("creepkit.plates")


def screen(
    histories: Sequence[History] | str | Path,
    laws: Sequence[CreepLaw | str] | None = None,
    using: Predictor | str | Mapping[str, Predictor] | None = None,
    *,
    compositions: Compositions | str | Path | None = None,
    to: str | Path | None = None,
    nuisances: Sequence[Nuisance] | None = None,
    settings: Settings | None = None,
    through: Predictor | None = None,
    dense: CreepLaw | str | None = DENSE,
    penalty: Penalty | Subsets | None = None,
    confirm: bool | Literal["when in doubt"] = "when in doubt",
    workers: int | None = None,
    progress: Progress | None = None,
) -> Plate:
    """Identify the law of every alloy from its tests, and set the alloys side by side.

    histories : of all alloys, or a folder of their files. Tests of one alloy are identified together; one that names
        no alloy is an alloy by itself.
    laws : candidates, by default the four of Table 1 of Chen et al.; times an Arrhenius factor where the tests of an
        alloy span several temperatures. using : predictor, by default the specimen that the histories name; through :
        a surrogate in which laws of several terms are searched before `using` has the last word (see identify()).
    compositions : table of what the alloys are made of, or its file; classes follow from it.
    to : folder for one JSON file an alloy, in which an interrupted call finds what is done. Alloys whose tests and
        settings are the same as there are not identified again. Its folder `fits` has the best identification of each.
    dense : the law whose misfit without sparsity is set against the reduced one's (Fig. 7b), None for none; penalty :
        what makes the reduced one of it, such as Sqrt(); by default it is the best of `laws`.
    confirm : whether the best law is simulated by the specimen itself: True, False, or "when in doubt", that is where
        a surrogate's guard says that its answer lies outside its domain.
    workers : processes, by default one for each core; 1 works in this process.

    An alloy that cannot be identified is recorded with the reason, and the others go on.
    """
    tests, table = histories_given(histories, compositions), compositions_given(compositions)
    settings = replace(settings or Settings(frames=FRAMES), weights="likelihood")
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    if penalty is not None:
        check_penalty(penalty)
        if dense is None:
            raise FitError("a penalty reduces the dense law, and there is none; give dense=, such as 'combined'")
    if confirm not in (True, False, "when in doubt"):
        raise FitError(f'confirm is {confirm!r}; allowed are True, False and "when in doubt"')
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory()) if to is None else to
        work = Screening(
            alloys=alloys_of(tests), laws=laws_given(LAWS if laws is None else laws), using=using_given(using, tests),
            through=through, settings=settings, dense=None if dense is None else laws_given([dense])[0],
            penalty=penalty, confirm=confirm, folder=folder_made(Path(folder), FITS),
        )  # fmt: skip
        answers = _all(work, size_given(workers), progress)
    return Plate.of(work.alloys, answers, work.using, table, None if to is None else Path(to))


def _all(work: Screening, size: int, progress: Progress | None) -> list[AlloyAnswer]:
    """The answers for all alloys, in their order; those that are in the folder are taken from there."""
    found = {k: answer for k in range(len(work.alloys)) if (answer := _kept(work, k)) is not None}
    todo = [k for k in range(len(work.alloys)) if k not in found]
    before, began = len(found), time.monotonic()
    for done in _done(work, todo, size):
        found[done.number], name = _told(work, done), work.alloys[done.number].name
        if progress is not None:
            rate = (time.monotonic() - began) / (len(found) - before)
            left = f"{duration(rate * (len(work.alloys) - len(found)))} left"
            progress("alloys", len(found), len(work.alloys), f"{name} done, {left}")
    return [found[k] for k in range(len(work.alloys))]


def _kept(work: Screening, number: int) -> AlloyAnswer | None:
    """The answer in the folder, if it is one to these tests and settings."""
    path = work.path(number)
    if not path.exists():
        return None
    try:
        answer = files.load(path)
    except FitError as error:
        _log.warning("%s", error)
        return None
    return answer if answer.fingerprint == work.fingerprint(number) else None


def _told(work: Screening, done: Answer) -> AlloyAnswer:
    """The answer that a worker left, or why it left none."""
    if done.kind != "done":
        return AlloyAnswer(work.alloys[done.number].name, reason=done.text)
    try:
        return files.load(work.path(done.number))
    except FitError as error:
        return AlloyAnswer(work.alloys[done.number].name, reason=str(error))


def _done(work: Screening, todo: Sequence[int], size: int) -> Iterator[Answer]:
    """Each alloy as it is done."""
    if min(size, len(todo)) <= 1:
        yield from (attempt(work, number) for number in todo)
        return
    waiting, deaths = list(reversed(todo)), Counter[int]()
    with ProcessWorkers(work, min(size, len(todo))) as crew:
        left = len(todo)
        while left:
            while crew.free and waiting:
                crew.submit(waiting.pop())
            for answer in crew.answers(PATIENCE):
                deaths[answer.number] += answer.kind == "died"
                if answer.kind == "died" and deaths[answer.number] < DEATHS:
                    waiting.append(answer.number)
                    continue
                left -= 1
                yield _in_words(answer)


def _in_words(answer: Answer) -> Answer:
    if answer.kind != "died":
        return answer
    text = f"its worker process died {DEATHS} times, the last time by {answer.text}; is there memory enough?"
    return replace(answer, text=text)
