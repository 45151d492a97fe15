"""Results as files: load() reads whatever a result's save() or a command wrote, by the format that the file names."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.files.json_documents import OTHER_DOCUMENTS, read_json
from creepkit.files.reading import FileKind

SAVED = FileKind(
    "a result", FitError, "give an identification, a ranking, a rupture assessment or an exported law of creepkit"
)


FORMATS = {
    "creepkit-identification": ("inverse.identification_document", "identification_from_json"),
    "creepkit-ranking": ("inverse.ranking_document", "ranking_from_json"),
    "creepkit-rupture-assessment": ("rupture_assessment.assessment", "assessment_from_json"),
    "creepkit-valued-law": ("exporters.law_files", "valued_law_from_json"),
}
"""{format: module that is imported where a file has it, and its function of the data and the path}."""


@checked
def load(path: str | Path) -> Any:
    """Return what a JSON file holds: an Identification, a Ranking, a RuptureAssessment or a LawWithValues.

    An identification knows its specimen by name and predicts new histories; attach its own with
    `.with_histories(histories)`, as those of a ranking. Laws are rebuilt from data and their fingerprints checked. The
    identifications of a ranking lie in files beside it.

    The error of the kind of file, in one sentence, says what is wrong with any other.
    """
    data = read_json(Path(path), SAVED)
    name = str(data.get("format")) if isinstance(data, dict) else ""
    if name not in FORMATS:
        other = OTHER_DOCUMENTS.get(name)
        found = f"this is {other[0]}; {other[1]}" if other else f"this is nothing that creepkit saves; {SAVED.advice}"
        raise FitError(f"{path}: {found}")
    module, function = FORMATS[name]
    return getattr(import_module(f"creepkit.{module}"), function)(data, str(path))
