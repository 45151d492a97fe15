"""Inconel 625 with the event at 8250 s as an unknown of the rig.

    python tests/benchmarks/inconel_event.py [FOLDER] [--starts 1] [--keep FOLDER] [--write]

FOLDER (../shared/data/dabi/in625) holds nine bulge tests between 716 and 811 C. All slow down at the same time of their
clocks, 8250 s, within a frame and without an elastic jump. Here that is a step of temperature (prior 0 K, standard
deviation 30 K), one for tests 01 to 08 and one for tests 09, 11 and 12, beside the nuisance parameters of the page
[Inconel 625](inconel_625.md): the zero of each camera (standard deviation 12 um) and the thickness of each dimple
(0.4935 mm, standard deviation 0.027 mm). Suspect frames are left out, as is the default. Laws are multiplied by
Arrhenius' factor about 1050 K; n(t) is the drifting exponent without strain hardening. All three outputs are compared,
and whole tests are weighted by how far they lie from the others (Student).

Finished rows are kept in the folder of --keep: stopped and started again, nothing is identified twice. Another version
of creepkit needs another folder.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments, progress
from public_calls import cross_validated_tests

import creepkit as ck
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import interval_quantile

EVENT = 8250.0
"""s, on the clock of every test."""


STRONG = ("test_09", "test_11", "test_12")
"""Tests that slow down by a factor of about three, the others by 1.2 to 1.4."""


RIG = (ck.Nuisance("offset", sd=0.012), ck.Nuisance("thickness", mean=0.4935, sd=0.027))
ARRHENIUS = ck.arrhenius(T_ref=1050.0)
LAWS = {
    "n(t)": ck.law("drifting-exponent").fix(m=0).times(ARRHENIUS),
    "Norton": ck.law("norton").times(ARRHENIUS),
    "strain hardening": ck.law("strain-hardening").times(ARRHENIUS),
    "time hardening": ck.law("time-hardening").times(ARRHENIUS),
    "hyperbolic sine": ck.law("hyperbolic-sine").times(ARRHENIUS),
}
HELD_OUT_LAWS = ("n(t)", "Norton")
EVENTS = (False, True)

Row = dict[str, Any]


@dataclass(frozen=True)
class Runs:
    """What is run: the tests, and how often each search begins."""

    tests: list[ck.History]
    starts: int

    def nuisances(self, event: bool) -> tuple[ck.Nuisance, ...]:
        """Those of the rig; with the event one step of temperature for each of the two groups of tests."""
        if not event:
            return RIG
        weak = tuple(h.name for h in self.tests if h.name not in STRONG)
        steps = (ck.Nuisance("temperature step", "all", sd=30.0, start=EVENT, tests=group) for group in (weak, STRONG))
        return (*RIG, *steps)

    def settings(self, event: bool) -> dict[str, Any]:
        """What all identifications have in common."""
        return {"starts": self.starts, "test_loss": "student", "nuisances": self.nuisances(event)}

    def fit(self, law: str, event: bool) -> Row:
        """One law by finite elements, by least squares."""
        return self.row_of(ck.identify(LAWS[law], self.tests, using="bulge", **self.settings(event)))

    def selection(self, event: bool) -> Row:
        """All laws ranked by select(), which ends with finite elements for those that the surrogate leaves."""
        laws = list(LAWS.values())
        ranking = ck.select(laws, self.tests, using="bulge", sums=False, **self.settings(event))
        names = {law.fingerprint: name for name, law in LAWS.items()}
        rows = [
            {"name": names.get(r.fit.law.fingerprint, r.fit.law.name), "weight": r.weight, "excess": r.excess}
            | {"by": r.fit.provenance["specimen"], **self.row_of(r.fit)}
            for r in ranking.laws
        ]
        return {"verdict": ranking.verdict, "laws": rows, "failed": dict(ranking.failed)}

    def held_out(self, law: str, event: bool) -> Row:
        """Each test predicted through the surrogate from the others, with the step that its group shows."""
        settings = {**self.settings(event), "weights": "likelihood"}
        fit = ck.identify(LAWS[law], self.tests, using=ck.surrogate("dimple"), **settings)
        validated = cross_validated_tests(fit, fit.histories)
        errors = [e["amplitude"].relative_squared_error for e in validated.errors.values()]
        return {"pooled": validated.pooled_error("amplitude"), "errors": errors}

    def row_of(self, fit: Identification) -> Row:
        """What tables need of an identification; JSON."""
        quantile, adequacy = interval_quantile(fit.freedom), fit.adequacy
        assert adequacy is not None
        steps = [n for n in fit.nuisances if n.kind == "temperature step"]
        return {
            "loss": fit.errors["amplitude"].relative_squared_error,
            "own losses": [test["amplitude"].errors.relative_squared_error for test in fit.tests],
            "chi-square of the amplitude": fit.errors["amplitude"].chi_square,
            "chi-square": adequacy.chi_square,
            "discrepancies": {o.output: o.discrepancy for o in adequacy.outputs},
            "noises": {o.output: o.noise for o in adequacy.outputs},
            "adequacy": str(adequacy),
            "parameters": len(fit.law.params),
            "values": values_text(fit),
            "steps": [[n.value, n.value - quantile * n.sd, n.value + quantile * n.sd] for n in steps],
        }


def values_text(fit: Identification) -> str:
    """Values with 95 % intervals; those that lie at a bound, or are not determined, marked with *."""
    return ", ".join(
        f"{e.name} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]{'' if e.verdict == 'determined' else '*'}"
        for e in fit.estimates
    )


def finished_row(file: Path, key: list[Any], compute: Callable[[], Row]) -> Row:
    """The row of a key from a file of earlier runs, which may have been killed, or computed and added to it."""
    for line in file.read_text().splitlines() if file.exists() else ():
        known = json.loads(line)
        if known["key"] == key:
            return dict(known["row"])
    begin = time.process_time()
    row = compute()
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a") as out:
        print(json.dumps({"key": key, "row": row}), file=out, flush=True)
    progress(f"  {key}: {time.process_time() - begin:.0f} CPU s")
    return row


def with_event(name: str, event: bool) -> str:
    return f"{name}, event" if event else name


def steps_cells(row: Row) -> list[str]:
    """The steps of temperature, K, of both groups, with intervals."""
    return [f"{value:.1f} [{low:.1f}, {high:.1f}]" for value, low, high in row["steps"]] or ["-", "-"]


def misfit_cells(row: Row) -> list[str]:
    left = 1e3 * row["discrepancies"]["amplitude"]
    return [f"{row['loss']:.3g}", f"{row['chi-square']:.3g}", f"{left:.2g}"]


MISFIT_HEADS = ("pooled loss", "chi-square", "left of the amplitude, um")
STEP_HEADS = ("step of tests 01 to 08, K", "step of tests 09, 11, 12, K")


def print_fits(page: Page, fits: Mapping[tuple[str, bool], Row], names: list[str]) -> None:
    """Misfit, parameters and steps of each law by finite elements and least squares."""
    page.heading("Misfit by finite elements")
    page.paragraph(
        'Least squares, `ck.identify(law, tests, using="bulge", test_loss="student")`, as in the last rows of the page '
        "[Inconel 625](inconel_625.md), whose columns these are: the pooled loss, and the loss of each test about "
        "its own mean, of the amplitude. Chi-square is that of `fit.adequacy`: reduced, of all outputs, with the noise "
        "that neighbouring frames show, tests of equal weight, at the linear optimum under that noise where this lies "
        "within all bounds and else at the values listed, so that two rows need not compare; what is left is the "
        "standard deviation of the amplitude beyond that noise. The chi-square of the amplitude is `fit.errors`, the "
        "mean over all its frames at the values listed. Steps have 95 % intervals."
    )
    page.table("law", *MISFIT_HEADS, "chi-square of the amplitude", *STEP_HEADS, *names)
    for (name, event), row in fits.items():
        own = (f"{value:.2g}" for value in row["own losses"])
        amplitude = f"{row['chi-square of the amplitude']:.3g}"
        page.row(with_event(name, event), *misfit_cells(row), amplitude, *steps_cells(row), *own)
    page.paragraph("Parameters with 95 % intervals; * is not determined, or at its bound. Units: 1/s, s, J/mol, MPa.")
    page.table("law", "values")
    for (name, event), row in fits.items():
        page.row(with_event(name, event), row["values"])


def print_selection(page: Page, row: Row, event: bool) -> None:
    """Verdict and tables of select()."""
    page.heading(f"Law selection {'with' if event else 'without'} the event")
    page.paragraph(
        '`ck.select(laws, tests, using="bulge", test_loss="student", sums=False)`: likelihood and BIC, of these five '
        "laws alone. Laws far behind the best keep the values of a cheaper predictor where there was one on the way; "
        "the column says what each was identified with."
    )
    page.paragraph(f"The verdict: {row['verdict']}.")
    for name, reason in row["failed"].items():
        page.paragraph(f"{name} could not be identified: {reason}.")
    page.table("law", "parameters", "BIC less the best", "weight", "by", *MISFIT_HEADS, *STEP_HEADS)
    for law in row["laws"]:
        numbers = (law["parameters"], f"{law['excess']:.1f}", f"{law['weight']:.2g}", law["by"])
        page.row(law["name"], *numbers, *misfit_cells(law), *steps_cells(law))
    page.table("law", "values")
    for law in row["laws"]:
        page.row(law["name"], law["values"])


def print_held_out(page: Page, held_out: Mapping[tuple[str, bool], Row], names: list[str]) -> None:
    """Errors of the amplitude of tests that were left out."""
    page.heading("Held-out prediction")
    page.paragraph(
        "Each test predicted from the other eight, by likelihood and through the surrogate, since ten times as many "
        "identifications by finite elements take too long. Thickness is nominal, the offset zero, and the step is what "
        "the others of its group show. Relative squared errors of the amplitude. The hardening laws, which end at m = "
        "0, and the hyperbolic sine are left out."
    )
    page.table("law", "pooled", "median", *names)
    for (name, event), row in held_out.items():
        numbers = (f"{row['pooled']:.3g}", f"{np.median(row['errors']):.2g}")
        page.row(with_event(name, event), *numbers, *(f"{error:.2g}" for error in row["errors"]))


def print_conclusions(
    page: Page,
    fits: Mapping[tuple[str, bool], Row],
    selections: Mapping[bool, Row],
    held_out: Mapping[tuple[str, bool], Row],
) -> None:
    """What remains of the need for n(t), from the tables above."""
    likely = {(law["name"], event): law for event in EVENTS for law in selections[event]["laws"]}
    others = [name for name in LAWS if name != "n(t)"]
    page.heading("What remains of the need for n(t)")
    least = min(
        rows[name, True]["loss"] / rows["n(t)", True]["loss"]
        for rows in (fits, likely)
        for name in LAWS
        if name != "n(t)"
    )
    page.paragraph(
        f"The event {'does not take' if least > 1 else 'takes'} the place of n(t): with it the other laws leave at "
        f"least {least:.1f} times the pooled loss of n(t)."
    )
    for method, rows in (("least squares", fits), ("likelihood", likely)):
        without, with_it = rows["n(t)", False]["loss"], rows["n(t)", True]["loss"]
        best = [min(rows[name, event]["loss"] for name in others) for event in EVENTS]
        page.paragraph(
            f"- By {method} the event takes the pooled loss of n(t) from {without:.2g} to {with_it:.2g} "
            f"({100 * (with_it / without - 1):+.0f} %), and the least of the other laws from {best[0]:.2g} "
            f"to {best[1]:.2g}, {best[0] / without:.0f} and {best[1] / with_it:.0f} times that of n(t). "
            f"Steps with n(t): {' and '.join(steps_cells(rows['n(t)', True]))} K."
        )
    weights = [f"{likely['n(t)', event]['weight']:.2g}" for event in EVENTS]
    decisive = sum(not row["verdict"].startswith("not") for row in selections.values())
    page.paragraph(
        f"- Among the five laws n(t) has a weight of {weights[0]} without and {weights[1]} with the event; {decisive} "
        "of the two verdicts are decisive."
    )
    left = [f"{1e3 * d['amplitude']:.2g} um" for d in (likely["n(t)", e]["discrepancies"] for e in EVENTS)]
    noise = 1e3 * likely["n(t)", True]["noises"]["amplitude"]
    page.paragraph(
        f"- By likelihood n(t) leaves {left[0]} of the amplitude without and {left[1]} with the event, where "
        f"neighbouring frames show a noise of {noise:.2g} um."
    )
    held = [[f"{held_out[name, event]['pooled']:.3g}" for event in EVENTS] for name in ("n(t)", "Norton")]
    page.paragraph(
        f"- Held out, the pooled error of the amplitude without and with the event is {' and '.join(held[0])} with "
        f"n(t) and {' and '.join(held[1])} with Norton."
    )
    marked = re.findall(r"(\w+) [^\s]+ \[[^]]*\]\*", likely["n(t)", True]["values"])
    page.paragraph(
        f"- Not determined, or at their bounds, with the event by likelihood: {', '.join(marked) or 'none'}."
    )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("../shared/data/dabi/in625"))
    parser.add_argument("--starts", type=int, default=1, help="of each search")
    parser.add_argument("--keep", default="build/inconel_event", help="folder in which finished rows are kept")
    options = parser.parse_args()
    runs = Runs(ck.exclude_suspect_frames(ck.read_histories(options.folder)), options.starts)
    file = Path(options.keep) / "rows.jsonl"

    def row(kind: str, *case: Any) -> Row:
        key = [kind, *case, f"{options.starts} starts"]
        return finished_row(file, key, lambda: getattr(runs, kind)(*case))

    fits = {(law, event): row("fit", law, event) for law in LAWS for event in EVENTS}
    selections = {event: row("selection", event) for event in EVENTS}
    held_out = {(law, event): row("held_out", law, event) for law in HELD_OUT_LAWS for event in EVENTS}
    names = [h.name.replace("_", " ") for h in runs.tests]
    page = Page("inconel_event", __doc__)
    print_fits(page, fits, names)
    for event, selection in selections.items():
        print_selection(page, selection, event)
    print_held_out(page, held_out, names)
    print_conclusions(page, fits, selections, held_out)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
