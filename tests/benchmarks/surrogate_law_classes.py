"""What lies inside and outside the class of laws of the shipped surrogate, against the finite elements.

    python tests/benchmarks/surrogate_law_classes.py [--samples 200] [--cases 12] [--folder build/surrogates] [--write]

Inside: every registered law that the surrogate predicts, on samples of the conditioned domain of that law (seed 78,
pressures and moduli of the paper, 12 h, frames 900 s apart). Outside: laws that it refuses, here predicted all the
same by the network, each with values drawn about planted ones (logarithms within a factor of two; the rate coefficient
such that the reduced-order model creeps by 30 to 300 um; 8, then 10 MPa, 12 h). Errors are the largest of a history,
relative to the amplitude at the same time. "Neither" counts the samples that are off by more than 1 % and that the
surrogate does not flag: silent errors. A law without samples has a term whose rate the domain cannot set.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import predict

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.language.symbols import POINT_VARIABLES, temperature
from creepkit.records import History, Status
from creepkit.registry import default_registry
from creepkit.surrogates.law_class import LawClass, acting_states
from helpers.laws_with_states import VALUES

SEED = 78
LIMIT = 0.01
TEMPERATURE = 1000.0
PLAN = History(
    "planned",
    np.linspace(900.0, 43200.0, 48),
    {},
    ck.PressureJump(P1=8, P2=10, Tj=14400),
    TEMPERATURE,
    "bulge",
    ck.Elastic(E=150e3),
)
KACHANOV = {"A": 1e-13, "n": 3.0, "B": 1e-12, "chi": 3.0, "phi": 3.0, "alpha": 0.5, "m": 0.0}
LIU = {"A": 1e-13, "n": 3.0, "B": 1e-12, "p": 3.0, "q_2": 3.0, "alpha": 0.5}
HEADS = ("law", "samples", "error, median, %", "90 % quantile, %", "largest, %", "within 1 %", "flagged", "neither")


def largest_error(predicted, true):
    """The largest relative error of the amplitude over frames that both have; infinite where nothing is predicted."""
    both = np.isfinite(true) & np.isfinite(predicted)
    return np.abs(predicted[both] / true[both] - 1).max() if both.any() else np.inf


def inside_errors(law, model, samples, folder):
    """Errors (n,) of the samples of a law, and which are flagged."""
    file = folder / f"class_{law.name}_{samples}.h5"
    if not file.exists():
        ck.generate(law, "bulge", samples, seed=SEED, to=file, every=900)
    data = ck.read_dataset(file, accepted_only=True)
    data = data.rows(slice(0, samples))
    errors, flagged = np.full(len(data), np.inf), np.zeros(len(data), bool)
    for row in range(len(data)):
        prediction = predict(model, data.law, data.values_of(row), [data.planned_test(row)])
        found = prediction.of(0)[1:, 0]
        errors[row] = largest_error(found, data.values[row, 1 : 1 + len(found), 0].astype(float))
        flagged[row] = prediction.status[0, 0] == Status.OUTSIDE_DOMAIN
    return errors, flagged


def drawn_values(law, planted, rng, reduced):
    """Values about planted ones, whose rate coefficient makes the dimple creep by a drawn amount."""
    values = {
        name: planted[name] * (2.0 ** rng.uniform(-1, 1) if param.scale == "log" else 1.0)
        for name, param in law.table.items()
    }
    first = next(name for name, param in law.table.items() if param.scale == "log")
    factors = np.geomspace(1e-3, 1e3, 61)
    columns = {name: np.full(factors.size, value) for name, value in values.items()} | {first: values[first] * factors}
    amplitude = reduced.predict(law, law.to_internal(columns), [PLAN]).values[:, 0, :, 0]
    rise = amplitude[:, -1] - amplitude[:, 0]
    target, known = np.exp(rng.uniform(np.log(0.03), np.log(0.3))), np.isfinite(rise)
    return values | {first: values[first] * float(np.interp(target, rise[known], factors[known]))}


def outside_errors(law, planted, models, cases):
    """{model: errors (n,)} of drawn cases that finite elements follow to the end."""
    rng, specimen = np.random.default_rng(SEED), ck.specimen("bulge")
    errors = {name: [] for name in models}
    for _ in range(cases):
        values = drawn_values(law, planted, rng, models["reduced-order model"])
        true = predict(specimen, law, values, [PLAN])
        if true.status[0, 0] != Status.COMPLETE:
            continue
        for name, model in models.items():
            found = predict(model, law, values, [PLAN])
            errors[name].append(largest_error(found.of(0)[:, 0], true.of(0)[:, 0]))
    return {name: np.array(found) for name, found in errors.items()}


def percent(value):
    return f"{100 * value:.2f}" if value < 0.1 else f"{100 * value:.0f}"


def quantiles(errors):
    return [percent(q) for q in np.quantile(errors, (0.5, 0.9, 1.0), method="inverted_cdf")]


def main():
    parser = arguments(__doc__)
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--folder", type=Path, default=Path("build/surrogates"))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    model, registry = ck.surrogate("dimple"), default_registry()
    page = Page("surrogate_law_classes", __doc__)
    page.heading("Outside the class: refused, and what the network would have said")
    page.table(
        "law", "internal variables that act back", "cases", "error of the network: median, largest, %",
        "of the reduced-order model: median, largest, %",
    )  # fmt: skip
    every_law = LawClass(tuple(s.name for s in POINT_VARIABLES), states=True)
    unguarded = model.recipe.surrogate(model.module, replace(model.metadata, law_class=every_law))
    models = {"network": unguarded, "reduced-order model": ck.specimen("bulge").reduced_order_model()}
    planted = VALUES | {registry.law("kachanov-rabotnov"): KACHANOV, registry.law("liu-murakami"): LIU}
    for law, values in planted.items():
        if model.outside_class(law):
            errors = outside_errors(law, values, models, options.cases)
            texts = [f"{quantiles(found)[0]}, {quantiles(found)[2]}" for found in errors.values()]
            page.row(law.name, ", ".join(acting_states(law)) or "-", len(errors["network"]), *texts)
    page.heading("Inside the class: registered laws")
    page.table(*HEADS)
    for name in sorted(registry.laws()):
        law = registry.law(name)
        law = law.at(TEMPERATURE) if law.uses(temperature) else law
        if model.outside_class(law):
            continue
        try:
            errors, flagged = inside_errors(law, model, options.samples, options.folder)
        except CreepkitError as error:
            progress(f"{name}: {error}")
            page.row(name, 0, *"------")
            continue
        silent = (errors > LIMIT) & ~flagged
        page.row(name, len(errors), *quantiles(errors), (errors <= LIMIT).sum(), flagged.sum(), silent.sum())
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
