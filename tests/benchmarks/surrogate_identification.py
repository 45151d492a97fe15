"""Identification of held-out simulations through surrogates and through finite elements: the table of the README.

    python tests/benchmarks/surrogate_identification.py [--models FILE ...] [--tests 6] [--laws norton ...] [--noise 1]

Each specimen is one simulated bulge test of a law (conditioned box, seed 78, apex thickness .5 mm, a jump of pressure,
12 h, 49 frames), to which white noise is added: 1.5 um on D_amp, .02 mm on S_d, .02 on S_p (times --noise). Its law is
identified from it through the finite element model itself, through the surrogate that comes with creepkit and through
any --models (a ParameterGru of that law), with the modulus as a nuisance of 10 %.

Columns: shift of the worst parameter between the two identifications, in posterior standard deviations of the one by
finite elements, median and largest; distance of both from the truth in the same unit (median of the worst parameter);
error of the rate at the reference stress, % median; CPU seconds of an identification.
"""

import argparse
import time

import numpy as np

import creepkit as ck

SEED = 78
LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}


def specimens(name, tests, noise, folder):
    """[(true values, measured history)] of a law."""
    file = f"{folder}/identified_{name}_{tests}.h5"
    data = ck.generate(name, "bulge", tests, seed=SEED, to=file, every=900, draws=None).accepted
    random = np.random.default_rng(SEED)
    found = []
    for k in range(tests):
        plan = data.planned_test(k)
        spread = np.stack([np.full(plan.times.size, noise * sd) for sd in SD.values()], axis=1)
        values = data.values[k].astype(float) + spread * random.standard_normal(spread.shape)
        outputs = dict(zip(data.outputs, values[1:].T, strict=True))
        known = {output: np.full(plan.times.size - 1, max(noise, 0.1) * sd) for output, sd in SD.items()}
        test = plan.replace(name=f"{name} {k}", times=plan.times[1:]).replace(outputs=outputs, standard_deviation=known)
        found.append((data.values_of(k), test))
    return found


def identified(law, test, using):
    """The identification and its CPU seconds."""
    began = time.process_time()
    nuisances = [ck.Nuisance("modulus", sd=0.1)]
    fit = ck.identify(law, [test], using, nuisances=nuisances, starts=4, frames=48)
    return fit, time.process_time() - began


def true_u(fit, values):
    """The true values in the coordinates of a fit."""
    return fit.coordinates.u(fit.law.to_internal(values)[0])


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--models", nargs="*", default=[])
    options.add_argument("--tests", type=int, default=6)
    options.add_argument("--laws", nargs="*", default=list(LAWS))
    options.add_argument("--noise", type=float, default=1.0)
    options.add_argument("--folder", default="build/surrogates")
    given = options.parse_args()
    models = {"shipped": ck.surrogate("dimple")} | {name: ck.surrogate(name) for name in given.models}
    print("| law | through | shift, sd median | largest | off truth, sd: fe | surrogate | rate off truth, %: fe | "
          "surrogate | CPU s: fe | surrogate |\n" + "|-" * 10 + "|")  # fmt: skip
    everything = {name: [] for name in models}
    for law in given.laws:
        found = specimens(law, given.tests, given.noise, given.folder)
        exact = [identified(law, test, "bulge") for _, test in found]
        for name, model in models.items():
            rows = []
            for (values, test), (fit, cost) in zip(found, exact, strict=True):
                other, cheap = identified(law, test, model)
                assert other.reference == fit.reference
                sd = np.sqrt(np.diag(fit.covariance))
                truth = true_u(fit, values)
                sigma = float(np.median(ck.specimen("bulge").reference_stress(test)))
                rate = [float(one.rate(sigma)[0]) for one in (fit, other)]
                true_rate = true_rate_of(fit, truth, sigma)
                rows.append((
                    np.abs((other.u - fit.u) / sd).max(), np.abs((fit.u - truth) / sd).max(),
                    np.abs((other.u - truth) / sd).max(), *(100 * abs(r / true_rate - 1) for r in rate), cost, cheap,
                ))  # fmt: skip
            m = np.array(rows)
            everything[name].extend(m[:, 0])
            middle = np.median(m, axis=0)
            print(f"| {law} | {name} | {middle[0]:.2f} | {m[:, 0].max():.2f} | {middle[1]:.2f} | {middle[2]:.2f} | "
                  f"{middle[3]:.2f} | {middle[4]:.2f} | {middle[5]:.1f} | {middle[6]:.2f} |", flush=True)  # fmt: skip
    for name, shifts in everything.items():
        print(f"{name}: median shift over all {len(shifts)} identifications {np.median(shifts):.2f} sd")


def true_rate_of(fit, truth, stress):
    """The rate of the true values where the identification tells its own."""
    from dataclasses import replace

    return float(replace(fit, u=truth).rate(stress)[0])


if __name__ == "__main__":
    main()
