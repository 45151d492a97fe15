"""The steps of the source group's released pipeline, as described in words; written anew for comparison.

Rigid motion of each frame by Kabsch over all points of a 25 mm square, the dome included; then a plane by RANSAC
(0.1 mm, 100 trials), which the frame is turned into; less frame 0; then eight parameters by curve_fit, whose centre is
fitted in each frame, p within 2 to 3.
"""

import numpy as np
from scipy.optimize import curve_fit

from creepkit.extraction.plate import plate_axes


def eight_parameters(xy, A, x0, y0, sx, sy, theta, p, offset):
    x, y = xy
    c, s = np.cos(theta), np.sin(theta)
    across, along = c * (x - x0) + s * (y - y0), -s * (x - x0) + c * (y - y0)
    return offset + A * np.exp(-0.5 * (np.abs(across / sx) ** p + np.abs(along / sy) ** p))


def kabsch(source, target):
    a, b = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - a).T @ (target - b))
    turn = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    R = (u @ turn @ vt).T
    return source @ R.T + b - R @ a


def ransac_plane(points, random, tolerance=0.1, trials=100):
    best = np.zeros(len(points), bool)
    for _ in range(trials):
        a, b, c = points[random.choice(len(points), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        inside = np.abs((points - a) @ normal) < tolerance * np.linalg.norm(normal)
        if inside.sum() > best.sum():
            best = inside
    return best


def released_fits(frames, chosen, center, seed=0):
    """(frames, 8) parameters of the chosen frames; center : (2,) mm, of the square, in the frames' axes."""
    random = np.random.default_rng(seed)
    first = frames[0]
    axes = plate_axes(first.points[first.valid])
    rest = axes.places(first.points) - np.r_[axes.place_of(*center), 0.0]
    square = first.valid & (np.abs(rest[:, :2]) < 12.5).all(axis=1) & (np.abs(rest[:, 2]) < 2.0)
    results = []
    for index in chosen:
        frame = frames[index]
        seen = square & frame.valid
        now = rest[seen] + frame.displacements[seen] @ axes.axes.T
        back = kabsch(now, rest[seen])
        plane = plate_axes(back[ransac_plane(back, random)])
        heights = plane.places(back)[:, 2] - rest[seen][:, 2]
        x, y = rest[seen][:, :2].T
        start = [heights.max(), 0.0, 0.0, 2.7, 2.7, 0.1, 2.2, 0.0]
        bounds = ([0, -5, -5, 0.5, 0.5, -np.pi / 4, 2, -1], [5, 5, 5, 10, 10, np.pi / 4, 3, 1])
        try:
            results.append(curve_fit(eight_parameters, (x, y), heights, start, bounds=bounds, max_nfev=2000)[0])
        except RuntimeError:
            results.append(np.full(8, np.nan))
    return np.array(results)
