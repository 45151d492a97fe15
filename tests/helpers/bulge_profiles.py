"""Bulges to be observed: planted ones, and profiles that CalculiX made of the true dimple."""

import numpy as np
from scipy.interpolate import CubicSpline

from helpers.paths import SHARED

NODES = np.linspace(0.0, 10.0, 41)
FINE = np.linspace(0.0, 10.0, 10001)
LOOKED_AT = np.linspace(0.0, 7.5, 76)
TABLES = SHARED / "benchmarks" / "dabi_ccx"


def bell(r, D, S, p):
    return D * np.exp(-((r / S) ** p))


def cross(x, y, D, S, p):
    return D * np.exp(-(np.abs(x / S) ** p) - np.abs(y / S) ** p)


def plates(radii, frames=6):
    """Profiles (frames, nodes) that are no generalised Gaussians, from small to large."""
    growth = np.arange(1, frames + 1)[:, None]
    return 0.12 * growth * (1 - (np.minimum(radii, 7.6) / 7.6) ** 2) ** (2.4 - 0.1 * growth)


def richardson(function, step):
    """The derivative of function(h) at 0, error of the fourth power of the step."""
    near, far = (function(h) - function(-h) for h in (step, 2 * step))
    return (8 * near - far) / (12 * step)


def table(name):
    """61 radii an eighth of a mm apart, as the deck's nodes are, u_z there (frames, 61), and D, S, p as printed.

    Eight radii are printed, but the fit beside them knew all nodes. In between ln u_z is nearly linear in r^2: a spline
    of it is within 3.2e-4 mm of the profile that CalculiX 2.20 gives with the deck of the table.
    """
    rows = np.loadtxt(TABLES / name, delimiter=",", skiprows=1)
    radii, nodes = np.array([0, 1, 2, 3, 4, 5, 6, 7.5]), np.linspace(0, 7.5, 61)
    return nodes, np.exp(CubicSpline(radii**2, np.log(rows[:, 1:9]), axis=1)(nodes**2)), rows[:, 9:12]


def profile_with_apex(apex):
    nodes, profiles, _ = table("dabi_timehardening.csv")
    return nodes, [[np.interp(apex, profiles[:, 0], column) for column in profiles.T]]
