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
from creepkit.law_search.grammar import HARDENING, SOFTENING, STRESS, Product, Sentence
from creepkit.records import History

STRESSES, TEMPERATURES, T_REF = (60.0, 80.0, 110.0, 150.0), (850.0, 900.0, 950.0), 900.0
SCATTER, STRAIN_NOISE, LAST_STRAIN, LAST_TIME, EQUIVALENT = 0.03, 2e-5, 0.04, 1e7, 0.05
RANGES = {
    ("power", "n"): (3.0, 7.0), ("sinh", "n"): (2.0, 5.0), ("sinh", "B"): (40.0, 90.0),
    ("exponential", "B"): (15.0, 30.0), ("threshold", "n"): (2.0, 5.0), ("threshold", "s_0"): (20.0, 45.0),
    ("double power", "n"): (1.0, 3.0), ("double power", "s_b"): (70.0, 110.0), ("double power", "p"): (3.0, 6.0),
    ("", "m"): (-0.7, -0.25), ("", "b"): (2.0, 10.0), ("", "e_p"): (0.002, 0.01), ("", "Omega"): (15.0, 60.0),
}  # fmt: skip
"""{(stress function or any, parameter): range} of draws; that of t_p is a tenth to the whole of the time to 1 %."""


def planted(seed: int) -> tuple[ck.CreepLaw, dict[str, float], np.random.Generator]:
    """A sentence with values."""
    rng = np.random.default_rng(seed)
    count = 1 + int(np.searchsorted([0.5, 0.9], rng.random(), side="right"))
    products: set[Product] = set()
    while len(products) < count:
        products.add(Product(*(str(rng.choice(list(names))) for names in (STRESS, HARDENING, SOFTENING))))
    sentence = Sentence(tuple(products), "arrhenius", T_REF)
    level, shares = 10 ** rng.uniform(-7.3, -6.3), rng.dirichlet(np.full(count, 4.0))
    values: list[float] = []
    for share, one in zip(shares, sentence.products, strict=True):
        own = {"A": 1.0, "t_p": 0.01 / level * 10 ** rng.uniform(-1, 0)}
        for name in (name for name in one.law.names if name not in own):
            own[name] = rng.uniform(*(RANGES.get((one.stress, name)) or RANGES["", name]))
        own = {name: own[name] for name in one.law.names}
        at = {"stress": 100.0, "strain": 0.01, "time": 0.01 / level}
        values += list((own | {"A": share * level / float(lower(one.law, "numpy").rate(own, **at))}).values())
    values.append(rng.uniform(2.5e5, 4e5))
    return sentence.law, dict(zip(sentence.law.names, values, strict=True)), rng


def curve(law: ck.CreepLaw, values: dict[str, float], stress: float, T: float, rng: np.random.Generator) -> History:
    """A bar under a constant true stress; the variable of integration is the fifth root of time."""
    kernel, factor = lower(law, "numpy"), np.exp(SCATTER * rng.normal())

    def slope(x: float, e: np.ndarray) -> np.ndarray:
        t = max(x, 1e-12) ** 5
        rate = kernel.rate(values, stress=stress, strain=np.maximum(e, 1e-14), time=t, temperature=T)
        return factor * np.asarray(rate) * 5 * max(x, 1e-12) ** 4

    reached = lambda x, e: e[0] - LAST_STRAIN  # noqa: E731
    reached.terminal = True
    end = LAST_TIME**0.2
    run = solve_ivp(slope, (0, end), [1e-12], "Radau", rtol=1e-9, atol=1e-13, events=reached, dense_output=True)
    times = np.geomspace(3e-3, 1.0, 40) * run.t[-1] ** 5
    strains = run.sol(times**0.2)[0] + STRAIN_NOISE * rng.normal(size=times.size)
    loading = ck.StressSteps([(0.0, stress)], control="stress")
    return History(f"{T:g} K, {stress:g} MPa", times=times, outputs={"strain": strains}, loading=loading, temperature=T)


def rate_error(fit, law: ck.CreepLaw, values: dict[str, float], tests: list[History]) -> float:
    """Largest ln of the ratio of the rate found and the planted one over the readings."""
    ratios = []
    for h in tests:
        at = {"stress": h.loading.program().values[0], "time": h.times, "temperature": h.mean_temperature}
        at["strain"] = np.maximum(h.outputs["strain"], 1e-6)
        rates = [lower(of, "numpy").rate(by, **at) for of, by in ((fit.law, fit.values), (law, values))]
        ratios.append(np.log(rates[0] / rates[1]) * np.ones(h.times.size))
    return float(np.abs(ratios).max())


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
        law, values, rng = planted(seed)
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
