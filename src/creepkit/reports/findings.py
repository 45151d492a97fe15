"""What was found of one material, whatever it was found by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.reports.ranking import equivalents_among_remaining
from creepkit.screening.results import AlloyResult

if TYPE_CHECKING:
    from creepkit.reports.contents import ReportGroup


@dataclass(frozen=True)
class GroupFindings:
    """What was found of one material, whatever it was found by.

    name : of the material, "" where there is only one. fit : the best law, with its values in the author's units.
    ranking : of all laws, None where one law alone was identified. verdict : in a sentence.
    equivalents : pairs of laws that the tests do not separate, a sentence each. remarks : further sentences.
    decisive : whether the verdict is that this law is the one, None where no laws were compared.
    """

    name: str
    fit: Identification
    ranking: Ranking | None
    verdict: str
    equivalents: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    decisive: bool | None = None

    @property
    def of(self) -> str:
        """The material in a caption."""
        return f" of {self.name}" if self.name else ""

    @property
    def weight(self) -> float:
        """Of the best law among those compared, 1 of one law alone."""
        return 1.0 if self.ranking is None else self.ranking.laws[0].weight

    @property
    def fits(self) -> list[Identification]:
        """Of all laws, the best first."""
        return [self.fit] if self.ranking is None else [one.fit for one in self.ranking.laws]


def findings_of(group: ReportGroup) -> GroupFindings | None:
    """What was found of a group; None where nothing was."""
    result = group.result
    if isinstance(result, AlloyResult):
        if not result.identified:
            return None
        ranking = Ranking(result.laws, failed=result.failed_laws) if len(result.laws) > 1 else None
        decisive = None if ranking is None else result.decisive
        return GroupFindings(
            group.name, result.best, ranking, result.verdict, result.equivalents, result.notes, decisive
        )
    if isinstance(result, Ranking):
        equivalents = () if result.decisive else tuple(map(str, equivalents_among_remaining(result)))
        return GroupFindings(group.name, result.best, result, result.verdict, equivalents, (), result.decisive)
    if isinstance(result, Identification):
        return GroupFindings(group.name, result, None, "")
    return None


def with_histories(group: ReportGroup) -> ReportGroup:
    """The group with its histories taken from its result where it states none."""
    found = findings_of(group)
    return group if group.histories or found is None else replace(group, histories=found.fit.histories)
