"""Identification of held-out simulations through surrogates and by finite elements.

    python tests/benchmarks/surrogate_identification.py [--models FILE ...] [--tests 6] [--laws norton ...] [--noise 1]
                                                        [--folder build/surrogates] [--write]

Each specimen is one simulated bulge test of a law (conditioned domain, seed 78, apex thickness 0.5 mm, a jump of
pressure, 12 h, 49 frames), to which white noise is added: 1.5 um on D_amp, 0.02 mm on S_d, 0.02 on S_p (times --noise).
Its law is identified from it by finite elements, through the surrogate that ships and through any --models (a
ParameterGru of that law), with the modulus as a nuisance of 10 %.

Columns: shift of the worst parameter between both identifications, in posterior standard deviations of the one by
finite elements, median and largest; distance of both from the truth in the same unit (median of the worst parameter);
error of the rate at the reference stress (median); CPU time of an identification (median).
"""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments

import creepkit as ck

SEED = 78
LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}


def planted_specimens(name, tests, noise, folder):
    """[(true values, measured history)] of a law."""
    file = folder / f"identified_{name}_{tests}.h5"
    data = ck.generate(name, "bulge", tests, seed=SEED, to=file, every=900, draws=None).accepted
    rng = np.random.default_rng(SEED)
    specimens = []
    for k in range(tests):
        plan = data.planned_test(k)
        spread = np.stack([np.full(plan.times.size, noise * sd) for sd in SD.values()], axis=1)
        values = data.values[k].astype(float) + spread * rng.standard_normal(spread.shape)
        outputs = dict(zip(data.outputs, values[1:].T, strict=True))
        known = {output: np.full(plan.times.size - 1, max(noise, 0.1) * sd) for output, sd in SD.items()}
        test = plan.replace(name=f"{name} {k}", times=plan.times[1:]).replace(outputs=outputs, standard_deviation=known)
        specimens.append((data.values_of(k), test))
    return specimens


def identified(law, test, using):
    """The identification and its CPU seconds."""
    start = time.process_time()
    nuisances = [ck.Nuisance("modulus", sd=0.1)]
    fit = ck.identify(law, [test], using, nuisances=nuisances, starts=4, frames=48)
    return fit, time.process_time() - start


def true_u(fit, values):
    """The true values in the coordinates of a fit."""
    return fit.coordinates.u(fit.law.to_internal(values)[0])


def rate_at(fit, u, stress):
    """The rate at a stress, MPa, by a law with the coordinates u."""
    return float(replace(fit, u=u).rate(stress)[0])


def comparison(values, test, exact, surrogate):
    """Numbers of one specimen; exact, surrogate : (identification, CPU seconds) by finite elements and surrogate."""
    (fit, cost), (other, surrogate_cost) = exact, surrogate
    assert other.reference == fit.reference
    sd = np.sqrt(np.diag(fit.covariance))
    truth = true_u(fit, values)
    stress = float(np.median(ck.specimen("bulge").reference_stress(test)))
    true_rate = rate_at(fit, truth, stress)
    return (
        np.abs((other.u - fit.u) / sd).max(),
        np.abs((fit.u - truth) / sd).max(),
        np.abs((other.u - truth) / sd).max(),
        *(100 * abs(rate_at(one, one.u, stress) / true_rate - 1) for one in (fit, other)),
        cost,
        surrogate_cost,
    )


HEADS = (
    "law",
    "surrogate",
    "shift: median, sd",
    "largest, sd",
    "finite elements from truth, sd",
    "surrogate from truth, sd",
    "rate by finite elements: error, %",
    "by the surrogate, %",
    "CPU time by finite elements, s",
    "by the surrogate, s",
)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--models", nargs="*", default=[])
    parser.add_argument("--tests", type=int, default=6, help="of each law")
    parser.add_argument("--laws", nargs="*", default=list(LAWS))
    parser.add_argument("--noise", type=float, default=1.0)
    parser.add_argument("--folder", type=Path, default=Path("build/surrogates"))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    models = {"the one that ships": ck.surrogate("dimple")} | {name: ck.surrogate(name) for name in options.models}
    page = Page("surrogate_identification", __doc__)
    page.table(*HEADS)
    shifts_of = {name: [] for name in models}
    for law in options.laws:
        specimens = planted_specimens(law, options.tests, options.noise, options.folder)
        exact = [identified(law, test, "bulge") for _, test in specimens]
        for name, model in models.items():
            rows = np.array(
                [
                    comparison(values, test, fit, identified(law, test, model))
                    for (values, test), fit in zip(specimens, exact, strict=True)
                ]
            )
            shifts_of[name].extend(rows[:, 0])
            medians = [f"{m:.2f}" for m in np.median(rows, axis=0)]
            page.row(law, name, medians[0], f"{rows[:, 0].max():.2f}", *medians[1:])
    for name, shifts in shifts_of.items():
        page.row("all", name, f"{np.median(shifts):.2f}", f"{np.max(shifts):.2f}", *[""] * 6)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
