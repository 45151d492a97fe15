"""Networks of one law and of any law on the same held-out samples: the table of the README.

    python tests/benchmarks/surrogate_comparison.py CASE1.h5 MODEL.safetensors ... [--samples 400] [--seed 0]

CASE1.h5 is a set of Eq. (1) in the paper's box (`creepkit generate drifting-exponent --box paper --interval 900`); the
samples are validation rows of a training with that seed, so that a ParameterGru trained on it with the same seed has
not seen them, and no RateNet has. Beside the models stand the base alone, the surrogate that comes with creepkit, and
the finite element model on a few candidates (for its time).

Columns: Eq. (4) of all outputs together (each over its standard deviation in the training rows), of D_amp, S_d, S_p;
largest error of D_amp in a history, median and 95 %, um; samples outside the domain; CPU ms of a candidate, 49 times,
asked for one by one and 100 at once; simulations it was trained on, and epochs.
"""

import argparse
import time

import numpy as np
from surrogate_accuracy import predicted

import creepkit as ck
from creepkit.surrogates.evaluation import relative_squared_error
from creepkit.surrogates.training_loop import trainable_samples, training_split


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("data")
    options.add_argument("models", nargs="*")
    options.add_argument("--samples", type=int, default=400)
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    data = trainable_samples(ck.read_dataset(given.data, accepted_only=True))
    train, rows = (part.numpy() for part in training_split(len(data), ck.Training(), given.seed))
    scale = np.nanstd(data.values[train].reshape(-1, len(data.outputs)).astype(float), axis=0)
    held = data.rows(rows[: given.samples])
    print("| model | Eq. (4) 1e-4 | D | S_d | S_p | largest um | 95 % | outside | ms | of 100 | runs | epochs |")
    print("|" + "-|" * 12)
    models = {
        "one degree of freedom": ck.specimen("bulge").reduced_order_model(),
        "shipped RateNet": ck.surrogate("dimple"),
    }
    for name, model in (models | {path: ck.surrogate(path) for path in given.models}).items():
        print(line(name, model, held, scale), flush=True)
    each, _ = costs(ck.specimen("bulge").replace(threads=1), held, few=3)
    print(f"| finite elements | 0 | 0 | 0 | 0 | 0 | 0 | 0 | {each:.1f} | {each:.1f} | 0 | 0 |")


def line(name, model, held, scale):
    """One model on the held-out samples."""
    model.predict(held.law, held.theta_of(0), [held.plan(0)])
    shown, outside = predicted(model, held)
    true = held.values[:, 1:].astype(float)
    mask = np.isfinite(true[..., 0]) & np.isfinite(shown[:, 1:, 0])
    true, shown = np.where(mask[..., None], true, 0.0), np.where(mask[..., None], shown[:, 1:], 0.0)
    errors = [
        relative_squared_error(true, shown, mask, scale),
        *(relative_squared_error(true[..., [k]], shown[..., [k]], mask) for k in range(3)),
    ]
    largest = 1e3 * np.where(mask, np.abs(shown[..., 0] - true[..., 0]), 0).max(axis=1)
    each, of_many = costs(model, held)
    known = model.told.provenance if hasattr(model, "told") else {}
    simulations = known.get("training_rows", 0) + known.get("validation_rows", 0)
    numbers = " | ".join(f"{1e4 * e:.2f}" for e in errors)
    return (
        f"| {name} | {numbers} | {np.median(largest):.2f} | {np.quantile(largest, 0.95):.1f} | {outside.sum()} | "
        f"{each:.1f} | {of_many:.2f} | {simulations} | {known.get('epochs', 0)} |"
    )


def costs(model, held, few=10):
    """CPU ms of a candidate, asked for one by one, and 100 at once in one test."""
    began = time.process_time()
    for k in range(few):
        model.predict(held.law, held.theta_of(k), [held.plan(k)])
    each = (time.process_time() - began) / few
    if few < 10:
        return 1e3 * each, 0.0
    values = {name: held.parameters[:100, k] for k, name in enumerate(held.parameter_names)}
    began = time.process_time()
    model.predict(held.law, held.law.to_internal(values), [held.plan(0)])
    return 1e3 * each, 1e3 * (time.process_time() - began) / len(held.parameters[:100])


if __name__ == "__main__":
    main()
