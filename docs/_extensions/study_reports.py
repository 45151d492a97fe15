"""Runs the studies of examples/studies, whose reports the tutorials link.

A link such as [the report](report:plate_of_dimples/report) leads to the page that the study of that folder writes. The
studies run in build/studies, where their results stay: only what changed runs again. Copies of the reports in
build/site/reports become part of the documentation as they are.
"""

import shutil
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError
from sphinx.util import logging

import creepkit as ck

STUDIES = Path(__file__).parents[2] / "examples" / "studies"
RUNS = Path(__file__).parents[2] / "build" / "studies"
SITE = Path(__file__).parents[2] / "build" / "site"


def write_reports(app: Sphinx, config: Config) -> None:
    """Run every study, and copy the reports to where Sphinx takes further files from."""
    reports = SITE / "reports"
    shutil.rmtree(reports, ignore_errors=True)
    for study in sorted(STUDIES.glob("*/*.toml")):
        name = f"{study.parent.name}/{study.stem}"
        logging.getLogger(__name__).info("study %s", name)
        result = ck.Study.load(study).run(to=RUNS / study.parent.name)
        if result.failures:
            raise ExtensionError(f"study {name}: {result.failures[0].stage}: {result.failures[0].sentence}")
        if result.report is not None:
            target = reports / study.parent.name
            target.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(result.report, target / result.report.name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect before Sphinx looks for the folder of further files."""
    app.connect("config-inited", write_reports, priority=2)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
