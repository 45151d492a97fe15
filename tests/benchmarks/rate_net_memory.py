"""Memory of RateNet: means over the creep so far, or a recurrent network.

    python tests/benchmarks/rate_net_memory.py RATES.h5 [--samples 2000] [--epochs 60] [--seeds 2] [--write]

RATES.h5 is a data set of the rate family (`creepkit generate rate-family --samples 2000 --seed 1 --to RATES.h5`). The
recurrent network (a GRU of 64 units with a bypass, then two layers of 64) takes the inputs of each time alone; the
direct one, that of the package, takes their means over the creep so far as well. Columns: weights; CPU time of training
with its features; Eq. (4) of the validation rows, all outputs together and of each; largest error of D_amp in a
history, median and 95 % quantile.
"""

import time
from dataclasses import dataclass

import torch
from measured import Page, arguments
from torch import nn

import creepkit as ck
from creepkit.surrogates.rate_net import RateNet
from creepkit.surrogates.rate_network import LOCAL_INPUTS, RateModule

HIDDEN = 64


class RecurrentLayers(nn.Module):
    """A GRU with a bypass over the inputs of each node alone, the first `local_count` of them."""

    def __init__(self, local_count, hidden):
        super().__init__()
        self.local_count = local_count
        self.first = nn.Sequential(nn.Linear(local_count, hidden), nn.SiLU())
        self.recurrent = nn.GRU(hidden, hidden, batch_first=True)
        self.last = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU())

    def forward(self, inputs):
        x = self.first(inputs[..., : self.local_count])
        return self.last(torch.cat([x, self.recurrent(x)[0]], dim=-1))


@dataclass(frozen=True)
class RecurrentRateNet(RateNet):
    """RateNet with another module; everything else is the package's."""

    def module(self, data, samples, train):
        module = RateModule(samples["inputs"].shape[-1], HIDDEN, self.layers)
        local_count = len(self.stress_factors) * len(self.strain_factors) + len(LOCAL_INPUTS)
        module.layers = RecurrentLayers(local_count, HIDDEN)
        return module.with_scales(samples, train)


HEADS = (
    "memory",
    "weights",
    "seed",
    "CPU time, s",
    "Eq. (4), all outputs, 1e-4",
    "of D_amp, 1e-4",
    "of S_d, 1e-4",
    "of S_p, 1e-4",
    "largest error: median, um",
    "95 % quantile, um",
)


def main():
    parser = arguments(__doc__)
    parser.add_argument("data")
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--epochs", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    torch.set_num_threads(1)
    data = ck.read_dataset(options.data, accepted_only=True).rows(slice(0, options.samples))
    training = ck.Training(epochs=options.epochs, rate=3e-3, schedule="cosine", clip=1.0, validation=0.1)
    page = Page("rate_net_memory", __doc__)
    page.paragraph(f"{len(data)} simulations, {options.epochs} epochs.")
    page.table(*HEADS)
    for seed in range(options.seeds):
        for title, recipe in (("means", RateNet), ("recurrent", RecurrentRateNet)):
            start = time.process_time()
            model = ck.train(data, recipe(training=training), seed=seed)
            cost = time.process_time() - start
            weights = sum(p.numel() for p in model.module.parameters())
            metrics = model.metadata.metrics
            errors = [metrics["loss"], *(metrics["outputs"][name]["rse"] for name in data.outputs)]
            largest = metrics["outputs"][data.outputs[0]]
            page.row(
                title,
                weights,
                seed,
                f"{cost:.0f}",
                *(f"{1e4 * error:.2f}" for error in errors),
                f"{1e3 * largest['largest_median']:.2f}",
                f"{1e3 * largest['largest_p95']:.1f}",
            )
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
