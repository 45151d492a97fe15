r"""Inconel 625 from bulge tests
============================

Nine bulge tests with finite elements in the loop: what they determine, what they leave open, and how well published
parameter sets predict them.

FOLDER holds the histories (CSV with a head: temperature_C, modulus_GPa, pressure_1_MPa, pressure_2_MPa, jump_time_h,
end_time_h; columns time_s, amplitude_mm, width_mm, shape). Without it three tests are simulated with a published set
of parameters, with noise and apex thickness as measured, and go through the same steps. ``--quick``
simulates fewer frames::

    python examples/03_inconel_625.py [--quick] [FOLDER [OUT]]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import creepkit as ck

T_REF = 1050.0
R = 8.314462618
R_PAPER = 8.31
THICKNESS = ck.Nuisance("thickness", mean=0.4935, sd=0.027)  # 25 measured dimples of one plate
dimple = ck.specimen("bulge")
quick = "--quick" in sys.argv
paths = [Path(word) for word in sys.argv[1:] if word != "--quick"]
folder = paths[0] if paths else None
out = paths[1] if len(paths) > 1 else Path("inconel_625")

# %%
# The law: n(t) of Eq. (1) without strain hardening, times Arrhenius (Eq. 5) about 1050 K
# ---------------------------------------------------------------------------------------

law = ck.law("drifting-exponent").fix(m=0).times(ck.arrhenius(T_ref=T_REF))
norton = ck.law("norton").times(ck.arrhenius(T_ref=T_REF))


def drifting(
    A: float, n_inf: float, rise: float, fall: float, tau_d: float, tau_r: float, Q: float, gas: float
) -> dict:
    """Values of `law` for A sigma^(n_inf + rise exp(-t/tau_d) - fall exp(-t/tau_r)) exp(-Q / gas T)."""
    values = dict(n_0=n_inf + rise - fall, n_inf=n_inf, C=fall, tau_d=tau_d, tau_r=tau_r)
    return dict(A=A * np.exp(-Q / (gas * T_REF)), **values, Q=Q * R / gas)


# What was published: Eq. (6) as printed, two sets listed with the paper's code, and the compression tests of the paper.
PUBLISHED = {
    "Eq. (6) as printed": (law, drifting(4.2e5, 4.3, 1.29, 1.9, 7818.4, 4753.9, 4.23e5, R_PAPER)),
    "listed set 1": (
        law,
        drifting(10**6.2956, 5.1592, 2.37895 + 5.1436 - 5.1592, 2.37895, 10347.3, 6546.1, 472840.0, R_PAPER),
    ),
    "listed set 2": (
        law,
        drifting(10**5.624, 4.30126, 1.29426 + 4.434 - 4.30126, 1.29426, 7818.379, 4753.9359, 422572.0, R_PAPER),
    ),
    "compression": (norton, dict(A=1.32e6 * np.exp(-4.61e5 / (R_PAPER * T_REF)), n=4.8, Q=4.61e5 * R / R_PAPER)),
}


def virtual_tests() -> list[ck.History]:
    """Three tests of 8 MPa with the noise and the scatter of thickness that were measured."""
    rng = np.random.default_rng(625)
    times = np.arange(150.0, 4 * 3600.0 + 1, 1800.0 if quick else 900.0)
    tests = []
    for k, (celsius, thickness) in enumerate(((743.0, 0.482), (771.0, 0.515), (802.0, 0.490))):  # C, mm
        one = ck.simulate(
            law,
            dimple.replace(apex_thickness=thickness),
            PUBLISHED["listed set 2"][1],
            loading=ck.PressureJump(8.0, 8.0, 10800.0),
            times=times,
            temperature=celsius + 273.15,
            elastic=ck.Elastic(E=180e3 - 100.0 * celsius),
            name=f"virtual_{k + 1}",
        )
        noise = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
        noisy = {name: value + noise[name] * rng.normal(size=value.size) for name, value in one.outputs.items()}
        tests.append(one.replace(outputs=noisy, geometry={}))
    return tests


# %%
# The tests, and what is suspect about them
# -----------------------------------------

tests = virtual_tests() if folder is None else ck.read_histories(folder)
for suspect in ck.check_data_quality(tests):
    print("suspect:", suspect)
tests = ck.exclude_suspect_frames(tests)

# %%
# One law for all tests
# ---------------------
# Two readings of "the fit": readings of equal weight, nothing unknown but the law; and with the zero of each camera and
# each dimple's thickness unknown.

ways = {
    "law alone": dict(nuisances=(), weights="equal"),
    "offset, thickness": dict(nuisances=(ck.Nuisance("offset", sd=0.012), THICKNESS)),
}
starts = 4
if folder is None:  # of three virtual tests every step once
    starts = 1
fits = {name: ck.identify(law, tests, using=dimple, starts=starts, **way) for name, way in ways.items()}
best = fits["offset, thickness"]
print(best)

# %%
# The audit
# ---------
# Eq. (4) divides by sum (m - mean m)^2; "all" takes the mean over all frames of all tests, "own" over the test's own.


def measured(history: ck.History) -> tuple[np.ndarray, np.ndarray]:
    """Used frames, and the amplitude there, mm."""
    return history.used, history.outputs["amplitude"][history.used]


def amplitudes(which: ck.CreepLaw, values: dict, histories: Sequence[ck.History]) -> list[np.ndarray]:
    """Predicted amplitude at the used frames of each test; a dimple that burst keeps its last value."""
    prediction = dimple.predict(which, which.to_internal(which.values(values)), histories)
    rows = [prediction.of(k)[:, 0] for k in range(len(histories))]
    return [np.where(np.isfinite(r), r, np.nanmax(r))[h.used] for r, h in zip(rows, histories, strict=True)]


def line(label: str, predicted: Sequence[np.ndarray]) -> str:
    """One row of the table: pooled loss, relative rms, then each test's loss about its own mean."""
    observed = [measured(h)[1] for h in tests]
    pooled = ck.relative_squared_error(observed, predicted)
    residuals = np.concatenate([p - m for p, m in zip(predicted, observed, strict=True)])
    relative = np.sqrt(np.mean(residuals**2) / np.mean(np.concatenate(observed) ** 2))
    losses = (ck.relative_squared_error([m], [p], about="test") for m, p in zip(observed, predicted, strict=True))
    return f"| {label} | {pooled:.3g} | {relative:.3g} | " + " | ".join(f"{v:.2g}" for v in losses) + " |"


names = [h.name.removeprefix("test_") for h in tests]
print("\n| amplitude | pooled loss | relative rms | " + " | ".join(names) + " |")
print("|-|-|-|" + "-|" * len(tests))
for label, (which, values) in PUBLISHED.items():
    print(line(label, amplitudes(which, values, tests)))
for factor in (0.5, 0.7, 1.3, 1.5):
    values = PUBLISHED["compression"][1]
    print(line(f"compression x {factor}", amplitudes(norton, values | {"A": values["A"] * factor}, tests)))
for label, fit in fits.items():
    found = fit.predict()
    print(line(label, [found.of(k)[h.used, 0] for k, h in enumerate(tests)]))
if folder is not None:
    held_out = ck.cross_validate(fits["law alone"], by="test")
    print(f"\nleft out in turn, predicted at nominal thickness: pooled loss {held_out.pooled_error('amplitude'):.3g}")
    losses = {name.removeprefix("test_"): e["amplitude"].relative_squared_error for name, e in held_out.errors.items()}
    print("  " + ", ".join(f"{name} {loss:.2g}" for name, loss in losses.items()))

# %%
# What one test says alone, and the pressure jump (Fig. 6f)
# ---------------------------------------------------------

alone = ck.law("drifting-exponent").fix(m=0)
for history in tests if folder is not None else ():
    own = ck.identify(alone, [history], using=dimple, nuisances=(ck.Nuisance("offset"),), starts=starts)
    n_inf = next(e for e in own.estimates if e.name == "n_inf")
    error = own.errors["amplitude"]
    print(
        f"{history.name} alone: loss {error.relative_squared_error:.2g}, chi square {error.chi_square:.2g}; "
        f"n_inf {n_inf.value:.2f} [{n_inf.low:.2f}, {n_inf.high:.2f}] {n_inf.verdict}"
    )
jumps = [h for h in ck.read_histories(folder) if h.loading.P2 != h.loading.P1] if folder is not None else []
for history in jumps:
    first = history.replace(used=history.used & (history.times < history.loading.Tj))
    second = history.replace(used=history.used & (history.times > history.loading.Tj + 60.0))
    own = ck.identify(alone, [first], using=dimple, nuisances=(ck.Nuisance("offset"),), starts=starts)
    predicted = own.predict([second], own_nuisances=False).of(0)[second.used, 0]
    observed = measured(second)[1]
    relative = np.sqrt(np.mean((predicted - observed) ** 2) / np.mean(observed**2))
    print(f"{history.name}: fitted before the jump, predicted after it within {100 * relative:.1f} % (relative rms)")

# %%
# Figures
# -------

out.mkdir(parents=True, exist_ok=True)
best.plot(out / "identified.png")
stress = np.geomspace(40.0, 160.0, 40)
figure, axes = plt.subplots(figsize=(6.0, 4.6))
for celsius, colour in zip((750.0, 800.0, 850.0), ("C0", "C1", "C3"), strict=True):
    T = celsius + 273.15
    late = 4 * 3600.0
    rate, _, _ = best.rate(stress, np.full_like(stress, T), time=late, warn=False)
    low = best.rate(stress, np.full_like(stress, T - 10), time=late, warn=False)[1]
    high = best.rate(stress, np.full_like(stress, T + 10), time=late, warn=False)[2]
    axes.fill_between(stress, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(stress, rate, color=colour, label=f"{celsius:.0f} C, identified at 4 h (95 %, and 10 C)")
    compressed = 1.32e6 * stress**4.8 * np.exp(-4.61e5 / (R_PAPER * T))
    axes.plot(stress, compressed, color=colour, ls="--", lw=1.0)
axes.set(xscale="log", yscale="log", xlabel="von Mises stress, MPa", ylabel="creep rate, 1/s")
axes.set_title("Inconel 625: bulge tests (solid) and compression of the paper (dashed)", fontsize=10)
axes.legend(fontsize=8)
axes.grid(alpha=0.25, which="both")
figure.tight_layout()
figure.savefig(out / "rates.png", dpi=150)

chosen = [tests[k] for k in np.argsort([float(h.temperature) for h in tests])[:: max(1, len(tests) // 4)]][:4]
figure, panels = plt.subplots(1, len(chosen), figsize=(3.4 * len(chosen), 3.2), squeeze=False)
for axes, history in zip(panels[0], chosen, strict=True):
    nuisances = {kind: float(v[0, 0]) for kind, v in best.nuisance_values([history]).items()}
    run = ck.simulate(
        law,
        dimple.replace(apex_thickness=nuisances.get("thickness", 0.4935)),
        best.values,
        loading=history.loading,
        times=history.times,
        temperature=history.temperature,
        elastic=history.elastic,
    )
    D, S, p = (history.outputs[name] for name in ("amplitude", "width", "shape"))
    for radius, colour in zip((0.0, 2.0, 4.0), ("C0", "C1", "C2"), strict=True):
        axes.plot(history.times / 3600, D * np.exp(-((radius / S) ** p)), ".", ms=2.5, color=colour, alpha=0.5)
        axes.plot(run.times / 3600, run.displacement(radius=radius), color=colour, label=f"r = {radius:.0f} mm")
    axes.set(xlabel="time, h", title=f"{history.name}, {history.condition}")
    axes.title.set_fontsize(9)
    axes.grid(alpha=0.25)
panels[0, 0].set_ylabel("displacement, mm")
panels[0, 0].legend(fontsize=8)
figure.tight_layout()
figure.savefig(out / "profiles.png", dpi=150)
plt.close("all")
print(f"\nfigures: {out}/identified.png, rates.png, profiles.png")
