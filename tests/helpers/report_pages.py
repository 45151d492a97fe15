"""A small ranking for reports, and names of tests as they must not be trusted."""

from functools import cache

import creepkit as ck
from creepkit.reports.contents import Attachment, Exclusion, ExportedFile, ReportContents, ReportGroup, ReportProvenance
from creepkit.reports.contents import StageFailure as Failure
from helpers.planted_bars import SPL, bars

HOSTILE = (
    "<script>alert(1)</script>",
    "\"'><img src=x onerror=alert(1)>]]></style></svg><!--",
    "turned \u202e round\u2066 $x^2$ {{ 7 * 7 }} &amp; % \x07\x00\n<b>second line</b>",
    "long " + "<i>x</i>" * 1250,
)
"""Names of tests, of a material, and of whatever has a name."""


@cache
def ranking(hostile: bool = False):
    """Two laws of two bars; the second law is the planted one."""
    law = ck.law("strain-hardening")
    tests = bars(law, SPL, [ck.constant_stress(s) for s in (40.0, 60.0)], seed=1, frames=60)
    names = (HOSTILE[1], HOSTILE[0] + HOSTILE[2] + HOSTILE[3]) if hostile else ("bar 0", "bar 1")
    tests = [test.replace(name=name, alloy=names[0], source=name) for test, name in zip(tests, names, strict=True)]
    return ck.select(["norton", "strain-hardening"], tests, starts=1, sums=False)


def contents(hostile: bool = False) -> ReportContents:
    """A report with every small part."""
    result = ranking(hostile)
    name = HOSTILE[1] if hostile else "study"
    exclusions = (Exclusion(result.best.tests[0].name, (3, 4, 5), f"outlier of {name}"),)
    return ReportContents(
        title=f"Creep of {name}",
        groups=(ReportGroup(name, result),),
        quality=ck.check_data_quality(result.best.histories),
        exclusions=exclusions,
        forecasts={name: result.forecast(result.best.histories[0])},
        exports=(ExportedFile(f"{name}/law.py", name, f"# {name}\nx = 1\n"),),
        failures=(Failure(f"design {name}", f"no test '{name}' is there"),),
        provenance=ReportProvenance(
            {name: "1"}, 7, {name: {name: [name, 1]}}, {name: "0" * 64}, (f"creepkit run {name}",)
        ),
        attachments=(Attachment("study.toml", name.encode()),),
        notes=(f"a note on {name}",),
    )
