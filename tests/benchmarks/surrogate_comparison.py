"""Networks of one law and of any law on the same held-out samples.

    python tests/benchmarks/surrogate_comparison.py SAMPLES.h5 MODEL.safetensors ... [--samples 400] [--seed 0]
                                                    [--write]

SAMPLES.h5 is a data set of Eq. (1) in the paper's domain (`creepkit generate drifting-exponent --domain paper
--interval 900`); the samples are validation rows of a training with that seed, so that a ParameterGru trained on it
with the same seed was not trained on them, and no RateNet was. Beside the models stand the reduced-order model alone,
the surrogate that ships, and the finite element model on a few candidates (for its time).

Columns: Eq. (4) of all outputs together (each over its standard deviation in the training rows), of D_amp, S_d, S_p;
largest error of D_amp in a history, median and 95 % quantile; samples outside the applicability domain; CPU time of a
candidate, 49 times, predicted one by one and 100 at once; simulations that the model was trained on, and epochs.
"""

import time

import numpy as np
from measured import Page, arguments
from public_calls import predict
from surrogate_accuracy import predicted

import creepkit as ck
from creepkit.surrogates.evaluation import relative_squared_error
from creepkit.surrogates.training_loop import trainable_samples, training_split

HEADS = (
    "model",
    "Eq. (4), all outputs, 1e-4",
    "of D_amp, 1e-4",
    "of S_d, 1e-4",
    "of S_p, 1e-4",
    "largest error: median, um",
    "95 % quantile, um",
    "outside the domain",
    "CPU time alone, ms",
    "among 100, ms",
    "simulations",
    "epochs",
)


def cells(name, model, held, scale):
    """One model on the held-out samples."""
    predict(model, held.law, held.values_of(0), [held.planned_test(0)])
    values, outside = predicted(model, held)
    true = held.values[:, 1:].astype(float)
    mask = np.isfinite(true[..., 0]) & np.isfinite(values[:, 1:, 0])
    true, values = np.where(mask[..., None], true, 0.0), np.where(mask[..., None], values[:, 1:], 0.0)
    errors = [
        relative_squared_error(true, values, mask, scale),
        *(relative_squared_error(true[..., [k]], values[..., [k]], mask) for k in range(3)),
    ]
    largest = 1e3 * np.where(mask, np.abs(values[..., 0] - true[..., 0]), 0).max(axis=1)
    provenance = model.metadata.provenance if hasattr(model, "metadata") else {}
    return [
        name,
        *(f"{1e4 * error:.2f}" for error in errors),
        f"{np.median(largest):.2f}",
        f"{np.quantile(largest, 0.95):.1f}",
        outside.sum(),
        f"{time_alone(model, held):.1f}",
        f"{time_of_many(model, held):.2f}",
        provenance.get("training_rows", 0) + provenance.get("validation_rows", 0),
        provenance.get("epochs", 0),
    ]


def time_alone(model, held, count=10):
    """CPU ms of a candidate, predicted one by one."""
    start = time.process_time()
    for k in range(min(count, len(held))):
        predict(model, held.law, held.values_of(k), [held.planned_test(k)])
    return 1e3 * (time.process_time() - start) / min(count, len(held))


def time_of_many(model, held):
    """CPU ms of a candidate, 100 at once in one test."""
    values = {name: held.parameters[:100, k] for k, name in enumerate(held.parameter_names)}
    start = time.process_time()
    predict(model, held.law, values, [held.planned_test(0)])
    return 1e3 * (time.process_time() - start) / len(held.parameters[:100])


def main():
    parser = arguments(__doc__)
    parser.add_argument("data")
    parser.add_argument("models", nargs="*")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    data = trainable_samples(ck.read_dataset(options.data, accepted_only=True))
    train, rows = (part.numpy() for part in training_split(len(data), ck.Training(), options.seed))
    scale = np.nanstd(data.values[train].reshape(-1, len(data.outputs)).astype(float), axis=0)
    held = data.rows(rows[: options.samples])
    models = {
        "reduced-order model": ck.specimen("bulge").reduced_order_model(),
        "RateNet that ships": ck.surrogate("dimple"),
    }
    page = Page("surrogate_comparison", __doc__)
    page.paragraph(f"{len(held)} held-out samples.")
    page.table(*HEADS)
    for name, model in (models | {path: ck.surrogate(path) for path in options.models}).items():
        page.row(*cells(name, model, held, scale))
    each = time_alone(ck.specimen("bulge").replace(threads=1), held, count=3)
    page.row("finite elements", *["0"] * 4, "0", "0", "0", f"{each:.1f}", "", "", "")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
