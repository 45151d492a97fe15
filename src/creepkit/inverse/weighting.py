"""What pulls how hard: outputs by their noise or by given weights, tests by how far they are from the others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.covariance import expected_effects, whitener
from creepkit.inverse.entries import Entries
from creepkit.inverse.measures import squares_about
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import Linear, restricted_log_likelihood
from creepkit.inverse.scales import LOGARITHMIC, RUPTURE, LinearScale
from creepkit.inverse.scatter import ASSUMED_RATE, FEW_TESTS, OutputScatter, Scatter, size_of, working_guess
from creepkit.inverse.settings import PAPER_WEIGHTS, Settings
from creepkit.inverse.sizes import estimated

FREEDOM = 4.0
"""Degrees of freedom of Student's t for whole tests; the usual choice where tails are unknown (Lange et al. 1989)."""
LEAST = 1e-2
"""Noise of a likelihood at least, over the floor of the output's scale: simulated histories have none of their own."""
ASKED_FOR = 0.95
"""Residuals are autocorrelated where the likelihood gains more by it than by chance in so many cases; each output that
drifts has two sizes more, how far and for how long."""
ABSENT = 1e-3
"""A drift below this, on its scale, is none."""
ALONE = 0.3
"""Scatter of ln of rupture times to begin from: one of each test, which has no noise, and cannot drift."""
UNWEIGHTED = 1e-6
"""Share of the pull that an output keeps which the weights do not name."""


class Weighting:
    """How the working scatter follows from settings: by likelihood, or by the weights of outputs."""

    def __init__(self, settings: Settings, entries: Entries, errors: Mapping[str, float] | None = None) -> None:
        """errors : {output: standard deviation of what the predictor itself is wrong by}, in the output's unit."""
        self.settings, self.entries, self.errors = settings, entries, errors or {}
        self.likelihood = settings.weights == "likelihood"
        self.relative: Mapping[str, float] | None = None
        if settings.weights == "equal":
            self.relative = _variances(dict.fromkeys(entries.outputs, 1.0), entries)
        elif settings.weights == "paper":
            self.relative = _variances(PAPER_WEIGHTS, entries)
        elif not isinstance(settings.weights, str):
            self.relative = _variances(settings.weights, entries)

    def guess(self) -> Scatter:
        """The working scatter before anything was fitted."""
        start = working_guess(self.entries, self.settings.nuisances)
        return start if self.relative is None else self._scaled(start, 0.3 / min(self.relative.values()))

    def working(self, residuals: Residuals, last: Scatter, linear: Linear | None = None) -> Scatter:
        """The working scatter, given residuals; for a likelihood also made linear."""
        nuisances = self.settings.nuisances
        if self.likelihood:
            assert linear is not None
            return self._shown(linear, last)
        if self.relative is None:
            return estimated(residuals, last, nuisances)
        own = expected_effects(residuals, last)[0]
        left = residuals.values + residuals.slopes * np.take_along_axis(own, residuals.output, axis=1)
        sizes = self.entries.spread([self.relative[name] for name in self.entries.outputs])
        white = (left / sizes)[residuals.present] ** 2 * _each(residuals)[residuals.present]
        scaled = self._scaled(last, float(np.sqrt(np.mean(white))))
        return estimated(residuals, scaled, nuisances, fixed=("misfit",))

    def start(self, tests: int) -> Scatter:
        """Where the alternation begins: the guess, or for a likelihood all sources of scatter at a tenth."""
        if not self.likelihood:
            return self.guess()
        nuisances, found = self.settings.nuisances, {}
        for name, scale, noise in zip(self.entries.outputs, self.entries.scales, self.entries.noise, strict=True):
            offset = size_of(nuisances, "offset", scale.floor, name)
            misfit = ALONE if name == RUPTURE else 0.03 if name in LOGARITHMIC else 0.0
            drift = 0.0 if name == RUPTURE else 0.1
            found[name] = OutputScatter(max(float(noise), LEAST * scale.floor), misfit, offset, drift)
        known = [n for n in nuisances if n.kind == "rate" and (n.sd is not None or tests >= FEW_TESTS)]
        return Scatter(found, size_of(known, "rate", ASSUMED_RATE))

    def _shown(self, linear: Linear, last: Scatter) -> Scatter:
        """The scatter of largest restricted likelihood; drift only where the residuals ask for it.

        A drift is a variance at the edge of what it may be: estimated always, it is above zero half of the time where
        there is none, and widens every interval.
        """
        nuisances, r = self.settings.nuisances, linear.residuals
        white = estimated(r, self._begun(last, 0.0), nuisances, fixed=(), linear=linear)
        whole = estimated(r, self._begun(last, 0.01), nuisances, fixed=(), linear=linear)
        gain = 2.0 * (restricted_log_likelihood(linear, whole) - restricted_log_likelihood(linear, white))
        wandering = sum(sizes.drift > ABSENT for sizes in whole.outputs.values())
        return self._unsure(whole if wandering and gain > chi2.ppf(ASKED_FOR, 2 * wandering) else white)

    def _unsure(self, scatter: Scatter) -> Scatter:
        """The same with the errors of the predictor as drift: they follow the curve, and do not average out."""
        for name, error in self._of_predictor().items():
            scatter = scatter.changed(name, drift=float(np.hypot(scatter[name].drift, error)))
        return scatter

    def stated(self, scatter: Scatter) -> set[tuple[str, str]]:
        """Those (output, source) that were not asked of the data: drifts that are the predictor's error and no more."""
        own = [n for n, error in self._of_predictor().items() if scatter[n].drift <= float(np.hypot(error, ABSENT))]
        return {(name, source) for name in own for source in ("drift", "reach")}

    def _of_predictor(self) -> dict[str, float]:
        """{output: standard deviation} of what the predictor is wrong by, on the output's scale."""
        scales = zip(self.entries.outputs, self.entries.scales, strict=True)
        linear = {name: scale.size for name, scale in scales if isinstance(scale, LinearScale)}
        return {n: self.errors[n] / size for n, size in linear.items() if self.errors.get(n, 0.0) > 0}

    def _begun(self, scatter: Scatter, drift: float) -> Scatter:
        """The same with a drift to begin from, or none, and the noise that was measured."""
        for name, noise, scale in zip(self.entries.outputs, self.entries.noise, self.entries.scales, strict=True):
            begun = max(scatter[name].drift, drift) if drift > 0 and name != RUPTURE else 0.0
            size = max(float(noise), LEAST * scale.floor)
            scatter = scatter.changed(name, noise=size, drift=begun, reach=1.0)
        return scatter

    def _scaled(self, scatter: Scatter, size: float) -> Scatter:
        """Misfits in the ratio that the weights ask for, without noise of their own."""
        assert self.relative is not None
        for name, relative in self.relative.items():
            scatter = scatter.changed(name, noise=0.0, misfit=max(size, 1e-6) * relative)
        return scatter

    def measured(self, working: Scatter) -> Scatter:
        """The scatter from which the whole covariance is estimated: with the noise that was measured."""
        guess = working_guess(self.entries, self.settings.nuisances)
        for name, sizes in guess.outputs.items():
            working = working.changed(name, noise=sizes.noise)
            if self.relative is not None:
                working = working.changed(name, misfit=sizes.misfit)
        return working


def pulling(working: Scatter, entries: Entries) -> Scatter:
    """The working scatter with which values are found: a test's one rupture pulls as hard as its whole curve.

    Frames that follow one another say the same thing many times; a rupture time says it once.
    """
    if RUPTURE not in working.outputs:
        return working
    frames = int((entries.present & ~entries.ruptures)[entries.whole].sum()) / int(entries.whole.sum())
    return working.changed(RUPTURE, misfit=working[RUPTURE].misfit / float(np.sqrt(frames)))


def _variances(weights: Mapping[str, float], entries: Entries) -> dict[str, float]:
    """{output: standard deviation} of independent entries, whose weighted squares are then weight x relative error."""
    unknown = [name for name in weights if name not in entries.outputs]
    if unknown:
        raise FitError(f"weights name '{unknown[0]}', which is not among the outputs {', '.join(entries.outputs)}")
    compared, found = entries.forward(entries.measured), {}
    largest = max(weights.values())
    for position, name in enumerate(entries.outputs):
        mine = entries.present & (entries.output == position)
        total = squares_about([compared[mine]])
        found[name] = float(np.sqrt(total / max(weights.get(name, 0.0), UNWEIGHTED * largest)))
    return found


def _each(residuals: Residuals) -> Floats:
    return np.broadcast_to(residuals.trust[:, None], residuals.values.shape)


def trusts(residuals: Residuals, working: Scatter) -> Floats:
    """(tests,) weights (nu + 1) / (nu + m / s): m the mean squared white residual of a test, s its median over tests.

    Each output is judged on its own, and the worst one counts, if it is worse than the median: amplitudes far from
    those of the twins are not hidden among good widths. Iterated with the fit this is the likelihood of tests that
    scatter as Student's t does: one like the others weighs one, one of ten times their error a twentieth.
    """
    plain = residuals.trusting(np.ones(len(residuals.values)))
    white = np.linalg.solve(whitener(plain, working), plain.values[..., None])[..., 0]
    worst = np.zeros(len(white))
    for position in range(len(working.outputs)):
        mine = plain.present & (plain.output == position)
        having = mine.any(axis=1)
        mean = (np.where(mine, white, 0.0) ** 2).sum(axis=1) / np.maximum(mine.sum(axis=1), 1)
        typical = max(float(np.median(mean[having])), 1e-300)
        worst = np.maximum(worst, mean / typical)
    return np.asarray((FREEDOM + 1) / (FREEDOM + np.maximum(worst, 1.0)))
