"""Surrogates of specimens that no module knows by name: held-out errors, and identifications of planted tests.

    python tests/benchmarks/surrogate_any_specimen.py [--samples 512] [--planted 10] [--keep build/any] [--write]

Specimens: the cantilever of a plugin file (tests/helpers/cantilever.py: a force at its end, steady creep by Norton's
law, span 45 to 55 mm and height 1.8 to 2.2 mm varied), a bar in relaxation, and a bar in tension. Data are drawn from
the conditioned domain of Norton's law with the ranges of each record (12 h, 3600 s apart); held-out sets have a seed of
their own. Networks: one layer of 32 gated units that sees load, mean load and time, 200 epochs, on the first output
(value), on its logarithm (log), or as correction of a material point at the reference stress of the record
(reference-stress).

Errors are over the largest value of a history: the median over all frames, and the largest of a history (median and
95 % quantile over histories). Planted: the values of a held-out sample, in the tests of that sample and the next, with
noise of 0.5 % of the largest value; identified from four starts through the network of the smallest median error and
through the specimen itself; a test that leaves fewer than two frames before rupture cannot be identified. Error of the
rate: factor at the geometric mean of the reference stresses, in per cent; both errors are medians.
"""

import time
from pathlib import Path

import numpy as np
import torch
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.records import Status
from creepkit.surrogates.recipe import Training

SEED, HELD_OUT_SEED, HELD_OUT = 5, 77, 128
NOISE = 0.005
RANGES = {"cantilever": {"span": (45.0, 55.0), "height": (1.8, 2.2)}, "relaxation": {}, "uniaxial": {}}
NETWORKS = {"value": {}, "log": {"target": "log"}, "reference-stress": {"base": "reference-stress"}}
TRAINING = Training(epochs=200, batch=32, rate=1e-2, schedule="cosine", clip=1.0)


def data_set(name, samples, seed, folder):
    """Accepted samples of a specimen, made once."""
    file = folder / f"{name}_{samples}_{seed}.h5"
    data = ck.generate("norton", name, samples, seed=seed, to=file, every=3600, **RANGES[name])
    return data.accepted.rows(slice(0, samples))


def held_out_errors(model, data):
    """(n, frames) errors over the largest value of a history, NaN at rest; and how many are outside the domain."""
    errors, outside = np.full(data.values.shape[:2], np.nan), 0
    for row in range(len(data)):
        plan = data.planned_test(row)
        prediction = model.predict(data.law, data.theta_of(row), [plan])
        true = data.values[row, :, 0].astype(float)
        errors[row, 1:] = (np.abs(prediction.values[0, 0, :, 0] - true) / np.nanmax(np.abs(true)))[1:]
        outside += prediction.status[0, 0] == Status.OUTSIDE_DOMAIN
    return errors, outside


def planted_tests(data, row, noise):
    """Two tests with the values of a row: its own and that of the next."""
    tests = []
    for k in (row, row + 1):
        plan = data.planned_test(k).replace(name=f"test {k}")
        values = data.specimen.predict(data.law, data.theta_of(row), [plan]).of(0)[:, 0]
        values = values + NOISE * np.nanmax(np.abs(values)) * noise.normal(size=values.size)
        outputs = {str(data.outputs[0]): values}
        tests.append(plan.replace(outputs=outputs, used=plan.times > 0))
    return tests


def log_stress(data, tests):
    """ln of the geometric mean of the reference stresses, MPa; of a bar in tension the loads."""
    levels = []
    for test in tests:
        own = getattr(data.specimen, "reference_stress", None)
        piece = data.specimen.of_test(test, {})[0] if hasattr(data.specimen, "of_test") else data.specimen
        levels.extend(test.loading.program().values if own is None else piece.reference_stress(test))
    return float(np.log(np.array(levels)[np.array(levels) > 0]).mean())


def identification_errors(data, using, count):
    """(fits, 2) errors of n and of ln rate, how many could not be identified, and seconds a fit."""
    errors, failed, start, noise = [], 0, time.process_time(), np.random.default_rng(1)
    for row in range(0, 2 * count, 2):
        tests, truth = planted_tests(data, row, noise), data.values_of(row)
        try:
            fit = ck.identify(data.law, tests, using, starts=4, nuisances=[])
        except CreepkitError as error:
            progress(f"{data.specimen.name}, row {row}: {error}")
            failed += 1
            continue
        found = {e.name: e.value for e in fit.estimates}
        stress = log_stress(data, tests)
        ln_rate = np.log(found["A"] / truth["A"]) + (found["n"] - truth["n"]) * stress
        errors.append((abs(found["n"] - truth["n"]), abs(ln_rate)))
    return np.array(errors), failed, (time.process_time() - start) / count


def planted_cells(title, data, using, count):
    """A row of the table of identifications."""
    errors, failed, seconds = identification_errors(data, using, count)
    n, rate = np.median(errors, axis=0)
    return data.specimen.name, title, count, failed, f"{n:.3f}", f"{100 * np.expm1(rate):.1f}", f"{seconds:.1f}"


def main():
    parser = arguments(__doc__)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--planted", type=int, default=10)
    parser.add_argument("--keep", type=Path, default=Path("build/any"))
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    ck.load_plugin(Path(__file__).resolve().parents[1] / "helpers" / "cantilever.py")
    page = Page("surrogate_any_specimen", __doc__)
    page.heading("Held-out samples")
    page.table(
        "specimen", "network", "samples", "training, CPU s", "error, median, %", "largest: median, %",
        "95 % quantile, %", "outside the domain",
    )  # fmt: skip
    models, held_out = {}, {}
    for name in RANGES:
        data = data_set(name, options.samples, SEED, options.keep)
        held_out[name] = data_set(name, HELD_OUT, HELD_OUT_SEED, options.keep)
        for title, settings in NETWORKS.items():
            recipe = ck.ParameterGru(32, 1, inputs=("load", "mean_load", "time"), training=TRAINING, **settings)
            start = time.process_time()
            try:
                model = ck.train(data, recipe, seed=0, device="cpu")
            except CreepkitError as error:
                progress(str(error))
                continue
            seconds = time.process_time() - start
            errors, outside = held_out_errors(model, held_out[name])
            largest = 100 * np.nanmax(errors, axis=1)
            page.row(
                name, title, len(data), f"{seconds:.0f}", f"{100 * np.nanmedian(errors):.2f}",
                f"{np.median(largest):.2f}", f"{np.quantile(largest, 0.95):.1f}", f"{outside} of {len(largest)}",
            )  # fmt: skip
            models[name, title] = model, float(np.nanmedian(errors))
    page.heading("Planted tests")
    page.table(
        "specimen", "predictor", "fits", "failed", "error of n, median", "error of the rate, median, %", "CPU s a fit"
    )
    for name in RANGES:
        title = min((key[1] for key in models if key[0] == name), key=lambda title: models[name, title][1])
        page.row(*planted_cells(f"network, {title}", held_out[name], models[name, title][0], options.planted))
        page.row(*planted_cells("the specimen itself", held_out[name], held_out[name].specimen, options.planted))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
