"""The example studies of public data, carried out from their files to their reports.

    python tests/benchmarks/studies.py [--only NAME] [--write]

CMSX-6 (nine creep curves at one temperature), Alloy 617 (94 creep tests at six temperatures) and Inconel 625 (nine
bulge tests by finite elements), as examples/studies declares them, and the planted study that ships. CPU time is that
of one process on an empty folder of results, with compiled laws in the cache; then of the same run again in that
process, which reads what is kept. The report is one HTML file, which carries study, lock and data.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from measured import Page, arguments, progress

import creepkit as ck

ROOT = Path(__file__).resolve().parents[2]
STUDIES = {
    "planted": ck.example_data("planted creep curves") / "study.toml",
    **{name: ROOT / "examples" / "studies" / f"{name}.toml" for name in ("cmsx6", "alloy617", "inconel625")},
}


def main() -> None:
    """Carry out each study twice, and print how it ended."""
    parser = arguments(__doc__)
    parser.add_argument("--only", choices=list(STUDIES), help="one study")
    options = parser.parse_args()
    page = Page("studies", __doc__)
    page.table(
        "study", "tests", "stages made", "failed", "CPU s", "CPU s of the same run again", "report, MB", "best law"
    )
    for name in [options.only] if options.only else STUDIES:
        try:
            study = ck.Study.load(STUDIES[name])
        except ck.errors.StudyError as error:
            progress(f"left out: {error}")
            continue
        with tempfile.TemporaryDirectory() as folder:
            times = []
            for _ in range(2):
                start = time.process_time()
                result = study.run(to=folder, progress=lambda *_: None)
                times.append(f"{time.process_time() - start:.1f}")
            made = sum(one.state in ("made", "kept") for one in result.stages)
            assert result.report is not None
            size = f"{result.report.stat().st_size / 1e6:.2f}"
            best = "; ".join(ranking.best.law.name for ranking in result.rankings.values())
            page.row(name, len(result.measured), made, len(result.failures), *times, size, best)
        sys.stdout.flush()
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
