"""A published creep law of a material: the law with its values, where they hold, and the text that prints them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import LawError, quoted
from creepkit.records.law_with_values import LawWithValues
from creepkit.records.units import celsius_text

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


@checked
@dataclass(frozen=True)
class Material:
    """A creep law of one material as a text prints it, in MPa, mm, s and K.

    name : short, in small letters. title : the material in words.
    law, values : any law, and {parameter: number in its unit}. A law of grain size or another condition keeps it.
    ranges : {"stress": (low, high) MPa, "temperature": K, a condition: its unit} of the tests behind it, or in which
        the source states or evaluates it; without "stress" where it is silent of it.
    source : author, title, table and page, and an address where it can be read.
    form : product form and heat treatment, as far as the source states them.
    covariance : (parameters, parameters), in the law's order, of internal values (ln where the scale is log), where
        the source has it or the data behind it.
    """

    name: str
    title: str
    law: CreepLaw
    values: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    source: str
    form: str = ""
    covariance: Sequence[Sequence[float]] = ()

    def __post_init__(self) -> None:
        origin, law = f"material '{self.name}'", self.law
        object.__setattr__(self, "values", MappingProxyType(law.values(self.values)))
        object.__setattr__(self, "ranges", MappingProxyType(dict(self.ranges)))
        known = ("stress", "temperature", "strain", "time", *(one.name for one in law.conditions))
        for name, (low, high) in self.ranges.items():
            if name not in known or not 0.0 <= low <= high:
                raise LawError(
                    f"{origin}: ranges has {quoted(name)} from {low:g} to {high:g}; give the lower number first, of "
                    f"{', '.join(known)}"
                )
        for label, text in (("title", self.title), ("source", self.source), ("form", self.form)):
            if not text.isprintable() or not (text.strip() or label == "form"):
                raise LawError(f"{origin}: the {label} {text!r} must be one line of text")
        matrix = np.asarray(self.covariance or np.zeros((len(law.names),) * 2), float)
        if matrix.shape != (len(law.names),) * 2 or not np.allclose(matrix, matrix.T):
            raise LawError(
                f"{origin}: the covariance must be a symmetric matrix with a row for each of {', '.join(law.names)}"
            )

    @property
    def spans(self) -> tuple[str, ...]:
        """The ranges in words, each with its unit."""
        units = {"stress": "MPa", "time": "s"} | {one.name: one.unit for one in self.law.conditions}
        found = [] if "stress" in self.ranges else ["any stress (not stated)"]
        for name, (low, high) in self.ranges.items():
            text = f"{low:.4g} to {high:.4g} {units.get(name, '')}".strip()
            found.append(celsius_text(low, high, digits=0) if name == "temperature" else text)
            found[-1] = found[-1] if name in ("stress", "temperature") else f"{name} {text}"
        return tuple(found)

    @property
    def valued(self) -> LawWithValues:
        """The law with its values; product form, range, standard deviations and source go into every export."""
        notes = [f"published law of {self.title}{f' ({self.form})' if self.form else ''}"]
        notes += [f"known for {', '.join(self.spans)}; beyond it is extrapolated"]
        for name, variance in zip(self.law.names, np.diag(np.atleast_2d(self.covariance or 0.0)), strict=False):
            if variance > 0.0:
                shown = f"ln {name}" if self.law.table[name].scale == "log" else name
                notes.append(f"standard deviation of {shown}: {np.sqrt(variance):.3g}")
        law = replace(self.law, title=self.title, references=(self.source,))
        return LawWithValues(law, self.values, notes, ranges=self.ranges, name=self.name)

    def __str__(self) -> str:
        numbers = ", ".join(f"{name} = {value:.6g}" for name, value in self.values.items())
        lines = (f"{self.name}: {self.title}", self.form, str(self.law), numbers, ", ".join(self.spans), self.source)
        return "\n  ".join(line for line in lines if line)
