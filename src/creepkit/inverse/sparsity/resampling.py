"""How often each term is kept when tests are drawn again: whether the choice hangs on one of them.

Tests are drawn with replacement, as many as there are; where there is but one, its frames are, in blocks. A test (or
frame) drawn k times has its white residuals counted k times: the bootstrap of weighted likelihood. Frames that move
together are whitened first, so that a block can be drawn without its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import beta

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.sparsity.fitting import penalised_fit
from creepkit.inverse.sparsity.penalised import Penalised
from creepkit.inverse.sparsity.penalties import Penalty, Subsets
from creepkit.inverse.sparsity.reduction import Reductions, Terms, kept_of
from creepkit.inverse.sparsity.stage import Stage

BLOCK = 6
"""Frames of a block: an eighth of a bulge test of 48."""
ABSENT = 1e-12
"""Weight of what was not drawn."""


@dataclass(frozen=True)
class Frequencies:
    """How often each term, and each set of terms, was kept.

    drawn : "tests" or "blocks of frames"; repeats : number of draws; counts : {term: times kept}; sets : {terms: times
    that they, and no others, were kept}, the most frequent first.
    """

    drawn: str
    repeats: int
    counts: Mapping[str, int]
    sets: Mapping[Terms, int]

    def interval(self, term: str) -> tuple[float, float]:
        """95 % interval of the frequency of a term, of Clopper and Pearson."""
        return binomial(self.counts[term], self.repeats)

    def __str__(self) -> str:
        lines = [f"{self.repeats} draws of {self.drawn}:"]
        for term, count in self.counts.items():
            low, high = self.interval(term)
            lines.append(f"  {term}: kept {count} times ({low:.2f} to {high:.2f})")
        for terms, count in self.sets.items():
            lines.append(f"  {' + '.join(terms)} alone: {count} times")
        return "\n".join(lines)


def binomial(count: int, repeats: int, outside: float = 0.05) -> tuple[float, float]:
    """Exact interval of a frequency (Clopper & Pearson (1934), Biometrika 26, 404)."""
    low = float(beta.ppf(outside / 2, count, repeats - count + 1)) if count > 0 else 0.0
    high = float(beta.ppf(1 - outside / 2, count + 1, repeats - count)) if count < repeats else 1.0
    return low, high


def frequencies(
    reductions: Reductions, penalty: Penalty | Subsets, strength: float | None, optimum: Floats, *,
    repeats: int = 20, seed: int = 0, progress: Progress | None = None,
) -> Frequencies:  # fmt: skip
    """Choose again for each draw, from the optima on all data; strength : that of all data, which stays.

    optimum : x of the penalised fit on all data.
    """
    if repeats < 1:
        raise FitError(f"repeats is {repeats}; at least one draw is needed")
    stage, found = reductions.stage, []
    for k, weights in enumerate(drawn_weights(stage, repeats, np.random.default_rng(seed))):
        found.append(_kept(reductions, weighted(stage, weights), penalty, strength, optimum))
        if progress is not None:
            progress("draw", k + 1, repeats)
    sets = {terms: found.count(terms) for terms in sorted(set(found), key=found.count, reverse=True)}
    counts = {label: sum(label in terms for terms in found) for label in reductions.labels}
    return Frequencies("tests" if len(stage.factor) > 1 else "blocks of frames", repeats, counts, sets)


def weighted(stage: Stage, weights: Floats) -> Stage:
    """The stage with the squares of white residuals counted `weights` (tests, entries) times."""
    return replace(stage, factor=stage.factor / np.sqrt(np.maximum(weights, ABSENT))[:, None, :])


def drawn_weights(stage: Stage, repeats: int, rng: np.random.Generator) -> Iterator[Floats]:
    """(tests, entries) how often each entry was drawn: whole tests, or blocks of frames of the only one."""
    tests, entries = stage.objective.entries.present.shape
    frame = stage.objective.entries.frame
    for _ in range(repeats):
        if tests > 1:
            yield np.repeat(rng.multinomial(tests, np.full(tests, 1.0 / tests))[:, None], entries, axis=1).astype(float)
        else:
            yield _blocks(int(frame.max()) + 1, rng)[frame]


def _blocks(frames: int, rng: np.random.Generator) -> Floats:
    """(frames,) how often each frame was drawn, in blocks that go round the end, so that all are alike."""
    length = min(BLOCK, max(frames // 2, 1))
    counts = np.zeros(frames)
    for start in rng.integers(frames, size=-(-frames // length)):
        counts[(start + np.arange(length)) % frames] += 1.0
    return counts


def _kept(
    reductions: Reductions, stage: Stage, penalty: Penalty | Subsets, strength: float | None, optimum: Floats
) -> Terms:
    if isinstance(penalty, Subsets):
        return Reductions(stage, reductions).lowest(penalty.EVERY).kept
    penalised = Penalised.of(stage.objective, penalty, strength)
    corners: Sequence[Floats] = [stage.placed(one.law, one.x) for one in reductions.singles()]
    x = penalised_fit(stage, penalised, [optimum, reductions.whole().x, *corners]).u
    return kept_of(stage.shares(x))
