"""Identifications and their ranking as the files that `creepkit report`, `app`, `predict` and `export` read."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from creepkit.files.writing import LAW_SIGNS, numbered_stems
from creepkit.reports.blocks import printable
from creepkit.reports.contents import ExportedFile

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking


def identified_files(rankings: Mapping[str, Ranking]) -> list[ExportedFile]:
    """Each law's identification, and ranking.json with their weights, which names them beside itself.

    rankings : {group of tests: its laws}; of several groups the names begin with the group.
    """
    from creepkit.files.json_documents import json_text
    from creepkit.inverse.identification_document import identification_to_json
    from creepkit.inverse.ranking_document import ranking_to_document

    files: list[ExportedFile] = []
    prefixes = {group: f"{group}_" if len(rankings) > 1 else "" for group in rankings}
    texts = [
        prefixes[group] + name
        for group, ranking in rankings.items()
        for name in (*(one.fit.law.name for one in ranking.laws), "ranking")
    ]
    names = (f"{stem}.json" for stem in numbered_stems(texts, "law", LAW_SIGNS))
    for ranking in rankings.values():
        beside: list[tuple[str, str]] = []
        for one in ranking.laws:
            name, text = next(names), json_text(identification_to_json(one.fit))
            beside.append((name, hashlib.sha256(text.encode()).hexdigest()))
            files.append(ExportedFile(name, f"identification of {one.fit.law.name}, read by ck.load", text))
        name, text = next(names), json_text(ranking_to_document(ranking, beside))
        files.append(ExportedFile(name, "ranking, with the identifications in the same folder", text))
    return files


def covariance_file(fit: Identification) -> ExportedFile:
    """The covariance of the estimates as a table: in ln of parameters of logarithmic scale, else in their units."""
    correlation = fit.correlation()
    covariance = correlation.matrix * np.outer(correlation.sd, correlation.sd)
    units = ["1" if p.scale == "log" else p.unit for p in fit.law.table.values()]
    values = [p.to_internal(fit.values[name]) for name, p in fit.law.table.items()]
    lines = [
        f"# covariance of the estimates of law {printable(fit.law.name, 160)}; ln A: of the natural logarithm of A, in",
        "# its unit; given the law, in the Gaussian approximation at the optimum",
        ",".join(["parameter", "unit", "estimate", *correlation.names]),
    ]
    for name, unit, value, row in zip(correlation.names, units, values, covariance, strict=True):
        lines.append(",".join([name, unit, f"{value:.12g}", *(f"{v:.12g}" for v in row)]))
    return ExportedFile(
        "covariance.csv", f"covariance of the estimates, {fit.law.title or fit.law.name}", "\n".join(lines) + "\n"
    )
