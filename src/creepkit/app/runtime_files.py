"""The scripts of the runtime, in the order in which a page or a program loads them."""

from __future__ import annotations

from functools import cache
from importlib import resources

RUNTIME_FILES = (
    "base.js",
    "time_transformation.js",
    "tableau.js",
    "stage_solver.js",
    "point_integration.js",
    "bars.js",
    "kinematics.js",
    "body_points.js",
    "reduced_model.js",
    "body_integration.js",
    "time_interpolation.js",
    "profile_fit.js",
    "dimple.js",
    "network.js",
)
"""Each needs those before it."""


def runtime_files() -> dict[str, str]:
    """{file name: text}, in order."""
    folder = resources.files("creepkit.app").joinpath("runtime")
    return {name: folder.joinpath(name).read_text(encoding="utf-8") for name in RUNTIME_FILES}


@cache
def runtime_script() -> str:
    """The whole runtime as the text of one classic script, which holds no end of a script element."""
    return "\n".join(runtime_files().values())
