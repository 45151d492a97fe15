"""Inconel 625: nine bulge tests, their common event at 8250 s, and whether a drifting exponent is needed.

    python tests/benchmarks/inconel_event.py [FOLDER] [--starts 1] [--keep FOLDER] [--write]

FOLDER (../shared/data/dabi/in625) holds tests between 716 and 811 C. All slow down at the same time of their clocks,
without an elastic jump. In rows with "event" that is a step of temperature (prior 0 K, standard deviation 30 K), one
for tests 01 to 08 and one for tests 09, 11 and 12. Nuisance parameters are the zero of each camera (12 um) and the
thickness of each dimple (0.4935 mm, standard deviation 0.027 mm). Laws are multiplied by Arrhenius' factor about
1050 K; n(t) is the drifting exponent without strain hardening.

Misfit: by finite elements, `ck.identify(law, tests, using="bulge", weights="equal")`. The pooled loss is that of the
amplitude: squared differences over squared deviations from the mean of all frames. Chi-square is that of
`fit.adequacy`, of all outputs; "left" is the standard deviation of the amplitude beyond the noise that neighbouring
frames show. Held out: each test predicted through the reduced-order model from the others, by likelihood, at nominal
thickness, with the step that its group shows; test 12, which moves half as much as its like, has 0.2 of it without the
event. Values marked * are not determined, or at their bound; units 1/s, s, J/mol, MPa.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from measured import Page, arguments, progress
from public_calls import cross_validated_tests

import creepkit as ck
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE

EVENT = 8250.0
"""s, on the clock of every test."""
STRONG = ("test_09", "test_11", "test_12")
"""Tests that slow down by a factor of about three, the others by 1.2 to 1.4."""
RIG = (ck.Nuisance("offset", sd=0.012), ck.Nuisance("thickness", mean=0.4935, sd=0.027))
ARRHENIUS = ck.arrhenius(T_ref=1050.0)
LAWS = {
    "n(t)": ck.law("drifting-exponent").fix(m=0).times(ARRHENIUS),
    "Norton": ck.law("norton").times(ARRHENIUS),
    "hyperbolic sine": ck.law("hyperbolic-sine").times(ARRHENIUS),
}
HELD_OUT_LAWS = ("n(t)", "Norton")

Row = dict[str, Any]


@dataclass(frozen=True)
class Runs:
    """What is run: the tests, and how often each search begins."""

    tests: list[ck.History]
    starts: int

    def settings(self, event: bool) -> dict[str, Any]:
        """What all identifications have in common; with the event one step of temperature for each group of tests."""
        weak = tuple(h.name for h in self.tests if h.name not in STRONG)
        steps = [ck.Nuisance("temperature step", "all", sd=30.0, start=EVENT, tests=group) for group in (weak, STRONG)]
        return {"starts": self.starts, "nuisances": (*RIG, *(steps if event else ()))}

    def fit(self, law: str, event: bool) -> Row:
        """One law by finite elements, by least squares."""
        return row_of(ck.identify(LAWS[law], self.tests, using="bulge", weights="equal", **self.settings(event)))

    def held_out(self, law: str, event: bool) -> Row:
        """Each test predicted through the reduced-order model from the others."""
        settings = {**self.settings(event), "weights": "likelihood"}
        fit = ck.identify(LAWS[law], self.tests, using=ck.surrogate("dimple"), **settings)
        return {"pooled": cross_validated_tests(fit, fit.histories).pooled_error("amplitude")}


def row_of(fit: Identification) -> Row:
    """What the table needs of an identification; JSON."""
    quantile, adequacy = NORMAL_QUANTILE, fit.adequacy
    assert adequacy is not None
    steps = [n for n in fit.nuisances if n.kind == "temperature step"]
    values = [
        f"{e.name} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]{'' if e.verdict == 'determined' else '*'}"
        for e in fit.estimates
    ]
    return {
        "loss": fit.errors["amplitude"].relative_squared_error,
        "chi-square": adequacy.chi_square,
        "left": {o.output: o.discrepancy for o in adequacy.outputs}["amplitude"],
        "steps": [[n.value, n.value - quantile * n.sd, n.value + quantile * n.sd] for n in steps],
        "values": ", ".join(values),
    }


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


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("../shared/data/dabi/in625"))
    parser.add_argument("--starts", type=int, default=1, help="of each search")
    parser.add_argument("--keep", default="build/inconel_event", help="folder in which finished rows are kept")
    options = parser.parse_args()
    runs = Runs(ck.exclude_suspect_frames(ck.read_histories(options.folder)), options.starts)
    file = Path(options.keep) / "rows.jsonl"

    def row(kind: str, law: str, event: bool) -> Row:
        key = [kind, law, event, f"{options.starts} starts"]
        return finished_row(file, key, lambda: getattr(runs, kind)(law, event))

    page, values = Page("inconel_event", __doc__), {}
    page.table(
        "law", "pooled loss", "chi-square", "left of the amplitude, um", "step of tests 01 to 08, K",
        "step of tests 09, 11, 12, K", "pooled loss, held out",
    )  # fmt: skip
    for law in LAWS:
        for event in (False, True):
            fit, name = row("fit", law, event), f"{law}, event" if event else law
            held_out = f"{row('held_out', law, event)['pooled']:.3g}" if law in HELD_OUT_LAWS else "-"
            steps = [f"{value:.1f} [{low:.1f}, {high:.1f}]" for value, low, high in fit["steps"]] or ["-", "-"]
            left = f"{1e3 * fit['left']:.2g}"
            page.row(name, f"{fit['loss']:.3g}", f"{fit['chi-square']:.3g}", left, *steps, held_out)
            values[name] = fit["values"]
    page.paragraph("Values of the two laws that are compared, with 95 % intervals:")
    page.table("law", "values")
    for name in values:
        if name.startswith(HELD_OUT_LAWS):
            page.row(name, values[name])
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
