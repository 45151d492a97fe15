"""How well a law describes and predicts its tests, in the units of who made them, whatever chi-square says of it.

Real tests reject almost every law; a law that is rejected and predicts within a few per cent is useful. Rates
are those of tests the law has not seen: each is compared with what the others say of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.records import is_logarithmic
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import ends, plural, plural_of
from creepkit.reports.verdicts import cause_headline, nuisance_values
from creepkit.reports.wording import first_kind, say
from creepkit.reports.words import FITS, HEADLINES, MEAN_MISFIT, MISSES, ONE_TEST, TRUTHS

if TYPE_CHECKING:
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.inverse.identification import Identification

LARGEST_PER_CENT = 0.5
"""Of ln, from which on a spread is given as a factor."""


USABLE, MOST_DESCRIBED = float(np.log(2.0)), 2
"""Of ln, within which a law is of use: the scatter band of creep tests; and what a headline names."""


WELL_PREDICTED = 0.5
"""Of ln rate, standard deviation of what the others say of a test: where it is larger they say nothing."""


@dataclass(frozen=True)
class Description:
    """Root mean squares of predicted over measured, of ln; NaN of what was not measured.

    rates : of tests left out in turn, of those that the others predict. outputs : {output: of its values}, of strains
    ln, of other outputs relative to their root mean square; with the offset of each test, and without a rate of its
    own. ruptures, minimum_rates : of the tests that state them and of which one is predicted; unpredicted : ruptures of
    which none is.
    """

    rates: float
    outputs: dict[str, float]
    ruptures: float
    minimum_rates: float
    unpredicted: int = 0

    @classmethod
    def of(cls, fit: Identification) -> Description:
        """That of an identification, also of one from a file."""
        ends = [m.rupture.ratio for m in fit.tests if m.rupture is not None and not m.rupture.censored]
        minima = [m.minimum_rate.ratio for m in fit.tests if m.minimum_rate is not None]
        outputs = {
            name: fit.rms if is_logarithmic(name) else errors.relative_rms_error for name, errors in fit.errors.items()
        }
        rates = [one.log_factor for one in fit.left_out if one.sd < WELL_PREDICTED]
        predicted = [ratio for ratio in ends if 0.0 < ratio < np.inf]
        unpredicted = len(ends) - len(predicted)
        return cls(_rms(rates), outputs, _spread(predicted), _spread(minima), unpredicted)

    def items(self) -> list[tuple[str, float]]:
        """(what it describes, root mean square), the most telling first."""
        lost = f" ({self.unpredicted} not predicted)" if self.unpredicted else ""
        known = [(f"rupture times{lost}", self.ruptures), ("minimum creep rates", self.minimum_rates)]
        known += [("creep rates", self.rates)]
        order = sorted(self.outputs, key=lambda name: not is_logarithmic(name))
        as_ln = {name: error if is_logarithmic(name) else np.log1p(error) for name, error in self.outputs.items()}
        known += [(plural_of(name), float(as_ln[name])) for name in order]
        return [(name, value) for name, value in known if np.isfinite(value)][:MOST_DESCRIBED]


def spread_text(spread: float) -> str:
    """A root mean square of ln as "12 %", large ones as "a factor of 2.1"."""
    if spread > LARGEST_PER_CENT:
        return f"a factor of {float(f'{np.exp(min(spread, 50.0)):.2g}'):g}"
    return f"{float(f'{100 * np.expm1(spread):.2g}'):g} %"


@dataclass(frozen=True)
class NewTestInterval:
    """How far one new test may lie from the law, amid the conditions of those that were made.

    quantity : "life" where lives were measured, else "rate". level : "heat" or "laboratory" of which it is another one,
    where the tests tell these apart; else "test". half_width : of the 95 % interval of ln of predicted over measured,
    as root mean square over the conditions of the tests: of law, scatter between tests, and what a rejected law misses.
    """

    quantity: str
    level: str
    half_width: float

    @classmethod
    def of(cls, fit: Identification) -> NewTestInterval | None:
        """That of an identification; None of so few tests that they do not show how they scatter."""
        scatter = fit.rate_scatter
        if scatter is None or len(scatter.tests) < MINIMUM_TESTS or scatter.stresses.size != len(scatter.tests):
            return None
        lives = [m.rupture for m in fit.tests if m.rupture is not None and m.rupture.used and not m.rupture.censored]
        measured = lives or [m.minimum_rate for m in fit.tests if m.minimum_rate is not None and not m.outputs]
        ends = [(one.low, one.high) for one in measured if one is not None]  # of a single test of its own heat
        level = next((one for one in ("heat", "laboratory") if one in scatter.levels), "test")
        drawn = scatter.levels if not ends else [level] * (level != "test")
        low, high = np.array(ends).T if ends else fit.rate(scatter.stresses, scatter.temperatures, warn=False)[1:]
        variance = (np.log(high / low) / (2.0 * NORMAL_QUANTILE)) ** 2 + sum(map(scatter.posterior.mean_square, drawn))
        known = variance[np.isfinite(variance)]
        if not known.size:
            return None
        return cls("life" if lives else "rate", level, float(NORMAL_QUANTILE * np.sqrt(known.mean())))

    @property
    def text(self) -> str:
        """Such as "a new test's rate within a factor of 1.18 (95 %)"."""
        factor = float(np.exp(min(self.half_width, 50.0)))
        shown = f"{factor:.3g}" if factor < 2.0 else f"{factor:.2g}"
        return ONE_TEST.format(level=self.level, quantity=self.quantity, factor=shown)


def headline(fit: Identification) -> str:
    """Where the law is to be used, how far a new test may lie from it, then whether it could be the true one."""
    items = Description.of(fit).items()
    bad = _said(MISSES, _usable(items, False))
    new = NewTestInterval.of(fit)
    values = {
        "law": fit.law.name,
        "range": tested_range(fit),
        "within": f"on average it fits {_said(FITS, items)}" if new is None else new.text,
        "bad": bad,
        "truth": _truth(fit),
        "described": f"; so far it misses {_said(MISSES, items)}" if items else "",
    }
    return HEADLINES[headline_kind(fit)].format(**values)


def mean_misfit_text(fit: Identification) -> str:
    """The mean misfit of the tests that were fitted, where the headline says instead how far a new one may lie."""
    usable = headline_kind(fit) in ("use", "use only", "use in part") and NewTestInterval.of(fit) is not None
    items = ", ".join(f"{name} {spread_text(value)}" for name, value in Description.of(fit).items())
    return MEAN_MISFIT.format(misfits=items) if usable else ""


def _said(words: str, items: list[tuple[str, float]]) -> str:
    return " and ".join(words.format(what=name, misfit=spread_text(value)) for name, value in items)


def headline_kind(fit: Identification) -> str:
    """Which of HEADLINES is said of a law."""
    items, in_tests = Description.of(fit).items(), fit.adequacy is not None and fit.adequacy.lies_in_tests
    good, bad = _usable(items), _usable(items, False)
    if not (fit.converged or in_tests):  # a cause goes before the search
        return "not found"
    only = rejected(fit) and not in_tests
    return first_kind({"use in part": good and bad, "use nothing": bad, "fitted": not good, "use only": only}) or "use"


def headline_role(fit: Identification) -> str:
    """How serious the first line is: "warning" of a law not to be used, "caution" of one that is in part, "" else."""
    kind = headline_kind(fit)
    usable = kind not in ("use nothing", "not found")
    return "warning" if not usable else "caution" if rejected(fit) or "in part" in kind else ""


def _usable(items: list[tuple[str, float]], usable: bool = True) -> list[tuple[str, float]]:
    """Those of what a law describes that are within a factor of 2, or those that are not."""
    return [pair for pair in items if (pair[1] <= USABLE) is usable]


def rejected(fit: Identification | TemperatureLaw) -> bool:
    """Whether the tests reject the law, so that what it says of them, rates and exponents, is not theirs."""
    return fit.adequacy is not None and fit.adequacy.rejects


def tested_range(*fits: Identification) -> str:
    """Stresses and temperatures of the tests, "80–200 MPa, 575–625 °C"; with ± where the load was reversed."""
    stresses, kelvin = ([end for fit in fits for end in fit.ranges[name]] for name in ("stress", "temperature"))
    programs = [test.loading.program() for fit in fits for test in fit.histories if test.loading.quantity == "stress"]
    is_reversed = any(one.values.min() < 0.0 < one.values.max() for one in programs)
    return f"{'±' * is_reversed}{ends(stresses, 3)} MPa, {celsius_text(min(kelvin), max(kelvin), digits=0)}".replace(
        " to ", "–"
    )


def tests_text(fit: Identification) -> str:
    """How many tests until when; of tests of which a minimum rate alone is known these, without a time."""
    timed = [h.times[-1] for h in fit.histories if h.outputs or h.rupture_time is not None or h.unruptured]
    longest = max(timed, default=0.0) if fit.histories else fit.ranges["time"][1]
    until = f" to {time_text(longest)}" if longest > 0.0 else ""
    are_rates = bool(fit.histories) and not timed
    return f"{plural(len(fit.tests), 'minimum rate' if are_rates else 'test')}{until}"


def _truth(fit: Identification) -> str:
    """Whether the law could be the true one."""
    adequacy = fit.adequacy
    if adequacy is None or adequacy.verdict == "cannot be judged":
        return TRUTHS["not judged"]
    only = [*adequacy.implausible, None][0]
    kind = first_kind(
        {
            "implausible": adequacy.explains and only,
            "explains": adequacy.explains,
            "in tests": adequacy.lies_in_tests,
            "rejected": True,
        }
    )
    if kind == "implausible" and only is not None:
        return say(TRUTHS[kind], **nuisance_values(only))
    return say(TRUTHS[kind], cause="".join(map(cause_headline, adequacy.explanations[:1])))


def _spread(ratios: list[float]) -> float:
    return _rms([float(np.log(r)) if 0.0 < r < np.inf else np.nan for r in ratios])


def _rms(values: list[float]) -> float:
    """Root mean square; NaN of nothing, and where one is not known."""
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")
