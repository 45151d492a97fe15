"""The material point: closed forms in several axes, both routes against one another, planted values, files."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.integration.tensor_point import proportional_loading
from creepkit.language import CreepLaw, mean_stress, principal_stress, stress
from creepkit.laws.norton import NORTON
from creepkit.readers.history_csv import write_history
from creepkit.records import History, PointLoading, Program, Status
from creepkit.specimens.material_point import MaterialPoint, PointRun
from helpers.kachanov_law import A, kachanov, n

E, NU = 1.6e5, 0.3
STEEL = ck.Elastic(E, NU)
VALUES = {"A": 1e-14, "n": 4.0}
TIMES = np.array([0.0, 10.0, 1e3, 1e4])
FINE = MaterialPoint(tolerance=1e-8)

KACHANOV = kachanov(principal_stress, 0.99)
BRITTLE = {"A": 1e-16, "n": 4.0, "C": 1e-13, "v": 4.0}


def plan(loading, times=TIMES, **changes) -> History:
    given = {"elastic": STEEL, "temperature": 1000.0, **changes}
    return History("test", times, {}, loading, specimen="point", **given)


def shown(loading, law=NORTON, values=VALUES, specimen=FINE, **changes):
    found = specimen.predict(law, law.to_internal(values), [plan(loading, **changes)])
    return {name: found.of(0)[:, k] for k, name in enumerate(found.outputs)}


def test_tension_with_torsion():
    """q^2 = s^2 + 3 tau^2; creep 11 is p s/q, and the shear strain of the tensor 3/2 p tau/q."""
    found, q = shown(PointLoading(stress={"11": 60, "12": 40})), np.sqrt(60.0**2 + 3 * 40.0**2)
    p = 1e-14 * q**4 * TIMES
    np.testing.assert_allclose(found["strain"], p, rtol=1e-9)
    np.testing.assert_allclose(found["strain_11"], p * 60 / q, rtol=1e-9)
    np.testing.assert_allclose(found["strain_12"], 1.5 * p * 40 / q, rtol=1e-9)


def test_measured_strains_may_include_the_elastic_part():
    """Hooke: s/E, -nu s/E and tau/2G."""
    loading = PointLoading(stress={"11": 60, "12": 40})
    found, creep = shown(loading, includes_elastic=True), shown(loading)
    expected = {"strain": 0.0, "strain_11": 60 / E, "strain_33": -NU * 60 / E, "strain_12": 40 * (1 + NU) / E}
    for name, elastic in expected.items():
        np.testing.assert_allclose(found[name] - creep[name], elastic, atol=1e-15)


@pytest.mark.parametrize(
    ("loading", "largest"),
    [
        (PointLoading(stress={"11": 100}), 100.0),
        (PointLoading(stress={"12": 100 / np.sqrt(3)}), 100 / np.sqrt(3)),
        (PointLoading(stress={"11": -100}), 0.0),
        (PointLoading(stress={"11": 140, "22": 40, "33": 40}), 140.0),
    ],
    ids=["tension", "torsion", "compression", "tension under tension all around"],
)
def test_brittle_rupture_follows_the_largest_principal_stress(loading, largest):
    """All have q = 100 MPa. (1 - w)^(v+1) = 1 - (v+1) C s_1^v t: torsion lives 9 times as long as tension (v = 4)."""
    end = (1 - 0.01**5) / (5 * 1e-13 * largest**4) if largest else np.inf
    times = np.array([1e3, 1e4, 1e6])
    found = FINE.predict(KACHANOV, KACHANOV.to_internal(BRITTLE), [plan(loading, times=times)])
    ruptured = largest > 0
    assert found.status[0, 0] == (Status.RUPTURED if ruptured else Status.COMPLETE)
    if ruptured:
        assert found.end_times[0, 0] == pytest.approx(end, rel=1e-5)
        lost = 1 - np.maximum(1 - 5e-13 * largest**4 * times, 0.0) ** 0.2
        reached = times < end
        scale = 1e-16 * 1e8 / (1e-13 * largest**4)  # p = A q^n/(C s1^v) w, for n = v
        np.testing.assert_allclose(found.of(0)[reached, 0], scale * lost[reached], rtol=1e-5)


def test_a_law_of_the_mean_stress_feels_a_hydrostatic_part():
    """Rate A s_m q^n under tension s and a pressure all around that comes later."""
    law = CreepLaw(
        name="mean",
        terms={"creep": A * mean_stress * stress**n},
        params={A: KACHANOV.table["A"], n: KACHANOV.table["n"]},
    )
    loading = PointLoading(stress={"11": 130, "22": 50, "33": 50})
    np.testing.assert_allclose(shown(loading, law=law)["strain"], 1e-14 * (230 / 3) * 80.0**4 * TIMES, rtol=1e-9)


class TestRoutes:
    """Stresses that keep their direction are one scalar problem, with exact derivatives; the rest is marched."""

    STEPS = ((0.0, 1.0), (2e3, 1.3), (6e3, 0.8))

    @pytest.mark.parametrize("law", [NORTON, KACHANOV], ids=["norton", "damage"])
    def test_both_give_the_same(self, law):
        loading = PointLoading(stress={c: [(t, s * f) for t, f in self.STEPS] for c, s in {"11": 60, "12": 40}.items()})
        test, values = plan(loading, times=np.linspace(0.0, 1e4, 11)), VALUES if law is NORTON else BRITTLE
        assert proportional_loading(loading, 1e4) is not None
        found = FINE.predict(law, law.to_internal(values), [test], sensitivities=True)
        run = FINE.run(law, values, test)
        np.testing.assert_allclose(found.of(0)[:, 0], run.equivalent, rtol=1e-5)
        np.testing.assert_allclose(found.of(0)[:, 1:7], run.creep_strain, rtol=1e-5, atol=1e-12)
        np.testing.assert_allclose(found.of(0)[:, 7:], run.stress, atol=1e-9)

    @pytest.mark.parametrize(
        "loading",
        [
            PointLoading(stress={"11": 60, "12": [(0.0, 0.0), (5e3, 40.0)]}),
            PointLoading(stress={"11": [(0.0, 60.0), (5e3, -60.0)]}),
            PointLoading(stress={"11": 60, "22": [(0.0, 0.0), (5e3, 30.0)], "33": [(0.0, 0.0), (5e3, 31.0)]}),
            PointLoading(stress={"11": 60}, strain={"22": 0.0}),
            PointLoading(strain={"12": [(0.0, 1e-3), (5e3, 0.0)]}),
        ],
        ids=["torsion later", "reversed", "constraint later", "strain held", "twisted back"],
    )
    def test_what_turns_is_marched(self, loading):
        assert proportional_loading(loading, 1e4, (E, NU)) is None

    @pytest.mark.parametrize("name", ["11", "12"])
    def test_one_strain_that_grows_is_a_scalar_problem(self, name):
        loading = PointLoading(strain={name: [(0.0, 5e-4), (2e3, 8e-4)]})
        test = plan(loading, times=np.linspace(0.0, 1e4, 6), includes_elastic=True)
        assert proportional_loading(loading, 1e4, (E, NU)) is not None
        found, run = (
            FINE.predict(KACHANOV, KACHANOV.to_internal(BRITTLE), [test], sensitivities=True),
            FINE.run(KACHANOV, BRITTLE, test),
        )
        np.testing.assert_allclose(found.of(0)[:, 1:7], run.total_strain, rtol=1e-6, atol=1e-10)
        np.testing.assert_allclose(found.of(0)[:, 7:], run.stress, rtol=1e-5, atol=1e-6)
        steps = [{**BRITTLE, "n": 4.0 + s} for s in (1e-4, -1e-4)]
        up, down = (FINE.predict(KACHANOV, KACHANOV.to_internal(values), [test]).of(0) for values in steps)
        assert found.jacobian is not None
        exact, difference = found.jacobian[0, 0, :, :, 1], (up - down) / 2e-4
        scale = np.abs(exact).max(axis=0) + 1e-12
        np.testing.assert_allclose(exact / scale, difference / scale, atol=1e-4)

    def test_differences_are_the_derivatives(self):
        """Two segments of constant stress, creep along each: d(strain)/d(ln A) = strain, to n the sum of p ln q."""
        loading = PointLoading(stress={"11": 60, "12": [(0.0, 0.0), (5e3, 40.0)]})
        found = FINE.predict(NORTON, NORTON.to_internal(VALUES), [plan(loading, times=[1e4])], sensitivities=True)
        q = np.array([60.0, np.sqrt(60.0**2 + 3 * 40.0**2)])
        p = 1e-14 * q**4 * 5e3
        assert found.jacobian is not None
        np.testing.assert_allclose(found.jacobian[0, 0, 0, 0], [p.sum(), p @ np.log(q)], rtol=1e-4)
        np.testing.assert_allclose(found.jacobian[0, 0, 0, 1], [p @ (60 / q), (p * 60 / q) @ np.log(q)], rtol=1e-4)


def test_a_run_keeps_tensors_and_states():
    loading = PointLoading(stress={"11": 60, "12": [(0.0, 0.0), (5e3, 40.0)]})
    run = ck.simulate(KACHANOV, "point", BRITTLE, loading=loading, times=TIMES, elastic=STEEL)
    assert isinstance(run, PointRun)
    assert list(run.outputs) == ["strain", "strain_11", "strain_22", "strain_33", "strain_12", "stress_11", "stress_12"]
    assert run.stress.shape == run.total_strain.shape == run.creep_strain.shape == (4, 6)
    np.testing.assert_allclose(run.mises, [60, 60, 60, np.sqrt(60**2 + 3 * 40**2)])
    np.testing.assert_allclose(run.total_strain[:, 0] - run.creep_strain[:, 0], 60 / E, rtol=1e-10)
    assert (np.diff(run.states["damage"]) > 0).all()


def test_programmes_are_taken_as_they_are():
    ramp = Program([0.0, 100.0], [0.0, 80.0])
    found = shown(PointLoading(stress={"11": ramp, "22": ramp}), times=[100.0])
    assert found["strain"][0] == pytest.approx(1e-14 * 80.0**4 * 100 / 5, rel=1e-7)


def test_frames_and_rows_of_programmes_do_not_use_up_the_steps():
    """Every frame ends a step of a stress that turns: the cap is on what the law needs beside them."""
    turning = PointLoading(stress={"11": 60.0, "12": [(0.0, 0.0), (5e3, 35.0)]})
    test = plan(turning, times=np.linspace(0.0, 1e4, 101))
    found = MaterialPoint(max_steps=10).predict(NORTON, NORTON.to_internal(VALUES), [test])
    assert found.status[0, 0] == Status.COMPLETE
    later = (60.0**2 + 3 * 35.0**2) ** 2
    assert found.of(0)[-1, 0] == pytest.approx(1e-14 * 5e3 * (60.0**4 + later), rel=1e-4)


def measured(loading, outputs, rng, noise=2e-6, times=None):
    test = plan(loading, times=np.geomspace(60, 3e4, 25) if times is None else times)
    found = shown(loading, law=KACHANOV, values=BRITTLE, times=test.times)
    name = f"test {loading.stress and list(loading.stress)} {[float(p.values[0]) for p in loading.stress.values()]}"
    return test.replace(name=name, outputs={k: found[k] + rng.normal(0, noise, test.times.size) for k in outputs})


def test_planted_values_of_a_damage_law_are_found_from_tension_and_torsion():
    """Damage by the largest principal stress: it takes both to tell C and v from A and n."""
    rng = np.random.default_rng(3)
    tension = [measured(PointLoading(stress={"11": s}), ["strain_11"], rng) for s in (70.0, 85.0)]
    twisted = [
        measured(PointLoading(stress={"11": 50, "12": t}), ["strain_11", "strain_12"], rng) for t in (30.0, 40.0)
    ]
    fit = ck.identify(KACHANOV, [*tension, *twisted], starts=2, frames=25)
    assert all(e.low <= BRITTLE[e.name] <= e.high for e in fit.estimates)
    assert fit.values["n"] == pytest.approx(4.0, abs=0.05)


def test_a_history_of_a_point_survives_its_file(tmp_path):
    loading = PointLoading(stress={"11": 60, "12": [(0.0, 0.0), (5e3, -40.0)]}, strain={"33": 0.0})
    run = ck.simulate(NORTON, "point", VALUES, loading=loading, times=TIMES, elastic=STEEL)
    (again,) = ck.read_histories(write_history(run, tmp_path / "point.csv"))
    assert (again.specimen, again.loading, again.elastic) == ("point", loading, STEEL)
    assert {name: v.tolist() for name, v in again.outputs.items()} == {n: v.tolist() for n, v in run.outputs.items()}
    assert again.condition == "20 °C, 11 60 MPa, 12 0 to -40 MPa, strain 33 0"
