"""A bar and a plate with a hole in FElupe, of an exported NumPy update: what felupe_update runs where FElupe is.

    python tests/benchmarks/felupe_models.py '["bar", "exported.py", 40]'

Prints a value and Newton's iterations an increment as JSON. Needs FElupe and NumPy alone.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import felupe
import numpy as np

KELVIN = 1073.15
HELD, STRAIN, PRESSURE = 1e5, 6e-4, 5.0
"""Of the bar: time, s, and strain; of the plate: MPa in the hole."""


def material(text: str, clock: dict[str, float]) -> Any:
    """FElupe's material of an exported module; the clock holds time and dtime, s."""
    module: dict[str, Any] = {}
    exec(compile(text, "exported", "exec"), module)
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    full = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])

    def umat(change: Any, strain: Any, stress: Any, states: Any, **_: Any) -> tuple[Any, Any, list[Any]]:
        engineering = change[rows, columns] * np.array([1, 1, 1, 2, 2, 2]).reshape(6, *[1] * (change.ndim - 2))
        outside = np.full((2, 1), KELVIN)
        new, state, tangent, failed = module["update"](
            clock["time"], clock["dtime"], outside, engineering, stress[rows, columns], states[0]
        )
        assert not failed.any()
        return tangent[full][:, :, full], new[full], [state]

    return felupe.MaterialStrain(umat, statevars=((len(module["INITIAL"]),),))


def bar(text: str, increments: int) -> dict[str, float]:
    """Stress of a bar that is held, MPa, and Newton's iterations an increment."""
    clock = {"time": 0.0, "dtime": 10.0}
    mesh = felupe.Cube(n=3)
    field = felupe.FieldContainer([felupe.Field(felupe.RegionHexahedron(mesh), dim=3)])
    held = felupe.dof.uniaxial(field, clamped=False, return_loadcase=False)
    body = felupe.SolidBody(material(text, clock), field)
    iterations = 0
    for k, end in enumerate([10.0, *(10.0 + HELD * (np.arange(1, increments + 1) / increments) ** 2)]):
        clock.update(dtime=end - clock["time"])
        held["move"].update(STRAIN)
        dof0, dof1 = felupe.dof.partition(field, held)
        ext0 = felupe.dof.apply(field, held, dof0)
        done = felupe.newtonrhapson(items=[body], dof0=dof0, dof1=dof1, ext0=ext0, verbose=0, tol=1e-9)
        clock["time"], iterations = end, iterations + (done.iterations if k else 0)
    stress = body.results.statevars[-9].mean()
    return {"value": float(stress), "iterations": iterations / increments}


def tube(text: str, increments: int, elements: int, exponent: float) -> dict[str, float]:
    """Largest difference of hoop less radial stress from the steady one, percent, and iterations an increment."""
    clock = {"time": 0.0, "dtime": 1.0}
    mesh = felupe.Rectangle(a=(1.0, 0.0), b=(2.0, np.pi / 2), n=(elements + 1, elements + 1))
    radius, angle = mesh.points.T.copy()
    mesh.update(points=np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1))
    region = felupe.RegionQuad(mesh)
    field = felupe.FieldContainer([felupe.FieldPlaneStrain(region, dim=2)])
    inside = np.isclose(radius, 1.0)
    edge = felupe.RegionQuadBoundary(mesh, mask=inside, ensure_3d=True)
    pressed = felupe.FieldContainer([felupe.FieldPlaneStrain(edge, dim=2)])
    pressure = felupe.SolidBodyPressure(pressed)
    body = felupe.SolidBody(material(text, clock), field)
    boundaries = {
        "below": felupe.Boundary(field[0], fy=0.0, skip=(1, 0)),
        "left": felupe.Boundary(field[0], fx=0.0, skip=(0, 1)),
    }
    dof0, dof1 = felupe.dof.partition(field, boundaries)
    ext0 = felupe.dof.apply(field, boundaries, dof0)
    iterations = 0
    ends = [1.0, *(1.0 + 1e3 * (np.arange(1, increments + 1) / increments) ** 3)]
    for k, end in enumerate(ends):
        clock.update(dtime=end - clock["time"])
        pressure.update(PRESSURE)
        done = felupe.newtonrhapson(items=[body, pressure], dof0=dof0, dof1=dof1, ext0=ext0, verbose=0, tol=1e-8)
        clock["time"], iterations = end, iterations + (done.iterations if k else 0)
    stress = body.results.statevars[-9:].reshape(3, 3, *body.results.statevars.shape[1:])
    place = np.einsum("cai,aq->iqc", mesh.points[mesh.cells], region.h[..., 0] if region.h.ndim > 2 else region.h)
    r, n = np.hypot(*place), 2.0 / exponent
    direction = place / r
    radial = np.einsum("iqc,ijqc,jqc->qc", direction, stress[:2, :2], direction)
    hoop = stress[0, 0] + stress[1, 1] - radial
    steady = n * PRESSURE * (2.0 / r) ** n / (2.0**n - 1.0)
    return {"value": float(100 * np.abs((hoop - radial) / steady - 1).max()), "iterations": iterations / increments}


if __name__ == "__main__":
    kind, file, *numbers = json.loads(sys.argv[1])
    print(json.dumps({"bar": bar, "tube": tube}[kind](Path(file).read_text(), *numbers)))
