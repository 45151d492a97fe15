"""Planted rupture tests: times by a method with known constants, heats that scatter, run-outs; and published ones."""

import numpy as np

import creepkit as ck

HOUR = 3600.0
R10 = np.log(10.0) * 8.314462618
"""J/(mol K)."""


def larson_miller(x, T):
    """log10 h at log10 MPa and K: C = 20, a quadratic of log stress."""
    return -20.0 + (32000.0 - 2000.0 * x - 1900.0 * x**2) / T


def orr_sherby_dorn(x, T):
    return 330e3 / (R10 * T) - 9.0 - 4.0 * x - 1.2 * (x - 2.0) ** 2


def manson_haferd(x, T):
    return 14.0 + (T - 500.0) * (0.02 - 0.024 * x)


TENSILE = {823.15: 420.0, 873.15: 380.0, 923.15: 330.0}


def wilshire(x, T):
    """u = 0.16, Q = 280 kJ/mol, ln k_1 = 6."""
    ratio = -np.log(10.0**x / np.interp(T, [*TENSILE], [*TENSILE.values()]))
    return 280e3 / (R10 * T) + (np.log(ratio) / 0.16 - 6.0 / 0.16) / np.log(10.0)


def planted(mean, *, seed=0, count=48, heats=0, scatter=0.08, between=0.1, end=np.inf, effects=None):
    """Histories at 823 to 923 K whose times lie from some tens to some thousand hours; run-outs at `end` hours.

    effects : log10 of the factors of heats; drawn where None.
    """
    rng = np.random.default_rng(seed)
    drawn = between * rng.standard_normal(max(heats, 1)) if effects is None else np.asarray(effects)
    tests = []
    for k in range(count):
        T = (823.15, 873.15, 923.15)[k % 3]
        x = _log_stress(mean, T, rng.uniform(1.3, 4.0))
        heat = (k // 3) % heats if heats else 0
        log_time = mean(x, T) + scatter * rng.standard_normal() + (drawn[heat] if heats else 0.0)
        labels = {"heat": f"H{heat}"} if heats else {}
        tests.append(rupture_test(f"t{k}", 10.0**x, T, 10.0**log_time, end=end, labels=labels))
    return tests


def _log_stress(mean, T, log_time):
    """log10 MPa at which a falling mean is log_time."""
    low, high = 0.5, 2.5
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean(middle, T) > log_time else (low, middle)
    return 0.5 * (low + high)


def rupture_test(name, stress, temperature, hours, *, end=np.inf, **fields):
    """A history without frames: it broke after some hours, or was stopped at `end`."""
    known = {"rupture_time": hours * HOUR} if hours < end else {"unruptured": True}
    return ck.History(name, [min(hours, end) * HOUR], {}, ck.constant_stress(stress), temperature, **known, **fields)


MOTORETTES = {
    150.0: [-8064] * 10,
    170.0: [1764, 2772, 3444, 3542, 3780, 4860, 5196, -5448, -5448, -5448],
    190.0: [408, 408, 1344, 1344, 1440, *[-1680] * 5],
    220.0: [408, 408, 504, 504, 504, *[-528] * 5],
}
"""Hours to failure of motor insulation by temperature in degrees Celsius, negative where the test was stopped before:
Crawford (1970), Insulation/Circuits 16, 45, as in Schmee, Hahn (1979), Technometrics 21, 417."""
