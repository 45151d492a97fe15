"""One explanation of what the rates of tests leave of a law, its size, and sentences; a test beside all others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from creepkit.records.units import celsius_text

Kind = Literal["stress exponent", "activation energy", "one test", "two groups"]


LARGEST_KELVIN, LARGEST_LOAD = 40.0, 1.3
"""By which a temperature and a load are mistaken; beyond it is another error."""


UNIT_FACTORS = {
    "strain": (10.0, 100.0, 1000.0, 25.4),
    "load": (6.895, 9.807, 10.0, 1000.0),
    "time": (24.0, 60.0, 3600.0),
}
"""Between units that are taken for one another: percent, per mille and one, inches and mm; ksi, kgf/mm2, bar and GPa
beside MPa; days, hours, minutes and seconds."""


ROUND_TOLERANCE = 0.2
"""Of ln: rates scatter."""


MOST_NAMED, MOST_IN_A_HEADLINE = 6, 2
"""Tests in a sentence, and in a headline."""


MENTIONED_ODDS, VERDICT_ODDS = float(np.log(6.0)), float(np.log(50.0))
"""ln of the odds against the law as it is, from which on an explanation is mentioned, and from which on it alone
contradicts a law that the readings do not: 6 are reached by 0.5 to 1.5 % of right laws whose rates scatter by 5 to
15 %, 50 by 0 to 0.5 % (400 draws each)."""


@dataclass(frozen=True)
class Explanation:
    """One explanation of what the rates of tests leave of a law.

    kind : what changes. tests : names of the tests that it concerns; of two groups those of the smaller.
    size, sd : of ln of the factor on their rates, or what the stress exponent, or the activation energy in J/mol,
        changes by over the tests, and its standard deviation. odds : ln of the odds against the law as it is; 0 of a
        test that stands out and is no explanation.
    ends : the exponent at the lowest and the highest stress, or the energy in J/mol at the lowest and the highest
        temperature; at : these stresses, MPa, or temperatures, K. Where both are one, ends are the exponent by the
        shape of curves and by the rates of tests.
    errors : of one test, errors of what is stated of it, any one of which would make it: {"load", "strain", "time":
        true value over that stated, "temperature": true less stated, K}.
    factors : on the rates of the single tests. near : others that explain nearly as much as the last of them.
    condition, temperature : of the one test, in words and in K. label, beside : of groups that the tests state, what
        the tests of the one are, such as "heat B", and those of the other, such as "heat A", "" where of several.
    without : {parameter: (value, low, high)}, 95 % intervals in the law's units of the tests without the one.
    """

    kind: Kind
    tests: tuple[str, ...]
    size: float
    sd: float
    odds: float
    ends: tuple[float, float] = (0.0, 0.0)
    at: tuple[float, float] = (0.0, 0.0)
    errors: Mapping[str, float] = field(default_factory=dict)
    factors: tuple[float, ...] = ()
    near: tuple[str, ...] = ()
    condition: str = ""
    temperature: float = 0.0
    label: str = ""
    beside: str = ""
    without: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    @property
    def is_of_law(self) -> bool:
        """Whether it is the law that misses what the tests show."""
        return self.kind in ("stress exponent", "activation energy")

    @property
    def is_of_curves(self) -> bool:
        """Whether it is what the shape of curves and the rates of tests say apart of the exponent at one stress."""
        return self.at[0] == self.at[1] > 0.0

    @property
    def headline(self) -> str:
        """In a few words."""
        if self.kind == "one test":
            verb = "do" if len(self.tests) > 1 else "does"
            return f"{self._named_tests} {verb} not agree with the others"
        if self.kind == "two groups":
            few = self._listed(MOST_IN_A_HEADLINE)
            return self._stated_groups or f"tests are of two groups: {few} creep {np.exp(self.size):.2g} times as fast"
        return f"the {self.kind} {self._change}"

    @property
    def sentence(self) -> str:
        """What it is, for people, without a full stop."""
        if self.is_of_law:
            return self.headline + ", more than this law lets it" * (not self.is_of_curves)
        speed = f"{np.exp(self.size):.3g} times as fast"
        if self.kind == "two groups":
            named = self._listed(MOST_NAMED)
            if self.label:
                return f"{self._stated_groups} at equal conditions ({self.label}: {named})"
            return f"tests ({named}) creep {speed} as the others at equal conditions: are they of one material?"
        if len(self.tests) > 1:
            factors = " and ".join(f"{factor:.3g}" for factor in self.factors)
            return f"{self._named_tests} creep {factors} times as fast as the others say{self._values_without}"
        errors = self._errors_text
        cause = f"; it would agree with them {errors}" if errors else ""
        near = f" (or '{self.near[0]}' is to blame)" if self.near else ""
        found = f"{self._named_tests} ({self.condition}) creeps {speed} as the others say{near}"
        return f"{found}{cause}{self._values_without}"

    @property
    def caution(self) -> str:
        """Of tests their size, as a rate and as what would make it, else that it is no verdict; without a full stop."""
        if self.kind != "one test":
            return f"{self.headline}: {np.exp(self.odds):.2g} times likelier than scatter, too little for a verdict"
        factors = " and ".join(f"{factor:.2g}" for factor in self.factors or (float(np.exp(self.size)),))
        verb, named = ("creep", " and ".join(self.tests)) if len(self.tests) > 1 else ("creeps", self.tests[0])
        found = f"{named} {verb} {factors} times as fast as the others lead to expect"
        kelvin = self.errors.get("temperature", 0.0)
        error = f"; {abs(kelvin):.2g} K {'less' if kelvin < 0 else 'more'} than stated would do it"
        return found + error * self.may_be_temperature

    @property
    def may_be_temperature(self) -> bool:
        """Whether an error of temperature of a usual size would make it."""
        return abs(self.errors.get("temperature", np.inf)) <= LARGEST_KELVIN

    @property
    def next_step(self) -> str:
        """What to do about it where it lies in the tests, without a full stop."""
        if self.label:
            key, _, value = self.label.partition(" ")
            return f'identify each {key} apart (group_by = "{key}" in a study, or --only "{key}={value}")'
        if self.kind == "one test" and self.odds < VERDICT_ODDS:
            return f"check the {'temperature' if self.may_be_temperature else 'record'} of {self.tests[0]}"
        if self.kind == "two groups":
            few = self._listed(MOST_IN_A_HEADLINE)
            return f"look how {few} differ (material, heat, rig), then identify each group apart"
        return f"check {self._named_tests} again (label, unit, thermocouple), then identify without"

    @property
    def _stated_groups(self) -> str:
        """How one group that the tests state creeps beside the other, the faster first; "" of others."""
        if not self.label:
            return ""
        factor, first, other = float(np.exp(self.size)), self.label, self.beside or "the others"
        if factor < 1.0 and self.beside:
            factor, first, other = 1.0 / factor, other, first
        return f"{first} creeps {factor:.2g} times as fast as {other}" + ("" if self.beside else " do")

    def _listed(self, most: int) -> str:
        more = len(self.tests) - most
        return ", ".join(self.tests[:most]) + (f" and {more} more" if more > 0 else "")

    @property
    def _named_tests(self) -> str:
        names = " and ".join(f"'{name}'" for name in self.tests)
        return f"tests {names}" if len(self.tests) > 1 else f"test {names}"

    @property
    def _change(self) -> str:
        low, high = self.ends
        if self.is_of_curves:
            return f"is {low:.2g} by the shape of the curves and {high:.2g} by the rates of the tests"
        verb = "rises" if high > low else "falls"
        if self.kind == "stress exponent":
            return f"{verb} from {low:.2g} at {self.at[0]:.4g} MPa to {high:.2g} at {self.at[1]:.4g} MPa"
        first, last = (celsius_text(T, T) for T in self.at)
        return f"{verb} from {low / 1e3:.3g} kJ/mol at {first} to {high / 1e3:.3g} kJ/mol at {last}"

    @property
    def _errors_text(self) -> str:
        """With which errors of what is stated the test would agree, units first."""
        kelvin, load = self.errors.get("temperature", np.inf), self.errors.get("load", np.inf)
        units, others = list[str](), list[str]()
        for quantity, known in UNIT_FACTORS.items():
            ratio = self.errors.get(quantity, 0.0)
            factor = max(ratio, 1.0 / ratio) if ratio > 0 else 1.0
            text = f"if its {quantity} were {factor:.3g} times {'smaller' if ratio < 1 else 'larger'}"
            near = [f"{one:g}" for one in known if abs(np.log(factor / one)) < ROUND_TOLERANCE]
            units += [f"{text} (nearly {near[0]}: a unit?)"] if near else []
            others += [text] if factor > LARGEST_LOAD and not near else []
        likely = list[str]()
        if abs(kelvin) <= LARGEST_KELVIN:
            actual = celsius_text(self.temperature + kelvin, self.temperature + kelvin)
            likely.append(f"at {actual}, {abs(kelvin):.2g} K {'less' if kelvin < 0 else 'more'} than stated")
        if 1.0 / LARGEST_LOAD <= load <= LARGEST_LOAD:
            likely.append(f"at a load {abs(100 * (load - 1)):.2g} % {'lower' if load < 1 else 'higher'}")
        return " or ".join([*units, *likely] or others)

    @property
    def _values_without(self) -> str:
        texts = [f"{name} = {v:.4g} [{low:.4g}, {high:.4g}]" for name, (v, low, high) in self.without.items()]
        return f"; without it {', '.join(texts)}" if texts else ""


@dataclass(frozen=True)
class LeftOut:
    """One test beside all others: what they say of it, and what they would say without it.

    log_factor, sd : ln of its rate over what the others say, and its standard deviation, from both.
    exponent : the stress exponent amid the tests, without it.
    """

    test: str
    log_factor: float
    sd: float
    exponent: float
