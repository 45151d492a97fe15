"""A page for every registered law, made from its record: equation, parameters, references and a creep curve.

Equations are MathML, which browsers show without a script from the network.
"""

import re
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from sphinx.application import Sphinx

import creepkit as ck
from creepkit.app.contents import page_contents
from creepkit.app.page import page_fragment, shared_scripts
from creepkit.exporters.documents import MathmlExporter, MathmlPrinter
from creepkit.language.law_record import symbols_used
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues
from creepkit.registry import default_registry
from creepkit.specimens.run import Run

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PAGES = Path(__file__).parents[1] / "laws" / "pages"
SHARED = "creepkit-page.js"
"""What the interactive parts of all pages share, beside Sphinx's own static files."""
SCRIPT = f'<script src="../../_static/{SHARED}"></script>'
TRY_IT = (
    "Curves follow the sliders; they are computed in this page. "
    "[Explore a law](../../how-to/explore_a_law.md) says how to lay measured tests over them."
)
STRESSES = (100.0, 200.0, 300.0, 400.0)
TEMPERATURE = 1100.0
CONDITION = 0.05
"""Of the material, in the unit of the law, for curves."""
LARGEST_STRAIN = 0.05
LARGEST_STRAIN_TO_RUPTURE = 0.3


def write_pages(app: Sphinx) -> None:
    """Write a page and a picture for each law, and the table of all of them."""
    PAGES.mkdir(parents=True, exist_ok=True)
    registered = default_registry().laws()
    for name, entry in registered.items():
        caption = _draw_creep_curve(_with_numbers(entry.value), PAGES / f"{name}.png")
        page = _page(entry.value, entry.provenance.origin, caption)
        (PAGES / f"{name}.md").write_text(page, encoding="utf-8")
    rows = [f"| [{law.title}]({name}.md) | `{name}` | {origin} |" for name, law, origin in _sorted(registered)]
    names = "\n".join(name for name, *_ in _sorted(registered))
    table = "| law | name | package |\n| --- | --- | --- |\n" + "\n".join(rows)
    text = f"# All registered laws\n\n{table}\n\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"
    (PAGES / "index.md").write_text(text, encoding="utf-8")


def write_shared_script(app: Sphinx, exception: Exception | None) -> None:
    """Write what the interactive parts need into the static files of the built pages."""
    if exception is None and app.builder.format == "html":
        text = shared_scripts(page_contents(ck.law("norton")))
        (Path(app.outdir) / "_static" / SHARED).write_text(text, encoding="utf-8")


def _sorted(registered: dict[str, Any]) -> list[tuple[str, str, ck.CreepLaw]]:
    rows = [(entry.provenance.origin, name, entry.value) for name, entry in registered.items()]
    return [(name, law, origin) for origin, name, law in sorted(rows, key=lambda row: row[:2])]


def _page(law: ck.CreepLaw, origin: str, caption: str) -> str:
    parts = [
        f"# {law.title}",
        f"Name: `{law.name}`. Package: {origin}.",
        *(f'<div class="equation">{equation}</div>' for equation in _equations(law)),
        _words(law),
        "## Parameters",
        _parameters(law),
    ]
    if law.states:
        parts += ["## Internal variables", _states(law)]
    if law.constraints:
        relations = ", ".join(_math(relation) for relation in law.constraints)
        parts += [f"The law holds where {relations}."]
    parts += ["## Creep curve", f"![creep curve of {law.name}]({law.name}.png)", caption]
    parts += [
        "## Try it",
        TRY_IT,
        f"```{{raw}} html\n{page_fragment(page_contents(_with_numbers(law)), scripts=False)}\n{SCRIPT}\n```",
    ]
    parts += ["## References", "\n".join(f"- {reference}" for reference in law.references) or "None."]
    return "\n\n".join(parts) + "\n"


def _with_numbers(law: ck.CreepLaw) -> ck.CreepLaw:
    return law.at(None, **{one.name: CONDITION for one in law.conditions})


def _equations(law: ck.CreepLaw) -> list[str]:
    """The equations of a page of the exporter, each a <math> element."""
    page = MathmlExporter().text(LawWithValues(law, law.center()))
    return re.findall(r'<math [^>]*display="block">.*?</math>', page, flags=re.DOTALL)


def _math(expression: Any) -> str:
    return f"<math>{MathmlPrinter().doprint(expression)}</math>"


MEANINGS = {
    "stress": "the von Mises stress over 1 MPa",
    "strain": "the equivalent creep strain",
    "time": "the time over 1 s",
    "temperature": "the temperature in K",
    "principal_stress": "the largest principal stress over 1 MPa",
    "mean_stress": "the mean stress over 1 MPa",
}
"""What the symbols of a material point mean."""


def _words(law: ck.CreepLaw) -> str:
    """A sentence on the symbols of the material point that the law uses."""
    used = symbols_used(law) | {ck.strain}
    meanings = [f"{_math(symbol)} is {MEANINGS[symbol.name]}" for symbol in POINT_VARIABLES if symbol in used]
    stated = [
        f"{_math(one)} is {CONDITION:g} {one.unit} in the curves, and what each test states" for one in law.conditions
    ]
    return "Here " + ", ".join([*meanings, *stated]) + "."


def _parameters(law: ck.CreepLaw) -> str:
    """Table of the parameters: symbol, meaning, unit, bounds, scale, and the value that switches it off."""
    rows = ["| symbol | name | meaning | unit | lower bound | upper bound | scale | switched off at |"]
    rows.append("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for symbol, param in law.params.items():
        low, high = param.bounds
        off = "-" if param.off is None else f"{param.off:g}"
        cells = (_math(symbol), f"`{symbol.name}`", param.meaning, param.unit)
        rows.append(f"| {' | '.join(cells)} | {low:g} | {high:g} | {param.scale} | {off} |")
    return "\n".join(rows)


def _states(law: ck.CreepLaw) -> str:
    rows = ["| symbol | meaning | unit | initial value | material has failed at |", "| --- | --- | --- | --- | --- |"]
    for symbol, state in law.states.items():
        limit = "-" if state.limit is None else f"{state.limit:.10g}"
        rows.append(f"| {_math(symbol)} | {state.meaning} | {state.unit} | {state.initial:g} | {limit} |")
    return "\n".join(rows)


# ---- creep curve ---------------------------------------------------------------------------------------------------


def _draw_creep_curve(law: ck.CreepLaw, path: Path) -> str:
    """Draw creep under a constant load with every parameter in the middle of its bounds; return the caption.

    The time axis ends at LARGEST_STRAIN (LARGEST_STRAIN_TO_RUPTURE for laws with a limit), at rupture, or after 1e20 s.
    """
    has_limit = any(state.limit is not None for state in law.states.values())
    largest = LARGEST_STRAIN_TO_RUPTURE if has_limit else LARGEST_STRAIN
    for stress in STRESSES:
        coarse = _simulated(law, stress, np.geomspace(1e-3, 1e20, 2000))
        reached = np.flatnonzero(coarse.outputs["strain"] < largest)
        if coarse.outputs["strain"].max(initial=0.0) > 0 and reached.size:
            break
    end = coarse.times[min(reached[-1] + 1, coarse.times.size - 1)]
    run = _simulated(law, stress, np.linspace(0.0, end, 500)[1:])
    shown = run.outputs["strain"] <= 1.2 * largest
    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    axes.plot(run.times[shown], 100 * run.outputs["strain"][shown])
    axes.set(xlabel="time, s", ylabel="creep strain, %", xlim=(0, None), ylim=(0, None))
    figure.savefig(path, dpi=110)
    plt.close(figure)
    warm = f" and {TEMPERATURE:g} K" if ck.temperature in symbols_used(law) else ""
    return (
        f"Creep under a constant load of initially {stress:g} MPa{warm}, every parameter in the middle of its bounds. "
        "Bounds of rate coefficients span many powers of ten, so the time scale is that of no particular material."
    )


def _simulated(law: ck.CreepLaw, stress: float, times: np.ndarray) -> Run:
    loading = ck.constant_stress(stress, "load")
    return ck.simulate(law, "uniaxial", law.center(), loading=loading, times=times, temperature=TEMPERATURE)


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for sources, and their scripts when all is built."""
    app.connect("builder-inited", write_pages, priority=600)
    app.connect("build-finished", write_shared_script)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
