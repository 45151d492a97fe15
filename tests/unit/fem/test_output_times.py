"""Values between the steps of a march: curves known in closed form, and runs with many more steps."""

from functools import cache

import numpy as np
import pytest
import sympy
from scipy.interpolate import CubicSpline

import creepkit as ck
from creepkit import kernels
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.simulation import REASONS, LoadHistory, Simulation, simulate
from creepkit.fem.solver import DEFLECTION_LIMIT, LIMIT_LOAD, SolverSettings
from creepkit.fem.time_interpolation import OFFSET, TimeInterpolation
from creepkit.language import CreepLaw, Elastic, strain, stress, time
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import History, PressureJump, Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.specimen import Bulge
from helpers.literature_laws import POWER, RATE, A, k, law, n, number

DIMPLE = finite_element_model(DimpleGeometry().mesh(0.5))
LAWS = {
    "norton": {"A": 6e-14, "n": 4.0},
    "strain-hardening": {"A": 1e-17, "n": 4.0, "m": -0.9},
    "time-hardening": {"A": 2e-10, "n": 4.0, "m": -0.9},
}


def program(*segments):
    """Segments (start, end, pressure, end pressure); temperature, modulus and motion are not looked at."""
    rows = np.zeros((len(segments), 10))
    rows[:, :4] = segments
    return rows


def doubling(start, end, beta=1.0, share=1.0):
    """Times as a march takes them: each at most twice the one before plus 10 s, and steps of `share` in t^beta."""
    times = [0.0]
    while times[-1] < end - start:
        longest = 2 * times[-1] + 10.0
        times.append(min(longest, (times[-1] ** beta + share * (end - start) ** beta) ** (1 / beta), end - start))
    return start + np.array(times)


@pytest.mark.parametrize("decay", [3.0, 300.0, 30000.0])
def test_a_transient_after_a_jump_is_met_within_a_thousandth(decay):
    before, after = doubling(0, 14400), doubling(14400, 43200)
    times, segments = np.concatenate([before, after]), np.repeat([0, 1], [before.size, after.size])
    line = TimeInterpolation.from_steps(times, segments, program((0, 14400, 8, 8), (14400, 43200, 10, 10)))

    def relaxing(y):
        return np.log1p(y / (decay + 20.0))

    values = np.concatenate([relaxing(before), 10 + relaxing(after - 14400)])
    asked = np.array([1.0, 3, 10, 45, 170, 2000, 28800])
    np.testing.assert_allclose(line.interpolate(values, 14400 + asked), 10 + relaxing(asked), rtol=1e-3)
    np.testing.assert_allclose(line.interpolate(values, asked[:-1]), relaxing(asked[:-1]), rtol=0.02, atol=1e-3)


def test_a_jump_has_the_value_before_it_and_time_zero_the_one_after():
    times, segments = np.array([0.0, 0.0, 10, 30, 100, 100, 110, 130]), np.array([0, 0, 0, 0, 0, 1, 1, 1])
    line = TimeInterpolation.from_steps(times, segments, program((0, 100, 8, 8), (100, 130, 10, 10)))
    values = np.array([0.0, 1, 2, 3, 4, 7, 8, 9])
    np.testing.assert_allclose(line.interpolate(values, [0, 10, 100, 130]), [1, 2, 4, 9], rtol=1e-14)
    assert 7 < line.interpolate(values, 100.01)[0] < 7.1
    assert np.isnan(line.interpolate(values, 130.1)).all()


def test_a_short_last_step_does_not_turn_its_small_errors_into_a_slope():
    times = np.append(doubling(0, 40000), 40003.0)
    line = TimeInterpolation.from_steps(times, np.zeros(times.size, int), program((0, 40003, 8, 8)))
    values = np.log1p(times / 500)
    values[-2] += 1e-4
    asked = np.array([22000.0, 28000, 35000, 39000])
    np.testing.assert_allclose(line.interpolate(values, asked), np.log1p(asked / 500), rtol=5e-4)


@cache
def run_of(law, pressure, few):
    kernel = kernels.lower(ck.law(law), "compiled")
    theta = ck.law(law).to_internal(ck.law(law).values(LAWS[law]))[0]
    course = LoadHistory(pressure, Program.constant(1000.0), Program.constant(150e3), 1200.0)
    return simulate(
        kernel, theta, DIMPLE, course, settings=SolverSettings() if few else SolverSettings(1e-3, 1e-5, 1.0)
    )


def apex(law, pressure, times, few):
    run = run_of(law, pressure, few)
    return run.at(run.displacements[:, DIMPLE.top[0], 1], times)


BLINK = Program(np.array([0.0, 1e-3]), np.array([0.0, 8.0]))
AT_ONCE = Program.constant(8.0)
JUMP = Program(np.array([0.0, 5, 600, 605]), np.array([0.0, 6, 6, 8]))


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("pressure", [BLINK, AT_ONCE, JUMP], ids=["blink", "at once", "jump"])
def test_any_time_of_twenty_minutes_is_right_within_half_a_percent(law, pressure):
    after = np.array([0.3, 1, 2, 4, 8, 15, 30, 60, 120, 200, 400, 590])
    times = np.sort(np.concatenate([5 + after, 605 + after]))
    np.testing.assert_allclose(apex(law, pressure, times, True), apex(law, pressure, times, False), rtol=5e-3)


@pytest.mark.parametrize("law", list(LAWS))
def test_the_seconds_of_a_ramp_are_right_within_two_percent_of_its_end(law):
    times = np.array([0.5, 1, 2, 3, 4, 5, 601, 602.5, 604, 605])
    few, many = apex(law, JUMP, times, True), apex(law, JUMP, times, False)
    assert np.abs(few - many)[:6].max() < 0.02 * many[5]
    assert np.abs(few - many)[6:].max() < 0.005 * many[-1]


# ---- step splines ----------------------------------------------------------------------------------------------------

# Splines between accepted steps: cubics, scipy's not-a-knot splines, and few steps.


RNG = np.random.default_rng(4)


def one_segment(places, exponent=1.0):
    """Steps at places of the variable in which values are splines, ln(1 + (t / 20 s)^beta), and back."""
    times = OFFSET * np.expm1(places) ** (1 / exponent)
    rows = ((0, len(times) - 1),)
    return TimeInterpolation(times, np.zeros(1), rows, np.zeros(1), np.array([exponent])), times


@pytest.mark.parametrize("exponent", [1.0, 0.3])
@pytest.mark.parametrize("steps", [3, 4, 5, 17, 60])
def test_splines_are_those_of_scipy(steps, exponent):
    places = np.cumsum(RNG.uniform(0.3, 1.0, steps)) / 4
    line, times = one_segment(places, exponent)
    values = np.cumsum(RNG.normal(size=(steps, 2, 5)), axis=0)
    asked = np.append(RNG.uniform(0.0, times[-1], 50), times)
    variable = lambda t: np.log1p((t / OFFSET) ** exponent)  # noqa: E731
    expected = CubicSpline(variable(times), values)(variable(asked))
    np.testing.assert_allclose(line.interpolate(values, asked), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_what_is_not_a_number_spoils_its_column_and_segment_alone():
    line, times = one_segment(np.linspace(0.0, 2.0, 7))
    values = np.ones((7, 3))
    values[4, 1] = np.nan
    got = line.interpolate(values, times)
    assert np.isnan(got[:, 1]).any()
    np.testing.assert_allclose(got[:, [0, 2]], 1.0, rtol=1e-15)
    assert np.isnan(line.interpolate(values, [np.nan, 1.1 * times[-1]])).all()


# ---- termination -----------------------------------------------------------------------------------------------------

# Ends that are answers: how a march says that a body burst, or that it could not go on, and what it keeps.


FAST = {"A": 1e-11, "n": 3.0}
RAMP = Program(np.array([0.0, 5.0]), np.array([0.0, 8.0]))
END = 14400.0


@pytest.fixture(scope="module")
def body() -> FiniteElementModel:
    return finite_element_model(DimpleGeometry().mesh(0.5))


def run(
    body: FiniteElementModel, creep: CreepLaw, values, pressure: Program = RAMP, end: float = END, **settings
) -> Simulation:
    kernel = kernels.lower(creep, "compiled")
    course = LoadHistory(pressure, Program.constant(300.0), Program.constant(150e3), end)
    return simulate(
        kernel, creep.to_internal(values)[0], body, course, settings=SolverSettings(**settings), keep_points=True
    )


def history_is_kept(made: Simulation, body: FiniteElementModel) -> None:
    """Finite up to the end, nothing after it."""
    assert made.end_time == made.times[-1]
    assert np.isfinite(made.displacements).all()
    assert np.isfinite(made.mises).all()
    apex = made.displacements[:, body.top[0], 1]
    assert made.at(apex, made.times[-1:])[0] == pytest.approx(apex[-1], rel=1e-12)
    assert np.isnan(made.at(apex, np.array([made.end_time * 1.001 + 1e-6, END]))).all()


def test_burst_by_deflection(body) -> None:
    made = run(body, NORTON, FAST, deflection_limit=1.0)
    apex = made.displacements[:, body.top[0], 1]
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[DEFLECTION_LIMIT])
    assert apex[-2] < 1.0 <= apex[-1]
    assert 0 < made.end_time < END
    history_is_kept(made, body)


def test_the_time_of_a_burst_does_not_depend_on_the_steps(body) -> None:
    """The limit is located within a step: to a thousandth of itself, whatever the tolerance of the steps."""
    coarse, fine = (run(body, NORTON, FAST, deflection_limit=1.0, tolerance=t, newton=1e-2 * t) for t in (3e-2, 3e-4))
    for made in (coarse, fine):
        assert made.displacements[-1, body.top[0], 1] == pytest.approx(1.0, rel=2e-3)
    assert coarse.times.size < fine.times.size / 3
    assert coarse.end_time == pytest.approx(fine.end_time, rel=5e-3)


def test_limit_load(body) -> None:
    """sinh(s/1 MPa)^3 flows at any rate near 10 MPa: a roof of that strength carries no 8 MPa.

    Its plastic limit load as a clamped plate, 11.3 s (h/a)^2/4 (Hopkins and Wang 1954), is 0.1 to 1 MPa; as a dome,
    when it has bulged, more.
    """
    made = run(body, HYPERBOLIC_SINE, {"A": 1e-5, "n": 3.0, "B": 1.0}, deflection_limit=np.inf, strain_limit=np.inf)
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[LIMIT_LOAD])
    assert made.end_time < 5.0
    assert made.mises.max() < 30.0
    history_is_kept(made, body)


WILD = {
    "no number beyond a stress": (law(A * stress**n * sympy.log(k - stress), {A: RATE, n: POWER, k: number(1, 100)}),
                                  {"A": 1e-9, "n": 2.0, "k": 50.0}),
    "a pole in strain": (law(A * stress**n / (k - strain), {A: RATE, n: POWER, k: number(1e-3, 1)}),
                         {"A": 1e-12, "n": 3.0, "k": 0.02}),
    "beyond all numbers at once": (law(A * sympy.exp(k * stress), {A: RATE, k: number(1, 100)}),
                                   {"A": 1e-5, "k": 100.0}),
    "tertiary creep": (law(A * stress**n * sympy.exp(k * strain), {A: RATE, n: POWER, k: number(1, 1000)}),
                       {"A": 1e-12, "n": 3.0, "k": 500.0}),
    "without bound in time": (law(A * stress**n * sympy.exp(k * time), {A: RATE, n: POWER, k: number(0, 2)}),
                              {"A": 1e-12, "n": 3.0, "k": 1.0}),
    "the fastest of Table 1": (NORTON, {"A": 1e-5, "n": 8.0}),
}  # fmt: skip
"""Laws that grow without bound or are no number, with values that take them there."""


@pytest.mark.parametrize("name", WILD)
def test_a_wild_law_ends_with_a_status(body, name: str) -> None:
    made = run(body, *WILD[name])
    assert made.status in (Status.RUPTURED, Status.NOT_CONVERGED)
    assert made.reason
    assert made.iterations[:2].sum() <= SolverSettings().max_steps
    history_is_kept(made, body)


def test_a_failed_test_predicts_nothing_after_its_end() -> None:
    """Of three candidates in one call only the mild one has numbers at the end; none is infinite."""
    times = np.array([5.0, 60.0, 600.0, END])
    test = History(
        name="planted", times=times, outputs={}, loading=PressureJump(8.0, 8.0, 7200.0), temperature=300.0,
        specimen="bulge", elastic=Elastic(E=150e3),
    )  # fmt: skip
    found = Bulge(refinement=0.5, threads=1, deflection_limit=0.5).predict(
        NORTON, NORTON.to_internal({"A": np.array([1e-13, 1e-11, 1e-5]), "n": np.array([3.0, 3.0, 8.0])}), [test]
    )
    assert found.status[:, 0].tolist() == [Status.COMPLETE, Status.RUPTURED, Status.RUPTURED]
    for c in range(3):
        assert (np.isfinite(found.values[c, 0]) == (times <= found.end_times[c, 0])[:, None]).all()
    assert found.end_times[0, 0] == END
    assert 600.0 < found.end_times[1, 0] < END
    assert found.end_times[2, 0] < 5.0
