"""Identifications and their ranking as the files that `creepkit report`, `app`, `predict` and `export` read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from creepkit.reports.contents import ExportedFile

if TYPE_CHECKING:
    from creepkit.inverse.selection.ranking import Ranking


def identified_files(rankings: Mapping[str, Ranking]) -> list[ExportedFile]:
    """Each law's identification, and ranking.json with their weights, which names them beside itself.

    rankings : {group of tests: its laws}; of several groups the names begin with the group.
    """
    from creepkit.files.json_documents import json_text
    from creepkit.inverse.identification_document import identification_to_json
    from creepkit.inverse.ranking_document import ranking_to_document

    files: list[ExportedFile] = []
    taken: set[str] = set()
    for group, ranking in rankings.items():
        prefix = f"{group}_" if len(rankings) > 1 else ""
        weights: dict[str, float] = {}
        for one in ranking.laws:
            name = _file_name(f"{prefix}{one.fit.law.name}", taken)
            weights[name] = one.weight
            text = json_text(identification_to_json(one.fit))
            files.append(ExportedFile(name, f"identification of {one.fit.law.name}, read by ck.load", text))
        name, text = _file_name(f"{prefix}ranking", taken), json_text(ranking_to_document(weights))
        files.append(ExportedFile(name, "ranking, with the identifications in the same folder", text))
    return files


def _file_name(text: str, taken: set[str]) -> str:
    """A name that any system can save, and that no other file has."""
    stem = re.sub(r"[^A-Za-z0-9._=-]+", "-", text).strip("-_.")[:80] or "law"
    name, number = f"{stem}.json", 2
    while name.lower() in taken:
        name, number = f"{stem}-{number}.json", number + 1
    taken.add(name.lower())
    return name
