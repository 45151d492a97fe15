"""Accuracy of surrogates of the dimple on held-out simulations, law by law.

    python tests/benchmarks/surrogate_accuracy.py [--models FILE ...] [--samples 200] [--folder build/surrogates]
                                                  [--sets NAME ...] [--write]

Held-out sets are drawn from the conditioned domain of each law (apex thickness 0.44 to 0.60 mm, 12 h, 20 um of creep or
more). Models: the reduced-order model, and the trained networks of --models, each on the sets of its law. Columns:
relative error of D_amp over all times, and at 12 h (medians); relative squared error (Eq. 4) of D_amp, S_d and S_p;
largest error of D_amp in a history, median and 95 % quantile; samples outside the applicability domain; share of
samples whose largest error is below 5 um or 2 % of the largest deflection.
"""

from pathlib import Path

import numpy as np
from measured import Page, arguments
from public_calls import predict

import creepkit as ck
from creepkit.records import Status
from creepkit.surrogates.evaluation import relative_squared_error

SEED = 77
SETS = {
    "norton": "norton",
    "strain hardening": "strain-hardening",
    "time hardening": "time-hardening",
    "sinh, n_loc < 8": "hyperbolic-sine",
    "sinh, n_loc >= 8": "hyperbolic-sine",
    "n(t), Eq. 1": "drifting-exponent",
    "mixtures, Eq. 2": "combined",
    "graham-walles": "graham-walles",
}
FIRST_FRAME = 1
"""The first frame compared; the one before lies on the loading ramp."""
HEADS = (
    "held-out set",
    "samples",
    "error of D_amp, %",
    "at 12 h, %",
    "Eq. (4) of D_amp, 1e-4",
    "of S_d, 1e-4",
    "of S_p, 1e-4",
    "largest error: median, um",
    "95 % quantile, um",
    "outside the domain",
    "within 5 um or 2 %, %",
)


def held_out(name, samples, folder):
    """The accepted samples of a set."""
    law = SETS[name]
    file = folder / f"heldout_{law}_{samples}.h5"
    if not file.exists():
        factor = 2 if law in ("hyperbolic-sine", "combined") else 1
        ck.generate(law, "bulge", factor * samples, seed=SEED, to=file, apex_thickness=(0.44, 0.60), every=900)
    data = ck.read_dataset(file, accepted_only=True)
    if "sinh" in name:
        steep = local_exponent(data) >= 8
        data = data.rows(steep if ">=" in name else ~steep)
    if "mixtures" in name:
        data = data.rows((term_fractions(data) > 0.05).sum(axis=1) >= 2)
    return data.rows(slice(0, samples))


def reference_stress(data):
    """(n,) MPa, of the geometric mean of both pressures."""
    stresses = [data.specimen.reference_stress(data.planned_test(k)) for k in range(len(data))]
    return np.array([np.exp(np.log(levels).mean()) for levels in stresses])


def local_exponent(data):
    """d ln rate / d ln stress of n sinh at 1.5 times the reference stress."""
    n, B = (data.parameters[:, data.parameter_names.index(p)] for p in ("n", "B"))
    x = 1.5 * reference_stress(data) / B
    return n * x / np.tanh(x)


def term_fractions(data):
    """(n, terms): fractions of the rate at the reference stress, a strain of 0.01 and 1e4 s."""
    s = reference_stress(data)
    p = {name: data.parameters[:, k] for k, name in enumerate(data.parameter_names)}
    with np.errstate(divide="ignore", over="ignore"):
        terms = np.stack(
            [
                p["A_1"] * np.sinh(s / p["B"]) ** p["n_1"],
                p["A_2"] * s ** p["n_2"] * 0.01 ** p["m_1"],
                p["A_3"] * s ** p["n_3"] * 1e4 ** p["m_2"],
            ],
            axis=1,
        )
    return terms / terms.sum(axis=1, keepdims=True)


def predicted(model, data):
    """(n, frames, 3), NaN where the prediction ended early, and which rows are outside the model's domain."""
    values, outside = np.full(data.values.shape, np.nan), np.zeros(len(data), bool)
    for k in range(len(data)):
        prediction = predict(model, data.law, data.values_of(k), [data.planned_test(k)])
        complete = prediction.of(0)
        values[k, : len(complete)] = complete
        outside[k] = prediction.status[0, 0] == Status.OUTSIDE_DOMAIN
    return values, outside


def cells(name, model, data):
    """One row of the table."""
    values, outside = predicted(model, data)
    true, values = data.values[:, FIRST_FRAME:].astype(float), values[:, FIRST_FRAME:]
    mask = np.isfinite(true[..., 0]) & np.isfinite(values[..., 0])
    relative = np.abs(values[..., 0] / true[..., 0] - 1)
    errors = [relative_squared_error(true[..., [k]], np.nan_to_num(values[..., [k]]), mask) for k in range(3)]
    largest = 1e3 * np.where(mask, np.abs(values[..., 0] - true[..., 0]), 0).max(axis=1)
    deepest = np.where(mask, true[..., 0], 0).max(axis=1)
    accurate = (largest < 5) | (largest < 20 * deepest)
    return [
        name,
        len(data),
        f"{100 * np.median(relative[mask]):.2f}",
        f"{100 * np.median(relative[:, -1][mask[:, -1]]):.2f}",
        f"{1e4 * errors[0]:.2f}",
        *(f"{1e4 * error:.1f}" for error in errors[1:]),
        f"{np.median(largest):.2f}",
        f"{np.quantile(largest, 0.95):.1f}",
        outside.sum(),
        f"{100 * accurate.mean():.0f}",
    ]


def main():
    parser = arguments(__doc__)
    parser.add_argument("--models", nargs="*", default=[])
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--folder", type=Path, default=Path("build/surrogates"))
    parser.add_argument("--sets", nargs="*", default=list(SETS))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    sets = {name: held_out(name, options.samples, options.folder) for name in options.sets}
    models = {"reduced-order model": ck.surrogate("dimple"), **{name: ck.surrogate(name) for name in options.models}}
    page = Page("surrogate_accuracy", __doc__)
    for title, model in models.items():
        page.heading(title[0].upper() + title[1:])
        page.table(*HEADS)
        for name, data in sets.items():
            if not model.outside_class(data.law):
                page.row(*cells(name, model, data))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
