"""Laws drawn from the grammar of search_laws(), and found again from twelve creep curves each.

    python tests/benchmarks/law_search.py [--laws 40] [--first 0] [--budget 60] [--write]

Sentences of one to three products (half, two fifths, a tenth of them), each of random factors that the tests can see,
and of a random share of the rate; four stresses (60 to 150 MPa, true stress held) at 850, 900 and 950 K, to 4 % of
strain or 1e7 s. The rate of each test scatters by 3 %, readings by 2e-5 of strain; 40 readings, by scipy's Radau. Found
is the planted sentence, or a law whose rate is within 5 % of the planted one at every reading. Law number k has seed k.
"""

from __future__ import annotations

import numpy as np
from measured import Page, arguments, binomial_interval
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.kernels import lower
from creepkit.law_search.grammar import HARDENING, SOFTENING, STRESS, Product, Sentence, allowed
from creepkit.records import History

STRESSES, TEMPERATURES, T_REF = (60.0, 80.0, 110.0, 150.0), (850.0, 900.0, 950.0), 900.0
SCATTER, STRAIN_NOISE, LAST_STRAIN, LAST_TIME, EQUIVALENT = 0.03, 2e-5, 0.04, 1e7, 0.05
RANGES = {
    ("power", "n"): (3.0, 7.0), ("sinh", "n"): (2.0, 5.0), ("sinh", "B"): (40.0, 90.0),
    ("exponential", "B"): (15.0, 30.0), ("threshold", "n"): (2.0, 5.0), ("threshold", "s_0"): (20.0, 45.0),
    ("double power", "n"): (1.0, 3.0), ("double power", "s_b"): (70.0, 110.0), ("double power", "p"): (3.0, 6.0),
    ("", "m"): (-0.7, -0.25), ("", "b"): (2.0, 10.0), ("", "e_p"): (0.002, 0.01), ("", "Omega"): (15.0, 60.0),
    ("", "H"): (4e3, 15e3), ("", "r"): (1.0, 1.0), ("", "D"): (1.0, 1.0), ("", "chi"): (3.0, 7.0),
    ("", "q"): (0.3, 1.0), ("", "Q_r"): (2.5e5, 4e5), ("", "Q_D"): (2.5e5, 4e5), ("", "Q"): (3e5, 3e5),
}  # fmt: skip
"""{(stress function or any, parameter): range} of draws; t_p is a tenth to the whole of the time to 1 %, where a tenth
to half of life is spent; recovery holds a back stress of X_REF at 100 MPa."""


X_REF, LAST_SHARE = 40.0, 0.98
"""MPa; share of life at which a test ends."""


def planted(seed: int) -> tuple[Sentence, dict[str, float], np.random.Generator]:
    """A sentence with values."""
    rng = np.random.default_rng(seed)
    count = 1 + int(np.searchsorted([0.5, 0.9], rng.random(), side="right"))
    products: list[Product] = []
    while len(products) < count:
        factors = [str(rng.choice(list(names))) for names in (STRESS, HARDENING, SOFTENING)]
        alone = count == 1 or "back stress" not in factors
        if alone and allowed([*products, Product(*factors)]):
            products.append(Product(*factors))
    sentence = Sentence(tuple(products), "arrhenius", T_REF)
    level, shares = 10 ** rng.uniform(-7.3, -6.3), rng.dirichlet(np.full(count, 4.0))
    values: list[float] = []
    for share, one in zip(shares, sentence.products, strict=True):
        law = Sentence((one,), "arrhenius", T_REF).law
        drawn = {"A": 1.0, "t_p": 0.01 / level * 10 ** rng.uniform(-1, 0)}
        for name in (name for name in law.names if name not in drawn):
            drawn[name] = rng.uniform(*(RANGES.get((one.stress, name)) or RANGES["", name]))
        if "H" in drawn:
            drawn["r"] = drawn["H"] * level / X_REF
        if "D" in drawn:
            drawn["D"] = level / 0.01 * 10 ** rng.uniform(-1.0, -0.3) / 100 ** drawn["chi"]
        drawn = {name: drawn[name] for name in law.names}
        at = {"stress": 100.0, "strain": 0.01, "time": 0.01 / level, "temperature": T_REF}
        at |= {"X": X_REF} if "H" in drawn else {}
        drawn["A"] = share * level / float(lower(law, "numpy").rate(drawn, **at))
        values += list(drawn.values())[:-1]
    values.append(rng.uniform(2.5e5, 4e5))
    return sentence, dict(zip(sentence.law.names, values, strict=True)), rng


def solved(law: ck.CreepLaw, values: dict[str, float], stress: float, T: float, factor: float):
    """(end s, function of time to strain) of a bar under a constant true stress, of so many times the law's creep rate.

    The variable of integration is the fifth root of time.
    """
    kernel, states = lower(law, "numpy"), [state.name for state in law.states]

    def slope(x: float, y: np.ndarray) -> np.ndarray:
        t = max(x, 1e-12) ** 5
        at = {"stress": stress, "strain": min(max(y[0], 1e-14), 2 * LAST_STRAIN), "time": t, "temperature": T}
        at |= dict(zip(states, np.minimum(y[1:], [0.999 if name == "v" else stress for name in states]), strict=True))
        rate, others = float(kernel.rate(values, **at)), kernel.state_rates(values, **at)
        driven = {"X": values["H"] * (factor - 1) * rate} if "X" in states else {}
        own = [float(others[name]) + driven.get(name, 0.0) for name in states]
        return np.array([factor * rate, *own]) * 5 * max(x, 1e-12) ** 4

    ends = [lambda x, y: y[0] - LAST_STRAIN]
    if "v" in states:
        ends.append(lambda x, y: y[1 + states.index("v")] - LAST_SHARE)
    for end in ends:
        end.terminal = True
    start = [1e-12, *([0.0] * len(states))]
    precise = {"rtol": 1e-7, "atol": [1e-11, *(1e-8 if name == "v" else 1e-5 for name in states)]}
    run = solve_ivp(slope, (0, LAST_TIME**0.2), start, "Radau", events=ends, dense_output=True, **precise)
    return run.t[-1] ** 5, lambda times: run.sol(np.asarray(times) ** 0.2)[0]


def curve(law: ck.CreepLaw, values: dict[str, float], stress: float, T: float, rng: np.random.Generator) -> History:
    """A test: a bar of a rate of its own, and readings that scatter."""
    end, strain = solved(law, values, stress, T, np.exp(SCATTER * rng.normal()))
    times = np.geomspace(3e-3, 1.0, 40) * end
    strains = strain(times) + STRAIN_NOISE * rng.normal(size=times.size)
    loading = ck.StressSteps([(0.0, stress)], control="stress")
    return History(f"{T:g} K, {stress:g} MPa", times=times, outputs={"strain": strains}, loading=loading, temperature=T)


def rates_along(law: ck.CreepLaw, values: dict[str, float], h: History, times: np.ndarray, strain) -> np.ndarray:
    """Rates of a law where the planted one passes, with its own internal variables from the start."""
    kernel, states = lower(law, "numpy"), [state.name for state in law.states]
    at = {"stress": h.loading.program().values[0], "temperature": h.mean_temperature}

    def slope(x: float, z: np.ndarray) -> np.ndarray:
        t = max(x, 1e-12) ** 5
        now = at | {"strain": max(float(strain(t)), 1e-14), "time": t} | dict(zip(states, z, strict=True))
        return np.array([float(one) for one in kernel.state_rates(values, **now).values()]) * 5 * max(x, 1e-12) ** 4

    if states:
        run = solve_ivp(slope, (0, times[-1] ** 0.2), [0.0] * len(states), "LSODA", times**0.2, rtol=1e-6, atol=1e-9)
        if run.y.shape[1] < times.size:
            return np.full(times.size, np.inf)
        at |= dict(zip(states, run.y, strict=True))
    return np.asarray(kernel.rate(values, **at, strain=np.maximum(strain(times), 1e-14), time=times)) * np.ones(
        times.size
    )


def rate_error(fit, law: ck.CreepLaw, values: dict[str, float], tests: list[History]) -> float:
    """Largest ln of the ratio of the rate found and the planted one, where the planted law passes at the readings."""
    worst = 0.0
    for h in tests:
        end, strain = solved(law, values, h.loading.program().values[0], h.mean_temperature, 1.0)
        times = h.times[h.times < end]
        rates = [rates_along(of, by, h, times, strain) for of, by in ((fit.law, fit.values), (law, values))]
        with np.errstate(all="ignore"):
            worst = max(worst, float(np.abs(np.log(rates[0] / rates[1])).max()))
    return worst


def main() -> None:
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--laws", type=int, default=40, help="planted laws")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--budget", type=float, default=60.0, help="CPU seconds of each search")
    options = parser.parse_args()
    page = Page("law_search", __doc__)
    page.table("seed", "planted", "place", "first law", "its rate: largest error, %", "sentences", "CPU s")
    places, seconds = [], []
    for seed in range(options.first, options.first + options.laws):
        sentence, values, rng = planted(seed)
        law = sentence.law
        tests = [curve(law, values, s, T, rng) for T in TEMPERATURES for s in STRESSES]
        search = ck.search_laws(tests, budget=options.budget)
        errors = [rate_error(one.fit, law, values, tests) for one in search.ranking.laws]
        names = [one.fit.law.name for one in search.ranking.laws]
        same = [name == law.name or error < EQUIVALENT for name, error in zip(names, errors, strict=True)]
        places.append(same.index(True) + 1 if any(same) else 99)
        seconds.append(search.seconds)
        found = places[-1] if places[-1] < 99 else "-"
        error, tried = f"{100 * np.expm1(errors[0]):.1f}", len(search.tried)
        page.row(seed, law.name, found, names[0], error, tried, f"{search.seconds:.0f}")
    for rank, asked in ((1, 70), (3, 90)):
        held = sum(place <= rank for place in places)
        low, high = binomial_interval(held, len(places))
        share = f"{100 * held / len(places):.0f} % [{100 * low:.0f}, {100 * high:.0f}]"
        page.paragraph(f"Found within the first {rank}: {share}, asked {asked} %.")
    page.paragraph(f"CPU time: median {np.median(seconds):.0f} s, most {max(seconds):.0f} s; asked 60 s in the median.")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
