"""Planted bending tests from another discretisation: midpoint fibres and stations, an explicit method of scipy."""

import numpy as np
from scipy.integrate import solve_ivp

import creepkit as ck

ELASTIC = ck.Elastic(E=150e3)
E = 150e3


def three_point(values, force, times, *, height=4.0, width=8.0, span=40.0, fibres=40, stations=24, strain_power=0.0):
    """Deflection of the middle, (times,) mm, for p' = A s^n p^m; small deflections, Bernoulli, virtual work."""
    y = (np.arange(fibres) + 0.5) * height / 2 / fibres  # one half: stresses are even
    area = width * height / fibres
    x = (np.arange(stations) + 0.5) * span / 2 / stations
    inertia = area * np.sum(y**2)
    moment = 0.5 * force * x[:, None]
    A, n = values["A"], values["n"]

    def slope(t, unknowns):
        c = unknowns.reshape(stations, fibres)
        stress = moment * y / inertia + E * (y * (c @ (area * y))[:, None] / inertia - c)
        rate = A * np.sign(stress) * np.abs(stress) ** n
        if strain_power:
            rate = rate * np.maximum(np.abs(c), 1e-9) ** strain_power
        return rate.ravel()

    found = solve_ivp(slope, (0.0, times[-1]), np.zeros(stations * fibres), "RK45", times, rtol=1e-6, atol=1e-9)
    creep = found.y.reshape(stations, fibres, -1)
    curvature = np.einsum("sft,f->st", creep, area * y) / inertia
    elastic = force * span**3 / (48 * E * width * height**3 / 12)
    return elastic + 2 * (0.5 * x * span / 2 / stations) @ curvature


def planted(values, forces, times, seed, *, noise=2e-3, tolerance=0.005, strain_power=0.0):
    """Measured histories of one alloy, and the true height of each test piece, which nobody measured."""
    rng = np.random.default_rng(seed)
    found = []
    for force in forces:
        height = 4.0 * (1 + tolerance * rng.standard_normal())
        deflection = three_point(values, force, times, height=height, strain_power=strain_power)
        found.append(
            ck.History(
                f"{force:g} N",
                times,
                {"deflection": deflection + noise * rng.standard_normal(times.size)},
                ck.constant_load("force", force),
                1000.0,
                specimen="three-point-bend",
                elastic=ELASTIC,
            )
        )
    return found
