"""Sparsity: what a penalty left of a sum of terms, and what that cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from scipy.stats import chi2

from creepkit.inverse.measures import Errors
from creepkit.inverse.sparsity.path import Path
from creepkit.inverse.sparsity.reduction import SHARE, Terms


@dataclass(frozen=True)
class Misfit:
    """How well a law fits, on the covariance of the whole sum.

    chi_square : of all outputs, priors included; parameters : of the law that were fitted; bic : chi-square + K ln N.
    errors : {output: Errors} over all used frames.
    """

    chi_square: float
    parameters: int
    bic: float
    errors: Mapping[str, Errors] = field(default_factory=dict)


@dataclass(frozen=True)
class Sparsity:
    """How a sum was reduced; the terms are those of `law`, the sum.

    penalty : its class; strength : None of a choice among subsets, which has none.
    kept, dropped : terms; off : exponents switched off, where BIC did not rise by it.
    proposed : terms that the penalty left, before the reduced law was confirmed.
    shares : contributions without penalty, with it, and after the refit of what was kept.
    whole, reduced : misfits of the sum and of the reduced law on one covariance.
    frames : measured values, N of BIC.
    path : over the strength, where that was chosen automatically (not saved).
    """

    law: str
    penalty: str
    strength: float | None
    kept: Terms
    dropped: Terms
    off: tuple[str, ...]
    proposed: Terms
    shares_without: Mapping[str, float]
    shares_with: Mapping[str, float]
    shares_after: Mapping[str, float]
    whole: Misfit
    reduced: Misfit
    frames: int
    path: Path | None = field(default=None, repr=False, compare=False)

    @property
    def rise(self) -> float:
        """Of chi-square, from the whole sum to the reduced law."""
        return self.reduced.chi_square - self.whole.chi_square

    @property
    def fewer(self) -> int:
        """Parameters that the reduced law does without."""
        return self.whole.parameters - self.reduced.parameters

    @property
    def p_value(self) -> float:
        """Chance of such a rise, or more, if the reduced law is true; 1 where nothing was dropped."""
        return float(chi2.sf(max(self.rise, 0.0), self.fewer)) if self.fewer > 0 else 1.0

    @property
    def excess(self) -> float:
        """BIC of the reduced law less that of the whole sum; below zero where the reduced law is preferred."""
        return self.reduced.bic - self.whole.bic

    @property
    def confirmed(self) -> bool:
        """Whether what the penalty proposed stood the comparison with the whole sum."""
        return self.proposed == self.kept

    @property
    def verdict(self) -> str:
        """What was dropped, what that cost, and whether it was too much, in one or two sentences."""
        gone = _listed([*self.dropped, *(f"exponent {name}" for name in self.off)])
        cost = (
            f"chi-square rises by {max(self.rise, 0.0):.1f} for {self.fewer} parameters fewer (p = {self.p_value:.2g}) "
            f"and BIC changes by {self.excess:+.1f}"
        )
        if not gone:
            told = f"all terms of '{self.law}' are kept"
        else:
            told = f"without {gone} of '{self.law}' {cost}: {_listed(self.kept)} suffice{'s' * (len(self.kept) == 1)}"
        if self.confirmed:
            return told
        back = _listed([term for term in self.kept if term not in self.proposed])
        return f"{told}. The penalty had dropped {back} too, but without BIC is higher than that of the whole sum"

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and names, without the path."""
        names = ("law", "penalty", "strength", "kept", "dropped", "off", "proposed", "frames")
        shares = {name: dict(getattr(self, name)) for name in ("shares_without", "shares_with", "shares_after")}
        plain = {name: getattr(self, name) for name in names}
        plain = {name: list(v) if isinstance(v, tuple) else v for name, v in plain.items()}
        return {**plain, **shares, "whole": _plain(self.whole), "reduced": _plain(self.reduced)}

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Sparsity:
        """The record that to_dict wrote."""
        lists = {name: tuple(given[name]) for name in ("kept", "dropped", "off", "proposed")}
        misfits = {
            name: Misfit(**{**given[name], "errors": {k: Errors(**v) for k, v in given[name]["errors"].items()}})
            for name in ("whole", "reduced")
        }
        return cls(**{**given, **lists, **misfits})

    def __str__(self) -> str:
        strength = "" if self.strength is None else f" of strength {self.strength:g}"
        width = max(map(len, self.shares_without))
        lines = [f"{self.penalty}{strength}: {self.verdict}", f"{'':{width}}  without  with  after"]
        for term, share in self.shares_without.items():
            after = self.shares_after.get(term)
            told = "dropped" if after is None else f"{after:.3f}"
            lines.append(f"{term:{width}}  {share:.3f}  {self.shares_with[term]:.3f}  {told}")
        return "\n".join([*lines, f"(contributions; below {SHARE:g} a term is dropped)"])


def _plain(misfit: Misfit) -> dict[str, Any]:
    return {**asdict(misfit), "errors": {name: asdict(errors) for name, errors in misfit.errors.items()}}


def _listed(names: list[str] | Terms) -> str:
    """'a', 'b' and 'c'."""
    quoted = [f"'{name}'" if not name.startswith("exponent ") else name for name in names]
    return quoted[0] if len(quoted) == 1 else " and ".join([", ".join(quoted[:-1]), quoted[-1]]) if quoted else ""
