"""Speed of what predicts dimples in the place of finite elements: one 12 h test with a pressure jump, 289 frames.

    python tests/benchmarks/surrogate_speed.py [--candidates 300] [--simulated 6] [--law norton] [--write]

First table, CPU time of a candidate: the reduced-order model and the finite element model, values alone and with
sensitivities to all parameters and to the apex thickness. Second table, the network of ParameterGru, 128 x 3 as in the
paper: all candidates together, and one candidate, without and with ten directions; beside it torch's forward pass in
float64. Its weights are not trained, which costs the same. All is measured in one process, on one thread, in turns; the
least of some repeats. The first run also compiles.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from measured import Page, arguments
from public_calls import predict

import creepkit as ck
from creepkit.records import History
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.surrogates.network_evaluation import ParameterNetwork
from creepkit.surrogates.parameter_network import ParameterModule, weights_of

LAWS = {
    "norton": {"A": 3e-15, "n": 3.5},
    "strain-hardening": {"A": 3e-16, "n": 3.0, "m": -0.5},
    "hyperbolic-sine": {"A": 3e-9, "n": 3.0, "B": 90.0},
}
END, EVERY = 43200.0, 150.0
TEST = History(
    name="12 h jump",
    times=np.arange(0.0, END + 1, EVERY),
    outputs={},
    loading=ck.PressureJump(8.0, 9.0, END / 2),
    temperature=1000.0,
    specimen="bulge",
    elastic=ck.Elastic(E=150e3),
)
REPEATS = 3
SIZES, HIDDEN, LAYERS, DIRECTIONS = (8, 1, 3), 128, 3, 10
"""Constants (some law's parameters and conditions), series and outputs; width, depth; directions of derivatives."""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--candidates", type=int, default=300)
    parser.add_argument("--simulated", type=int, default=6, help="candidates of the finite element model")
    parser.add_argument("--law", choices=list(LAWS), default="norton")
    options = parser.parse_args()
    torch.set_num_threads(1)
    page = Page("surrogate_speed", __doc__)
    page.heading(f"CPU time of a candidate of law '{options.law}'")
    page.table("model", "values, ms", "with sensitivities, ms")
    exact = Bulge(threads=1)
    for title, model, count in (
        ("reduced-order model", exact.reduced_order_model(), options.candidates),
        ("finite elements", exact, options.simulated),
    ):
        page.row(title, *(f"{1e3 * s:.3g}" for s in specimen_times(model, options.law, count)))
    page.heading(f"CPU time of the network, {HIDDEN} x {LAYERS}, {TEST.times.size} frames")
    page.table("candidates", "values, ms", f"with {DIRECTIONS} directions, ms", "values by torch, ms")
    for count in (options.candidates, 1):
        page.row(count, *(f"{1e3 * s:.3g}" for s in network_times(count)))
    if options.write:
        page.write()


def specimen_times(model: Any, name: str, count: int) -> list[float]:
    """CPU time of a candidate, s: values, and values with sensitivities."""
    law, candidates = ck.law(name), scattered(name, count)
    few = {n: v[: max(1, count // 10)] for n, v in candidates.items()}
    thickness = {"thickness": np.full((1, 1), Bulge().geometry.apex_thickness)}
    values, derivatives = in_turns(
        lambda: predict(model, law, candidates, [TEST]),
        lambda: predict(model, law, few, [TEST], thickness, sensitivities=True),
    )
    return [values / count, derivatives / max(1, count // 10)]


def network_times(count: int) -> list[float]:
    """CPU time of all candidates, s: values, values with derivatives, and torch's values."""
    module = ParameterModule(SIZES, HIDDEN, LAYERS, "gru", logarithm=False, corrects_base=False)
    shape = ("gru", HIDDEN, LAYERS)
    weights = weights_of(module.state_dict())
    network = ParameterNetwork.from_weights(weights, SIZES, shape, logarithm=False, corrects_base=False)
    module, rng = module.double().eval(), np.random.default_rng(0)
    constants, series = rng.normal(size=(count, SIZES[0])), rng.normal(size=(1, TEST.times.size, SIZES[1]))
    directions = rng.normal(size=(count, DIRECTIONS, SIZES[0]))
    batch = {"constants": torch.from_numpy(constants), "series": torch.from_numpy(np.tile(series, (count, 1, 1)))}

    def by_torch() -> None:
        with torch.no_grad():
            module(batch)

    return in_turns(
        lambda: network.outputs(constants, series),
        lambda: network.outputs_with_derivatives(constants, series, directions=directions),
        by_torch,
    )


def in_turns(*runs: Callable[[], Any]) -> list[float]:
    """Least CPU time of each run, s; the first turn, which may compile, does not count."""
    best = [np.inf] * len(runs)
    for turn in range(REPEATS + 1):
        for k, run in enumerate(runs):
            start = time.process_time()
            run()
            if turn > 0:
                best[k] = min(best[k], time.process_time() - start)
    return best


def scattered(name: str, count: int) -> dict[str, np.ndarray]:
    """Values of candidates about those of LAWS: a standard deviation of 0.5 in ln of coefficients, 3 % in the rest."""
    rng, table = np.random.default_rng(1), ck.law(name).table
    return {
        n: v * np.exp(rng.normal(0.0, 0.5 if table[n].scale == "log" else 0.03, count)) for n, v in LAWS[name].items()
    }


if __name__ == "__main__":
    main()
