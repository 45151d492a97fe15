"""Small studies that are run, and what their results are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import creepkit as ck
from creepkit.inverse.identification_document import identification_to_json
from creepkit.studies.result import StudyResult

STUDY = """\
[study]
title = "two laws"
[data]
files = ["data/*.csv"]
[identification]
laws = ["norton", "strain-hardening"]
group_by = "alloy"
starts = 1
frames = 12
[selection]
sums = false
further_laws = 0
[[forecast]]
name = "next"
group = "A"
load = { stress_MPa = 60 }
end_h = 50
draws = 50
[[export]]
target = "python"
file = "law.py"
"""


ONE_FIT = """\
[study]
title = "one law"
[data]
files = ["data/*850C*.csv"]
[identification]
laws = ["norton"]
temperature = "none"
starts = 1
frames = 12
"""


def study_in(folder: Path, text: str = STUDY) -> Path:
    (folder / "data").mkdir(parents=True)
    for source in sorted(ck.example_data("planted creep curves").glob("*MPa.csv")):
        alloy = {"750": "A", "850": "B"}.get(source.name[8:11])
        if alloy and "_to_" not in source.name:
            content = source.read_text()
            (folder / "data" / source.name).write_text(f"# alloy: {alloy}\n{content}")
    path = folder / "study.toml"
    path.write_text(text)
    return path


def states(result: StudyResult) -> dict[str, str]:
    return {one.name: one.state for one in result.stages}


def made(result: StudyResult) -> set[str]:
    return {name for name, state in states(result).items() if state == "made"}


def numbers(result: StudyResult) -> Any:
    """All numbers of the results, without the times at which they were made."""
    laws = {}
    for group, ranking in result.rankings.items():
        for one in ranking.laws:
            content = json.loads(json.dumps(identification_to_json(one.fit)))
            content["provenance"].pop("when")
            laws[group, one.fit.law.name] = (content, one.excess, one.weight, one.chi_square)
    forecasts = {name: str(forecast) for name, forecast in result.forecasts.items()}
    return laws, forecasts, {name: r.verdict for name, r in result.rankings.items()}
