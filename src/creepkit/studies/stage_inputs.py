"""What the stages of a study are made from: its file, its tests, and what several of them need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.inverse.kept_fits import history_digest
from creepkit.records import History
from creepkit.studies import arguments
from creepkit.studies.inputs import StudyInputs, TestGroup
from creepkit.studies.stage import StageKind, stage_name
from creepkit.studies.study_file import StudyFile

if TYPE_CHECKING:
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class StageInputs:
    """A study with the tests that were read. root : see resolve_paths."""

    file: StudyFile
    inputs: StudyInputs
    root: Path | None = None

    def groups_of(self, place: tuple[str | int, ...], name: str | None) -> list[TestGroup]:
        """The group of a name, or all."""
        if name is None:
            return list(self.inputs.groups)
        found = [group for group in self.inputs.groups if group.name == name]
        if not found:
            names = " and ".join(f"'{group.name}'" for group in self.inputs.groups)
            raise self.file.error((*place, "group"), f"there is no group '{name}' of tests; there are {names}")
        return found

    def needed(self, place: tuple[str | int, ...], table: StageKind, group: TestGroup) -> str:
        """The name of a stage that the table at `place` needs; StudyError where the study has not its table."""
        if getattr(self.file.model, table) is None:
            raise self.file.error(place, f"needs the table [{table}], which the study has not")
        return stage_name(table, group.name)

    def digests(self, histories: Sequence[History]) -> list[str]:
        """A hash of each test."""
        return [history_digest(history) for history in histories]

    @property
    def settings(self) -> IdentificationSettings:
        """Of every identification."""
        return arguments.settings_of(self.file)

    def laws(self, group: TestGroup) -> list[tuple[CreepLaw, CreepLaw]]:
        """Pairs of a candidate as it is named, and as it is fitted to a group."""
        named = arguments.laws_of(self.file)
        return [(law, arguments.law_as_fitted(self.file, law, group.histories)) for law in named]
