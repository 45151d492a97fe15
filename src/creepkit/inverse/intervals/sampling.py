"""Samples of the posterior by Markov chain Monte Carlo: many walkers that learn their steps from one another, by emcee.

Moves are those of differential evolution (ter Braak (2006), Stat. Comput. 16, 239), a fifth of them its snooker update
(ter Braak & Vrugt (2008), Stat. Comput. 18, 435): on normal densities of 2 to 7 dimensions they forget in a third of
the steps that emcee's own stretch move takes. Each step is two batched predictions of half the walkers. Where Laplace's
approximation bends (parameters at bounds, laws with little data) samples do not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.mixture import INTERVAL_PROBABILITIES
from creepkit.inverse.intervals.opening import interval_problem
from creepkit.inverse.intervals.posterior import Posterior
from creepkit.inverse.intervals.quantities import DerivedQuantity, quantity_of, local_exponent, log_rate
from creepkit.inverse.search.refining import IterationCallback
from creepkit.inverse.threads import single_threaded_blas
from creepkit.records import Predictor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONVERGED_LENGTH = 50.0
"""Steps over autocorrelation time that emcee's authors ask for before its estimate may be trusted."""
MAX_START_DRAWS = 50
"""Draws of a walker's start that may fall outside the bounds."""


@dataclass(frozen=True, eq=False)
class PosteriorSamples:
    """Draws of a law's values from their posterior.

    chain : (steps, walkers, parameters) conditioned coordinates u, all of them; log_probability : (steps, walkers).
    burn : steps left out at the beginning. acceptance : mean share of accepted moves.
    autocorrelation : (parameters,) steps until a walker has forgotten where it was.
    """

    coordinates: Coordinates
    chain: Floats
    log_probability: Floats
    burn_in: int
    acceptance_fraction: float
    autocorrelation_time: Floats
    notes: tuple[str, ...] = ()

    @property
    def u(self) -> Floats:
        """(draws, parameters) after the burn-in."""
        return self.chain[self.burn_in :].reshape(-1, self.chain.shape[-1])

    @property
    def values(self) -> dict[str, Floats]:
        """{parameter: (draws,)} in the author's units."""
        theta = self.coordinates.theta(self.u)
        table = self.coordinates.law.table.items()
        return {n: np.exp(theta[:, k]) if p.scale == "log" else theta[:, k] for k, (n, p) in enumerate(table)}

    @property
    def converged(self) -> bool:
        """Whether the chain is long against its autocorrelation time."""
        return bool(len(self.chain) > CONVERGED_LENGTH * self.autocorrelation_time.max())

    @property
    def effective_sample_size(self) -> float:
        """Number of independent draws that tell as much."""
        return float(len(self.u) / self.autocorrelation_time.max())

    def interval(self, quantity_or_name: str | DerivedQuantity) -> tuple[float, float, float]:
        """Median and 95 % interval of a parameter, by name, or another quantity: (median, low, high)."""
        quantity = quantity_of(self.coordinates, quantity_or_name)
        quantiles = quantity.to_unit(np.quantile(quantity.function(self.coordinates)(self.u), INTERVAL_PROBABILITIES))
        return float(quantiles[0]), float(quantiles[1]), float(quantiles[2])

    def rate(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Median creep rate, 1/s, with its 95 % interval: (rate, low, high), each of the broadcast shape."""
        draws = log_rate(self.coordinates, stress, temperature, strain, time)(self.u)
        median, low, high = np.exp(np.quantile(draws, INTERVAL_PROBABILITIES, axis=0))
        return median, low, high

    def local_exponent(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Median local stress exponent with its 95 % interval."""
        draws = local_exponent(self.coordinates, stress, temperature, strain, time)(self.u)
        median, low, high = np.quantile(draws, INTERVAL_PROBABILITIES, axis=0)
        return median, low, high

    def plot(self, path: str | Path | None = None) -> Figure:
        """Every pair of parameters, and each alone; written to `path` when given."""
        from creepkit.inverse.intervals.plots import pairs_figure

        return pairs_figure(self, path)

    def __str__(self) -> str:
        width = max(len(name) for name in self.coordinates.names)
        lines = [
            f"{self.chain.shape[1]} walkers, {len(self.chain)} steps ({self.burn_in} left out): acceptance "
            f"{self.acceptance_fraction:.2f}, autocorrelation {self.autocorrelation_time.max():.3g} steps, some "
            f"{self.effective_sample_size:.0f} independent draws"
        ]
        for name, param in self.coordinates.law.table.items():
            middle, low, high = self.interval(name)
            unit = "" if param.unit == "1" else f" {param.unit}"
            lines.append(f"  {name:{width}} = {middle:.5g}  [{low:.4g}, {high:.4g}]{unit}")
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


def sample_posterior(
    fit: Identification, *, walkers: int = 32, steps: int = 1000, seed: int = 0, using: Predictor | None = None,
    progress: IterationCallback | None = None,
) -> PosteriorSamples:  # fmt: skip
    """Sample the posterior of an identification's values; needs emcee.

    walkers : an even number of at least twice the parameters. using : another predictor of the same tests than the
        fit's, such as a surrogate where the fit's is a finite element model.
    """
    emcee, size = _import_emcee(), fit.u.size
    if walkers % 2 or walkers < 2 * size + 2 or steps < 10:
        raise FitError(
            f"{walkers} walkers and {steps} steps were asked for; a law of {size} parameters needs an even number of "
            f"at least {2 * size + 2} walkers, and at least 10 steps"
        )
    posterior = Posterior.from_problem(interval_problem(fit if using is None else replace(fit, predictor=using)), fit.freedom)
    rng = np.random.default_rng(seed)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, size, posterior, vectorize=True, moves=moves)
    start = emcee.State(_initial_walkers(fit, posterior, walkers, rng), random_state=np.random.RandomState(seed).get_state())
    with single_threaded_blas():
        for k, _ in enumerate(sampler.sample(start, iterations=steps)):
            if progress is not None:
                progress("step", k + 1, steps)
    return _posterior_samples(fit, sampler.get_chain(), sampler.get_log_prob(), sampler.acceptance_fraction, emcee)


def _import_emcee() -> Any:
    try:
        import emcee
    except ImportError:
        raise FitError("sampling needs emcee, which is not installed: pip install 'creepkit[mcmc]'") from None
    return emcee


def _initial_walkers(fit: Identification, posterior: Posterior, walkers: int, rng: np.random.Generator) -> Floats:
    """(walkers, parameters) from Laplace's approximation, drawn again where a bound cuts it, ever closer to the fit."""
    root = np.linalg.cholesky(fit.covariance + 1e-14 * np.diag(np.diag(fit.covariance)))
    centre = np.clip(fit.u, posterior.lower, posterior.upper)
    starts = np.empty((walkers, fit.u.size))
    missing = np.ones(walkers, bool)
    for k in range(MAX_START_DRAWS):
        starts[missing] = centre + 0.9**k * rng.normal(size=(int(missing.sum()), fit.u.size)) @ root.T
        starts = np.where(missing[:, None], _reflected(starts, posterior), starts)
        missing &= ~np.isfinite(posterior(starts))
        if not missing.any():
            return starts
    raise FitError(
        f"law '{fit.law.name}': no walker can start, the values lie at the edge of the law's bounds; widen the bounds"
    )


def _reflected(u: Floats, posterior: Posterior) -> Floats:
    """Points beyond a bound thrown back by as much: values at their bound leave half a normal distribution."""
    u = np.where(u < posterior.lower, 2 * posterior.lower - u, u)
    return np.where(u > posterior.upper, 2 * posterior.upper - u, u)


def _posterior_samples(fit: Identification, chain: Floats, log_probability: Floats, accepted: Floats, emcee: Any) -> PosteriorSamples:
    steps = len(chain)
    autocorrelation_time = np.array([float(emcee.autocorr.integrated_time(chain[:, :, k], tol=0)[0]) for k in range(fit.u.size)])
    autocorrelation_time = np.where(np.isfinite(autocorrelation_time), np.maximum(autocorrelation_time, 1.0), steps)
    burn_in = int(min(np.ceil(5 * autocorrelation_time.max()), steps // 2))
    notes = []
    if steps <= CONVERGED_LENGTH * autocorrelation_time.max():
        notes.append(
            f"not converged: the chain is {steps / autocorrelation_time.max():.0f} autocorrelation times long, {CONVERGED_LENGTH:.0f} are needed; "
            f"ask for {int(np.ceil(CONVERGED_LENGTH * autocorrelation_time.max() / 100.0)) * 100 + 100} steps or more"
        )
    acceptance_fraction = float(np.mean(accepted))
    if not 0.05 < acceptance_fraction < 0.8:
        notes.append(f"a share of {acceptance_fraction:.2f} of the moves was accepted, where .2 to .5 is healthy")
    return PosteriorSamples(fit.coordinates, chain, log_probability, burn_in, acceptance_fraction, autocorrelation_time, tuple(notes))
