"""Sentences of creepkit.reports.words with their values, and the numbers that stand in them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from string import Formatter
from typing import Any

import numpy as np

from creepkit.records import is_logarithmic, output_unit
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import first_of, listed

SMALLEST_SHOWN_P_VALUE, LARGEST_SHOWN_ODDS = 1e-12, 13.8
"""p-values below, and ln of odds above, are shown as such."""


def p_value_text(p: float) -> str:
    """A probability as "p = 0.028"."""
    if p <= SMALLEST_SHOWN_P_VALUE:
        return f"p < {SMALLEST_SHOWN_P_VALUE:g}"
    return "" if np.isnan(p) else f"p = {p:.{2 if p >= 1e-3 else 1}g}"


def noises_text(noises: float) -> str:
    """Multiples of a noise to two digits, without a power of ten."""
    return f"{float(f'{noises:.2g}'):g}" if np.isfinite(noises) and noises < 1e5 else f"{noises:.2g}"


def odds_text(log_odds: float) -> str:
    """Odds as "a factor of 30"; log_odds : their ln."""
    more = " or more" if log_odds > LARGEST_SHOWN_ODDS else ""
    return f"a factor of {float(f'{np.exp(min(log_odds, LARGEST_SHOWN_ODDS)):.1g}'):,.0f}{more}"


def shown_unit(output: str, specimen: str = "") -> tuple[float, str]:
    """By what an output is multiplied where it is shown, and its unit then: strains in per cent."""
    return (100.0, "%") if is_logarithmic(output) else (1.0, output_unit(output, specimen))


def amount_text(value: float, output: str) -> str:
    """So much of an output, strains in per cent."""
    factor, unit = shown_unit(output)
    return f"{factor * value:.2g} {unit}".strip()


FORMATS: Mapping[str, Callable[[Any], str]] = {
    "%": lambda share: f"{100 * share:.2g} %",
    "C": lambda kelvin: celsius_text(kelvin, kelvin),
    "and": lambda names: listed(names) if names else "",
    "but": "; but ".join,
    "commas": ", ".join,
    "factors": lambda factors: " and ".join(f"{one:.3g}" for one in factors),
    "first": lambda names: f"'{names[0]}'{first_of(names[1:], 0)}" if names else "",
    "h": time_text,
    "kJ/mol": lambda energy: f"{energy / 1e3:.3g} kJ/mol",
    "noises": noises_text,
    "odds": odds_text,
    "or": " or ".join,
    "or with": " or with ".join,
    "p": p_value_text,
    "quoted": lambda names: " and ".join(f"'{name}'" for name in names),
    "six": lambda names: first_of(names, 6),
    "two": lambda names: first_of(names, 2),
    "whole %": lambda share: f"{100 * share:.0f} %",
}
"""{what stands behind the colon of a field in a sentence: the text of its value}; others are those of Python."""


class _Words(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        return FORMATS[format_spec](value) if format_spec in FORMATS else format(value, format_spec)


_WORDS, _PART, _FIELD = _Words(), re.compile("<(.*?)>"), re.compile("{.*?}")
"""Part of a sentence that may be left out, and a field."""


def say(text: str, /, **values: Any) -> str:
    """A sentence with its values, without the parts between < and > of which a value is empty, nothing or not known."""

    def part(found: re.Match[str]) -> str:
        said = [_WORDS.vformat(field, (), values) for field in _FIELD.findall(found[1])]
        return "" if {*said} & {"", "0", "nan"} else found[1]

    return _WORDS.vformat(_PART.sub(part, text), (), values)


def first_kind(kinds: Mapping[str, object]) -> str:
    """The first of the kinds of a table that holds; "" of none."""
    return next((kind for kind, holds in kinds.items() if holds), "")
