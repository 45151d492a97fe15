"""The base of axisymmetric specimens: bars against the material point, batches, lengths, endings and messages."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError
from creepkit.fem.mesh import Mesh

AREA = 4.0 * np.pi
LAWS = {
    "norton": {"A": 1e-16, "n": 5.0},
    "time-hardening": {"A": 1e-13, "n": 4.0, "m": -0.4},
    "strain-hardening": {"A": 1e-17, "n": 5.0, "m": -0.3},
    "hyperbolic-sine": {"A": 1e-8, "B": 50.0, "n": 3.0},
}


@dataclass(frozen=True)
class RoundBar(ck.Axisymmetric):
    """A smooth round bar under a dead force; its strain is that of a gauge length about the middle."""

    radius: float = ck.dimension(2.0, (0.1, 100.0), tolerance=0.01)
    gauge_length: float = ck.dimension(3.0, (0.1, 100.0), tolerance=0.01)

    name, title = "round-bar", "Smooth bar in finite elements"
    outputs = (ck.Output("strain", "strain", noise=1e-5),)
    loads = (ck.Load("force", "force"),)

    def section(self, load: str) -> ck.Section:
        bar = ck.Section.rectangle((0.0, 0.0), (self.radius, 4.0), self.elements(2), self.elements(2))
        return bar.hold("bottom", z=True).plane("top").pull("top")

    def observe(self, displacements: ck.Displacements):
        return {"strain": np.log1p(displacements.axial("top_left") / 4.0 * (3.0 / self.gauge_length))}


@dataclass(frozen=True)
class HeldBar(RoundBar):
    """The same bar at an imposed elongation, mm; its nominal stress."""

    name = "held-bar"
    outputs = (ck.Output("nominal", "stress", grows=False),)
    loads = (ck.Load("elongation", "length"),)

    def section(self, load: str) -> ck.Section:
        bar = ck.Section.rectangle((0.0, 0.0), (self.radius, 4.0), 1, 2)
        return bar.hold("bottom", z=True).move("top")

    def observe(self, displacements: ck.Displacements):
        return {"nominal": displacements.force / (np.pi * self.radius**2)}


def plan_of(specimen: ck.Axisymmetric, loading, times, **more) -> ck.History:
    """A planned test at 1000 K."""
    given = {"temperature": 1000.0, "elastic": ck.Elastic(E=150e3), **more}
    outputs = {name: np.zeros(len(times)) for name in specimen.outputs}
    return ck.History("plan", times, outputs, loading, specimen=specimen.name, **given)


def predicted(specimen, law, values, plans, **more) -> ck.Prediction:
    """Of one candidate, in the law's units."""
    law = ck.law(law)
    return specimen.predict(law, law.to_internal(law.values(values)), plans, **more)


@pytest.mark.parametrize("law", LAWS)
def test_a_bar_creeps_as_the_material_point(law: str) -> None:
    """Under steps of load, at all times, for laws with and without memory; the point has its own integration."""
    times = np.geomspace(60.0, 4e4, 15)
    steps = [(0.0, 60.0), (1e4, 75.0)]
    stiff = {"elastic": ck.Elastic(E=9e7)}
    plan = plan_of(RoundBar(), ck.load_steps("force", [(t, s * AREA) for t, s in steps]), times, **stiff)
    point = plan.replace(loading=ck.StressSteps(tuple(steps)), specimen="uniaxial", includes_elastic=True)
    found = predicted(RoundBar(tolerance=1e-4, resolution=1e-5), law, LAWS[law], [plan])
    known = predicted(ck.specimen("uniaxial"), law, LAWS[law], [point])
    assert found.status == known.status == 0
    assert known.of(0)[-1, 0] > 1e-3
    np.testing.assert_allclose(found.of(0), known.of(0), rtol=1e-3)


@pytest.mark.parametrize("law", ["norton", "strain-hardening"])
def test_a_held_bar_relaxes_as_the_material_point(law: str) -> None:
    """From a strain of 5e-4 on; the point has stress by logarithmic strain, and an area that stays."""
    times = np.geomspace(60.0, 1e6, 15)
    plan = plan_of(HeldBar(), ck.constant_load("elongation", 4.0 * np.expm1(5e-4)), times)
    point = plan.replace(loading=ck.constant_strain(5e-4), specimen="relaxation", outputs={"stress": np.zeros(15)})
    found = predicted(HeldBar(tolerance=1e-4), law, LAWS[law], [plan]).of(0)[:, 0]
    known = predicted(ck.specimen("relaxation"), law, LAWS[law], [point]).of(0)[:, 0]
    assert known[-1] < 0.7 * known[0]
    np.testing.assert_allclose(found, known, rtol=2e-3)


def test_candidates_and_tests_are_those_of_single_predictions() -> None:
    """To the bit, in two threads, with lengths that differ from candidate to candidate and from test to test."""
    bar, law = RoundBar(threads=2), ck.law("norton")
    plans = [
        plan_of(bar, ck.constant_load("force", 700.0), [100.0, 1e4]),
        plan_of(bar, ck.constant_load("force", 800.0), [10.0, 100.0, 1e4], geometry={"radius": 2.2}),
    ]
    theta = law.to_internal({"A": np.array([1e-16, 2e-16]), "n": np.array([5.0, 4.9])})
    lengths = {"gauge_length": np.array([[3.0, 3.1], [2.9, 3.0]])}
    found = bar.predict(law, theta, plans, nuisances=lengths, sensitivities=True)
    for c in range(2):
        for k, plan in enumerate(plans):
            own = {"gauge_length": lengths["gauge_length"][c : c + 1, k : k + 1]}
            one = bar.replace(threads=1).predict(law, theta[c : c + 1], [plan], nuisances=own, sensitivities=True)
            np.testing.assert_array_equal(found.of(k, c), one.of(0))
            frames = slice(None, plan.times.size)
            np.testing.assert_array_equal(found.jacobian[c, k, frames], one.jacobian[0, 0])
            slope = found.nuisance_jacobian["gauge_length"][c, k, frames]
            # log1p(3 u/(4 L)) to L, at the same u
            length, strain = own["gauge_length"][0, 0], one.of(0)
            np.testing.assert_allclose(slope, np.expm1(strain) * np.exp(-strain) / -length, rtol=1e-6)


def test_a_length_that_moves_the_mesh_alone() -> None:
    """A thicker bar under the same force creeps less, as stress to the power n: d ln strain/d ln radius = -2 n."""
    bar = RoundBar(tolerance=1e-4)
    plan = plan_of(bar, ck.constant_load("force", 700.0), [1e5], elastic=ck.Elastic(E=9e7))
    found = predicted(
        bar, "norton", {"A": 1e-18, "n": 5.0}, [plan], nuisances={"radius": np.array([[2.0]])}, sensitivities=True
    )
    strain = found.of(0)[0, 0]
    assert strain < 1e-3
    elastic = 700.0 / AREA / 9e7
    exact = -(10.0 * (strain - elastic) * np.exp(5.0 * strain) + 2.0 * elastic) / 2.0  # of -ln(1 - n A s^n t)/n + s/E
    assert found.nuisance_jacobian["radius"][0, 0, 0, 0] == pytest.approx(exact, rel=1e-3)


def test_a_mesh_from_elsewhere() -> None:
    """The same mesh, given as one from a file would be: what is held comes with it, sides and points are named."""
    made = RoundBar().section("force")
    held = np.zeros(made.nodes.shape, bool)
    held[np.unique(made.sides["bottom"]), 1] = True
    mesh = Mesh(made.nodes, made.elements, held, made.sides["right"], np.zeros(0, int))

    @dataclass(frozen=True)
    class ReadBar(RoundBar):
        grid: Mesh = field(default=mesh)

        def section(self, load: str) -> ck.Section:
            bar = ck.Section.of_mesh(self.grid).with_side("top", lambda r, z: z > 3.999).with_point("top_left", 0, 4)
            return bar.plane("top").pull("top")

    plan = plan_of(RoundBar(), ck.constant_load("force", 700.0), [1e3, 1e5])
    one, other = (predicted(bar, "norton", LAWS["norton"], [plan]).of(0) for bar in (RoundBar(), ReadBar()))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_bar_ends_in_tertiary_creep() -> None:
    """A dead load leads to infinite strain at 1/(n A s^n), which is a result; the strain limit comes just before."""
    values = {"A": 1e-16, "n": 5.0}
    end = 1.0 / (5.0 * 1e-16 * 80.0**5)
    run = ck.simulate(
        "norton", RoundBar(tolerance=1e-3), values, loading=ck.constant_load("force", 80.0 * AREA), temperature=1000.0,
        elastic=ck.Elastic(E=150e3), times=np.linspace(0.1, 2.0, 20) * end,
    )  # fmt: skip
    assert run.status is ck.Status.RUPTURED
    assert run.rupture_time == pytest.approx(end, rel=0.01)
    assert run.reason in ("creep strain reached the strain limit", "equilibrium was lost while the load did not rise")


@dataclass(frozen=True)
class Dimple(ck.Axisymmetric):
    """The dimple of the bulge test, with its apex observed in the place of Gaussian fits."""

    apex_thickness: float = ck.dimension(0.5, (0.1, 2.0), tolerance=0.02)

    name, title = "dimple", "Dimple by the general interface"
    outputs = (ck.Output("apex", "length"),)
    loads = (ck.Load("pressure", "pressure"),)

    def section(self, load: str) -> ck.Section:
        mesh = ck.specimen("bulge").geometry.replace(apex_thickness=self.apex_thickness).mesh(1.0)
        return ck.Section.of_mesh(mesh).press("pressed")

    def observe(self, displacements: ck.Displacements):
        return {"apex": displacements.axial("top_first")}


def test_the_dimple_is_such_a_specimen() -> None:
    """What the bulge specimen says of its apex, in steps of its own, and the derivative to its thickness."""
    loading, times = ck.PressureJump(P1=8.0, P2=10.0, Tj=7200.0), np.geomspace(60.0, 14400.0, 12)
    given = {"loading": loading, "elastic": ck.Elastic(E=150e3), "temperature": 1000.0, "times": times}
    known = ck.simulate("norton", ck.specimen("bulge").replace(tolerance=2e-4), LAWS["norton"], **given)
    found = ck.simulate("norton", Dimple(tolerance=2e-4, resolution=0.01), LAWS["norton"], **given)
    np.testing.assert_allclose(found.outputs["apex"], known.displacement(0.0), rtol=5e-4)
    thicker = (
        ck.simulate("norton", ck.specimen("bulge").replace(tolerance=2e-4, apex_thickness=t), LAWS["norton"], **given)
        for t in (0.501, 0.499)
    )
    up, down = (run.displacement(0.0) for run in thicker)
    derivatives = predicted(
        Dimple(tolerance=2e-4, resolution=0.01), "norton", LAWS["norton"], [plan_of(Dimple(), loading, times)],
        nuisances={"apex_thickness": np.array([[0.5]])}, sensitivities=True,
    )  # fmt: skip
    slope = (up - down) / 0.002
    np.testing.assert_allclose(derivatives.nuisance_jacobian["apex_thickness"][0, 0, :, 0], slope, rtol=5e-3)


def test_a_run_keeps_the_whole_body() -> None:
    run = ck.simulate(
        "norton", RoundBar(), LAWS["norton"], loading=ck.constant_load("force", 60.0 * AREA), temperature=1000.0,
        elastic=ck.Elastic(E=9e7), times=[1e3, 1e4],
    )  # fmt: skip
    assert run.geometry == {"radius": 2.0, "gauge_length": 3.0}
    assert run.displacements().shape == (2, len(run.model.nodes), 2)
    stress = 60.0 * np.exp(run.outputs["strain"])[:, None]
    np.testing.assert_allclose(run.field("stress").values / stress, 1.0, rtol=1e-4)
    np.testing.assert_allclose(run.field("creep strain").values[-1], run.outputs["strain"][-1], rtol=1e-3)
    with pytest.raises(SolveError, match="nothing is known at 20000 s; the simulation reaches from 0 to 10000 s"):
        run.field("stress", 2e4)
