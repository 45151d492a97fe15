"""Surrogates of the dimple on held-out simulations, law by law: the table of the README.

    python tests/benchmarks/surrogate_accuracy.py [--models FILE ...] [--samples 200] [--folder build/surrogates]

Held-out sets come from the conditioned box of each law (seed 77, apex thickness .44 to .60 mm, 12 h, 900 s apart; 20 um
of creep or more), so that no network has seen them; those of the hyperbolic sine are told apart by their local stress
exponent at 1.5 times the reference stress, and mixtures are what is left of the combined law when two terms or more
hold 5 % of the rate. They are simulated once and kept in the folder (some 8 CPU-s a hundred samples).

Models: the one-degree-of-freedom base alone, the surrogate that comes with creepkit, and any --models.
Columns: median relative error of D_amp over all times, and at 12 h; RSE (Eq. 4) of D_amp, S_d, S_p; largest error of
each history, median and 95th percentile, um; samples flagged as outside the domain. The last column is the share of
samples whose largest error is below 5 um or 2 % of the largest deflection.
"""

import argparse
from pathlib import Path

import numpy as np

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
"""Frames before it (the ramp itself) say nothing."""


def held_out(name, samples, folder):
    """The accepted samples of a set."""
    law = SETS[name]
    file = folder / f"heldout_{law}_{samples}.h5"
    if not file.exists():
        more = 2 if law in ("hyperbolic-sine", "combined") else 1
        ck.generate(law, "bulge", more * samples, seed=SEED, to=file, apex_thickness=(0.44, 0.60), every=900)
    data = ck.read_dataset(file, accepted_only=True)
    if "sinh" in name:
        steep = local_exponent(data) >= 8
        data = data.rows(steep if ">=" in name else ~steep)
    if "mixtures" in name:
        data = data.rows((term_shares(data) > 0.05).sum(axis=1) >= 2)
    return data.rows(slice(0, samples))


def reference_stress(data):
    """(n,) MPa, of the geometric mean of both pressures."""
    found = [data.specimen.reference_stress(data.plan(k)) for k in range(len(data))]
    return np.array([np.exp(np.log(levels).mean()) for levels in found])


def local_exponent(data):
    """d ln rate / d ln stress of n sinh at 1.5 times the reference stress."""
    n, B = (data.parameters[:, data.parameter_names.index(p)] for p in ("n", "B"))
    x = 1.5 * reference_stress(data) / B
    return n * x / np.tanh(x)


def term_shares(data):
    """(n, terms) of the rate at the reference stress, a strain of .01 and 1e4 s."""
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
    """(n, frames, 3), NaN where the model stopped, and which rows are outside its domain."""
    values, outside = np.full(data.values.shape, np.nan), np.zeros(len(data), bool)
    for k in range(len(data)):
        found = model.predict(data.law, data.theta_of(k), [data.plan(k)])
        own = found.of(0)
        values[k, : len(own)] = own
        outside[k] = found.status[0, 0] == Status.OUTSIDE_DOMAIN
    return values, outside


def row(name, model, data):
    """One line of the table."""
    shown, outside = predicted(model, data)
    true, shown = data.values[:, FIRST_FRAME:].astype(float), shown[:, FIRST_FRAME:]
    mask = np.isfinite(true[..., 0]) & np.isfinite(shown[..., 0])
    relative = np.abs(shown[..., 0] / true[..., 0] - 1)
    errors = [relative_squared_error(true[..., [k]], np.nan_to_num(shown[..., [k]]), mask) for k in range(3)]
    largest = 1e3 * np.where(mask, np.abs(shown[..., 0] - true[..., 0]), 0).max(axis=1)
    deepest = np.where(mask, true[..., 0], 0).max(axis=1)
    fine = (largest < 5) | (largest < 20 * deepest)
    return (
        f"| {name} | {len(data)} | {100 * np.median(relative[mask]):.2f} | "
        f"{100 * np.median(relative[:, -1][mask[:, -1]]):.2f} | {1e4 * errors[0]:.2f} | {1e4 * errors[1]:.1f} | "
        f"{1e4 * errors[2]:.1f} | {np.median(largest):.2f} | {np.quantile(largest, 0.95):.1f} | {outside.sum()} | "
        f"{100 * fine.mean():.0f} |"
    )


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--models", nargs="*", default=[])
    options.add_argument("--samples", type=int, default=200)
    options.add_argument("--folder", type=Path, default=Path("build/surrogates"))
    options.add_argument("--sets", nargs="*", default=list(SETS))
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    sets = {name: held_out(name, given.samples, given.folder) for name in given.sets}
    models = {"one degree of freedom": ck.specimen("bulge").reduced_order_model(), "shipped": ck.surrogate("dimple")}
    models |= {name: ck.surrogate(name) for name in given.models}
    for title, model in models.items():
        print(f"\n{title}\n")
        print(
            "| held-out | samples | rel. % | 12 h % | RSE D 1e-4 | S_d | S_p | largest um | 95 % | outside | fine % |"
        )
        print("|" + "-|" * 11)
        for name, data in sets.items():
            print(row(name, model, data), flush=True)


if __name__ == "__main__":
    main()
