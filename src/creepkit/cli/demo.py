"""`creepkit demo`: the studies that ship with the package, measured creep curves first, on one screen."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.reports.blocks import aligned
from creepkit.reports.terminal import ProgressBar, tell, tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.studies.result import StudyResult


EXAMPLE_DATA = Path(__file__).parents[1] / "example_data"


MEASURED = EXAMPLE_DATA / "cmsx6"
"""Nine creep curves of CMSX-6, most of them to rupture."""


PLANTED = EXAMPLE_DATA / "planted_creep_curves"
"""Nine simulated creep curves of bars, and the truth behind them."""


PLANTED_BULGE = EXAMPLE_DATA / "planted_bulge_test"
"""A simulated bulge test of one dimple, and the truth behind it."""


HEADINGS = {
    MEASURED: "MEASURED: nine creep curves of CMSX-6 at 980 °C, thinned; six tests ruptured, three were stopped\n"
    "(Federal Institute for Materials Research and Testing, doi 10.5281/zenodo.13937986, CC BY 4.0)",
    PLANTED_BULGE: "\nSIMULATED: a dimple with camera noise, at two pressures; laws by finite elements",
}
"""What is said before the study of each."""


FOLDERS = {"curves": PLANTED, "bulge": PLANTED_BULGE, "ruptures": MEASURED}
"""{folder that --data writes: where its files come from}."""


def command(
    to: Annotated[Path, typer.Option(help="Folder for results; made if needed."), OutputPath("folder")] = Path("demo"),
    data: Annotated[
        bool, typer.Option("--data", help="Write the data alone: the folders curves, bulge and ruptures.")
    ] = False,
) -> None:
    """Run the studies that ship: creep curves, a bulge test.

    Rupture times are printed beside the measured ones, the true law of the simulated test beside the identified one.
    Each study leaves a report; 'creepkit run' carries out such a study of your own.
    """
    if data:
        _write_data(to)
        return
    started = time.perf_counter()
    studies = {to / "creep_curves": MEASURED, to / "bulge_test": PLANTED_BULGE}
    results = [_run(source, folder) for folder, source in studies.items()]
    tell(f"time: {time.perf_counter() - started:.0f} s")
    tell(f"results, and the best law of each as LaTeX and Python: {to}")
    tell(f"reports: {' '.join(str(result.report) for result in results)}")


def _write_data(to: Path) -> None:
    """The example data without their study files, to try the commands on."""
    from creepkit.errors import HistoryError
    from creepkit.files.writing import check_folder_target, write_bytes

    for name, source in FOLDERS.items():
        folder = to / name
        files = [path for path in sorted(source.iterdir()) if path.suffix in (".csv", ".json", ".md")]
        check_folder_target(folder, HistoryError, tuple(path.name for path in files))
        folder.mkdir(parents=True, exist_ok=True)
        for path in files:
            write_bytes(path.read_bytes(), folder / path.name, HistoryError)
        tell_written(folder, f": {len(files)} files")


def _run(data: Path, folder: Path) -> StudyResult:
    """Carry out the study of example data, and print what it found; FitError where a stage fails."""
    import creepkit as ck
    from creepkit.errors import FitError
    from creepkit.reports.answer import answer_text

    tell(HEADINGS[data])
    study = ck.Study.load(data / "study.toml")
    with ProgressBar() as progress:
        result = study.run(to=folder, progress=progress.tick if sys.stdout.isatty() else None)
    for failure in result.failures:
        raise FitError(f"{failure.stage}: {failure.sentence}")
    ranking = result.rankings[""]
    tell(answer_text(ranking.best, ranking, "report.html"))
    if data == PLANTED_BULGE:
        _print_truth(data, ranking.best)
    return result


def _print_truth(folder: Path, fit: Identification) -> None:
    """The true values beside the identified ones."""
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    rows = []
    for estimate in fit.estimates if fit.law.name.startswith(truth["law"]) else ():
        true_value = truth["values"][estimate.name]
        inside = "yes" if estimate.low <= true_value <= estimate.high else "no"
        interval = f"{estimate.low:.4g} to {estimate.high:.4g}"
        rows.append((estimate.name, f"{true_value:.4g}", f"{estimate.value:.4g}", interval, inside))
    if "rate_scatter" in truth:
        sds = f"{100 * truth['rate_scatter']:.0f} %", f"{100 * fit.noise_model.rate:.0f} %"
        rows.append(("rate between tests", *sds, "", ""))
    tell(f"the truth: {truth['law']}")
    for line in aligned(("parameter", "true", "identified", "95 % interval", "inside"), rows):
        tell(f"  {line}")
